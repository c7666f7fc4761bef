"""Find water in a map's heights: large areas of exactly one height from which water cannot run off.

Maps store lakes and the sea as one height. But heights in whole metres also make terraces of gentle land. A terrace has
a step up on one side and a step down on the other. Water has no side with a step down, except at an outlet.
"""

import numpy as np

from ..basics.boxes import over_blocks

LEAST_SIDE = 8  # least side of a tile, in posts; areas are sets of tiles
MOST_TILES = 512  # most tiles along a side of the map: larger maps have larger tiles
LEAST_TILES = 100  # least tiles of an area (6400 posts): a smaller area may be the bed of a dry basin
LEAST_OF_SEA = 24  # least tiles of an area at height 0
OUTLET = 0.08  # largest share of the tiles around an area that may lie lower, with no post above the area


def water_posts(heights: np.ndarray) -> np.ndarray | None:
    """Posts in water, (rows, cols) bool; None if there is no water. `heights` has NaN at voids."""
    side = tile_side(heights.shape)
    if min(heights.shape) < 2 * side:
        return None
    found = water_tiles(*(_of_tiles(of, heights, side) for of in (np.minimum, np.maximum)))
    return None if found is None else posts_at(found, heights, side)


def tile_side(shape: tuple[int, ...]) -> int:
    """Posts along a side of a tile of a map."""
    return max(LEAST_SIDE, max(shape) // MOST_TILES)


def water_tiles(low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """Height of the water in each tile, (rows, cols) float32, NaN in dry tiles; None if there is no water.

    `low` and `high` are the lowest and highest height of each whole tile; NaN for a tile with a void post.
    """
    flat = low == high
    if flat.sum() < LEAST_OF_SEA:
        return None
    found = np.full(low.shape, np.nan, np.float32)
    for tiles in _areas(flat, low):
        if len(tiles) >= (LEAST_TILES if low[tuple(tiles[0])] else LEAST_OF_SEA) and _holds_water(tiles, low, high):
            found[tiles[:, 0], tiles[:, 1]] = low[tuple(tiles[0])]
    return found if np.isfinite(found).any() else None


def _of_tiles(of: np.ufunc, heights: np.ndarray, side: int) -> np.ndarray:
    """Reduce each whole tile with a ufunc; NaN for a tile with a void post."""
    rows, cols = (n // side for n in heights.shape)
    return over_blocks(of, heights[: rows * side, : cols * side], side)


def _areas(flat: np.ndarray, level: np.ndarray) -> list[np.ndarray]:
    """Areas of neighbouring tiles at one height: (n, 2) rows and columns each."""
    areas = []
    seen = ~flat
    for start in zip(*np.nonzero(flat), strict=True):
        if seen[start]:
            continue
        seen[start] = True
        area = []
        todo = [start]
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
    """Whether the land around an area is higher in some place, and lower only at an outlet."""
    level = low[tuple(tiles[0])]
    steps = np.array(list(np.ndindex(3, 3))) - 1
    around = np.unique((tiles[:, None] + steps).reshape(-1, 2), axis=0)
    around = around[((around >= 0) & (around < low.shape)).all(1)]
    lows = low[around[:, 0], around[:, 1]]
    highs = high[around[:, 0], around[:, 1]]
    rim = (lows != level) | (highs != level)
    falls = np.count_nonzero((lows < level) & (highs <= level))
    rises = np.count_nonzero(highs > level)
    return bool(rises > 0 and falls <= OUTLET * np.count_nonzero(rim))


def posts_at(found: np.ndarray, heights: np.ndarray, side: int, first: tuple[int, int] = (0, 0)) -> np.ndarray:
    """Posts at the height of the water in their own tile, or in a tile beside it.

    `found` is a result of `water_tiles`. `heights` are those of the map, or of a part from row and column `first` on.
    """
    rows, cols = (np.arange(start, start + n) for start, n in zip(first, heights.shape, strict=True))
    padded = np.pad(found, 1, constant_values=np.nan)
    tile_row, tile_col = (np.minimum(at // side, n - 1) + 1 for at, n in zip((rows, cols), found.shape, strict=True))
    water = np.zeros(heights.shape, bool)
    for i, j in np.ndindex(3, 3):
        water |= heights == padded[tile_row + i - 1][:, tile_col + j - 1]
    return water
