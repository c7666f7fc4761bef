"""Method sat: its meshes have no holes, and their error is within the certified bound on the whole surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import cameras, holes, random_map, rough
from ring_scenes import (
    check_covered_once,
    clipmap_of,
    corners_with_patches,
    in_units,
    patches_of,
    surface_errors,
    triangles_of,
)

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap

pytestmark = pytest.mark.line

FINEST = -5  # log2 of the least spacing, one more beyond ring 0: glsl/lod/rings/leaf.glsl
SIZES = [(2, 2), (2, 3), (5, 9), (2, 49), (49, 2), (33, 33), (34, 51)]
LAND = {
    "rough": lambda: Heightmap(rough(41, 58, 3), 10.0),
    "flat": lambda: Heightmap(0.1 * rough(64, 37, 8), (7.0, 19.0)),
    "cliffs": lambda: Heightmap(np.where(rough(50, 50, 4) > 20, 90.0, 0.0), 10.0),
    "holes": lambda: Heightmap(holes(45), 15.0),
    "offset": lambda: Heightmap(8848 + rough(40, 33, 3, 0.05).astype("f8"), 1.0),
}
VIEWS = ["default", "grazing", "down", "wide", "pit", "outside", "far", "corner"]
TOLERANCES = [0.1, 0.3, 1.0, 8.0]
TWO = {view: TOLERANCES[i % 2 :: 2] for i, view in enumerate(VIEWS)}  # each has two of them


@pytest.fixture(scope="module", params=LAND)
def scene(request, session_context):
    with session_context as ctx:
        scene = clipmap_of(ctx, LAND[request.param]())
        yield scene
        scene.release()


def check_mesh(scene, camera, **settings):
    """The whole map is covered once, by as many triangles as the selection says."""
    selection = scene.select(camera, cull=False, **settings)
    drawn = triangles_of(selection)
    check_covered_once(drawn, scene.heightmap)
    assert selection.triangles == len(drawn)
    return selection


def check_certificate(scene, camera, tolerance, metric):
    """No place of the surface is further off than certified, nor certified further than asked for.

    32 parts between two posts are the finest (beyond ring 0, 16): where they are not enough, the certificate says so.
    """
    selection = scene.select(camera, tolerance, metric)
    errors = surface_errors(scene, selection, camera)
    assert (errors.max_px if metric == "max" else errors.rms_px) <= selection.certified_px
    if selection.certified_px > tolerance:
        patches = patches_of(scene, selection)
        assert (patches.step_log2[patches.bound_px > tolerance] <= FINEST + 1).all()
    return selection, errors


@pytest.mark.parametrize("view", VIEWS)
def test_hard_land_is_covered_once(ctx, scene, view):
    for tolerance in TWO[view]:
        check_mesh(scene, cameras(scene.heightmap, scene.size)[view], tolerance_px=tolerance)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("metric", ["max", "rms"])
def test_hard_land_keeps_its_certificate(ctx, scene, view, metric):
    for tolerance in TWO[view]:
        check_certificate(scene, cameras(scene.heightmap, scene.size)[view], tolerance, metric)


@pytest.mark.parametrize("shape", SIZES, ids=str)
def test_every_size_is_whole_and_keeps_its_certificate(ctx, shape):
    heightmap = Heightmap(rough(*shape, seed=4), (10.0, 13.0))
    scene = clipmap_of(ctx, heightmap)
    for view in ("default", "grazing", "outside", "corner"):
        camera = cameras(heightmap, scene.size)[view]
        check_mesh(scene, camera, tolerance_px=0.5)
        check_certificate(scene, camera, 0.5, "max")
        check_certificate(scene, camera, 2.0, "rms")
    check_mesh(scene, camera, triangles=300)


def random_camera(rng, heightmap):
    """From inside, above, beside and far away."""
    (east, north), (low, high) = heightmap.extent_m, heightmap.range_m
    reach = max(east, north, high - low)
    away = reach * rng.choice([0.0, 0.5, 30.0])
    eye = rng.uniform([-away, -away, low], [east + away, north + away, high + max(away, 0.2 * reach)])
    target = rng.uniform([0, 0, low], [east, north, high])
    return Camera(tuple(eye), tuple(target + 1e-3 * reach), float(rng.uniform(5, 140)))


@settings(max_examples=8)
@given(st.integers(2, 60), st.integers(2, 60), st.integers(0, 10**6))
def test_any_map_from_anywhere(ctx, rows, cols, seed):
    rng = np.random.default_rng(seed)
    size = [(64, 64), (160, 90), (320, 180)][rng.integers(0, 3)]
    scene = clipmap_of(ctx, random_map(rng, rows, cols), size)
    for _ in range(2):
        camera, tolerance = random_camera(rng, scene.heightmap), float(0.3 * 2 ** rng.uniform(0, 4.7))
        check_mesh(scene, camera, tolerance_px=tolerance)
        check_certificate(scene, camera, tolerance, ("max", "rms")[rng.integers(0, 2)])
        check_mesh(scene, camera, triangles=int(10 ** rng.uniform(0.4, 4)))
    scene.release()


def test_cells_cut_in_32_leave_no_crack(ctx):
    """Far from the eye, too, cells may need the finest cut; but their neighbours' edges have 64 segments at most."""
    heights = np.zeros((200, 200))
    heights[104:108, 140:148] = 1e3 * (np.indices((4, 8)).sum(0) % 2)
    scene = clipmap_of(ctx, Heightmap(heights, 1.0), (64, 64))
    camera = Camera((16.0, 95.0, 20.0), (150.0, 95.0, 0.0), 20.0)
    selection = check_mesh(scene, camera, tolerance_px=0.3)
    assert {0, 2} <= set(patches_of(scene, selection).side_log2[patches_of(scene, selection).step_log2 < 0])


