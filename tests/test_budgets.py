"""A budget of triangles: what decides the mesh."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import cameras, rough
from ring_scenes import change_shaders, clipmap_of, patches_of, surface_errors, triangles_of

from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import budget

POSTS, SPACING_M = 129, 10.0


@pytest.fixture(scope="module")
def terraces(session_context):
    """Steps in rough land: most of the error is in a few cells."""
    heights = rough(POSTS, POSTS, 5, relief=150.0)
    with session_context as ctx:
        scene = clipmap_of(ctx, Heightmap(np.floor(heights / 40) * 40 + 0.3 * heights, SPACING_M), (320, 180))
        yield scene
        scene.release()


def across_the_land():
    middle = 0.5 * (POSTS - 1) * SPACING_M
    return Camera((middle, 200.0, 150.0), (middle, middle, 50.0))


@pytest.fixture
def changed(monkeypatch):
    """A scene of the same map whose shaders differ in one place."""

    def of(scene, old, new):
        change_shaders(monkeypatch, old, new)
        return clipmap_of(scene.terrain.ctx, scene.heightmap, scene.size)

    return of


def error_px(scene, triangles):
    return surface_errors(scene, scene.select(across_the_land(), triangles=triangles), across_the_land()).rms_px


@pytest.mark.slow
@pytest.mark.parametrize(
    "old, new",
    [
        pytest.param("side_log2 == 0 && step_log2 == -1", "false", id="eight triangles over a cell instead of four"),
    ],
)
def test_a_budget_is_worse_without(ctx, terraces, changed, old, new):
    budgets = (9000, 18000)
    errors = [error_px(terraces, each) for each in budgets]
    other = changed(terraces, old, new)
    assert all(error < error_px(other, each) for error, each in zip(errors, budgets, strict=True))


def test_a_valley_is_worse_if_squares_weigh_as_much_as_their_nearest_point(ctx, terraces, changed):
    """A square below the eye is mostly far away. Its nearest point has an error of many pixels for a metre."""
    camera, budgets = standard_view(terraces.heightmap, "valley"), (2000, 6000)

    def errors(scene):
        return np.array([surface_errors(scene, scene.select(camera, triangles=n), camera).rms_px for n in budgets])

    least = errors(terraces)  # first, so that its passes are made of the shaders as they are
    other = changed(terraces, "/ p.middle_m", "/ p.nearest_m")
    assert (least < 0.7 * errors(other)).all()


def test_a_budget_is_worse_with_fewer_blocks_across(ctx, terraces, monkeypatch):
    error = error_px(terraces, 18000)
    monkeypatch.setattr("terrain_gl.lod.rings.across_for", lambda triangles: 4)
    assert error < error_px(terraces, 18000)


def test_a_fan_over_a_cell_has_four_triangles(ctx, terraces):
    """And one more for each vertex that a finer neighbour adds."""
    selection = terraces.select(across_the_land(), triangles=18000, cull=False)
    patches = patches_of(terraces, selection)
    fans = (patches.side_log2 == 0) & (patches.step_log2 == -1)
    alone = (patches.edges_log2[fans] == 0).all(1)
    assert alone.sum() > 20 and (~alone).sum() > 5
    middles = triangles_of(selection)["post"].reshape(-1, 2).astype(float)
    at_middle = {tuple(place) for place in patches.corner[fans] + 0.5}
    around = sum(tuple(place) in at_middle for place in middles)
    assert around == (2 ** patches.edges_log2[fans]).sum()


def test_every_budget_is_used(ctx, terraces):
    """Also where many targets of the search have the same price."""
    camera = cameras(terraces.heightmap)["default"]
    for triangles in np.geomspace(300, 30000, 25).astype(int).tolist():
        assert 0.9 * triangles < terraces.select(camera, triangles=triangles).triangles <= triangles


# --- The metric "max": the smallest tolerance -------------------------------------------------------------------------


def test_the_smallest_tolerance_that_fits(ctx, terraces):
    """A slightly smaller tolerance takes too many triangles; the least squares have a larger error somewhere."""
    scene = terraces
    for camera in (across_the_land(), standard_view(scene.heightmap, "high")):
        for triangles in (1500, 12000):
            mesh = scene.select(camera, triangles=triangles, metric="max")
            assert mesh.triangles <= triangles
            assert scene.achieved(mesh, camera).max_px <= mesh.certified_px
            assert scene.select(camera, 0.9 * mesh.certified_px).triangles > triangles
            assert mesh.certified_px < scene.select(camera, triangles=triangles, metric="rms").certified_px


def test_if_no_tolerance_fits_the_mesh_is_that_of_least_squares(ctx, terraces):
    """It leaves out the finest rings."""
    camera = standard_view(terraces.heightmap, "valley")
    coarsest = terraces.select(camera, 1e6).triangles
    assert coarsest > 40
    few = terraces.select(camera, triangles=coarsest // 2, metric="max")
    assert few.triangles <= coarsest // 2 and few.price is not None


RANGES = [(budget.TOLERANCE, 0.0), (budget.PRICE, 0.0), (budget.MEAN, budget.FIRST_MEAN)]


@given(st.sampled_from(RANGES), st.integers(100, 10**6), st.floats(0.3, 3.0), st.floats(0.0, 0.3))
def test_the_search_ends_at_the_limit(range_and_first, limit, slope, plateau):
    """What a mesh uses falls with x, in steps. The mesh fits, and that of an x a little smaller does not."""
    (range_, first), tried = range_and_first, []

    def used(x):
        octaves = math.log2(50_000) - slope * range_.falls * x
        return min(2.0 ** (math.floor(octaves / max(plateau, 1e-6)) * max(plateau, 1e-6)), 1e7)

    def mesh_at(x):
        tried.append(x)
        return x

    at = budget.smallest(limit, mesh_at, used, range_, first)
    assert at in tried and len(set(tried)) == len(tried) <= budget.TRIES + 4  # none is made twice
    assert used(at) <= limit or at == range_.highest
    is_end = at in (range_.lowest, range_.highest)
    assert used(at) >= budget.CLOSE * limit or is_end or used(at - 0.5) > limit
