"""Recovery files: sculpted land that is not saved yet, for the case that the program ends by an error.

A file is written some seconds after a stroke, and at once after an error. It is removed when the land is saved, and
when the user leaves without saving. So if a file is still there, but its process no longer runs, the land was lost.
"""

import os
import re
import traceback
from itertools import count
from pathlib import Path

from ..heightmap import Heightmap
from .map_writer import MapWriter

_NAME = re.compile(r".+-(\d+)-\d+\.(tif|npz)")


def state_path() -> Path:
    """Path of the file of settings: see `Memory`."""
    folder = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    return Path(folder) / "terrain-gl" / "view.json"


def recovery_folder() -> Path:
    """The folder of recovery files, beside the file of settings."""
    return state_path().parent / "recovered"


class Recovery:
    """Keeps one recovery file of the land that is being sculpted."""

    def __init__(self) -> None:
        self.folder: Path | None = None  # None for no recovery files
        self.path: Path | None = None  # None until land is written
        self._writer: MapWriter | None = None

    def _holds(self, land: object) -> bool:
        """Whether this land is in the file, or is being written to it."""
        writer = self._writer
        return writer is not None and writer.land is land and (writer.done or not writer.message)

    def write(self, heightmap: Heightmap, land: object) -> None:
        """Begin to write this land in place of earlier land, in a thread; `TerrainError` for a store without edits."""
        if self.folder is None or self._holds(land):
            return
        self.join()
        self.folder.mkdir(parents=True, exist_ok=True)
        if self.path is None:
            ending = ".npz" if heightmap.is_store else ".tif"
            stem = Path(heightmap.name).stem or "terrain"
            paths = (self.folder / f"{stem}-{os.getpid()}-{number}{ending}" for number in count(1))
            self.path = next(path for path in paths if not path.exists())
        self._writer = MapWriter(str(self.path), heightmap, land)

    def join(self) -> None:
        if self._writer:
            self._writer.join()

    def remove(self) -> None:
        """Remove the file: its land is saved, undone, or given up by the user."""
        self.join()
        if self.path:
            self.path.unlink(missing_ok=True)
        self.path = self._writer = None


def lost_land(folder: Path) -> list[Path]:
    """Recovery files of processes that no longer run, the latest first."""
    found = [path for path in folder.glob("*") if (name := _NAME.fullmatch(path.name)) and not _runs(int(name[1]))]
    return sorted(found, key=lambda path: path.stat().st_mtime, reverse=True)


def offer_of(path: Path) -> str:
    """A line that says how to open lost land."""
    how = "open the store with --edits and this file" if path.suffix == ".npz" else "Map, recent opens it"
    return f"sculpted land that was not saved is in {path}: {how}"


def _runs(pid: int) -> bool:
    if os.name != "posix":
        return pid == os.getpid()
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def note_error(error: BaseException, folder: Path) -> None:
    """Write the origin of an error to `errors.txt`, for developers."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "errors.txt").write_text("".join(traceback.format_exception(error)), "utf-8")
    except OSError:
        pass  # the window shows the error itself
