"""A budget of triangles: the mesh that uses them best.

metric "max"   the smallest tolerance whose mesh fits: `smallest_tolerance`, for both certified methods
metric "rms"   the least squares, by a price for a triangle: `spend`, for the clipmap

A price decides about each square alone (glsl/lod/rings/prices.glsl). The triangles that finer neighbours add along
edges are not counted. So the search for a price gets a target, which is smaller than the budget. The target is
corrected until the mesh fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from .selection import Goal, Selection

PATCH_COST = 1.0  # cost of a patch in triangles; smaller than for a tolerance: docs/allocation.md
PRICES = 24  # prices tried at once, in each of PASSES passes: glsl/lod/rings/prices.glsl
PASSES = 3
LOWEST_LOG2 = -36.0
HIGHEST_LOG2 = 60.0
CHEAPEST = 2.0**LOWEST_LOG2  # the lowest price: it gives the most triangles
DEAREST = 2.0 ** (HIGHEST_LOG2 - 1)  # at this price or above, a mesh counts as the smallest that there is
CLOSE = 0.985  # a mesh with at least this share of the budget is accepted
UNCUT = 0.85  # the first target, as a share of the budget
TRIES = 6  # after this many targets, the best mesh that fits is taken
FINEST_PX_LOG2 = -8.0  # the finest and the coarsest tolerance that are tried for the metric "max"
COARSEST_PX_LOG2 = 20.0
SURE_LOG2 = 1 / 64  # the tolerance is found to about one per cent


def spend(triangles: int, mesh_for: Callable[[int], Selection]) -> Selection:
    """A mesh with at most `triangles`, and close to it if more triangles make the error smaller.

    Parameters
    ----------
    triangles
        The budget. If even the coarsest mesh has more, the result is that mesh.
    mesh_for
        Makes the mesh for a target.
    """
    target = max(2, int(UNCUT * triangles))  # the mesh of the target `low` fits, that of `high` does not
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


def smallest_tolerance(goal: Goal, select: Callable[[Goal], Selection]) -> Selection:
    """Find the smallest tolerance of the largest error whose mesh has at most `goal.triangles`; returns this mesh.

    The number of triangles falls when the tolerance rises; with logarithmic axes the curve is nearly a straight line.
    So each step tries the tolerance where the chord between two known meshes meets the budget. If the coarsest mesh
    has too many triangles, the result is the mesh of least squares, which may leave out the finest rings.
    """
    assert goal.triangles
    aim = math.log2(goal.triangles)
    too_fine: tuple[float, float] | None = None  # log2 of a tolerance, and of the triangles of its mesh
    fits: tuple[float, float] | None = None
    at = 0.0
    while True:
        mesh = select(replace(goal, tolerance_px=2.0**at, triangles=None))
        tried = at, math.log2(max(mesh.triangles, 1))
        is_sure = too_fine is not None and at - too_fine[0] <= SURE_LOG2
        if tried[1] > aim:
            if at >= COARSEST_PX_LOG2:
                return select(replace(goal, metric="rms"))
            too_fine = tried
        elif is_sure or mesh.triangles >= CLOSE * goal.triangles or at <= FINEST_PX_LOG2:
            return mesh
        else:
            fits = tried
        if too_fine is None or fits is None:
            at = min(at + 3.0, COARSEST_PX_LOG2) if fits is None else max(at - 3.0, FINEST_PX_LOG2)
        elif fits[0] - too_fine[0] <= SURE_LOG2:
            at = fits[0]  # select this mesh again, because the buffers hold the mesh that was tried last
        else:
            share = (too_fine[1] - aim) / (too_fine[1] - fits[1])
            at = too_fine[0] + min(max(share, 0.1), 0.9) * (fits[0] - too_fine[0])
