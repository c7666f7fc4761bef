"""Sky and ground images. Each image is read once, in a thread: the window does not wait, and errors become messages."""

import os
import threading
from collections.abc import Callable

from ..basics.exceptions import TerrainError
from ..light.lighting import ground_seen, sky_seen
from ..readers.georeference import Georeference
from .settings import Settings
from .window_state import WindowState


class ImageReader:
    """Reads a sky or ground image; then the scene is drawn with it.

    Parameters
    ----------
    place_of
        Function that returns the map's georeference.
    """

    def __init__(self, settings: Settings, window: WindowState, place_of: Callable[[], Georeference | None]) -> None:
        self._settings = settings
        self._window = window
        self._place_of = place_of
        self._thread: threading.Thread | None = None
        self._result: tuple[str, str | None, str] | None = None  # option, path, error

    @property
    def busy(self) -> bool:
        """Whether an image is being read."""
        return self._thread is not None

    def read(self, option: str, path: str) -> None:
        """Read a file for an option of `RenderOptions`, "sky" or "material"; an empty path sets the default."""
        self.join()
        path = os.path.expanduser(path.strip())
        self._result = None
        self._thread = threading.Thread(target=self._try, args=(option, path or None), name=f"reading {path}")
        self._thread.start()

    def step(self) -> None:
        """Use an image that has been read, or show its error."""
        if not self._result:
            return
        option, path, error = self._result
        self._result = None
        self._thread = None
        if error:
            self._window.say(error)
        else:
            self._settings.change_all(**{option: path})
            self._window.refresh()

    def join(self) -> None:
        """Wait for the thread."""
        if self._thread:
            self._thread.join()

    def _try(self, option: str, path: str | None) -> None:
        message = ""
        try:
            if path and option == "sky":
                sky_seen((0.0, 0.0), path)
            elif path:
                ground_seen(path, self._place_of())
        except (TerrainError, OSError, MemoryError) as error:
            message = str(error) or "not enough memory"
        except Exception as error:  # the user sees one line, not a thread's traceback
            message = f"{path}: cannot be read ({type(error).__name__}: {error})"
        self._result = option, path, message
