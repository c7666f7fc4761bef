""".npy arrays, SRTM .hgt tiles, and other files without a header, through numpy."""

from __future__ import annotations

import math
import os
import tokenize

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.georeference import hgt_place
from terrain_gl.readers.raster import MAX_CHANNELS, Blocks, Raster, one_line, rows_at_once

SRTM_VOID = -32768.0


def open_npy(path: str, name: str) -> Raster:
    """Open a 2-D array, or a 3-D one of colours, in C or Fortran order."""
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, TypeError, OSError, EOFError, OverflowError, SyntaxError, tokenize.TokenError) as error:
        raise TerrainError(f"{name}: is not a whole .npy array ({one_line(error)}): save it again") from None
    if array.ndim not in (2, 3) or array.dtype.kind not in "iuf":
        kind = f"{array.ndim}-dimensional {array.dtype}"
        raise TerrainError(f"{name}: holds a {kind} array: expected numbers of shape (rows, cols)")
    is_stack = array.ndim == 3 and array.shape[0] == 1 < array.shape[1]  # (1, rows, cols), as rasterio reads a band
    shape = (*array.shape[is_stack:], 1)[:3]
    if shape[2] > MAX_CHANNELS:
        raise TerrainError(f"{name}: has shape {array.shape}: expected (rows, cols), save one layer")
    if not array.flags.c_contiguous and len(array.shape[is_stack:]) == 3:
        raise TerrainError(f"{name}: is in Fortran order: save numpy.ascontiguousarray(array)")
    return Raster(
        name, shape, array.dtype, _npy_blocks(path, array.dtype, shape, array.offset, array.flags.c_contiguous)
    )


def _npy_blocks(path: str, dtype: np.dtype, shape: tuple[int, int, int], offset: int, c_order: bool) -> Blocks:
    """Read in pieces. A memory map is not used, because all of its pages would stay in memory."""
    rows, cols, channels = shape if c_order else (shape[1], shape[0], shape[2])
    step = rows_at_once(cols)
    with open(path, "rb") as file:
        file.seek(offset)
        for row in range(0, rows, step):
            piece = slice(row, min(row + step, rows))
            pixels = np.fromfile(file, dtype, (piece.stop - row) * cols * channels)
            pixels = pixels.reshape(piece.stop - row, cols, channels)
            yield (piece, pixels) if c_order else (np.s_[:, piece], pixels.swapaxes(0, 1))


def open_hgt(path: str, name: str) -> Raster:
    """SRTM tile: n × n big-endian int16, one degree a side, named after its south-west corner."""
    size = os.path.getsize(path)
    side = math.isqrt(size // 2)
    if size != 2 * side * side:
        raise TerrainError(f"{name}: {size} bytes are not a square of 2-byte posts: the .hgt tile is cut short")
    shape = (side, side, 1)
    blocks = _npy_blocks(path, np.dtype(">i2"), shape, 0, True)
    spacing_m, place = hgt_place(path, side)
    return Raster(name, shape, np.dtype(">i2"), blocks, nodata=SRTM_VOID, spacing_m=spacing_m, georeference=place)


RAW_ENDINGS = (".raw", ".r16", ".r32")
ORDERS = {"little": "<", "big": ">"}  # of the bytes of a number
_RAW_TYPES = {1: "u1", 2: "u2", 4: "f4"}
_SMOOTHER = 0.5  # land is "much smoother" if neighbours differ by less than this share of the other difference
_SAMPLE_BYTES = 1 << 22


def open_raw(path: str, name: str, size: tuple[int, int] | None, byte_order: str | None = None) -> Raster:
    """A file without a header, row after row, as game engines write it: 8 or 16 bits, or 32-bit floats.

    `size` is columns and rows; by default a square of 16-bit posts, or of floats for .r32. Numbers count as
    little-endian and unsigned; or as big-endian or signed, with a note, if that gives much smoother land.
    """
    length = os.path.getsize(path)
    if size is None:
        side = math.isqrt(length // (4 if path.lower().endswith(".r32") else 2))
        size = side, side
    cols, rows = size
    each = length // max(1, cols * rows)
    if each not in _RAW_TYPES or each * cols * rows != length:
        raise TerrainError(f"{name}: {length} bytes are not {cols} x {rows} posts of 1, 2 or 4 bytes: give --raw WxH")
    notes: tuple[str, ...] = ()
    sample = _in_the_middle(path, each, cols)
    if byte_order is None:
        rough = {order: _roughness(sample.view(f"{ORDERS[order]}i{each}")[..., 0]) for order in ORDERS}
        byte_order = "big" if rough["big"] < _SMOOTHER * rough["little"] else "little"
        if byte_order == "big":
            notes = ("its land is smooth with the big end of numbers first: --byte-order little is the other way",)
    dtype = np.dtype(ORDERS[byte_order] + _RAW_TYPES[each])
    if each == 2:
        unsigned, signed = (_variation(values) for values in _by_sign(sample.view(dtype)[..., 0]))
        if signed < _SMOOTHER * unsigned:  # without the sign, heights below 0 are the highest
            dtype = np.dtype(dtype.str.replace("u", "i"))
            notes += ("its land is smooth with signed numbers: heights below 0 count as such",)
    shape = (rows, cols, 1)
    return Raster(name, shape, dtype, _npy_blocks(path, dtype, shape, 0, True), notes=notes)


def _in_the_middle(path: str, each: int, cols: int) -> np.ndarray:
    """Bytes of rows in the middle of a file without a header: (rows, cols, each) uint8."""
    row_bytes = each * cols
    rows = max(1, _SAMPLE_BYTES // row_bytes)
    with open(path, "rb") as file:
        file.seek(max(0, os.path.getsize(path) // row_bytes - rows) // 2 * row_bytes)
        return np.frombuffer(file.read(rows * row_bytes), np.uint8).reshape(-1, cols, each)


def _by_sign(bits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """16 bits as unsigned and as signed numbers."""
    unsigned = bits.astype(np.int64) & 0xFFFF
    return unsigned, (unsigned ^ 0x8000) - 0x8000


def _variation(values: np.ndarray) -> float:
    """Mean difference of neighbours along rows."""
    return float(np.abs(np.diff(values, axis=1)).mean()) if values.shape[1] > 1 else 0.0


def _roughness(bits: np.ndarray) -> float:
    """Mean difference of neighbours along rows, as a share of the range; between floats, the floats are counted.

    In the wrong byte order, neighbours differ at random.
    """
    if bits.itemsize == 2:
        order = min(_by_sign(bits), key=_variation)
    else:  # a float's place in the order of all floats; of two negative floats, the lower one has the larger bits
        order = bits.astype(np.int64)
        order = np.where(order < 0, -(order & 0x7FFFFFFF), order)
    extent = float(np.ptp(order))
    return _variation(order) / extent if extent else 0.0
