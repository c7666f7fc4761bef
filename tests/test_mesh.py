"""Captured meshes: vertices at their places, watertight, no flipped or overlapping triangles."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, Scene, cameras, random_map, rough

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import EveryPost, Goal
from terrain_gl.mesh import MeshDraw, captured_triangles, vertex_heights

pytestmark = pytest.mark.line

SIZES = [
    (2, 2),
    (2, 3),
    (3, 3),
    (2, 300),
    (300, 2),
    (5, 9),
    (66, 67),
    *(pytest.param(size, marks=pytest.mark.slow) for size in ((65, 65), (70, 155))),
]


def doubled_areas(triangles):
    """Positive where a triangle is counter-clockwise seen from above; rows run south."""
    a, b, c = (triangles[:, i].astype("f8") for i in range(3))  # multiples of 1/64 and their products are exact
    return -((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def lone_edges(triangles):
    """Edges of one triangle only, (n, 2, 2) columns and rows; asserts that no edge has more than two, one each way.

    One sort finds them all, because an edge is one number: both its ends, in 64ths of a post, and one bit for the
    direction in which its triangle goes along it.
    """
    places = (64 * triangles).astype("u8")
    assert (places == 64 * triangles).all()
    width = places[..., 0].max() + np.uint64(1)
    ends = places[..., 1] * width + places[..., 0]
    assert ends.max() < 1 << 31
    a, b = ends.ravel(), np.roll(ends, -1, 1).ravel()
    edges = np.sort(np.minimum(a, b) << 32 | np.maximum(a, b) << 1 | (a > b))
    assert (edges[1:] != edges[:-1]).all(), "two triangles on one side of an edge"
    shared = (edges[1:] >> 1) == (edges[:-1] >> 1)
    lone = edges[~(np.append(shared, False) | np.append(False, shared))]
    ends = np.stack([lone >> 32, lone >> 1 & 0x7FFFFFFF], -1)
    return np.stack([ends % width, ends // width], -1) / 64


def check_watertight(triangles, heightmap):
    """Every inner edge belongs to two triangles, all outer edges are on the map's rim, and the map is covered once."""
    last = np.array([heightmap.cols - 1, heightmap.rows - 1])
    assert triangles.min() >= 0 and (triangles <= last).all()
    areas = doubled_areas(triangles)
    assert (areas > 0).all()
    assert areas.sum() == 2 * last.prod()
    rim = lone_edges(triangles)
    along = ((rim == 0) | (rim == last)).all(1)  # both ends on the same side
    assert along.any(1).all()


@pytest.mark.parametrize("shape", SIZES, ids=str)
def test_every_size_is_watertight(ctx, sample, shape):
    heightmap = Heightmap(rough(*shape, seed=4), 10.0)
    scene = Scene.of(ctx, heightmap)
    cases = [*itertools.product((0.0, 0.5, 3.0), ("default", "grazing", "outside", "corner"))]
    for tolerance, view in cases if shape == (2, 2) else sample(cases, 3):
        selection = scene.select(cameras(heightmap)[view], tolerance, cull=False)
        check_watertight(scene.triangles(selection), heightmap)


GOALS = [{"tolerance_px": 0.5}, {"tolerance_px": 2.0}, {"tolerance_px": 1.0, "metric": "rms"}]
GOALS += [{"triangles": 2}, {"triangles": 300}]


@pytest.mark.parametrize("name", MAPS)
def test_hard_maps_are_watertight(ctx, name):
    """Two goals for each camera: over all maps, each camera has each goal."""
    heightmap, first = MAPS[name](), list(MAPS).index(name)
    scene = Scene.of(ctx, heightmap)
    for i, camera in enumerate(cameras(heightmap).values(), first):
        for goal in (GOALS[i % 5], GOALS[(i + 2) % 5]):
            check_watertight(scene.triangles(scene.select(camera, cull=False, **goal)), heightmap)


