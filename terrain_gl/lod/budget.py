"""Searches for a mesh: with a budget of triangles, or with a mean error over the picture.

--triangles N --metric max    the smallest tolerance whose mesh has at most N triangles
--triangles N --metric rms    the lowest price of a triangle whose mesh has at most N triangles
--max-error E --metric rms    the highest price of a triangle whose mesh has a mean error of at most E

`smallest` does all three: it finds the smallest x whose mesh uses at most a given amount, of triangles or of error. x
is the logarithm of the tolerance or of the price; for a mean, x is minus the logarithm of the price. A price decides
about each square alone (glsl/lod/rings/prices.glsl), as a tolerance does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from .goal import Goal
from .selection import Selection

PATCH_COST = 1.0  # of a patch in triangles, where a price decides; smaller than for a tolerance: docs/allocation.md
CLOSE = 0.985  # a mesh that uses at least this share of the limit is accepted
AIM = 0.993  # the share that the search aims at
LARGEST_STEP = 16.0  # octaves
CHORDS = 6  # so many steps follow a chord; then the interval is halved
TRIES = 12  # after so many meshes, the best mesh that fits is taken


class SearchRange(NamedTuple):
    """The values of x.

    Attributes
    ----------
    lowest, highest
        The ends of the search.
    falls
        Octaves by which a mesh uses less if x rises by one, as a first guess.
    sure
        The search ends when x is known to this.
    """

    lowest: float
    highest: float
    falls: float
    sure: float


# The error of N triangles is about proportional to 1 / N. Its square falls by the price λ for each further triangle, so
# λ is proportional to 1 / N³.
TOLERANCE = SearchRange(-8.0, 20.0, 1.0, 1 / 64)  # log2 of pixels
PRICE = SearchRange(-36.0, 60.0, 1 / 3, 1 / 64)  # log2 of pixels² for a triangle
FIRST_MEAN = -5.0
MEAN = SearchRange(-40.0, 9.0, 1 / 3, 3 / 64)  # minus log2 of a price in squared tolerances


def smallest(
    limit: float,
    mesh_at: Callable[[float], Selection],
    used: Callable[[Selection], float],
    range_: SearchRange,
    at: float,
) -> Selection:
    """The mesh of the smallest x that uses at most `limit`; that of the highest x if none does.

    With logarithmic axes, the curve is nearly a straight line. So each step tries the x where the chord between two
    known meshes meets the limit.

    Parameters
    ----------
    mesh_at
        Makes the mesh of an x.
    used
        How much a mesh uses.
    at
        The first x.
    """
    aim = math.log2(AIM * limit)
    too_much: tuple[float, float] | None = None  # x, and log2 of what its mesh uses
    fits: tuple[float, float] | None = None
    best: Selection | None = None  # the mesh of `fits`
    falls = range_.falls
    steps = 0
    while True:
        mesh = mesh_at(at)
        tried = at, math.log2(min(max(used(mesh), 1e-30), 1e30))
        before = too_much or fits
        if before and before[0] != at:
            falls = max((before[1] - tried[1]) / (at - before[0]), 1e-3)
        is_sure = steps >= TRIES or (too_much is not None and at - too_much[0] <= range_.sure)
        if used(mesh) > limit:
            if at >= range_.highest:
                return mesh
            too_much = tried
        elif is_sure or used(mesh) >= CLOSE * limit or at <= range_.lowest:
            return mesh
        else:
            fits, best = tried, mesh
        steps += 1
        if too_much is None or fits is None:
            step = min(abs(tried[1] - aim) / falls, LARGEST_STEP) + 2 * range_.sure
            at = max(at - step, range_.lowest) if too_much is None else min(at + step, range_.highest)
        elif best and (fits[0] - too_much[0] <= range_.sure or steps >= TRIES):
            return best
        else:
            share = (too_much[1] - aim) / (too_much[1] - fits[1]) if steps < CHORDS else 0.5
            at = too_much[0] + min(max(share, 0.1), 0.9) * (fits[0] - too_much[0])


def smallest_tolerance(goal: Goal, select: Callable[[Goal], Selection]) -> Selection:
    """Find the smallest tolerance of the largest error whose mesh has at most `goal.triangles`; returns this mesh.

    If the coarsest mesh has too many triangles, the result is the mesh of least squares, which may leave out the
    finest rings.
    """
    assert goal.triangles

    def mesh_at(log2_px: float) -> Selection:
        return select(replace(goal, tolerance_px=2.0**log2_px, triangles=None))

    mesh = smallest(goal.triangles, mesh_at, lambda mesh: mesh.triangles, TOLERANCE, 0.0)
    return mesh if mesh.triangles <= goal.triangles else select(replace(goal, metric="rms"))
