"""The heights that a page's horizons need: windows around the page, each twice as wide and half as fine as the last.

Window 0 has the page's own spacing: the page and an apron around it. Window k has the spacing of the level k above the
page. Therefore distant mountains cost little, and are as exact as their distance requires. All windows have the same
number of posts.

          ┌───────────────┐
          │   ┌───────┐   │      the horizon of a post in the page P: heights of window 0 as far as it reaches,
          │   │ ┌─┐   │   │      then those of window 1 outside window 0, and so on
          │   │ │P│   │   │
          │   │ └─┘   │   │
          │   └───────┘   │
          └───────────────┘

Windows are a function of the map alone: it does not matter which pages are loaded. Horizons for the sun begin with
window 0. Horizons for the sky begin with window 1, because the sky's light is soft: there the page has a quarter of the
posts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Rect, tiles_over
from ..gpu import layout
from ..light.horizon import AZIMUTHS
from .map import PagedMap, PageKey

LEAST_APRON = 16  # posts
BORDER = 1  # texels of the sky around a page: with them, lookups are bilinear up to the page's rim

MARGIN = 2 * layout.SKY_TEXEL + 1  # posts around a page whose horizons the texels of its border need


class PageWindows(NamedTuple):
    """Windows around a page."""

    heights: np.ndarray  # (windows, side + 1, side + 1) float32 metres; outside the map, its rim is repeated
    # (windows, 2) columns and rows from the first post of window 0 to that of each window, in posts of the page
    shift: np.ndarray
    inside: np.ndarray  # (windows, 4) first column and row on the map, then the last ones, in posts of the window

    def coarser(self) -> PageWindows:
        """The windows without the first one."""
        return PageWindows(self.heights[1:], (self.shift[1:] - self.shift[1]) >> 1, self.inside[1:])


def side_of(tile: int) -> int:
    """Cells along a side of a window."""
    return tile + 2 * max(LEAST_APRON, tile // 4)


def sky_side(tile: int) -> int:
    """Texels of the sky along a side of a page, with the border. Each texel has 3 × 3 cells of window 1."""
    return -(-(tile // 2) // layout.SKY_TEXEL) + 2 * BORDER


def light_bytes(tile: int) -> int:
    """GPU memory for the light of a page: the sun's horizon of each post, and the texels of the sky."""
    return 2 * (tile + 1) ** 2 + 16 * sky_side(tile) ** 2


def scratch_bytes(heightmap: PagedMap) -> int:
    """GPU memory for making the light of one page: its windows, the horizons of window 0, and hulls."""
    posts = side_of(heightmap.tile) + 1
    count = most_windows(heightmap)
    return 4 * posts**2 * count + 2 * AZIMUTHS * posts**2 + hull_bytes(heightmap)


