"""Writes the sculpted map to a file, in a thread. For a store, it writes the edits."""

import shlex
import threading
from collections.abc import Callable
from itertools import count
from pathlib import Path

from ..files.edits import check_edits_name, edits_of, write_tiles
from ..files.writers import as_options, format_of, write_heightmap
from ..heightmap import Heightmap
from ..readers.raster import has_rasterio


class MapWriter:
    """Writes one map to a file, whose ending names the format; `land` identifies what is written.

    An unknown ending, and a store without edits, are refused with a `TerrainError`.
    """

    def __init__(self, path: str, heightmap: Heightmap, land: object = None) -> None:
        write = _edits(path, heightmap) if heightmap.is_store else _map(path, heightmap)
        self.path = path
        self.message = ""  # the outcome, in a line; "" until it is known
        self.done = False  # whether the file is complete
        self.land = land
        self._thread = threading.Thread(target=self._write, args=(write,), name=f"writing {path}")
        self._thread.start()

    def join(self) -> None:
        self._thread.join()

    def _write(self, write: Callable[[], str]) -> None:
        try:
            again = write()
            self.done = True
            self.message = f"saved {Path(self.path).absolute()}; to open it again: {again}"
        except MemoryError:
            self.message = "not enough memory"
        except Exception as error:  # the window shows any error as one line and stays open
            self.message = str(error) or type(error).__name__


def _map(path: str, heightmap: Heightmap) -> Callable[[], str]:
    """A function that writes the whole map, and returns a text on how to open it again."""
    format_of(path)
    present = heightmap.copy()  # the land may be sculpted while the thread writes
    return lambda: as_options(write_heightmap(path, present))


def _edits(path: str, heightmap: Heightmap) -> Callable[[], str]:
    """A function that writes the present edits, and returns a text on how to draw them again."""
    check_edits_name(path, heightmap)
    edited = edits_of(heightmap)
    tiles = edited.edited()
    edits = edited.edits

    def write() -> str:
        write_tiles(path, edited, tiles)
        if edited.edits == edits:
            edited.saved_as = str(Path(path).absolute())
        return f"terrain-gl view {shlex.quote(edited.name)} --edits {shlex.quote(path)}"

    return write


def suggested_path(heightmap: Heightmap) -> str:
    """A file name in the working directory that no file has yet."""
    stem = Path(heightmap.name).stem or "terrain"
    is_window = heightmap.georeference is not None and has_rasterio()
    ending = ".npz" if heightmap.is_store and not is_window else ".tif"
    return next(name for i in count(1) if not Path(name := f"{stem}-edited-{i}{ending}").exists())
