"""A sky and a ground from picture files: read in a thread first, so that nothing waits and what is wrong is told."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING

from ..exceptions import TerrainError
from ..light.lighting import ground_seen, sky_seen

if TYPE_CHECKING:
    from .flight import Flight

KINDS = ("sky", "material")  # fields of `Drawing`


class Dressing:
    """The pictures that the land is seen with, and those that are on their way."""

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._thread: threading.Thread | None = None
        self._read: tuple[str, str | None, str] | None = None  # kind, path, what is wrong with it

    @property
    def busy(self) -> bool:
        """Whether a picture is being read."""
        return self._thread is not None

    def wear(self, kind: str, path: str) -> None:
        """Take a sky or a ground from a file; without a path, the one that there is without."""
        self.join()
        path = os.path.expanduser(path.strip())
        self._read = None
        self._thread = threading.Thread(target=self._try, args=(kind, path or None), name=f"reading {path}")
        self._thread.start()

    def step(self) -> None:
        """See with what has been read, or tell why not."""
        if not self._read:
            return
        (kind, path, wrong), self._read, self._thread = self._read, None, None
        if wrong:
            self._flight.say(wrong)
        else:
            self._flight.settings.draw_both(**{kind: path})
            self._flight.refresh()

    def join(self) -> None:
        """Wait for the thread."""
        if self._thread:
            self._thread.join()

    def _try(self, kind: str, path: str | None) -> None:
        wrong = ""
        try:
            if path and kind == "sky":
                sky_seen((0.0, 0.0), path)
            elif path:
                ground_seen(path)
        except (TerrainError, OSError, MemoryError) as error:
            wrong = str(error) or "not enough memory"
        except Exception as error:  # a thread's traceback would tell nobody what to do
            wrong = f"{path}: cannot be read ({type(error).__name__}: {error})"
        self._read = kind, path, wrong
