"""The mean over the picture: `--metric rms` with a tolerance, method sat."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import random_camera, random_map, rough, surface_m, tessellation_ends
from ring_scenes import PLACES, change_shaders, clipmap_of, patches_of, triangles_of

from terrain_gl import reference
from terrain_gl.camera import Camera, screen_shift_px
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import Goal, budget, hiding
from terrain_gl.reference.rings import mean_px

SIZE = (320, 180)
SPACING_M = 10.0


def scene_of(ctx, heights):
    return clipmap_of(ctx, Heightmap(heights.astype("f4"), SPACING_M), SIZE)


@pytest.fixture(scope="module")
def scene(session_context):
    heights = rough(257, 257, 5, relief=300.0) + np.random.default_rng(1).normal(size=(257, 257)) * 2
    with session_context as ctx:
        scene = scene_of(ctx, heights)
        yield scene
        scene.release()


def across_the_land():
    return Camera((1280.0, 200.0, 500.0), (1280.0, 1600.0, 100.0), 50.0)


def select(scene, camera, asked_px, hides=True):
    return scene.levels.select(camera, scene.size, scene.near_m, Goal(asked_px, "rms", hides=hides))


def area_mean_px(scene, mesh, camera):
    """Root mean square over the area of the drawn cells with data, from the captured triangles.

    Each cell takes its 6 × 6 places, with the weights 3, 4, 4, 4, 4, 3 along each side.
    """
    drawn, heightmap = triangles_of(mesh), scene.heightmap
    shape = [PLACES * (n - 1) + 1 for n in heightmap.heights.shape]
    drawn_m = surface_m(
        PLACES * drawn["post"].astype("f8"), drawn["height_m"].astype("f8") + scene.terrain.base_m, shape
    )
    void = np.isnan(heightmap.heights)
    solid = ~(void[1:, 1:] | void[1:, :-1] | void[:-1, 1:] | void[:-1, :-1])
    cells = solid & ~np.isnan(drawn_m[2::PLACES, 2::PLACES])
    share, along = np.zeros(shape), [3, 4, 4, 4, 4, 3]
    for i, j in np.ndindex(6, 6):
        share[i : i + PLACES * len(cells) : PLACES, j : j + PLACES * cells.shape[1] : PLACES] += (
            cells * along[i] * along[j]
        )
    row, col = np.nonzero(share > 0)
    truth_m = reference.bilinear_heights(scene.terrain.filled.astype("f8"), col / PLACES, row / PLACES)
    east, north = (step / PLACES for step in heightmap.spacing_m)
    at = np.stack([col * east, (shape[0] - 1 - row) * north, truth_m], -1)
    px, seen = screen_shift_px(camera, scene.size, at, drawn_m[row, col] - truth_m, scene.near_m)
    weight = share[row, col][seen]
    return float(np.sqrt((weight * np.square(px[seen])).sum() / weight.sum())) if seen.any() else 0.0


@pytest.mark.slow
@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_the_mean_is_certified(ctx, seed):
    """Random maps, with voids and without, cameras anywhere; hidden land is left out."""
    rng = np.random.default_rng(seed)
    scene = clipmap_of(ctx, random_map(rng), SIZE)
    for _ in range(3):
        camera, asked_px = random_camera(rng, scene.heightmap), float(10 ** rng.uniform(-1, 1))
        mesh = select(scene, camera, asked_px)
        achieved = scene.achieved(mesh, camera)
        assert achieved.rms_px <= mesh.certified_px and achieved.uncovered == 0
        assert area_mean_px(scene, mesh, camera) == pytest.approx(achieved.rms_px, rel=1e-3, abs=1e-6)
        assert achieved.max_px <= (mesh.farthest_px or mesh.certified_px)
        assert mesh.certified_px <= asked_px or tessellation_ends(mesh, asked_px)
    scene.release()


@pytest.mark.parametrize("asked_px", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("view", ["across", "ridge", "valley"])
def test_the_tolerance_is_used(ctx, scene, view, asked_px):
    """The certified mean is close to the tolerance; the largest error is above it, up to a limit."""
    camera = across_the_land() if view == "across" else standard_view(scene.heightmap, view)
    mesh = select(scene, camera, asked_px)
    assert 0.9 * asked_px < mesh.certified_px <= asked_px < mesh.farthest_px <= hiding.FARTHEST["rms"] * asked_px
    assert 0.25 * asked_px < scene.achieved(mesh, camera).rms_px
    assert mesh.triangles < 0.6 * scene.select(camera, asked_px).triangles


def seen_whole():
    """A view of the whole map."""
    return Camera((1280.0, -1000.0, 2500.0), (1280.0, 1280.0, 0.0), 70.0)


def bound_px(scene, mesh):
    """The reference's bound, where all patches are wholly in the picture."""
    patches = patches_of(scene, mesh)
    last = [scene.heightmap.cols - 1, scene.heightmap.rows - 1]
    ends = np.minimum(patches.corner + patches.size, last) - np.maximum(patches.corner, 0)
    return mean_px(ends.prod(1).astype(float), patches.bound_px.astype(float), np.ones(len(ends), bool))


