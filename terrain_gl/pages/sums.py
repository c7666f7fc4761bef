"""The data of a page for the GPU: heights, and summed-area tables of its own errors, ready to copy into a slot."""

from typing import NamedTuple

import numpy as np

from ..gpu import layout
from ..gpu.packing import ERROR_UNIT, pack_16, square_up, unpack_pair
from ..terrain import quantisation_range, steps_of
from .map import Page, PagedMap, PageKey
from .marks import is_mixed


class Sums(NamedTuple):
    """The content of a slot."""

    heights: np.ndarray  # (side + 1, side + 1) float32 metres; outside the map, the page's rim is repeated
    height_sums: np.ndarray  # (side + 1, side + 1) uint32: summed-area table of the heights in steps; it wraps
    counters: np.ndarray  # summed-area tables of class counters
    squares: np.ndarray  # summed-area table of squared errors
    ranges: np.ndarray | None  # (side, side) uint32: records `layout.NODE_RANGE` of the nodes; None for level 0
    marks: np.ndarray | None = None  # (side + 1, side + 1) uint8: of posts and nodes; None for a map without marks
    is_mixed: bool = False  # whether any node has both holes and land


def bytes_of_slot(tile: int, is_marked: bool = False) -> int:
    """GPU memory of a slot."""
    words = counter_words(tile)
    return (9 if is_marked else 8) * (tile + 1) ** 2 + 4 * words + words // 2 + layout.NODE_RANGE.itemsize * tile**2


def bytes_at_work(tile: int) -> int:
    """Approximate memory of a page while it is read and prepared."""
    return 3 * bytes_of_slot(tile)


def counter_words(tile: int) -> int:
    """Words of class counters in a slot."""
    return layout.CLASS_WORDS * (tile // layout.COUNT_TILE) ** 2


def sums_of(heightmap: PagedMap, key: PageKey) -> Sums:
    """Read a page, and compute its tables; glsl/error/count.comp computes the same counters and squares in memory."""
    page = heightmap.page(key)
    level = key[0]
    side = heightmap.tile
    base_m, low_m, span_m = quantisation_range(*heightmap.quantised_m)
    span = np.float32(span_m)
    tile = layout.COUNT_TILE * (1 if level else 2)
    n = side // tile
    worst, square = _of_cells(page, base_m, span) if level == 0 else _of_records(page, key, heightmap, span)
    per_tile = _padded(worst, side).reshape(n, tile, n, tile).max((1, 3))
    limits = layout.class_limits_m(span_m, heightmap.ground_spacing_m)
    counts = (per_tile > limits[:, None, None]).astype(np.uint8)
    sums = counts.cumsum(1, dtype=np.uint8).cumsum(2, dtype=np.uint8)
    counters = np.ascontiguousarray(sums.reshape(layout.CLASS_WORDS, 4, n, n).transpose(0, 2, 3, 1))
    squares = _padded(square_up(square), side).reshape(n, tile, n, tile).sum((1, 3), dtype=np.uint64)
    squares = squares.cumsum(0, dtype=np.uint64).cumsum(1, dtype=np.uint64)
    heights = np.pad(page.heights, [(0, side + 1 - n) for n in page.heights.shape], mode="edge").astype(np.float32)
    steps = steps_of(heights - np.float32(base_m), low_m - base_m, span_m)
    height_sums = steps.cumsum(0, dtype=np.uint32).cumsum(1, dtype=np.uint32)
    ranges = _padded(_ranges(page), side) if level else None
    sums = Sums(heights, height_sums, counters, squares, ranges)
    if page.marks is None:
        return sums
    return sums._replace(marks=_padded(page.marks, side + 1), is_mixed=is_mixed(page.marks))


def _of_cells(page: Page, base_m: float, span: np.float32) -> tuple[np.ndarray, np.ndarray]:
    """For cells of the map: largest error in metres, and squared error in units of span², both from the twist."""
    h = page.heights - np.float32(base_m)
    twist = (h[:-1, :-1] - h[:-1, 1:]) - (h[1:, :-1] - h[1:, 1:])
    t = twist / span
    errors = np.float32(0.25) * np.abs(twist) * np.float32(1 + 2.0**-20), t * t / np.float32(64)
    if page.marks is None:
        return errors
    is_hole = (page.marks[:-1, :-1] & layout.HOLE) > 0
    return np.where(is_hole, np.float32(0), errors[0]), np.where(is_hole, np.float32(0), errors[1])


def _of_records(page: Page, key: PageKey, heightmap: PagedMap, span: np.float32) -> tuple[np.ndarray, np.ndarray]:
    """For cells of patches: the same two errors, from the records of their nodes."""
    level, row, col = key
    most, rms = unpack_pair(page.errors).astype(np.float32) * (span * np.float32(ERROR_UNIT))
    posts = []
    for first, n, last in ((row, most.shape[0], heightmap.rows - 1), (col, most.shape[1], heightmap.cols - 1)):
        low = (first * heightmap.tile + np.arange(n)) << level
        high = np.minimum(low + (1 << level), last)
        posts.append((high - low + (high == last)).astype(np.float32))
    share = rms / span
    return most, share * share * (posts[0][:, None] * posts[1])


def _ranges(page: Page) -> np.ndarray:
    """Records `layout.NODE_RANGE`: lowest and highest heights, exchanged in nodes with voids."""
    low, high = page.ranges
    if page.marks is None:
        return pack_16(low, high)
    return np.where(page.marks[:-1, :-1] & layout.HOLED, pack_16(high, low), pack_16(low, high))


def _padded(values: np.ndarray, side: int) -> np.ndarray:
    """Values with 0 outside the page."""
    return np.pad(values, [(0, side - n) for n in values.shape])
