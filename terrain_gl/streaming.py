"""Load what a view needs: choose a mesh, load finer pages under its patches over tolerance, and choose again.

The certificate holds at every moment: where a page is missing, the records of a coarser page bound the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .camera import Camera
from .exceptions import UsageError
from .gpu import layout
from .lod import Goal, Selection
from .pages import PagedTables, PagedTerrain, PageKey

MOST_LEVELS = 3  # most levels that a patch skips at once
MOST_PAGES = 32  # most pages that a patch requests at once


def choose_complete(
    tables: PagedTables, choose: Callable[[], Selection], camera: Camera, goal: Goal
) -> tuple[Selection, dict[str, Any]]:
    """Choose a mesh, and load pages until it is within the tolerance; report what is missing.

    Returns
    -------
    Selection
        The last mesh that was chosen.
    dict
        `complete`, `tiles_resident`, `tiles_missing`: docs/stats.md.
    """
    if goal.triangles:
        raise UsageError("a store is drawn within a tolerance: give --max-error, not --triangles")
    terrain, has_evicted = tables.terrain, False
    while True:
        selection = choose()
        wanted = pages_wanted(terrain, selection, camera, goal.tolerance_px)
        if not wanted:
            break
        if not has_evicted and len(terrain.slot_of) + len(wanted) > terrain.slots:
            has_evicted = True  # only once in a view: all pages that come later are needed
            terrain.keep(pages_used(terrain, selection))
        if not tables.load(wanted):
            break
    there = terrain.slot_of.keys() | terrain.missing.keys()
    left_out = [key for key in wanted if key not in there]
    missing = [{"tile": _called(key), "reason": reason} for key, reason in terrain.missing.items()]
    missing += [{"tile": _called(key), "reason": "no room (--gpu-memory)"} for key in left_out]
    told = {"complete": not wanted, "tiles_resident": len(terrain.slot_of), "tiles_missing": missing}
    return selection, told


def pages_wanted(terrain: PagedTerrain, selection: Selection, camera: Camera, tolerance_px: float) -> list[PageKey]:
    """Pages under patches over tolerance that would make them finer, the most useful first.

    The worth of a page is certified pixels times projected area, summed over all patches that want it.
    """
    worth: dict[PageKey, float] = {}
    last = terrain.heightmap.cols - 1, terrain.heightmap.rows - 1
    (east, north), eye = terrain.heightmap.spacing_m, np.asarray(camera.eye)
    for x, y, side_log2, bound_px in _over(selection, tolerance_px):
        low = max(x, 0), max(y, 0)
        end = min(x + (1 << side_log2), last[0]), min(y + (1 << side_log2), last[1])
        finest = terrain.resident_level(low, end, max(0, side_log2 - 6))
        if finest == 0:
            continue  # all posts are loaded, so finer pages cannot help
        steps = min(max(1, math.ceil(math.log2(min(bound_px / tolerance_px, 2.0**MOST_LEVELS)))), finest)
        keys = terrain.over(low, end, finest - steps)
        while len(keys) > MOST_PAGES and steps > 1:
            steps -= 1
            keys = terrain.over(low, end, finest - steps)
        middle = np.array([(low[0] + end[0]) / 2 * east, (last[1] - (low[1] + end[1]) / 2) * north, eye[2]])
        away = max(float(np.linalg.norm((middle - eye)[:2])), 1.0)
        gain = bound_px * ((1 << side_log2) * max(east, north) / away) ** 2
        for key in keys:
            if key not in terrain.slot_of:
                worth[key] = worth.get(key, 0.0) + gain
    return sorted(worth, key=lambda key: (-worth[key], key))


def pages_used(terrain: PagedTerrain, selection: Selection) -> set[PageKey]:
    """The loaded pages at the spacing of each patch."""
    last, used = (terrain.heightmap.cols - 1, terrain.heightmap.rows - 1), set()
    patches = _patches(selection)
    for (x, y), side, step_log2 in zip(
        patches.corner.tolist(), patches.side.tolist(), patches.step_log2.tolist(), strict=True
    ):
        end = min(x + side, last[0]), min(y + side, last[1])
        used.update(terrain.over((x, y), end, min(max(step_log2, 0), terrain.top_level)))
    return used & terrain.slot_of.keys()


def _patches(selection: Selection) -> layout.RingPatches:
    surface: Any = selection.surface
    data = surface.patches.read(selection.patches * layout.RING_PATCH.itemsize) if selection.patches else b""
    return layout.unpack_ring_patches(np.frombuffer(data, layout.RING_PATCH))


def _over(selection: Selection, tolerance_px: float) -> list[tuple[int, int, int, float]]:
    """Corner, log2 of the side, and bound of the patches over tolerance."""
    patches = _patches(selection)
    over = patches.bound_px > tolerance_px
    columns = patches.corner[over, 0], patches.corner[over, 1], patches.side_log2[over], patches.bound_px[over]
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _called(key: PageKey) -> str:
    level, row, col = key
    return f"level {level}, row {row}, column {col}"