@pytest.mark.slow
@settings(max_examples=8)
@given(st.integers(2, 80), st.integers(2, 80), st.integers(0, 10**6))
def test_any_map_is_watertight_from_anywhere(ctx, rows, cols, seed):
    rng = np.random.default_rng(seed)
    heightmap = random_map(rng, rows, cols)
    scene = Scene.of(ctx, heightmap)
    east, north = heightmap.extent_m
    low, high = heightmap.range_m
    for _ in range(3):
        eye = rng.uniform([-east, -north, low], [2 * east, 2 * north, high + east])
        camera = Camera(tuple(eye), tuple(rng.uniform([0, 0, low], [east, north, high])), float(rng.uniform(5, 140)))
        selection = scene.select(
            camera, float(10 ** rng.uniform(-1, 1)), ("max", "rms")[rng.integers(0, 2)], cull=False
        )
        check_watertight(scene.triangles(selection), heightmap)
        budget = int(10 ** rng.uniform(0.4, 4))
        check_watertight(scene.triangles(scene.select(camera, triangles=budget, cull=False)), heightmap)
    scene.release()


def test_culled_mesh_has_no_gap_where_it_is_seen(ctx):
    """Lone edges of a culled mesh are on the map's rim or out of the picture."""
    heightmap = MAPS["odd"]()
    scene = Scene.of(ctx, heightmap)
    last = np.array([heightmap.cols - 1, heightmap.rows - 1])
    for camera, triangles in itertools.product(cameras(heightmap).values(), (None, 2000)):
        lone = lone_edges(scene.triangles(scene.select(camera, 1.0, triangles=triangles)))
        inner = lone[~((lone == 0) | (lone == last)).all(1).any(1)]
        for t in np.linspace(0, 1, 9):
            assert not in_picture(scene, camera, inner[:, 0] * (1 - t) + inner[:, 1] * t, inner, t).any()


def in_picture(scene, camera, places, edges, t):
    """Whether points on drawn edges are in the picture; (n, 2) columns and rows."""
    heights = vertex_heights(scene.terrain.filled.astype("f8"), edges)
    up = heights[:, 0] * (1 - t) + heights[:, 1] * t
    east, north = scene.heightmap.spacing_m
    world = np.stack([places[:, 0] * east, (scene.heightmap.rows - 1 - places[:, 1]) * north, up], -1)
    x, y, z = camera.axes @ (world - np.asarray(camera.eye)).T
    tan_x, tan_y = camera.half_extent(scene.size)
    return (z >= scene.near_m) & (np.abs(x) <= tan_x * z) & (np.abs(y) <= tan_y * z)


def test_many_large_patches_are_not_garbled(ctx):
    """Mesa draws garbage beyond 65,535 vertices a draw: a map of patches of 32 × 32, every triangle checked."""
    heightmap = Heightmap(rough(513, 513, 9), 10.0)
    scene = Scene.of(ctx, heightmap)
    every_post = EveryPost(scene.tables, scene.levels.view)
    selection = every_post.select(cameras(heightmap)["far"], scene.size, scene.near_m, Goal(cull=False))
    assert selection.counts[5] > 65535 // 33**2
    check_watertight(scene.triangles(selection), heightmap)


def test_heights_are_those_of_the_posts(ctx, monkeypatch):
    heightmap = MAPS["offset"]()
    scene = Scene.of(ctx, heightmap)
    selection = scene.select(cameras(heightmap)["default"], 1.0)
    scene.triangles(selection)  # compares them bit by bit
    scene.terrain.heightmap.heights[:] += np.float32(0.01)
    with pytest.raises(TerrainError, match="at wrong heights"):
        captured_triangles(selection)


def test_capture_leaves_no_trace_in_the_next_one(ctx):
    heightmap = MAPS["odd"]()
    scene = Scene.of(ctx, heightmap)
    camera = cameras(heightmap)["default"]
    few = scene.triangles(scene.select(camera, 5.0))
    many = scene.triangles(scene.select(camera, 0.1))
    assert len(many) > 4 * len(few)
    assert scene.triangles(scene.select(camera, 5.0)).tobytes() == few.tobytes()


PLACE = np.dtype([("clip", "4f4"), ("post", "2f4")])


