"""lod of method sat: a clipmap around the eye. The summed-area tables decide how coarse each patch may be.

rings    nested rectangles around the eye; ring l has cells of 2^l posts
blocks   8 × 8 units of one ring cell; a unit that needs 8 segments a side or more is a block itself
leaves   squares of 8, 4, 2 or 1 units: each is drawn as a patch of T × T segments, T ≥ 2
edges    the leaves on both sides of an edge take the finest spacing among them
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from .sat import box_sum

BLOCK_SIDE = 8  # units a side of a block
MOST_SEGMENTS_LOG2 = 6  # OpenGL's 64
FINEST = -5  # log2 of the smallest spacing in ring 0: 32 segments between two posts; in other rings 16
PATCH_COST = 14.0  # cost of a patch in triangles, besides its own triangles
LEAST_PARTS = 4 * (8 + PATCH_COST)  # four squares of 2 × 2 segments
FEW_LOG2 = 1  # for squares of at most 2^FEW_LOG2 cells a side, the cells themselves are read
ROUNDS = 3  # depth of blocks inside blocks
REFINE_FROM = 3  # units of 2^3 segments or more become blocks, which about halves their cost
REFINED = 0.5
Post = tuple[int, int]  # column, row
Square = tuple[int, int, int]  # depth, column, row of a square of a block


class Leaf(NamedTuple):
    """A patch: its north-west post, log2 of its side, and of its spacing, in posts."""

    low: Post
    side_log2: int
    step_log2: int


# Ring l is n blocks wide, and a block is 8 · 2^l posts wide. The ring's origin is a multiple of four of its cells. Of
# these origins, we take the one for which the ring's middle is nearest to the eye:
#   origin = 4 · 2^l · ⌊(eye − n · 8 · 2^l / 2) / (4 · 2^l) + 1/2⌋


def ring_origin(eye: tuple[float, float], blocks: tuple[int, int], level: int) -> Post:
    """First column and row of a ring around a place on the map, given in posts."""
    step = 4 << level
    col, row = (
        step * int(np.floor((at - 0.5 * n * (BLOCK_SIDE << level)) / step + 0.5))
        for at, n in zip(eye, blocks, strict=True)
    )
    return col, row


def rows_on_map(origin: int, blocks: int, level: int, last: int) -> range:
    """The rows (or columns) of a ring's blocks that overlap the map, whose posts are 0 to `last`."""
    side = BLOCK_SIDE << level
    meet = [i for i in range(blocks) if origin + side * i < last and origin + side * (i + 1) > 0]
    return range(meet[0], meet[-1] + 1)


# A tile of nodes is one entry of a level's tables, tile · 2^j posts wide. A box is widened to whole tiles.


class ClassTables(NamedTuple):
    """Class tables of one level j: cells of 2^j × 2^j posts."""

    classes: Sequence[np.ndarray]  # summed-area tables, (rows, cols) of tiles
    tile: int  # nodes a side of a tile
    most_m: float  # the highest minus the lowest height: no error is larger
    limits_m: np.ndarray  # of the classes


