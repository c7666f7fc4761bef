"""A budget of triangles for the clipmap: which price a triangle has, and how many triangles the price is asked for.

A price decides each square alone (glsl/lod/rings/prices.glsl). It does not count the triangles that finer neighbours
add along edges. So it is asked for a smaller number of triangles, the target, which is corrected until the mesh fits.

A budget may pay for the mesh of every post: two triangles in each cell of the map. Then a mesh that is worse gives way
to one in which no cell is coarser than a cell of the map.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .selection import Selection

PATCH_COST = 1.0  # cost of a patch in triangles; smaller than for a tolerance: docs/allocation.md
PRICES = 24  # prices tried at once, and how many times: glsl/lod/rings/prices.glsl
PASSES = 3
LOWEST_LOG2 = -36.0
HIGHEST_LOG2 = 60.0
CHEAPEST = 2.0**LOWEST_LOG2  # give the most triangles, and the fewest
DEAREST = 2.0 ** (HIGHEST_LOG2 - 1)
CLOSE = 0.985  # a mesh with this part of the budget is accepted
UNCUT = 0.85  # the first target, as a part of the budget
TRIES = 6  # after so many targets the best of them is taken
# One ring of the map's own cells takes the place of all rings, if it is small enough. It may have so many cells in all,
# and so many in the picture: a number for each triangle of the budget, and a number besides.
AROUND = (3, 4096)
SEEN = (1.25, 1024)
MOST_AROUND = 4_000_000  # a dispatch may have 65,535 groups, one for each block
BETTER = 0.95  # of the squared error of every post: the comparison does not know which diagonals the driver chooses


def may_have(cells: int, most: tuple[float, int], triangles: int) -> bool:
    """Whether the ring may have so many cells; `most` is `AROUND` or `SEEN`."""
    return cells <= min(most[0] * triangles + most[1], MOST_AROUND)


def is_worse(compared: np.ndarray, triangles: int) -> bool:
    """Whether the mesh of every post fits the budget and has a smaller error.

    Parameters
    ----------
    compared
        (blocks, 4) floats of glsl/lod/rings/compare.comp.
    triangles
        The budget.
    """
    ours, every, triangles_of_every, _ = compared.sum(0, dtype=np.float64)
    return bool(triangles_of_every <= triangles and ours > BETTER * every)


def spend(triangles: int, mesh_for: Callable[[int], Selection]) -> Selection:
    """A mesh with at most `triangles`, and nearly so many if they gain anything.

    Parameters
    ----------
    triangles
        The budget. If even the coarsest mesh has more, the result is that mesh.
    mesh_for
        Makes the mesh for a target.
    """
    target = max(2, int(UNCUT * triangles))  # low fits, high does not
    low = 0
    high = 1 << 31
    attempt = 0
    while True:
        mesh = mesh_for(target)
        attempt = attempt + 1
        fits = mesh.triangles <= triangles
        price = mesh.price or 0.0
        is_close = mesh.triangles >= CLOSE * triangles or price <= CHEAPEST
        if target == 2 or (price >= DEAREST and not fits) or (fits and (is_close or attempt > TRIES)):
            return mesh
        low, high = (max(low, target), high) if fits else (low, min(high, target))
        aim = 0.993 if fits else 0.99**attempt  # many targets may have the same price: go further each time
        guess = int(target * aim * triangles / max(mesh.triangles, 1))
        target = low if low and attempt >= TRIES else max(2, guess if low < guess < high else (low + high) // 2)
