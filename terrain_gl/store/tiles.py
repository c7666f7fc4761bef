"""Tiles of a store, verified: each tile is compared with the checksum that was stored when the store was built.

The checksum (CRC-32) is computed from the tile's values, and stored for the tile's place. So it finds errors that the
checksum inside a shard cannot find: a tile of another place, or of an earlier store. The store's description has a hash
of the list of all checksums.
"""

import hashlib
import threading
import zlib
from collections import OrderedDict
from collections.abc import Iterator

import numpy as np

from .format import FIELDS, Arrays, MissingTileError, fields_of, shape_of
from .pyramid import Area, StoreSizes

At = tuple[str, int, int, int]  # field, level, row and column of a tile


def tiles_of(pyramid: StoreSizes, name: str, level: int) -> tuple[int, int, int]:
    """Words, rows and columns of the tiles of an array."""
    rows, cols = (-(-n // pyramid.tile) for n in shape_of(pyramid, name, level))
    return FIELDS[name][2], rows, cols


def arrays_of(pyramid: StoreSizes, is_marked: bool) -> Iterator[tuple[str, int]]:
    """Field and level of all arrays."""
    for level in range(pyramid.top + 1):
        for name in fields_of(level, is_marked):
            yield name, level


def checksums(values: np.ndarray, tile: int) -> np.ndarray:
    """Checksums of the tiles of (..., rows, cols) values: (words, rows, cols) uint32."""
    whole = values.reshape(-1, *values.shape[-2:])
    words = whole.shape[0]
    rows = -(-whole.shape[1] // tile)
    cols = -(-whole.shape[2] // tile)
    found = np.empty((words, rows, cols), np.uint32)
    for word, row, col in np.ndindex(found.shape):
        part = whole[word, row * tile : (row + 1) * tile, col * tile : (col + 1) * tile]
        found[word, row, col] = zlib.crc32(np.ascontiguousarray(part).tobytes())
    return found


class Checks:
    """The checksums of all tiles.

    Attributes
    ----------
    of
        (words, rows, cols) uint32 of each field and level.
    """

    def __init__(self, pyramid: StoreSizes, is_marked: bool, values: np.ndarray | None = None) -> None:
        shapes = {at: tiles_of(pyramid, *at) for at in arrays_of(pyramid, is_marked)}
        ends = np.cumsum([np.prod(shape) for shape in shapes.values()])
        self.values = np.zeros(ends[-1], np.uint32) if values is None else np.ascontiguousarray(values, np.uint32)
        parts = np.split(self.values, ends[:-1])
        self.of = {at: part.reshape(shape) for (at, shape), part in zip(shapes.items(), parts, strict=True)}

    def note(self, name: str, level: int, where: Area, noted: np.ndarray, tile: int) -> None:
        """Store the checksums of an area that begins with a whole tile."""
        row, col = (s.start // tile for s in where)
        _, rows, cols = noted.shape
        self.of[name, level][:, row : row + rows, col : col + cols] = noted

    @property
    def sha256(self) -> str:
        """Hash of all checksums."""
        return hashlib.sha256(self.values.astype("<u4").tobytes()).hexdigest()


class Tiles:
    """Reads tiles from any thread; the most recently read ones stay in memory.

    Parameters
    ----------
    most_bytes
        The most memory that tiles may take.
    """

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
        side = self._pyramid.tile
        rows, cols = where
        words = (FIELDS[name][2],) if FIELDS[name][2] > 1 else ()
        found = np.empty((*words, max(0, rows.stop - rows.start), max(0, cols.stop - cols.start)), FIELDS[name][0])
        for y in range(rows.start // side, -(-rows.stop // side)):
            for x in range(cols.start // side, -(-cols.stop // side)):
                tile = self.tile((name, level, y, x))
                top, left = max(rows.start, y * side), max(cols.start, x * side)
                end = min(rows.stop, y * side + tile.shape[-2])
                right = min(cols.stop, x * side + tile.shape[-1])
                part = tile[..., top - y * side : end - y * side, left - x * side : right - x * side]
                found[..., top - rows.start : end - rows.start, left - cols.start : right - cols.start] = part
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
        shape = shape_of(self._pyramid, name, level)
        where = slice(row * side, min((row + 1) * side, shape[0])), slice(col * side, min((col + 1) * side, shape[1]))
        tile = self._arrays.read(name, level, where)
        size = tuple(s.stop - s.start for s in where)
        noted = self._checks.of[name, level][:, row : row + 1, col : col + 1]
        if tile.shape[-2:] != size or not np.array_equal(checksums(tile, side), noted):
            raise MissingTileError(self._arrays.called(name, level, where) + ": is not the tile that was built")
        return tile
