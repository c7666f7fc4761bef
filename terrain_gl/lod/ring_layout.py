"""Where the rings of the clipmap are: nested rectangles of blocks around the eye.

Ring l has cells of 2^l posts. A block is 8 × 8 cells. A ring is about square in metres, and `across` blocks wide along
the axis with the larger spacing. It follows the eye in steps of four of its cells, so it begins and ends on the lattice
of the next coarser ring (Asirvatham & Hoppe 2005, "Terrain rendering using GPU-based geometry clipmaps").
"""

import math
from typing import NamedTuple

import numpy as np

from ..basics.rect import Rect
from ..camera import Camera, boxes_in_picture
from ..heightmap import Heightmap

BLOCK_SIDE = 8  # ring cells along a block's side
# pairs: from this number of triangles on, a ring has this many blocks across
_ACROSS = ((200_000, 64), (60_000, 48), (20_000, 32), (6_000, 16), (2_000, 8))
BLOCKS_ACROSS = 8  # blocks across a ring, along the axis with the larger spacing


class Ring(NamedTuple):
    """One ring of the clipmap.

    Attributes
    ----------
    level
        Its cells are 2^level posts wide.
    origin
        Column and row of its north-west post; may lie beyond the map.
    blocks
        Columns and rows of blocks, including those that the finer ring covers. All of them overlap the map.
    """

    level: int
    origin: tuple[int, int]
    blocks: tuple[int, int]

    @property
    def end(self) -> tuple[int, int]:
        """Column and row of the ring's south-east post."""
        side = BLOCK_SIDE << self.level
        return self.origin[0] + self.blocks[0] * side, self.origin[1] + self.blocks[1] * side

    def beyond(self, last_post: tuple[int, int]) -> list[Rect]:
        """The part of the map outside the ring, as rectangles of posts."""
        west, north = self.origin
        east, south = self.end
        last_col, last_row = last_post
        sides = [(0, 0, west, last_row), (east, 0, last_col, last_row)]
        strips = [*sides, (0, 0, last_col, north), (0, south, last_col, last_row)]
        return [each for each in strips if each[0] < each[2] and each[1] < each[3]]


def rings_around(
    eye_post: tuple[float, float],
    away_m: float,
    last_post: tuple[int, int],
    spacing_m: tuple[float, float],
    top_level: int,
    across: int = BLOCKS_ACROSS,
    left_out: int = 0,
) -> list[Ring]:
    """Rings around a place, finest first; the last one covers the whole map.

    Parameters
    ----------
    eye_post
        Column and row below the eye. For an eye beside the map, the nearest place on the map is taken.
    away_m
        Rough distance from the eye to the ground. Rings that would lie wholly within it are left out.
    last_post
        Last column and row of the map.
    top_level
        Coarsest level of the error tables, and of the rings.
    across
        Blocks across a ring, along the axis with the larger spacing.
    left_out
        How many of the finest rings to leave out.
    """
    blocks = _blocks_across(spacing_m, across)
    centre = min(max(eye_post[0], 0.0), float(last_post[0])), min(max(eye_post[1], 0.0), float(last_post[1]))
    half_m = 0.5 * across * BLOCK_SIDE * max(spacing_m)
    finest = min(top_level, max(0, math.floor(math.log2(max(away_m, half_m) / half_m))) + left_out)
    rings = []
    for level in range(finest, top_level + 1):
        rings.append(_ring_at(level, centre, blocks, last_post))
        if _covers(rings[-1], last_post):
            break
    return rings


def rings_in_picture(
    rings: list[Ring], heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float
) -> list[Ring]:
    """The finest rings that together contain all land in the picture."""
    dx, dy = heightmap.spacing_m
    last_col, last_row = heightmap.cols - 1, heightmap.rows - 1
    needed = len(rings)
    while needed > 1:  # land beyond a ring is also beyond all finer ones
        if strips := rings[needed - 2].beyond((last_col, last_row)):
            west, north, east, south = np.array(strips).T
            low_m, high_m = (np.full(len(strips), at) for at in heightmap.range_m)
            low = np.stack([dx * west, dy * (last_row - south), low_m], 1)
            high = np.stack([dx * east, dy * (last_row - north), high_m], 1)
            if boxes_in_picture(camera, size, near_m, low, high).any():
                break
        needed -= 1
    return rings[:needed]


def ring_over(last_post: tuple[int, int], spacing_m: tuple[float, float], top_level: int) -> list[Ring]:
    """One ring over the whole map, for a mesh without an eye.

    A unit can become a block twice, and the last units have at most 64 segments a side. So a longer map needs more
    units. With them, the finest triangles are a quarter of a post wide, or smaller.
    """
    reach = BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE * 64
    across = 2 << max(0, math.ceil(math.log2(2 * max(last_post) / reach)))
    centre = (0.5 * last_post[0], 0.5 * last_post[1])
    blocks = _blocks_across(spacing_m, across)
    rings = (_ring_at(level, centre, blocks, last_post) for level in range(top_level + 1))
    return next([ring] for ring in rings if _covers(ring, last_post))


def _blocks_across(spacing_m: tuple[float, float], across: int) -> tuple[int, int]:
    largest = max(spacing_m)
    east, north = spacing_m
    return max(across, round(across * largest / east)), max(across, round(across * largest / north))


def _ring_at(level: int, centre: tuple[float, float], blocks: tuple[int, int], last_post: tuple[int, int]) -> Ring:
    """The ring around a place, without rows and columns of blocks that lie beyond the map."""
    (col, cols), (row, rows) = (_along(level, *axis) for axis in zip(centre, blocks, last_post, strict=True))
    return Ring(level, (col, row), (cols, rows))


def _along(level: int, centre: float, blocks: int, last: int) -> tuple[int, int]:
    """First post and number of blocks along one axis. A ring begins about half its width before the centre."""
    step, side = 4 << level, BLOCK_SIDE << level
    start = step * math.floor((centre - 0.5 * blocks * side) / step + 0.5)
    first, end = max(0, -start // side), min(blocks, -((start - last) // side))
    return start + side * first, max(1, end - first)


def _covers(ring: Ring, last_post: tuple[int, int]) -> bool:
    west, north = ring.origin
    east, south = ring.end
    return west <= 0 and north <= 0 and east >= last_post[0] and south >= last_post[1]


def across_for(triangles: int) -> int:
    """Blocks across a ring for a budget. More triangles need more units: the search for a price cuts no unit."""
    return next((across for least, across in _ACROSS if triangles >= least), 4)