@pytest.mark.parametrize("asked_px", [0.3, 2.0])
def test_every_patch_is_in_the_sum(ctx, scene, asked_px):
    mesh = select(scene, seen_whole(), asked_px)
    assert mesh.certified_px == pytest.approx(bound_px(scene, mesh), rel=1e-3)


def test_without_one_patch_the_sum_is_another(ctx, scene, monkeypatch):
    change_shaders(monkeypatch, "if (!hidden) add_to_mean", "if (!hidden && i > 0u) add_to_mean")
    other = scene_of(ctx, scene.heightmap.heights)
    mesh = select(other, seen_whole(), 0.3)
    assert mesh.certified_px != pytest.approx(bound_px(other, mesh), rel=1e-3)


def test_patches_partly_in_the_picture_are_in_the_sum(ctx, monkeypatch):
    """Flat land with a rough strip at one side of the picture."""
    heights = np.zeros((129, 129))
    heights[:, 78:81] = np.random.default_rng(2).normal(size=(129, 3)) * 10
    camera = Camera((300.0, 640.0, 900.0), (300.0, 640.0, 0.0), 35.0)

    def certified(scene):
        mesh = select(scene, camera, 0.2)
        result = scene.achieved(mesh, camera).rms_px, mesh.certified_px
        scene.release()
        return result

    achieved, bound = certified(scene_of(ctx, heights))
    assert achieved <= bound <= 0.2
    change_shaders(monkeypatch, "if (!hidden) add_to_mean", "if (!hidden && is_land) add_to_mean")
    achieved, bound = certified(scene_of(ctx, heights))
    assert achieved > bound


def test_land_with_voids_is_no_land_of_the_mean(ctx, scene, monkeypatch):
    """Cells with voids have no error, so they must not make the mean smaller."""
    heights = scene.heightmap.heights.copy()
    rng = np.random.default_rng(4)
    heights[:, 64:][rng.random((257, 193)) < 0.3] = np.nan
    voids = scene_of(ctx, heights)
    mesh = select(voids, seen_whole(), 0.2)
    assert voids.achieved(mesh, seen_whole()).rms_px <= mesh.certified_px <= 0.2 < mesh.farthest_px
    change_shaders(monkeypatch, "if (is_void(first + ivec2(i % posts.x, i / posts.x))) return true;", "")
    other = scene_of(ctx, heights)
    assert select(other, seen_whole(), 0.2).triangles < 0.9 * mesh.triangles


def test_where_no_patch_is_wholly_in_the_picture_each_patch_keeps_the_tolerance(ctx, scene):
    camera = Camera((1285.0, 1285.0, float(scene.heightmap.heights[128, 128]) + 4), (1290.0, 1290.0, 0.0), 30.0)
    mesh, largest = select(scene, camera, 0.5), scene.select(camera, 0.5)
    assert mesh.farthest_px is None and mesh.certified_px == largest.certified_px
    assert mesh.triangles == largest.triangles


def test_few_meshes_are_tried(ctx, scene, monkeypatch):
    tried, at_price = [], type(scene.levels)._at_price

    def counted(selector, rings, price):
        tried[-1] += 1
        return at_price(selector, rings, price)

    monkeypatch.setattr(type(scene.levels), "_at_price", counted)
    for px in np.geomspace(0.2, 5, 12):
        tried.append(0)
        select(scene, across_the_land(), float(px))
    assert np.median(tried) <= 7 and max(tried) <= budget.TRIES


def test_the_mean_of_a_node_includes_its_far_edges():
    """A spike on the common edge of two nodes is an error of both, because each draws one side of it."""
    heights = np.zeros((9, 9))
    heights[2, 4] = 9.0
    squares = reference.cut_errors(heights, 2).squares
    cell = 9.0**2 / 9  # mean square of a bilinear function that is 9 at one corner, and 0 at the others
    assert (squares[0] >= 2 * cell).all()
