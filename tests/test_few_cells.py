"""Near the eye, squares of at most 2 × 2 cells of the map look at the cells themselves: closer than the tables."""

import numpy as np
import pytest
from maps import rough
from ring_scenes import change_shaders, clipmap_of, patches_of, surface_errors

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap

POSTS, SPACING_M = 129, 10.0


@pytest.fixture(params=[0, 1], ids=["whole", "voids"])
def scene(ctx, request):
    """A plain with rough cells here and there, of which some maps know only a part."""
    rng = np.random.default_rng(3)
    heights = rough(POSTS, POSTS, 4, relief=40.0) + 8 * (rng.random((POSTS, POSTS)) < 0.1).astype("f4")
    heights[np.s_[::17, ::19]] = np.nan if request.param else heights[::17, ::19]
    return clipmap_of(ctx, Heightmap(heights, SPACING_M), (320, 180))


def near_ground():
    middle = 0.5 * (POSTS - 1) * SPACING_M
    return Camera((middle + 3, middle - 200, 60.0), (middle, middle, 10.0))


@pytest.mark.parametrize("metric", ["max", "rms"])
@pytest.mark.parametrize("error", [0.3, 1.0])
def test_the_promise_holds_near_the_ground(scene, metric, error):
    view = scene.select(near_ground(), error, metric=metric)
    found = surface_errors(scene, view, near_ground())
    assert (found.max_px if metric == "max" else found.rms_px) <= view.certified_px
    patches = patches_of(scene, view)
    assert ((patches.side_log2 <= 1) & (patches.step_log2 < 0)).sum() > 20


def test_a_mesh_that_asks_the_tables_alone_needs_more_triangles(scene, monkeypatch):
    few = scene.select(near_ground(), 0.3).triangles
    change_shaders(monkeypatch, "FEW_LOG2 = 1", "FEW_LOG2 = -1")
    tables = clipmap_of(scene.terrain.ctx, scene.heightmap, (320, 180))
    assert tables.select(near_ground(), 0.3).triangles > 1.1 * few


def test_a_budget_is_spent_on_rough_cells(scene, monkeypatch):
    """With the error of every cell known, the same budget gives a mesh with a smaller error."""
    few = scene.select(near_ground(), triangles=12000)
    with_few = surface_errors(scene, few, near_ground()).rms_px
    change_shaders(monkeypatch, "FEW_LOG2 = 1", "FEW_LOG2 = -1")
    tables = clipmap_of(scene.terrain.ctx, scene.heightmap, (320, 180))
    without = surface_errors(tables, tables.select(near_ground(), triangles=12000), near_ground()).rms_px
    assert with_few < without
