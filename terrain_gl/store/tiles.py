"""Tiles of a store, verified: each tile is compared with the checksum that was stored when the store was built.

The checksum (CRC-32) is computed from the tile's values, and stored for the tile's place. So it finds errors that the
checksum inside a shard cannot find: a tile of another place, or of an earlier store. The store's description has a hash
of the list of all checksums.
"""

import hashlib
import threading
import zlib
from collections import OrderedDict

import numpy as np

from ..basics.rect import Area, tiles_over
from .format import FIELDS, Arrays, fields_of, shape_of
from .pyramid import StoreSizes, area

At = tuple[str, int, int, int]  # field, level, row and column of a tile


def checksums(values: np.ndarray, tile: int) -> np.ndarray:
    """Checksums of the tiles of (..., rows, cols) values: (words, rows, cols) uint32."""
    whole = values.reshape(-1, *values.shape[-2:])
    rows, cols = (-(-n // tile) for n in whole.shape[1:])
    found = np.empty((len(whole), rows, cols), np.uint32)
    for word, row, col in np.ndindex(found.shape):
        part = whole[word, row * tile : (row + 1) * tile, col * tile : (col + 1) * tile]
        found[word, row, col] = zlib.crc32(part.tobytes())
    return found


class Checks:
    """The checksums of all tiles: `of` has (words, rows, cols) uint32 for each field and level."""

    def __init__(self, pyramid: StoreSizes, is_marked: bool, values: np.ndarray | None = None) -> None:
        shapes = {
            (name, level): (FIELDS[name][2], *(-(-n // pyramid.tile) for n in shape_of(pyramid, name, level)))
            for level in range(pyramid.top + 1)
            for name in fields_of(level, is_marked)
        }
        ends = np.cumsum([np.prod(shape) for shape in shapes.values()])
        self.values = np.zeros(ends[-1], np.uint32) if values is None else np.ascontiguousarray(values, np.uint32)
        parts = np.split(self.values, ends[:-1])
        self.of = {at: part.reshape(shape) for (at, shape), part in zip(shapes.items(), parts, strict=True)}

    def note(self, name: str, level: int, tile: tuple[int, int], noted: np.ndarray) -> None:
        """Store the checksums of an area; `tile` is the row and column of its first tile."""
        row, col = tile
        _, rows, cols = noted.shape
        self.of[name, level][:, row : row + rows, col : col + cols] = noted

    @property
    def sha256(self) -> str:
        """Hash of all checksums."""
        return hashlib.sha256(self.values.astype("<u4").tobytes()).hexdigest()


class Tiles:
    """Reads tiles from any thread. The last tiles that were read stay in memory, at most `most_bytes` of them."""

    def __init__(self, arrays: Arrays, checks: Checks, most_bytes: int) -> None:
        self._arrays = arrays
        self._checks = checks
        self._pyramid = arrays.pyramid
        self.most_bytes = most_bytes
        self.bytes = 0
        self._kept: OrderedDict[At, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def area(self, name: str, level: int, where: Area) -> np.ndarray:
        """Values of an area, (rows, cols); for ranges (2, rows, cols).

        Raises
        ------
        MissingTileError
            A tile of it is missing or damaged.
        """
        dtype, _, words = FIELDS[name]
        shape = tuple(max(0, s.stop - s.start) for s in where)
        found = np.empty((words, *shape) if words > 1 else shape, dtype)
        for at, inside, part in tiles_over(where, self._pyramid.tile):
            found[(..., *part)] = self.tile((name, level, *at))[(..., *inside)]
        return found

    def tile(self, at: At) -> np.ndarray:
        """One tile, as `area` returns it."""
        with self._lock:
            if at in self._kept:
                self._kept.move_to_end(at)
                return self._kept[at]
        tile = self._read(at)
        with self._lock:
            if at not in self._kept:
                self._kept[at] = tile
                self.bytes += tile.nbytes
            while self.bytes > self.most_bytes:
                self.bytes -= self._kept.popitem(last=False)[1].nbytes
        return tile

    def _read(self, at: At) -> np.ndarray:
        name, level, row, col = at
        side = self._pyramid.tile
        where = area(shape_of(self._pyramid, name, level), side, (row, col))
        tile = self._arrays.read(name, level, where)
        noted = self._checks.of[name, level][:, row : row + 1, col : col + 1]
        if tile.shape[-2:] != tuple(s.stop - s.start for s in where) or not np.array_equal(
            checksums(tile, side), noted
        ):
            raise self._arrays.missing(name, level, where, "is not the tile that was built")
        return tile
