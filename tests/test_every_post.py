"""Budgets that pay for every post: the mesh is no worse than `full`, two triangles in each cell of the map."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import SIZE, Scene, rough
from ring_scenes import change_shaders, clipmap_of, surface_errors

from terrain_gl.camera import Camera, in_picture
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import budget
from terrain_gl.lod.land import posts_in_picture
from terrain_gl.lod.ring_layout import ring_of_posts
from terrain_gl.lod.selection import Goal
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import UNLIT
from terrain_gl.verify.measure import posts_of

SPACING_M = 10.0
OTHER_DIAGONALS = 1.002  # the mesh of every post may have other diagonals than `full` where the driver chooses them


def land(rows, cols, seed, relief=60.0):
    return Heightmap(rough(rows, cols, seed, relief=relief), SPACING_M)


def drawn(renderer, camera, **options):
    """Triangles of a mesh; its root mean square error over the surface, and over what the pixels show."""
    triangles = renderer.draw(camera, style=UNLIT, **options)["triangles"]
    shown = renderer.inspector.error_map()
    return triangles, renderer.measure()["rms_error_px"], float(np.sqrt(np.nanmean(np.square(shown))))


def views_of(heightmap):
    return Camera.default(heightmap), standard_view(heightmap, "ridge"), standard_view(heightmap, "valley")


@pytest.mark.parametrize("shape", [(20, 33), (33, 20), (57, 90), (100, 80)])
@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_budget_for_every_post_is_not_worse(shape, seed):
    heightmap = land(*shape, seed)
    with Renderer(heightmap, (320, 180)) as renderer:
        for camera in views_of(heightmap):
            full, full_px, full_shown_px = drawn(renderer, camera, method="full")
            for triangles in (full, int(1.3 * full)):
                spent, px, shown_px = drawn(renderer, camera, triangles=triangles)
                assert 0.9 * triangles < spent <= triangles
                assert px <= full_px * OTHER_DIAGONALS
                assert shown_px <= full_shown_px * (OTHER_DIAGONALS + 0.02)


@st.composite
def cameras_near(draw, rows, cols):
    part = st.integers(-30, 130).map(lambda per_cent: 0.01 * per_cent)
    east, north = (cols - 1) * SPACING_M, (rows - 1) * SPACING_M
    eye = draw(part) * east, draw(part) * north, draw(st.integers(70, 400))
    return Camera(eye, (draw(part) * east, draw(part) * north, 0.0), fov_deg=draw(st.sampled_from([20.0, 50.0, 80.0])))


@given(st.data(), st.integers(6, 60), st.integers(6, 60), st.integers(0, 1000))
@settings(max_examples=25)
def test_no_map_and_no_camera_makes_it_worse(session_context, data, rows, cols, seed):
    heightmap, camera = land(rows, cols, seed), data.draw(cameras_near(rows, cols))
    with session_context as ctx:
        scene, every = clipmap_of(ctx, heightmap), Scene.of(ctx, heightmap)
        full = every.select(camera, tolerance_px=0.0)
        if full.triangles >= 2:
            px = scene.achieved(scene.select(camera, triangles=full.triangles), camera).rms_px
            assert px <= every.achieved(full, camera).rms_px * OTHER_DIAGONALS
        every.release()
        scene.release()


@pytest.fixture
def small(ctx):
    scene = clipmap_of(ctx, land(20, 33, 0), (320, 180))
    yield scene
    scene.release()


def every_post_of(ctx, scene, camera):
    """Triangles, and measured errors, of the mesh of every post."""
    every = Scene.of(ctx, scene.heightmap, scene.size)
    full = every.select(camera, tolerance_px=0.0)
    errors = every.achieved(full, camera)
    every.release()
    return full.triangles, errors


def test_without_the_comparison_it_is_worse(ctx, small, monkeypatch):
    camera = standard_view(small.heightmap, "ridge")
    triangles, every = every_post_of(ctx, small, camera)
    assert small.achieved(small.select(camera, triangles=triangles), camera).rms_px <= every.rms_px * OTHER_DIAGONALS
    monkeypatch.setattr(budget, "is_worse", lambda *_: False)
    assert small.achieved(small.select(camera, triangles=triangles), camera).rms_px > 1.1 * every.rms_px


def test_the_maps_last_posts_take_part(ctx, monkeypatch):
    """The picture shows two posts of the rim, and no other place that `measure` compares."""
    camera = Camera((73.7, 62.875, 144.06), (64.92, -50.27, 0.0), fov_deg=20.0)
    for old, is_good in (("unchanged", True), ("PLACES + ivec2(equal(cell + 1, u_last_post))", False)):
        change_shaders(monkeypatch, old, "ivec2(PLACES)")
        scene = clipmap_of(ctx, land(51, 9, 93))
        triangles, every = every_post_of(ctx, scene, camera)
        px = scene.achieved(scene.select(camera, triangles=triangles), camera).rms_px
        assert (px <= every.rms_px * OTHER_DIAGONALS) == is_good
        scene.release()


def test_the_other_mesh_is_that_of_every_post_and_finer_with_more(ctx, small, monkeypatch):
    monkeypatch.setattr(budget, "is_worse", lambda *_: True)
    for camera in views_of(small.heightmap):
        triangles, every = every_post_of(ctx, small, camera)
        selection = small.select(camera, triangles=triangles)
        assert selection.triangles == triangles
        assert small.achieved(selection, camera).rms_px == pytest.approx(every.rms_px, rel=OTHER_DIAGONALS - 1)
        finer = small.select(camera, triangles=3 * triangles)
        assert triangles < finer.triangles <= 3 * triangles
        assert small.achieved(finer, camera).rms_px < 0.7 * every.rms_px


def compared(monkeypatch, scene, camera, triangles):
    """What the pass reports: the sums of the mesh and of every post, and the triangles of every post."""
    told = []
    monkeypatch.setattr(budget, "is_worse", lambda numbers, _: bool(told.append(numbers.sum(0, dtype=float))))
    selection = scene.select(camera, triangles=triangles)
    errors = surface_errors(scene, selection, camera)
    return told[0][:3], errors.rms_px**2 * errors.places / 16


@pytest.mark.parametrize("view", ["default", "ridge", "valley"])
def test_sums_are_those_of_measured_meshes(ctx, monkeypatch, view):
    scene = clipmap_of(ctx, land(57, 90, 3), (320, 180))
    camera = Camera.default(scene.heightmap) if view == "default" else standard_view(scene.heightmap, view)
    triangles, errors = every_post_of(ctx, scene, camera)
    (ours, every, triangles_of_every), measured = compared(monkeypatch, scene, camera, triangles)
    assert ours == pytest.approx(measured, rel=0.08)
    assert every == pytest.approx(errors.rms_px**2 * errors.posts, rel=0.08)
    assert triangles_of_every == triangles
    scene.release()


def test_cut_edges_matter_to_the_sums(ctx, monkeypatch):
    """Two triangles with a cut edge are a fan, which is closer to the truth."""
    heights = rough(57, 90, 5, relief=150.0)
    heightmap = Heightmap(np.floor(heights / 20) * 20 + 0.2 * heights, SPACING_M)
    camera, off = Camera.default(heightmap), []
    for cut in ("edges_log2 != ivec4(0)", "false"):
        change_shaders(monkeypatch, "edges_log2 != ivec4(0)", cut)
        scene = clipmap_of(ctx, heightmap, (320, 180))
        (ours, _, _), measured = compared(monkeypatch, scene, camera, 4000)
        off.append(ours / measured - 1)
        scene.release()
    assert off[0] < 0.1 and off[1] > 0.5


def test_one_ring_of_the_maps_cells_is_better_than_rings(ctx, monkeypatch):
    heightmap = land(160, 160, 5, relief=150.0)
    scene, camera = clipmap_of(ctx, heightmap, (320, 180)), standard_view(heightmap, "ridge")
    alone = surface_errors(scene, scene.select(camera, triangles=18000), camera).rms_px
    monkeypatch.setattr(budget, "may_have", lambda *_: False)
    assert alone < 0.9 * surface_errors(scene, scene.select(camera, triangles=18000), camera).rms_px
    scene.release()


def test_a_budget_far_below_every_post_keeps_its_rings(ctx, monkeypatch):
    """So its patches may have more than 8 × 8 cells, and the buffers do not grow with the map."""
    scene = clipmap_of(ctx, land(257, 257, 5), SIZE)
    used = []
    monkeypatch.setattr(budget, "is_worse", lambda *_: used.append(1))
    for triangles in (50, 500, 5000):
        assert scene.select(Camera.default(scene.heightmap), triangles=triangles).triangles <= triangles
    assert not used
    scene.release()


@given(st.data(), st.integers(2, 90), st.integers(2, 90), st.integers(0, 1000))
def test_the_rectangle_holds_all_posts_in_the_picture(data, rows, cols, seed):
    heightmap, camera = land(rows, cols, seed), data.draw(cameras_near(rows, cols))
    west, north, east, south = posts_in_picture(heightmap, camera, SIZE, 1.0)
    at = (posts_of(heightmap, (0, 0, cols, rows)) - camera.eye) @ np.array(camera.axes).T
    seen = in_picture(camera, SIZE, at.T, 1.0).reshape(rows, cols)
    seen[north : south + 1, west : east + 1] = False
    assert not seen.any()
    origin, end = ring_of_posts((west, north, east, south)).origin, ring_of_posts((west, north, east, south)).end
    assert origin[0] <= west and origin[1] <= north and end[0] >= east and end[1] >= south


def test_a_goal_without_culling_has_the_whole_map(small):
    camera = standard_view(small.heightmap, "ridge")
    cells = (small.heightmap.rows - 1) * (small.heightmap.cols - 1)
    selection = small.levels.select(camera, SIZE, small.near_m, Goal(triangles=4 * cells, cull=False))
    assert 3.9 * cells < selection.triangles <= 4 * cells
