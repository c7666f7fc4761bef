"""Water that a map shows by itself: large areas of one exact height that no rim lets run off.

Maps store lakes and the sea as one height. But whole numbers make terraces of gentle land, too: a terrace ends in a
step up on one side and in a step down on the other. Water has no side that goes down, but for an outlet.
"""

from __future__ import annotations

import numpy as np

LEAST_SIDE = 8  # posts a side of the tiles that areas are made of
MOST_TILES = 512  # a side of the map: tiles of larger maps are larger
LEAST_TILES = 100  # of one height, side by side: 6400 posts; less may be the bed of a dry basin
LEAST_OF_SEA = 24  # at height 0
OUTLET = 0.08  # share of the tiles around an area that may lie lower, none of their posts higher


def water_posts(heights: np.ndarray) -> np.ndarray | None:
    """(rows, cols) bool, the posts that stand in water; None if none do.

    Parameters
    ----------
    heights
        (rows, cols) float32 metres, NaN where void.
    """
    side = max(LEAST_SIDE, max(heights.shape) // MOST_TILES)
    rows, cols = (n // side for n in heights.shape)
    if rows < 2 or cols < 2:
        return None
    low, high = (_of_tiles(of, heights, side) for of in (np.minimum, np.maximum))
    flat = low == high
    if flat.sum() < LEAST_OF_SEA:
        return None
    found = np.full((rows, cols), np.nan, np.float32)
    for tiles in _areas(flat, low):
        if len(tiles) >= (LEAST_TILES if low[tuple(tiles[0])] else LEAST_OF_SEA) and _holds_water(tiles, low, high):
            found[tiles[:, 0], tiles[:, 1]] = low[tuple(tiles[0])]
    return _posts_of(found, heights, side) if np.isfinite(found).any() else None


def _of_tiles(of: np.ufunc, heights: np.ndarray, side: int) -> np.ndarray:
    """What a ufunc makes of each whole tile; NaN where it has a void post."""
    rows, cols = (n // side for n in heights.shape)
    tiles = heights[: rows * side, : cols * side].reshape(rows, side, cols, side)
    return of.reduce(of.reduce(tiles, 3), 1)


def _areas(flat: np.ndarray, level: np.ndarray) -> list[np.ndarray]:
    """Tiles, (n, 2) rows and columns, that lie side by side on one level."""
    areas, seen = [], ~flat
    for start in zip(*np.nonzero(flat), strict=True):
        if seen[start]:
            continue
        seen[start] = True
        area, todo = [], [start]
        while todo:
            row, col = todo.pop()
            area.append((row, col))
            for at in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
                inside = 0 <= at[0] < flat.shape[0] and 0 <= at[1] < flat.shape[1]
                if inside and not seen[at] and level[at] == level[start]:
                    seen[at] = True
                    todo.append(at)
        areas.append(np.array(area))
    return areas


def _holds_water(tiles: np.ndarray, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether the land around an area nowhere falls away from it, but for an outlet, and somewhere rises."""
    level = low[tuple(tiles[0])]
    steps = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    around = np.unique((tiles[:, None] + steps).reshape(-1, 2), axis=0)
    around = around[((around >= 0) & (around < low.shape)).all(1)]
    lows, highs = low[around[:, 0], around[:, 1]], high[around[:, 0], around[:, 1]]
    rim = (lows != level) | (highs != level)
    falls, rises = np.count_nonzero((lows < level) & (highs <= level)), np.count_nonzero(highs > level)
    return bool(rises > 0 and falls <= OUTLET * np.count_nonzero(rim))


def _posts_of(found: np.ndarray, heights: np.ndarray, side: int) -> np.ndarray:
    """Posts on the level of a watery tile that they belong to, or that lies beside their own."""
    rows, cols = heights.shape
    padded = np.pad(found, 1, constant_values=np.nan)
    tile_row = np.minimum(np.arange(rows) // side, found.shape[0] - 1) + 1
    tile_col = np.minimum(np.arange(cols) // side, found.shape[1] - 1) + 1
    water = np.zeros(heights.shape, bool)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            levels = padded[tile_row + i][:, tile_col + j]
            water |= heights == levels
    return water
