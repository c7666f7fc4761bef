"""A budget of triangles for the clipmap: which price a triangle has, and how many triangles the price is asked for.

A price decides each square alone (glsl/lod/rings/prices.glsl). It does not count the triangles that finer neighbours
add along edges. So it is asked for a smaller number of triangles, the target, which is corrected until the mesh fits.
"""

from __future__ import annotations

from collections.abc import Callable

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
