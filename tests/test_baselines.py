"""Clipmap and tessellated: watertight meshes from any eye, exact counts, correct errors, the requested triangles."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, REAL, SIZE, cameras, new_heights, random_camera, random_map, rough, surface_m
from test_mesh import check_watertight

import terrain_gl as tg
from terrain_gl.comparison.clipmap import BLOCK, Rings, blocks_of, rings_of
from terrain_gl.comparison.curves import detail_of
from terrain_gl.comparison.pyramid import Pyramid, halve
from terrain_gl.comparison.tessellated import Edges
from terrain_gl.error import ErrorTables
from terrain_gl.gpu.layout import PLACES
from terrain_gl.lod import Goal, ViewBlock
from terrain_gl.mesh import captured_triangles
from terrain_gl.renderer.methods import BASELINES, Selectors
from terrain_gl.shade.picture import UNLIT
from terrain_gl.terrain import Terrain

PARAMETERS = {"clipmap": Rings, "tessellated": Edges}
PARAMETER_SETS = [
    *(("clipmap", rings) for rings in (Rings(), Rings(13), Rings(33), Rings(15, finest=2), Rings(63, 0, 0.0))),
    *(("tessellated", edges) for edges in (Edges(), Edges(3, 8, 8), Edges(2, 4, 12), Edges(40, 32, 16))),
]


class Scene:
    """A map with the baselines, and what they draw of it."""

    def __init__(self, ctx, heightmap, size=SIZE):
        self.heightmap, self.size = heightmap, size
        self.terrain, self.view = Terrain(ctx, heightmap), ViewBlock(ctx)
        self.tables = ErrorTables(self.terrain, build=False)  # no baseline reads the tables
        self.selectors = Selectors(self.tables, self.view)

    def select(self, method, camera, parameters, cull=True):
        near_m = 0.1 * min(self.heightmap.spacing_m)
        return self.selectors[method].select(camera, self.size, near_m, Goal(parameters=parameters, cull=cull))

    def release(self):
        for part in (self.selectors, self.tables, self.view, self.terrain):
            part.release()


def one_height_a_post(posts, heights_m, heightmap):
    """Heights (rows, cols) at posts with a vertex, NaN elsewhere; asserts that a post has one height."""
    col, row = posts.reshape(-1, 2).astype(int).T
    flat = row * heightmap.cols + col
    drawn = np.full(heightmap.rows * heightmap.cols, np.nan, "f4")
    drawn[flat] = heights_m.ravel()
    assert np.array_equal(drawn[flat], heights_m.ravel()), "a crack: two heights at one post"
    return drawn.reshape(heightmap.rows, heightmap.cols)


def check_mesh(scene, method, camera, parameters):
    whole = scene.select(method, camera, parameters, cull=False)
    posts, heights_m = captured_triangles(whole)
    assert len(posts) == whole.triangles
    check_watertight(posts, scene.heightmap)
    one_height_a_post(posts, heights_m, scene.heightmap)
    return posts


# --- the pyramid ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(2, 2), (2, 3), (3, 2), (5, 9), (64, 65), (66, 67), (131, 200)], ids=str)
def test_pyramid_is_the_specification(ctx, shape):
    terrain = Terrain(ctx, tg.Heightmap(rough(*shape, 3, 1000.0), 10.0))
    pyramid = Pyramid(terrain)
    level, *above = pyramid.read()
    expected = level.astype("f8")
    for got in above:
        expected = halve(expected)
        assert got.shape == expected.shape
        # for each level, 25 products and sums in float32 of numbers below 2500
        assert np.abs(got - expected).max() <= len(above) * 30 * 2500 * 2**-24
    assert got.shape == (2, 2)


def test_planes_stay_planes(ctx):
    """At the rim, too: the filters are symmetric everywhere."""
    heightmap = MAPS["plane"]()
    terrain = Terrain(ctx, heightmap)
    pyramid = Pyramid(terrain)
    last = np.array(heightmap.heights.shape) - 1
    for j, heights in enumerate(pyramid.read()):
        row, col = (np.minimum(np.arange(n) << j, end) for n, end in zip(heights.shape, last, strict=True))
        assert np.abs(heights - heightmap.heights[np.ix_(row, col)]).max() < 1e-3


def test_ranges_hold_all_samples(ctx):
    heightmap = MAPS["odd"]()
    terrain = Terrain(ctx, heightmap)
    pyramid = Pyramid(terrain)
    levels = pyramid.read()
    for j in range(2, len(levels) + 2):
        cells = np.maximum(np.array(levels[0].shape) - 2 >> j, 0) + 1
        at = np.indices(cells).reshape(2, -1).T[:, ::-1]
        for (col, row), (low, high) in zip(at, pyramid.ranges(at, np.full(len(at), j)), strict=True):
            for i, heights in enumerate(levels[: j + 1]):
                y, x = (slice(n << j - i, (n + 1 << j - i) + 1) for n in (row, col))
                assert low <= heights[y, x].min() and heights[y, x].max() <= high


# --- meshes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("method", BASELINES)
def test_hard_maps_are_watertight(ctx, sample, method, name):
    scene = Scene(ctx, MAPS[name]())
    parameter_sets = [parameters for of, parameters in PARAMETER_SETS if of == method]
    for camera, parameters in sample([*itertools.product(cameras(scene.heightmap).values(), parameter_sets)], 3):
        check_mesh(scene, method, camera, parameters)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(2, 150), st.integers(2, 150), st.integers(0, 10**6))
def test_any_map_is_watertight_from_anywhere(ctx, rows, cols, seed):
    rng = np.random.default_rng(seed)
    scene = Scene(ctx, random_map(rng, rows, cols))
    for _ in range(3):
        camera = random_camera(rng, scene.heightmap)
        rings = Rings(int(rng.integers(13, 120)), [None, 0, 1, 4][rng.integers(0, 4)], rng.uniform(0, 0.25))
        check_mesh(scene, "clipmap", camera, rings)
        patch, ring = 2 ** int(rng.integers(2, 6)), 2 * int(rng.integers(4, 20))
        check_mesh(scene, "tessellated", camera, Edges(10 ** rng.uniform(-1, 2.5), patch, ring))
    scene.release()


@pytest.mark.parametrize(("method", "parameters"), PARAMETER_SETS, ids=str)
def test_no_sky_shows_through(ctx, sample, method, parameters):
    renderer = tg.Renderer(MAPS["holes"](), SIZE, ctx=ctx)
    for view, camera in sample([*cameras(renderer.heightmap).items()], 3):
        stats = renderer.draw(camera, method=method, parameters=parameters, style="depth")
        assert len(renderer.triangles()) == stats["triangles"], view
        assert renderer.measure()["holes"] == 0, view


@pytest.mark.parametrize("method", BASELINES)
def test_heights_drawn_are_those_of_the_pyramid(ctx, method):
    """At a vertex, the height lies between the lowest and the highest that any level has there and around it."""
    scene = Scene(ctx, MAPS["odd"]())
    camera = cameras(scene.heightmap)["default"]
    posts, heights_m = captured_triangles(scene.select(method, camera, PARAMETERS[method]()))
    levels = scene.selectors[method].pyramid.read()
    slack = 1e-4 * np.ptp(levels[0])
    col, row = posts.reshape(-1, 2).astype(int).T
    low, high = np.full((2, len(col)), levels[0][row, col])
    for j, level in enumerate(levels[1:6], 1):
        for step in np.ndindex(2, 2):
            at = np.minimum((np.stack([row, col], -1) >> j) + step, np.array(level.shape) - 1)
            low, high = np.minimum(low, level[tuple(at.T)]), np.maximum(high, level[tuple(at.T)])
    assert ((low - slack <= heights_m.ravel()) & (heights_m.ravel() <= high + slack)).all()


@pytest.mark.slow
def test_a_ring_as_large_as_the_map_is_the_map_itself(ctx):
    renderer = tg.Renderer(MAPS["odd"](), SIZE, ctx=ctx)
    views = cameras(renderer.heightmap)
    del views["far"]  # whose rings are far from the map, too
    for view, camera in views.items():
        renderer.draw(camera, method="clipmap", parameters=Rings(4 * 203 + 1, finest=0), style=UNLIT)
        stats = renderer.measure()
        assert (stats["max_error_posts_px"], stats["holes"]) == (0, 0) and stats["posts_measured"] > 20, view


def test_rings_nest_and_cover_the_map_once():
    heightmap = tg.Heightmap(np.zeros((500, 733)), (2.0, 3.0))
    rng = np.random.default_rng(0)
    for _ in range(200):
        eye = (*rng.uniform(-500, 2000, 2), 10.0)
        seen = np.zeros((499, 732), int)
        for ring in rings_of(heightmap, eye, 2 * rng.integers(6, 50, 2), int(rng.integers(0, 5))):
            step = 2**ring.level
            for x, y, width, height in blocks_of(ring)["cells"]:
                assert max(width, height) <= BLOCK
                seen[y * step : (y + height) * step, x * step : (x + width) * step] += 1
        assert (seen == 1).all()


@pytest.mark.parametrize("method", BASELINES)
def test_culling_takes_only_what_is_not_seen(ctx, method):
    scene = Scene(ctx, MAPS["odd"]())
    for view, camera in cameras(scene.heightmap).items():
        parameters = replace(PARAMETERS[method](), ring=33 if method == "clipmap" else 16)
        whole, whole_m = captured_triangles(scene.select(method, camera, parameters, cull=False))
        drawn, _ = captured_triangles(scene.select(method, camera, parameters))
        assert len(drawn) <= len(whole) * (0.5 if view == "grazing" else 1)
        kept = {triangle.tobytes() for triangle in drawn}
        left_out = np.array([triangle.tobytes() not in kept for triangle in whole])
        col, row = whole[left_out].reshape(-1, 2).T
        east, north = scene.heightmap.spacing_m
        z = whole_m[left_out].ravel().astype("f8") + scene.terrain.base_m
        world = np.stack([col * east, (scene.heightmap.rows - 1 - row) * north, z], -1)
        x, y, depth = camera.axes @ (world - np.asarray(camera.eye)).T
        tan_x, tan_y = camera.half_extent(scene.size)
        assert not ((depth > 0.1 * min(east, north)) & (np.abs(x) < tan_x * depth) & (np.abs(y) < tan_y * depth)).any()


# --- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", BASELINES)
@pytest.mark.parametrize("view", ["default", "corner", "down", "wide"])
def test_measured_errors_are_those_of_the_captured_triangles(ctx, method, view):
    """Against a float64 rasterisation of the captured mesh."""
    renderer = tg.Renderer(MAPS["holes"](), SIZE, ctx=ctx)
    heightmap = renderer.heightmap
    parameters = PARAMETERS[method](33 if method == "clipmap" else 20.0)
    renderer.draw(cameras(heightmap)[view], method=method, parameters=parameters, cull=False, style=UNLIT)
    selection = renderer.inspector.frame.selection
    posts, heights_m = captured_triangles(selection)
    drawn = surface_m(posts, heights_m, heightmap.heights.shape)
    renderer.measure()
    rows, cols = drawn.shape
    inside = 1, 1, PLACES * (cols - 1) - 1, PLACES * (rows - 1) - 1
    got = renderer.inspector._measurement.errors_m(selection, inside)[PLACES - 1 :: PLACES, PLACES - 1 :: PLACES]
    expected = (drawn - renderer.terrain.filled)[1:-1, 1:-1]
    assert np.isfinite(got).all()
    assert np.abs(got - expected).max() <= 1e-6 * np.abs(drawn).max()


@pytest.mark.parametrize("method", BASELINES)
@pytest.mark.parametrize(
    "view, triangles", [("default", 10000), ("wide", 30000), ("outside", 10000), ("grazing", 30000)]
)
def test_as_many_triangles_as_asked_for(ctx, method, triangles, view):
    renderer = tg.Renderer(tg.Heightmap(rough(300, 410, 8, 300.0), 10.0), SIZE, ctx=ctx)
    stats = renderer.draw(cameras(renderer.heightmap)[view], method=method, triangles=triangles, style=UNLIT)
    assert stats["triangles"] == pytest.approx(triangles, rel=0.02)
    assert stats["requested_triangles"] == triangles and stats["certified_max_error_px"] is None


@pytest.mark.slow
@pytest.mark.parametrize("method", BASELINES)
def test_more_triangles_are_nearer_to_the_truth(ctx, method):
    renderer = tg.Renderer(tg.Heightmap(rough(300, 410, 8, 300.0), 10.0), SIZE, ctx=ctx)
    camera = cameras(renderer.heightmap)["default"]
    errors = []
    for triangles in (2000, 8000, 32000):
        renderer.draw(camera, method=method, triangles=triangles, style=UNLIT)
        errors.append(renderer.measure()["rms_error_px"])
    assert errors[0] > 1.5 * errors[1] > 2.25 * errors[2] > 0


@pytest.mark.slow
@pytest.mark.parametrize("method", BASELINES)
def test_best_parameters_are_no_worse_than_the_first(ctx, method):
    renderer = tg.Renderer(tg.Heightmap(rough(300, 410, 8, 300.0), 10.0), SIZE, ctx=ctx)
    camera = cameras(renderer.heightmap)["default"]
    renderer.draw(camera, method=method, triangles=10000, style=UNLIT)
    first = renderer.measure()["rms_error_px"]
    best = detail_of(renderer, camera, method, 10000)
    stats = renderer.draw(camera, method=method, style=UNLIT, **best)
    assert stats["triangles"] == pytest.approx(10000, rel=0.02)
    assert renderer.measure()["rms_error_px"] <= first


@pytest.mark.parametrize("method", BASELINES)
def test_the_same_again(ctx, method):
    """The same mesh and picture, whatever was drawn before; a new renderer gives it, too."""
    heightmap = MAPS["odd"]()
    first, second = (tg.Renderer(heightmap, SIZE, ctx=ctx) for _ in range(2))
    camera = cameras(heightmap)["default"]
    once = first.render(camera, method=method).image, first.triangles().tobytes()
    first.render(cameras(heightmap)["wide"], method=method, triangles=500)
    again = first.render(camera, method=method).image, first.triangles().tobytes()
    fresh = second.render(camera, method=method).image, second.triangles().tobytes()
    assert np.array_equal(once[0], again[0]) and np.array_equal(once[0], fresh[0])
    assert once[1] == again[1] == fresh[1]


@pytest.mark.parametrize("method", BASELINES)
@pytest.mark.parametrize("kind", ["heights", "voids", "span"])
def test_edits_are_followed(ctx, method, kind):
    before = MAPS["holes"]()
    renderer = tg.Renderer(before, SIZE, ctx=ctx)
    camera = cameras(before)["default"]
    renderer.draw(camera, method=method, style=UNLIT)
    renderer.edit(np.s_[80:100], np.s_[60:90], new_heights(kind))
    renderer.draw(camera, method=method, style=UNLIT)
    fresh = tg.Renderer(renderer.heightmap, SIZE, ctx=ctx)
    fresh.draw(camera, method=method, style=UNLIT)
    drawn, expected = renderer.inspector.drawn_heights(), fresh.inspector.drawn_heights()
    base_m = renderer.terrain.base_m - fresh.terrain.base_m
    assert np.array_equal(renderer.triangles(), fresh.triangles())
    assert np.abs(drawn - expected).max() <= (0 if base_m == 0 else 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", BASELINES)
def test_real_map(ctx, dem, method):
    name = "ps_height_1k.png"
    renderer = tg.Renderer(tg.Heightmap.open(dem / name, **REAL[name]), (1280, 720), ctx=ctx)
    camera = tg.Camera((81920, 30000, 9000), (81920, 110000, 0), 60.0)
    renderer.draw(camera, method=method, triangles=103040, style=UNLIT)
    stats = renderer.measure()
    assert stats["triangles"] == pytest.approx(103040, rel=0.02)
    assert stats["posts_measured"] == 599970 and stats["holes"] == 0
    assert stats["rms_error_px"] < 0.354  # of a longest-edge bisection with as many triangles, Dupuy 2020


def test_wrong_parameters_are_refused(ctx):
    renderer = tg.Renderer(MAPS["two"](), SIZE, ctx=ctx)
    camera = cameras(renderer.heightmap)["default"]
    for wrong, told in (
        ({"method": "sat", "parameters": Rings()}, "has no such parameter"),
        ({"method": "clipmap", "parameters": Edges()}, "has no such parameter"),
        ({"method": "clipmap", "parameters": Rings(), "triangles": 10}, "give only one of them"),
    ):
        with pytest.raises(tg.UsageError, match=told):
            renderer.draw(camera, **wrong)
    for kind, value in ((Rings, 11), (Edges, 0.0), (Edges, float("nan"))):
        with pytest.raises(tg.UsageError):
            kind(value)


@pytest.mark.parametrize("method", BASELINES)
def test_meshes_chosen_for_one_eye_are_the_same_to_another(ctx, method):
    renderer = tg.Renderer(MAPS["odd"](), SIZE, ctx=ctx)
    views = cameras(renderer.heightmap)
    renderer.draw(views["default"], method=method, style=UNLIT)
    chosen, heights = renderer.triangles(), renderer.inspector.drawn_heights()
    renderer.draw(views["outside"], method=method, chosen_for=views["default"], style=UNLIT)
    assert np.array_equal(renderer.triangles(), chosen) and np.array_equal(renderer.inspector.drawn_heights(), heights)


def test_errors_of_levels_are_what_they_miss(ctx):
    heightmap = tg.Heightmap(rough(257, 257, 5, 500.0), 10.0)
    terrain = Terrain(ctx, heightmap)
    pyramid = Pyramid(terrain)
    errors_m = pyramid.errors_m()
    assert errors_m[0] == 0 and (np.diff(errors_m) > 0).all()
    fine = pyramid.read()[0]
    for level in (1, 2, 3, 4):
        coarse, step = pyramid.read()[level].astype("f8"), 2**level
        row, col = np.indices((256, 256))
        y, x, v, u = row // step, col // step, row % step / step, col % step / step
        a, d = coarse[y, x], coarse[y + 1, x + 1]  # triangles share the diagonal from north-west
        b, c = coarse[y, x + 1], coarse[y + 1, x]
        drawn = np.where(u >= v, a + u * (b - a) + v * (d - b), a + v * (c - a) + u * (d - c))
        # the mean over so many random squares is within a few per cent of the mean over all
        assert errors_m[level] == pytest.approx(np.sqrt(np.square(fine[:-1, :-1] - drawn).mean()), rel=0.03)


# --- vertices between posts -------------------------------------------------------------------------------------------

BETWEEN = [
    *(("clipmap", rings) for rings in (Rings(15, finest=-3), Rings(33, finest=-1))),
    *(("tessellated", edges) for edges in (Edges(3, 16, 8, 2), Edges(1, 4, 8, 8), Edges(2, 8, 8, 3))),
]


@pytest.mark.parametrize("name", ["odd", "two", "long"])
@pytest.mark.parametrize(("method", "parameters"), BETWEEN, ids=str)
def test_cells_cut_in_parts_are_watertight(ctx, method, parameters, name):
    scene = Scene(ctx, MAPS[name]())
    for view in ("grazing", "down"):  # the eye is above the map
        camera = cameras(scene.heightmap)[view]
        mesh = scene.select(method, camera, parameters, cull=False)
        posts, _ = captured_triangles(mesh)
        assert len(posts) == mesh.triangles and (posts != np.floor(posts)).any()
        check_watertight(posts, scene.heightmap)


@pytest.mark.parametrize(
    ("method", "whole", "cut"),
    [
        ("clipmap", Rings(8 * 203 + 1, finest=0), Rings(8 * 203 + 1, finest=-1)),
        ("tessellated", Edges(0.01, 4), Edges(0.01, 4, parts=2)),
    ],
)
def test_parts_of_cells_are_nearer_to_the_truth(ctx, method, whole, cut):
    """A cell as two triangles has an error of 1/4 of its twist, in 2 × 2 parts of 1/16; posts are exact."""
    renderer = tg.Renderer(MAPS["odd"](), SIZE, ctx=ctx)
    errors = []
    for parameters in (whole, cut):
        renderer.draw(cameras(renderer.heightmap)["default"], method=method, parameters=parameters, style=UNLIT)
        stats = renderer.measure()
        assert (stats["max_error_posts_px"], stats["holes"]) == (0, 0)
        errors.append(stats["max_error_px"])
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.3)  # places are a quarter of a cell apart