@pytest.mark.parametrize("view", ["default", "wide", "down"])
def test_triangles_stay_in_a_cell_of_their_patch(ctx, scene, view):
    """The bound of cut edges assumes this: no triangle leaves one cell of its patch's lattice."""
    camera = cameras(scene.heightmap, scene.size)[view]
    for tolerance in TOLERANCES:
        corners = corners_with_patches(scene, scene.select(camera, tolerance, cull=False))
        first = corners[:, 0]
        is_fan = (first["high"] - first["low"] == 1).all(1) & (first["step_log2"] == -1)  # over a single cell
        cell = np.round(64 * np.where(is_fan, 1.0, 2.0 ** first["step_log2"])).astype(int)[:, None]
        places = in_units(corners["post"])
        assert (places.max(1) <= (places.min(1) // cell + 1) * cell).all()


@pytest.mark.parametrize("view", ["default", "wide"])
def test_triangles_touch_new_vertices_of_one_edge_alone(ctx, scene, view):
    """The bound of cut edges assumes this. New vertices stand on a patch's edge, off the lattice of its cells."""
    camera, many = cameras(scene.heightmap, scene.size)[view], 0
    for tolerance in TOLERANCES:
        corners = corners_with_patches(scene, scene.select(camera, tolerance, cull=False))
        cell = np.round(64 * 2.0 ** corners["step_log2"]).astype(int)
        places, low, high = in_units(corners["post"]), 64 * corners["low"].astype(int), 64 * corners["high"].astype(int)
        rim = 64 * np.array(scene.terrain.all_posts[2:])
        off = (places % cell[..., None] != 0) & (places != rim)  # the lattice, along columns and along rows
        on = [places[..., 0] == low[..., 0], places[..., 1] == low[..., 1]]
        on += [places[..., 0] == high[..., 0], places[..., 1] == high[..., 1]]  # west, north, east, south
        new = np.stack([on[side] & off[..., 1 - side % 2] for side in range(4)], -1).any(1)  # (triangles, sides)
        assert (new.sum(1) <= 1).all()
        many += int(new.any(1).sum())
    assert many > 20 or scene.heightmap.range_m[1] < 10
