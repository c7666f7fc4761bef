"""Writes the sculpted map to a file, in a thread."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from ..files.writers import as_options, format_of, write_heightmap
from ..heightmap import Heightmap


class MapWriter:
    """Writes one map.

    Parameters
    ----------
    path
        The file; its ending names the format.
    heightmap, exaggeration
        The map, and the factor that its heights are divided by before they are written.
    land
        An object that identifies the map that was written.

    Attributes
    ----------
    message
        The outcome, in a line; "" until it is known.
    done
        Whether the file is complete.

    Raises
    ------
    TerrainError
        No format has this ending.
    """

    def __init__(self, path: str, heightmap: Heightmap, exaggeration: float = 1.0, land: object = None) -> None:
        format_of(path)
        self.path, self.message, self.done, self.land = path, "", False, land
        plain = Heightmap(heightmap.heights / np.float32(exaggeration), heightmap.spacing_m, heightmap.name)
        plain.georeference = heightmap.georeference
        self._thread = threading.Thread(target=self._write, args=(plain,), name=f"writing {path}")
        self._thread.start()

    def join(self) -> None:
        """Wait for the thread."""
        self._thread.join()

    def _write(self, heightmap: Heightmap) -> None:
        try:
            opening = write_heightmap(self.path, heightmap)
            self.done = True
            self.message = f"saved {Path(self.path).absolute()}; to open it again: {as_options(opening)}"
        except MemoryError:
            self.message = "not enough memory"
        except Exception as error:  # the window shows any error as one line and stays open
            self.message = str(error) or type(error).__name__


def suggested_path(map_name: str) -> str:
    """A file name in the working directory that is free."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while Path(name := f"{stem}-edited-{number}.tif").exists():
        number += 1
    return name