def hull_bytes(heightmap: PagedMap) -> int:
    """GPU memory for the hulls of the lines over a page: points times lines."""
    side = side_of(heightmap.tile)
    count = most_windows(heightmap)
    points = side + 1 + count * (side // 4 + 2)
    return 8 * points * 2 * (heightmap.tile + 2 * MARGIN + 4)


def most_windows(heightmap: PagedMap) -> int:
    """The largest number of windows that a page of this map has."""
    return max(window_count(heightmap, level) for level in range(heightmap.top + 1))


def window_count(heightmap: PagedMap, level: int) -> int:
    """Number of windows of a page of a level: at least 2, at most `MAX_WINDOWS`.

    Within these limits, the last window contains the whole map, or has the spacing of the coarsest level.
    """
    count = 2
    side = side_of(heightmap.tile)
    while level + count <= heightmap.top and count < layout.MAX_WINDOWS:
        if side << level + count - 1 >= 2 * max(heightmap.rows, heightmap.cols):
            break
        count += 1
    return count


def windows_of(heightmap: PagedMap, key: PageKey) -> PageWindows:
    """Read the windows around a page. Where a tile is missing, the next coarser window takes its place.

    `TerrainError`: a tile of the coarsest window is missing.
    """
    level = key[0]
    side = side_of(heightmap.tile)
    first = _first_posts(heightmap, key)
    count = len(first)
    heights = np.empty((count, side + 1, side + 1), np.float32)
    inside = np.empty((count, 4), np.int32)
    for k in range(count - 1, -1, -1):
        last = np.array(heightmap.posts(level + k)[::-1]) - 1
        low, high = np.clip(-first[k], 0, side), np.clip(last - first[k], 0, side)
        inside[k] = *low, *high
        coarser = None if k == count - 1 else partial(_finer, heights[k + 1], first[k + 1], first[k], low, high)
        part = _read(heightmap, level + k, first[k] + low, first[k] + high, coarser)
        around = [(low[i], side - high[i]) for i in (1, 0)]
        heights[k] = np.pad(part, around, mode="edge")
    shift = np.array([(first[k] << k) - first[0] for k in range(count)], np.int32)
    return PageWindows(heights, shift, inside)


def holds(heightmap: PagedMap, key: PageKey, posts: Rect) -> bool:
    """Whether any window of a page contains a post of a rectangle."""
    side = side_of(heightmap.tile)
    last = np.array([heightmap.cols - 1, heightmap.rows - 1])
    for k, first in enumerate(_first_posts(heightmap, key), key[0]):
        low = np.minimum(np.maximum(first, 0) << k, last)
        high = np.minimum(np.maximum(first + side, 0) << k, last)
        begin, end = np.maximum(low, posts[:2]), np.minimum(high, posts[2:])
        on_lattice = (-(-begin >> k) << k <= end) | (end == last)
        if (begin <= end).all() and on_lattice.all():
            return True
    return False


def _first_posts(heightmap: PagedMap, key: PageKey) -> list[np.ndarray]:
    """Column and row of the first post of each window, on the lattice of its level."""
    level, row, col = key
    middle = np.array([col, row]) * heightmap.tile + heightmap.tile // 2
    half = side_of(heightmap.tile) // 2
    return [(middle >> k) - half for k in range(window_count(heightmap, level))]


def flat_windows(heightmap: PagedMap) -> PageWindows:
    """Two windows of flat ground: a page has at least two."""
    side = side_of(heightmap.tile)
    shift = np.array([[0, 0], [-side // 2] * 2], np.int32)
    inside = np.array([[0, 0, side, side]] * 2, np.int32)
    return PageWindows(np.zeros((2, side + 1, side + 1), np.float32), shift, inside)


def _read(
    heightmap: PagedMap, level: int, low: np.ndarray, high: np.ndarray, coarser: Callable[[], np.ndarray] | None
) -> np.ndarray:
    """Heights of posts from `low` to `high`, columns and rows. For missing tiles, `coarser` gives the heights."""
    rows, cols = (slice(int(low[i]), int(high[i]) + 1) for i in (1, 0))
    if level > heightmap.top:
        return _above(heightmap, level - heightmap.top, rows, cols)
    if coarser is None:
        return heightmap.lattice_heights(level, rows, cols)
    missing = []
    found = np.empty((rows.stop - rows.start, cols.stop - cols.start), np.float32)
    for _, _, part in tiles_over((rows, cols), heightmap.tile):
        y, x = (slice(s.start + p.start, s.start + p.stop) for s, p in zip((rows, cols), part, strict=True))
        try:
            found[part] = heightmap.lattice_heights(level, y, x)
        except TerrainError:
            missing.append(part)
    instead = coarser() if missing else found
    for part in missing:
        found[part] = instead[part]
    return found


def _above(heightmap: PagedMap, levels: int, rows: slice, cols: slice) -> np.ndarray:
    """Heights for a window whose level is `levels` above the top level: every 2^`levels`-th post of the top level."""
    posts = heightmap.posts(heightmap.top)
    at = [np.minimum(np.arange(s.start, s.stop) << levels, n - 1) for s, n in zip((rows, cols), posts, strict=True)]
    where = [slice(int(each[0]), int(each[-1]) + 1) for each in at]
    heights = heightmap.lattice_heights(heightmap.top, *where)
    return heights[np.ix_(at[0] - at[0][0], at[1] - at[1][0])]


def _finer(
    coarse: np.ndarray, first: np.ndarray, fine_first: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Heights of a window between the posts of the next coarser one, from `low` to `high`."""
    (x, u), (y, v) = (_halves(low[i] + fine_first[i], high[i] + fine_first[i], first[i]) for i in (0, 1))
    rows = coarse[y] * (1 - v)[:, None] + coarse[y + 1] * v[:, None]
    return rows[:, x] * (1 - u) + rows[:, x + 1] * u


def _halves(low: int, high: int, first: int) -> tuple[np.ndarray, np.ndarray]:
    """For each post, the place in the coarser window at or before it, and its fraction of the way to the next."""
    post = np.arange(low, high + 1)
    return (post >> 1) - first, (0.5 * (post & 1)).astype(np.float32)
