"""Sky and ground images. Each image is read once, in a thread: the window does not wait, and errors become messages."""

import os
import threading

from ..light.lighting import ground_seen, sky_seen
from .loading import in_a_line
from .scene import Scene


class ImageReader:
    """Reads a sky or ground image; then the scene is drawn with it."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._thread: threading.Thread | None = None
        self._result: tuple[str, str | None, str] | None = None  # option, path, error

    @property
    def busy(self) -> bool:
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
            self._scene.window.say(error)
        else:
            self._scene.settings.change_all(**{option: path})
            self._scene.window.refresh()

    def join(self) -> None:
        if self._thread:
            self._thread.join()

    def _try(self, option: str, path: str | None) -> None:
        message = ""
        try:
            if path and option == "sky":
                sky_seen((0.0, 0.0), path)
            elif path:
                ground_seen(path, self._scene.heightmap.georeference if self._scene.has_map else None)
        except Exception as error:  # the user sees one line, not a thread's traceback
            message = str(in_a_line(error, f"{path}: cannot be read")) or "not enough memory"
        self._result = option, path, message
