"""Asks for a map's file: by the system's dialog if there is one, else by a list of a folder's maps in the window.

Nothing here blocks: the system's dialog is a process of its own, and a thread reads the folder.
"""

import os
import shutil
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..readers.archives import MAPS
from .window_state import WindowState

ENDINGS = (*MAPS, ".r32", ".zip", ".gz")
MOST = 2000  # most lines of a list
PARENT = "../"
_HELPERS = ("zenity", "matedialog", "qarma", "kdialog")  # programs that portable-file-dialogs starts on Linux


class FileDialog:
    """At most one dialog at a time. The function `on_choice` gets the path of the file that the user has chosen."""

    def __init__(self, window: WindowState, on_choice: Callable[[str], None]) -> None:
        self._window = window
        self._on_choice = on_choice
        self.has_desktop = False  # whether the user sits at this machine, so that the system's dialog may be used
        self.folder: Path | None = None  # the folder that the list shows; None while no list is open
        self.entries: list[str] | None = None  # folders, with a slash, and maps in it; None while they are being read
        self._last = Path.cwd()
        self._system: Any = None
        self._reading: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether the system's dialog is open, or a folder is being read: both end without an event of the window."""
        return self._system is not None or (self.folder is not None and self.entries is None)

    def open(self, beside: str = "") -> None:
        """Ask for a file; the folder of the file `beside` is shown first."""
        if self._system or self.folder:
            return
        if os.path.isfile(beside):
            self._last = Path(beside).resolve().parent
        self._system = _system_dialog(self._last) if self.has_desktop else None
        if not self._system:
            self.go(self._last)

    def step(self) -> None:
        """Take the answer of the system's dialog, if there is one."""
        if self._system and self._system.ready(0):
            chosen = self._system.result()
            self._system = None
            if chosen:
                self._take(Path(chosen[0]))

    def go(self, folder: Path) -> None:
        self.folder = folder
        self.entries = None
        self._reading = threading.Thread(target=self._read, args=(folder,), name=f"listing {folder}", daemon=True)
        self._reading.start()
        self._window.refresh()

    def choose(self, entry: str) -> None:
        """Go into a folder of the list, or take a file."""
        assert self.folder
        path = self.folder.parent if entry == PARENT else self.folder / entry
        if entry.endswith("/"):
            self.go(path)
        else:
            self._take(path)

    def close(self) -> bool:
        """Close the dialog; returns whether there was one."""
        was_open = self.folder is not None or self._system is not None
        if self._system:
            self._system.kill()
        self._system = self.folder = self.entries = None
        return was_open

    def join(self) -> None:
        if self._reading:
            self._reading.join()

    def _take(self, path: Path) -> None:
        self._last = path.parent
        self.folder = self.entries = None
        self._on_choice(str(path))

    def _read(self, folder: Path) -> None:
        entries, words = maps_in(folder)
        if self.folder == folder:  # the user has not gone to another folder
            self.entries = entries
            if words:
                self._window.say(words)
            self._window.refresh()


def maps_in(folder: Path) -> tuple[list[str], str]:
    """The parent, the folders and the maps of a folder; and a line about a problem, "" if there is none.

    Names of folders end with a slash.
    """
    names: list[str] = []
    words = ""
    try:
        names = sorted((name for name in os.listdir(folder) if not name.startswith(".")), key=str.lower)
    except OSError as error:
        words = f"{folder}: {error.strerror}"
    folders = {name for name in names if os.path.isdir(folder / name)}
    found = [f"{name}/" for name in names if name in folders]
    found += [name for name in names if name not in folders and name.lower().endswith(ENDINGS)]
    if len(found) > MOST:
        words = f"{folder}: the first {MOST:,} of {len(found):,} are shown; type a path under Map"
    return [PARENT, *found[:MOST]], words


def _system_dialog(folder: Path) -> Any:
    if sys.platform == "linux" and not any(map(shutil.which, _HELPERS)):
        return None
    try:
        from imgui_bundle import portable_file_dialogs as dialogs
    except ImportError:
        return None
    kinds = " ".join(f"*{ending}" for ending in ENDINGS)
    return dialogs.open_file("Open a map", f"{folder}{os.sep}", ["Maps", kinds, "All files", "*"])
