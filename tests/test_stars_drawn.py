"""Stars are drawn as their bounds assume, and these bounds decide meshes."""

import math

import numpy as np
import pytest
from maps import cameras, rough
from ring_scenes import clipmap_of, patches_of, surface_errors
from test_stars import star

from terrain_gl.camera import Camera
from terrain_gl.gpu import gl, layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import ring_layout
from terrain_gl.lod.ring_layout import PATCH
from terrain_gl.lod.star import are_of_stars, draws_stars

ERROR_PX = 0.5


@pytest.fixture
def scene(ctx):
    scene = clipmap_of(ctx, Heightmap(rough(257, 257, 3, relief=200.0), 10.0), (320, 180))
    yield scene
    scene.release()


def test_the_software_renderer_draws_stars(ctx):
    if not gl.is_software(ctx):
        pytest.skip("a driver may choose other triangles")
    assert draws_stars(ctx)


@pytest.mark.parametrize("n", [4, 8])
def test_other_triangles_are_no_stars(n):
    side, rng = 64, np.random.default_rng(0)
    for share in (0.0, 0.3, 1.0):
        triangles = star(np.zeros(2, int), side, share, rng, n=n) * (n / side)
        assert are_of_stars(triangles, n)
        assert not are_of_stars(triangles[:, :, ::-1] * 0.5, n), "a part of a patch, at another scale"
    for moved in (np.array([0.5, 0.0]), np.array([0.0, 1.0])):  # a vertex inside elsewhere
        inner = (triangles > 0).all(2) & (triangles < n).all(2)
        assert not are_of_stars(np.where(inner[..., None], triangles + moved, triangles), n)
    assert not are_of_stars(star(np.zeros(2, int), side, 0.0, rng, turned=False, n=n) * (n / side), n)
    assert not are_of_stars(np.zeros((0, 3, 2)), n), "nothing was drawn"


def with_stars(scene, column, error):
    """Overwrite errors of stars in units of span · 2^-14; column 0: of 4 × 4 segments, column 1: of 8 × 8."""
    words = np.frombuffer(scene.tables.ranges.read(), layout.NODE_RANGE).copy()
    words["stars_m"][:, column] = error
    scene.tables.ranges.write(words)


def alone(scene, view, segments_log2):
    """How many patches of a size are no pairs."""
    patches = patches_of(scene, view)
    return int(((patches.side_log2 - patches.step_log2 == segments_log2) & ~patches.pair.any(1)).sum())


@pytest.mark.parametrize("column", [0, 1])
def test_without_the_bounds_of_stars_there_are_fewer_of_them(scene, column):
    camera = cameras(scene.heightmap)["default"]
    view = scene.select(camera, ERROR_PX)
    before, patches = alone(scene, view, column + 2), view.patches
    with_stars(scene, column, 2.0**14)
    view = scene.select(camera, ERROR_PX)
    assert alone(scene, view, column + 2) < 0.9 * before
    assert view.patches > patches


@pytest.mark.parametrize(("column", "error_px"), [(0, ERROR_PX), (1, ERROR_PX / 8)])
def test_with_stars_of_no_error_the_promise_breaks(scene, column, error_px):
    camera = cameras(scene.heightmap)["default"]
    view = scene.select(camera, error_px)
    assert surface_errors(scene, view, camera).max_px <= view.certified_px <= error_px
    with_stars(scene, column, 0.0)
    view = scene.select(camera, error_px)
    assert surface_errors(scene, view, camera).max_px > view.certified_px


def test_a_driver_that_draws_no_stars_keeps_the_promise_with_more_patches(ctx, scene, monkeypatch):
    camera = cameras(scene.heightmap)["default"]
    with_bounds = scene.select(camera, ERROR_PX).patches
    monkeypatch.setattr("terrain_gl.lod.star.draws_stars", lambda ctx: False)
    other = clipmap_of(ctx, scene.heightmap, (320, 180))
    view = other.select(camera, ERROR_PX)
    assert surface_errors(other, view, camera).max_px <= view.certified_px <= ERROR_PX
    assert view.patches > 1.1 * with_bounds
    other.release()


@pytest.mark.parametrize("metric", ["max", "rms"])
@pytest.mark.parametrize("error", [0.3, 1.0, 3.0])
def test_stars_keep_the_promise(scene, metric, error):
    for name in ("default", "grazing"):
        camera = cameras(scene.heightmap)[name]
        view = scene.select(camera, error, metric=metric)
        found = surface_errors(scene, view, camera)
        assert (found.max_px if metric == "max" else found.rms_px) <= view.certified_px <= error


def test_rings_step_by_four_cells_so_that_more_squares_are_nodes(scene, monkeypatch):
    """Only a square on a node has a fan's or a star's bound. With steps of two cells fewer squares are nodes."""

    def chosen():
        views = [scene.select(Camera((x, x + 100, 420.0), (1280, 2000, 100)), 1.0) for x in np.linspace(900, 1500, 7)]
        return sum(view.triangles for view in views), sum(view.patches for view in views)

    def start(level, centre, patches):
        step = 2 << level
        return step * math.floor((centre - 0.5 * patches * (PATCH << level)) / step + 0.5)

    triangles, patches = chosen()
    monkeypatch.setattr(ring_layout, "_start_of", start)
    more_triangles, more_patches = chosen()
    assert more_triangles > 1.1 * triangles and more_patches > 1.2 * patches