@pytest.mark.parametrize("name", ["odd", "offset", "tiny", "huge", "long"])
def test_vertices_stand_in_the_picture_where_they_belong(ctx, name):
    """Drawn vertices are within a hundredth of a pixel of those in float64, near the eye and far away."""
    scene = Scene.of(ctx, MAPS[name]())
    draw = MeshDraw(scene.levels, "PICTURE", varyings=("gl_Position", "v_post"))
    scale = np.asarray(scene.size) / 2
    for view, camera in cameras(scene.heightmap).items():
        selection = scene.select(camera, 0.5)
        vertices = np.frombuffer(draw.capture(selection, PLACE.itemsize), PLACE)
        vertices = vertices[(vertices["post"] == np.floor(vertices["post"])).all(1)]  # those on posts
        col, row = vertices["post"].astype(int).T
        east, north = scene.heightmap.spacing_m
        world = np.stack([col * east, (scene.heightmap.rows - 1 - row) * north, scene.terrain.filled[row, col]], -1)
        x, y, z = camera.axes @ (world - np.asarray(camera.eye)).T
        front = z > scene.near_m
        x, y, z, clip = x[front], y[front], z[front], vertices["clip"][front].astype("f8")
        expected = np.stack([x, y], -1) / z[:, None] * camera.focal_px(scene.size[1])
        drawn = clip[:, :2] / clip[:, 3:] * np.divide(scene.levels.view.viewport[2:], 2)
        seen = (np.abs(expected) <= scale).all(1)
        assert np.abs(drawn - expected)[seen].max(initial=0) < 0.01, view
        assert np.allclose(clip[:, 2] / clip[:, 3], scene.near_m / z, rtol=1e-3), view


CORNER = np.dtype([("post", "2f4"), ("low", "2u2"), ("high", "2u2"), ("step_log2", "f4"), ("bound", "u4")])


@pytest.mark.parametrize("name", ["odd", "holes", "cliff"])
def test_triangles_of_a_patch_are_those_that_the_error_tables_speak_of(ctx, name):
    """Each triangle lies in one cell of its patch's lattice, also where neighbours cut the patch's edges."""
    scene = Scene.of(ctx, MAPS[name]())
    draw = MeshDraw(scene.levels, "PICTURE", varyings=("v_post", "v_of_patch"))
    sizes_seen, is_cut = set(), False
    for camera in cameras(scene.heightmap).values():
        for tolerance in (0.5, 2.0):
            data = draw.capture(scene.select(camera, tolerance), CORNER.itemsize)
            vertices = np.frombuffer(data, CORNER).reshape(-1, 3)
            step = np.exp2(vertices["step_log2"][:, 0])
            origin = vertices["low"][:, 0].astype(int)
            cells = (vertices["post"] - origin[:, None]) / step[:, None, None]
            low, ends = np.floor(cells).min(1), np.ceil(cells).max(1)
            segments = (vertices["high"][:, 0].astype(int) - origin)[:, 0] / step
            fan = step * segments == 1  # a single cell of the map is a fan around its centre
            assert (ends - low <= 1 + fan[:, None]).all()
            sizes_seen |= set(np.log2(segments[~fan]).round().astype(int).tolist())
            is_cut |= bool((cells % 1 != 0).any())
    assert sizes_seen >= {1, 2, 3} and is_cut


def test_a_patch_of_the_reference_covers_its_square_once():
    for step, segments in ((1, 1), (4, 8), (2, 32)):
        triangles = reference.patch_triangles((3, 5), step, segments)
        areas = reference.areas(triangles)
        assert len(triangles) == 2 * segments**2 and (areas == step**2 / 2).all()
        assert triangles.min((0, 1)).tolist() == [3, 5]
        assert triangles.max((0, 1)).tolist() == [3 + step * segments, 5 + step * segments]


def test_vertices_stand_at_the_references_heights():
    places = np.array([[0, 0], [3, 2], [0.5, 0.5], [2.5, 1.5]])
    heights = rough(7, 9)
    assert vertex_heights(heights, places) == pytest.approx(reference.vertex_heights(heights.astype("f8"), places))