def tiles_over(level: ClassTables, j: int, low: Post, end: Post, last: Post) -> tuple[Post, Post]:
    """First tile, and the one after the last tile, over posts `low` to `end`; `last` is the map's last post."""
    side = level.tile << j
    rows, cols = level.classes[0].shape
    x, y = (max(at, 0) // side for at in low)
    x1, y1 = (min((min(e, of) - 1) // side + 1, n) for e, of, n in zip(end, last, (cols, rows), strict=True))
    return (x, y), (x1, y1)


# All cells of a box have errors of at most ε if the count of a class with limit(c) ≤ ε is 0. For a spacing 2^j below 1,
# a cell of the map is cut into n × n parts, n = 2^−j, which divides its error by n².


def is_within(levels: Sequence[ClassTables], low: Post, end: Post, last: Post, step_log2: int, error_m: float) -> bool:
    """Whether the tables prove that every cell of spacing 2^step_log2 in a box has an error of at most `error_m`."""
    j = max(step_log2, 0)
    level = levels[j]
    allowed_m = error_m * 4.0 ** max(-step_log2, 0)
    if allowed_m >= level.most_m:
        return True
    below = np.flatnonzero(level.limits_m <= allowed_m)
    return len(below) > 0 and box_sum(level.classes[below[0]], *tiles_over(level, j, low, end, last)) == 0


# A tile of level 0 has 4 × 4 cells of the map. For a square of at most 2 × 2 cells, we read the cells themselves, which
# gives a tighter bound: |t| / 4, and |t| / (4 n²) in n × n parts.


def few_cells_m(twists_m: np.ndarray, low: Post, side_log2: int, step_log2: int) -> float:
    """Largest error in a square of at most 2 × 2 cells, drawn at a spacing of 2^step_log2 ≤ 1; inf for all others."""
    if step_log2 > 0 or side_log2 > FEW_LOG2:
        return np.inf
    (x, x1), (y, y1) = ((max(at, 0), at + (1 << side_log2)) for at in low)
    return float(np.abs(twists_m[y:y1, x:x1]).max(initial=0.0)) / 4 * 4.0**step_log2


def coarsest_step(low: Post, side_log2: int, top_level: int) -> int:
    """log2 of the coarsest spacing of a square: two segments a side or more, and its corner is on the lattice."""
    bits = low[0] | low[1] | 1 << side_log2
    return min((bits & -bits).bit_length() - 1, top_level, side_log2 - 1)


def finest_step(side_log2: int, ring_level: int) -> int:
    """log2 of the smallest spacing: at most 64 segments a side, and between two posts 32 in ring 0, elsewhere 16."""
    return max(side_log2 - MOST_SEGMENTS_LOG2, FINEST if ring_level == 0 else FINEST + 1)


def next_step(coarsest: int, finest: int, holds: Callable[[int], bool]) -> int | None:
    """log2 of the coarsest spacing within the tolerance; None if there is none."""
    return next((step for step in range(coarsest, finest - 1, -1) if holds(step)), None)


# A single cell of the map with 2 × 2 segments is a fan of four triangles: its edges are straight, so they stay whole.


def is_cell_fan(side_log2: int, step_log2: int) -> bool:
    """Whether a leaf is such a fan; its side and spacing are log2 in posts."""
    return side_log2 == 0 and step_log2 == -1


# From the units up:   cost(square) = min(2 T² + 14,  Σ cost of its four parts)
# Four parts cost at least LEAST_PARTS. If a square costs no more than that, it becomes one leaf.


def cut_block(steps: dict[Square, int | None], unit_log2: int, can_refine: bool) -> np.ndarray:
    """Cut a block into leaves.

    Parameters
    ----------
    steps
        log2 of the spacing of each square (depth, column, row) as one leaf; None if no spacing is within the tolerance.
        Squares of depth d are 8 >> d units wide. Squares with nothing to draw are missing.
    unit_log2
        Posts along a unit, log2.
    can_refine
        Whether units may become blocks.

    Returns
    -------
    leaves
        (8, 8, 2) for each unit, row after row: log2 of its square's units a side, and of its spacing. The first number
        is −1 if there is nothing to draw, −2 if the unit becomes a block, −3 if no spacing is within the tolerance.
    """
    leaves = np.zeros((BLOCK_SIDE, BLOCK_SIDE, 2), int)
    _cut(steps, unit_log2, can_refine, (0, 0, 0), leaves)
    return leaves


def _cut(
    steps: dict[Square, int | None], unit_log2: int, can_refine: bool, square: Square, leaves: np.ndarray
) -> float:
    """Cost of a square in triangles; writes the words of its units to `leaves`."""
    depth, x, y = square
    side = BLOCK_SIDE >> depth
    own = leaves[y * side : (y + 1) * side, x * side : (x + 1) * side]
    if square not in steps:
        own[...] = -1, 0
        return 0.0
    step = steps[square]
    segments_log2 = unit_log2 + 3 - depth - step if step is not None else 0
    whole = np.inf if step is None else 2.0 * 4.0**segments_log2 + PATCH_COST
    if depth == 3:
        refine = can_refine and (step is None or segments_log2 >= REFINE_FROM)
        own[...] = (-2, 0) if refine else (-3, 0) if step is None else (0, step)
        return whole * (REFINED if refine else 1.0)
    if whole > LEAST_PARTS:
        at = [(depth + 1, 2 * x + k % 2, 2 * y + k // 2) for k in range(4)]
        parts = sum(_cut(steps, unit_log2, can_refine, part, leaves) for part in at)
        if step is None or parts < whole:
            return parts
    own[...] = 3 - depth, step
    return whole


# Where leaves of different sizes meet, one spacing holds along the whole side of the larger leaf: the finest among this
# leaf and all leaves beyond that side.

WEST, NORTH, EAST, SOUTH = range(4)


def leaf_map(leaves: Sequence[Leaf], shape: tuple[int, int]) -> np.ndarray:
    """Index of the leaf over each cell of a map with (rows, cols) posts; −1 where there is none."""
    over = np.full((shape[0] - 1, shape[1] - 1), -1)
    for i, leaf in enumerate(leaves):
        x, y = leaf.low
        side = 1 << leaf.side_log2
        over[max(y, 0) : y + side, max(x, 0) : x + side] = i
    return over


def edge_step_log2(leaves: Sequence[Leaf], over: np.ndarray, i: int, side: int) -> int:
    """log2 of the posts between the vertices along a side of leaf i."""
    own = leaves[i]
    beside = _beside(leaves, over, i, side)
    larger = [k for k in beside if leaves[k].side_log2 > own.side_log2]
    if larger:
        own = leaves[larger[0]]
        beside = _beside(leaves, over, larger[0], side ^ 2)
    return min(0 if is_cell_fan(*leaf[1:]) else leaf.step_log2 for leaf in (own, *(leaves[k] for k in beside)))


def _beside(leaves: Sequence[Leaf], over: np.ndarray, i: int, side: int) -> set[int]:
    """Leaves along a side, just outside it."""
    x, y = leaves[i].low
    posts = 1 << leaves[i].side_log2
    rows, cols = over.shape
    if side in (NORTH, SOUTH):
        row = y - 1 if side == NORTH else y + posts
        cells = over[row, max(x, 0) : x + posts] if 0 <= row < rows else np.empty(0, int)
    else:
        col = x - 1 if side == WEST else x + posts
        cells = over[max(y, 0) : y + posts, col] if 0 <= col < cols else np.empty(0, int)
    return set(cells[cells >= 0].tolist())


# With a budget, the price λ of a triangle decides:   cost(square) = min over T of  E(T) + λ (2 T² + PATCH_COST)
# (Everett 1963, "Generalized Lagrange multiplier method"). A higher price gives fewer triangles.


def cheapest(weights: np.ndarray, side_log2: int, price: float) -> tuple[float, int]:
    """Least cost of a square, and log2 of its segments; `weights` are squared pixels for T = 1, 2, 4, ... 64."""
    sizes = range(len(weights))
    triangles = np.array([4.0 if is_cell_fan(side_log2, side_log2 - k) else 2.0 * 4**k for k in sizes])
    costs = weights + price * (triangles + PATCH_COST)
    best = int(np.argmin(costs))
    return float(costs[best]), best


# The mean over the picture. Patch p has n cells, and its own root mean square is at most b pixels. Each cell is in one
# patch, so
#   mean² ≤ Σ n b² / Σ′ n        Σ over all drawn patches, Σ′ over those wholly in the picture and without voids


def mean_px(cells: np.ndarray, bounds_px: np.ndarray, whole: np.ndarray) -> float:
    """Bound of the root mean square over the drawn land; inf if no patch is whole. One number for each drawn patch."""
    land = cells[whole].sum()
    return float(np.sqrt((cells * np.square(bounds_px)).sum() / land)) if land else np.inf
