"""Where the rings of the clipmap are: nested rectangles of blocks around the eye.

Ring l has cells of 2^l posts. A block is 8 × 8 cells. A ring is about square in metres, and `across` blocks wide along
the axis with the larger spacing. It follows the eye in steps of two of its cells, so the next finer ring ends on
its lattice (Asirvatham & Hoppe 2005, "Terrain rendering using GPU-based geometry clipmaps").
"""

from __future__ import annotations

import math
from typing import NamedTuple

PATCH = 8  # ring cells along a block's side
PATCHES = 8  # blocks across a ring, along the axis with the larger spacing


class Ring(NamedTuple):
    """One ring of the clipmap.

    Attributes
    ----------
    level
        Its cells are 2^level posts wide.
    origin
        Column and row of its north-west post; may lie beyond the map.
    patches
        Columns and rows of blocks, including those that the finer ring covers. All of them overlap the map.
    """

    level: int
    origin: tuple[int, int]
    patches: tuple[int, int]

    @property
    def end(self) -> tuple[int, int]:
        """Column and row of its south-east post."""
        side = PATCH << self.level
        return self.origin[0] + self.patches[0] * side, self.origin[1] + self.patches[1] * side

    def beyond(self, last_post: tuple[int, int]) -> list[tuple[int, int, int, int]]:
        """The map outside the ring, as four strips: first column and row, last column and row. Some may be empty."""
        (west, north), (east, south), (last_col, last_row) = self.origin, self.end, last_post
        sides = [(0, 0, west, last_row), (east, 0, last_col, last_row)]
        return [*sides, (0, 0, last_col, north), (0, south, last_col, last_row)]


def rings_around(
    eye_post: tuple[float, float],
    away_m: float,
    last_post: tuple[int, int],
    spacing_m: tuple[float, float],
    top_level: int,
    across: int = PATCHES,
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
    patches = _patches_across(spacing_m, across)
    centre = [min(max(at, 0.0), float(last)) for at, last in zip(eye_post, last_post, strict=True)]
    half_m = 0.5 * across * PATCH * max(spacing_m)
    finest = min(top_level, max(0, math.floor(math.log2(max(away_m, half_m) / half_m))) + left_out)
    rings = []
    for level in range(finest, top_level + 1):
        rings.append(_on_map(_ring_at(level, centre, patches), last_post))
        if _covers(rings[-1], last_post):
            break
    return rings


def ring_over(last_post: tuple[int, int], spacing_m: tuple[float, float], top_level: int) -> list[Ring]:
    """One ring over the whole map, for a mesh without an eye.

    A unit becomes a block at most twice, and then has at most 64 segments a side. So the ring needs more units the
    longer the map is: its finest triangles are then a quarter of a post, or smaller.
    """
    reach = PATCH * PATCH * PATCH * 64
    across = 2 << max(0, math.ceil(math.log2(2 * max(last_post) / reach)))
    centre, patches = [0.5 * last for last in last_post], _patches_across(spacing_m, across)
    rings = (_on_map(_ring_at(level, centre, patches), last_post) for level in range(top_level + 1))
    return next([ring] for ring in rings if _covers(ring, last_post))


def _patches_across(spacing_m: tuple[float, float], across: int) -> tuple[int, int]:
    largest = max(spacing_m)
    east, north = (max(across, round(across * largest / spacing)) for spacing in spacing_m)
    return east, north


def _ring_at(level: int, centre: list[float], patches: tuple[int, int]) -> Ring:
    step = 2 << level
    corner = [at - 0.5 * n * (PATCH << level) for at, n in zip(centre, patches, strict=True)]
    col, row = (step * math.floor(at / step + 0.5) for at in corner)
    return Ring(level, (col, row), patches)


def _on_map(ring: Ring, last_post: tuple[int, int]) -> Ring:
    """The ring without the rows and columns of blocks that lie beyond the map."""
    side = PATCH << ring.level
    first = [max(0, -start // side) for start in ring.origin]
    starts = zip(ring.patches, ring.origin, last_post, strict=True)
    end = [min(n, -((start - last) // side)) for n, start, last in starts]
    col, row = (start + side * i for start, i in zip(ring.origin, first, strict=True))
    cols, rows = (max(1, b - a) for a, b in zip(first, end, strict=True))
    return Ring(ring.level, (col, row), (cols, rows))


def _covers(ring: Ring, last_post: tuple[int, int]) -> bool:
    return all(ring.origin[i] <= 0 and ring.end[i] >= last_post[i] for i in range(2))


def patches_for(triangles: int) -> int:
    """Blocks across a ring for a budget: no unit becomes a block there, so many triangles need many units."""
    return next((across for least, across in ((200_000, 24), (60_000, 16), (16_000, 8)) if triangles >= least), 4)
