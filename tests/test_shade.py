"""Shading: means and slopes of footprints, the sun, orientation, holes; and colours do not depend on the mesh."""

from functools import partial

import moderngl
import numpy as np
import pytest
from asking import ask
from drivers import must_be_one_driver

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.error import ErrorTables
from terrain_gl.gpu.context import create_context
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.ground import HeightSums
from terrain_gl.lod import Goal, RingsSelector
from terrain_gl.shade.picture import STYLES, Look, Picture
from terrain_gl.terrain import Terrain, quantisation_range

SIZES = [(2, 2), (3, 5), (37, 64), (130, 71)]


def hills(rows, cols, seed=1, relief=200.0):
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:rows, :cols]
    waves = sum(np.sin(x * a + y * b + c) for a, b, c in rng.uniform(-0.4, 0.4, (6, 3)))
    return (relief * (waves + 0.1 * rng.random((rows, cols)))).astype("f4")


def queries(rows, cols, n, most=40.0, seed=2):
    rng = np.random.default_rng(seed)
    posts = rng.uniform(0, 1, (n, 2)) * [cols - 1, rows - 1]
    posts[: n // 4] = np.round(posts[: n // 4])
    return np.concatenate([posts, rng.uniform(2, most, (n, 2))], 1).astype("f4")


def ask_relief(ctx, heightmap, call, questions):
    """Height and slope (n, 3) from a function of relief.glsl, for a post a.xy and an extent a.zw."""
    terrain = Terrain(ctx, heightmap)
    sums = HeightSums(terrain)
    read = {**terrain.resources, **sums.resources}
    statements = f"Relief r = {call}; return vec4(r.height_m, r.slope, 0.0);"
    answers = ask(ctx, "shade/relief.glsl", statements, questions, resources=read)[:, :3]
    answers[:, 0] += terrain.base_m
    return answers


class Scene:
    """A map ready to be drawn."""

    def __init__(self, ctx, heightmap, size=(160, 90), samples=4):
        terrain = Terrain(ctx, heightmap)
        self.levels, self.size = RingsSelector(ErrorTables(terrain)), size
        self.picture = Picture(terrain, self.levels.view, size, samples)
        self.near_m = 0.1 * min(heightmap.spacing_m)

    def draw(self, camera, tolerance_px=1.0, style="shaded", sun=(300, 35), **look):
        selection = self.levels.select(camera, self.size, self.near_m, Goal(tolerance_px))
        self.picture.draw(selection, camera, Look(style, sun, **look))
        return self.picture.read()


@pytest.fixture
def scene(ctx):
    return partial(Scene, ctx)


def from_above(heightmap, height=1.6, fov_deg=60):
    east, north = heightmap.extent_m
    middle = (east / 2, north / 2)
    return Camera((*middle, heightmap.range_m[1] + height * north), (*middle, heightmap.range_m[0]), fov_deg)


@pytest.mark.parametrize("size", SIZES)
def test_means_and_slopes_of_boxes(ctx, size):
    heightmap = Heightmap(hills(*size), spacing_m=(30.0, 20.0))
    questions = queries(*size, 200)
    answers = ask_relief(ctx, heightmap, "relief_of_sums(0, a.xy, a.zw)", questions)
    step_m = 2 * float(np.ptp(heightmap.heights)) / 65535
    for (x, y, w, h), answer in zip(questions.astype(float), answers, strict=True):
        height, slope = reference.relief(heightmap.heights, (x, y), (w, h), heightmap.spacing_m)
        assert answer[0] == pytest.approx(height, abs=step_m)
        # half floats are off by at most half a step each; the posts are at least half a post apart
        assert np.all(np.abs(answer[1:] - slope) <= 2 * step_m / np.array(heightmap.spacing_m) + 1e-5)


@pytest.mark.parametrize("units_m", [(0.0, 60.0), (-900.0, -880.0), (700.0, 760.0)])
def test_means_and_slopes_far_beyond_the_units(ctx, units_m):
    """Steps below the units are negative, and boxes have fewer posts, so that sums fit their words."""
    heightmap = Heightmap(hills(300, 290), spacing_m=(30.0, 20.0))
    heightmap.quantised_m = units_m
    _, low_m, span_m = quantisation_range(*units_m)
    most_m = max(heightmap.range_m[1], low_m + span_m) - min(heightmap.range_m[0], low_m)
    questions = queries(300, 290, 100, 250.0 * np.sqrt(span_m / most_m) - 1e-3)
    exact = [reference.relief(heightmap.heights, q[:2], q[2:], heightmap.spacing_m)[0] for q in questions.astype(float)]
    assert ask_relief(ctx, heightmap, "relief_of_sums(0, a.xy, a.zw)", questions)[:, 0] == pytest.approx(
        exact, abs=0.01
    )
    whole = np.float32([[145, 150, 250, 250]])  # the middle of the box
    side = 250.0 * np.sqrt(span_m / most_m)
    middle = reference.relief(heightmap.heights, (145.0, 150.0), (side, side), heightmap.spacing_m)[0]
    assert ask_relief(ctx, heightmap, "relief_of_sums(0, a.xy, a.zw)", whole)[0, 0] == pytest.approx(middle, abs=0.01)


def test_boxes_stay_exact_far_into_a_large_map(ctx):
    heights = np.full((1500, 1501), 1000.0, "f4")
    heights[:, 1400:] += np.arange(101, dtype="f4")
    heights[0, 0] = 0.0
    heightmap = Heightmap(heights, spacing_m=1.0)
    questions = np.array([[1450, 1450, 20, 20], [1450.3, 1449.7, 90, 90], [700, 1400, 250, 250]], "f4")
    answers = ask_relief(ctx, heightmap, "relief_of_sums(0, a.xy, a.zw)", questions)
    assert answers[:, 0] == pytest.approx([1050, 1050.3, 1000], abs=0.02)
    assert answers[:, 1] == pytest.approx([1, 1, 0], abs=0.003)
    assert answers[:, 2] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("wide, high", [(0.5, 0.5), (1.0, 0.5), (1.0, 1.0)])
def test_noise_over_a_footprint_is_the_best_that_its_middle_tells_of_the_mean(ctx, wide, high):
    at = np.random.default_rng(0).uniform(0, 200, (4000, 2))
    around = (np.arange(8) + 0.5) / 8 - 0.5
    boxes = at[:, None] + np.stack(np.meshgrid(wide * around, high * around), -1).reshape(1, -1, 2)
    statement = "return vec4(noise(a.xy, 1.0, a.zw), 0.0, 0.0, 0.0);"
    unused = {name: ctx.buffer(reserve=4096) for name in ("HeightSums", "Terrain")}  # the file declares them

    def noise(posts, extent):
        questions = np.concatenate([posts, np.broadcast_to(extent, posts.shape)], -1)
        told = ask(ctx, "shade/cover.glsl", statement, questions.reshape(-1, 4), resources=unused)
        return told[:, 0].reshape(posts.shape[:-1])

    middles, means = noise(at, (wide, high)), noise(boxes, (0.0, 0.0)).mean(1)
    # least squares give a factor of 1; the Gaussian, which is cut off, gives up to 0.03 less, and chance adds 0.03
    assert middles @ means / (middles @ middles) == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("size", SIZES)
def test_splines(ctx, size):
    heightmap = Heightmap(hills(*size), spacing_m=(30.0, 20.0))
    questions = queries(*size, 200)
    answers = ask_relief(ctx, heightmap, "relief_of_spline(0, a.xy)", questions)
    expected = [reference.spline_relief(heightmap.heights, q[:2], heightmap.spacing_m) for q in questions.astype(float)]
    assert answers[:, 0] == pytest.approx([e[0] for e in expected], abs=1e-2)
    assert answers[:, 1:] == pytest.approx(np.array([e[1] for e in expected]), abs=1e-3)


def test_rough_slopes_are_those_of_a_plane_at_its_rims_too(ctx):
    """Also for boxes of less than two posts, which a rim would cut to one post."""
    y, x = np.mgrid[:6, :9]
    heightmap = Heightmap((3 * x - 2 * y + 500).astype("f4"), spacing_m=10.0)
    places = [(x, y) for x in np.linspace(0, 8, 17) for y in np.linspace(0, 5, 11)]
    questions = np.array([(*place, e, 0.7 * e) for place in places for e in (0.1, 1.0, 2.0, 5.0)], "f4")
    slopes = ask_relief(ctx, heightmap, "rough_relief(a.xy, a.zw)", questions)[:, 1:]
    assert slopes == pytest.approx(np.broadcast_to([0.3, 0.2], slopes.shape), abs=2e-3)


def test_splines_and_boxes_agree_on_a_plane(ctx):
    y, x = np.mgrid[:40, :50]
    heightmap = Heightmap((3 * x - 2 * y + 500).astype("f4"), spacing_m=10.0)
    questions = np.array([[20, 20, e, 0.7 * e] for e in np.linspace(0.1, 20, 50)], "f4")
    answers = ask_relief(ctx, heightmap, "relief_of(a.xy, a.zw)", questions)
    assert answers[:, 0] == pytest.approx(520, abs=0.02)
    assert answers[:, 1] == pytest.approx(0.3, abs=1e-3)
    assert answers[:, 2] == pytest.approx(0.2, abs=1e-3)


def test_an_edit_equals_a_rebuild(ctx):
    heights = hills(70, 90)
    heights[0, :2] = -5000, 5000  # the span stays
    terrain = Terrain(ctx, Heightmap(heights))
    sums = HeightSums(terrain)
    edited = heights.copy()
    edited[20:33, 40:57] += 77
    sums.update(terrain.edit(0, 0, edited))
    fresh_terrain = Terrain(ctx, Heightmap(edited))
    fresh = HeightSums(fresh_terrain)
    assert sums.buffer.read() == fresh.buffer.read()


def test_bytes_per_post(scene):
    heightmap = Heightmap(hills(400, 300))
    s = scene(heightmap)
    s.draw(Camera.default(heightmap))
    assert s.picture.sums.bytes == 4 * 400 * 300
    # heights 4, lobes 9; the sky 9 sums and 4 words for 2 × 2 cells; the sun 5 sums for 2 × 2 cells, and a horizon
    assert s.picture.bytes <= (4 + 9 + (9 + 4) * 4 / 4 + 5 * 4 / 4 + 2) * 400 * 300


def ridge(by_column):
    """Two flanks of slope 1/2. The crest is the middle column if `by_column`, else the middle row."""
    y, x = np.mgrid[:65, :65]
    return Heightmap((10.0 * (32 - np.abs((x if by_column else y) - 32))).astype("f4"), spacing_m=20.0)


@pytest.mark.parametrize("azimuth", [0, 90, 180, 270])
def test_the_flank_towards_the_sun_is_brighter(scene, azimuth):
    heightmap = ridge(by_column=azimuth in (90, 270))
    s = scene(heightmap, size=(64, 64))
    picture = s.draw(from_above(heightmap, 0.9), sun=(azimuth, 40))[..., :3].astype(float).mean(-1)
    north, south, west, east = (
        picture[20:28].mean(),
        picture[36:44].mean(),
        picture[:, 20:28].mean(),
        picture[:, 36:44].mean(),
    )
    lit, dark = {0: (north, south), 90: (east, west), 180: (south, north), 270: (west, east)}[azimuth]
    assert lit > dark + 20


def test_straight_down_north_is_up_and_east_is_right(scene):
    heights = np.zeros((64, 64), "f4")
    heights[:8, 56:] = 30.0  # the north-eastern corner
    heightmap = Heightmap(heights, spacing_m=10.0)
    camera = Camera((315, 315, 1000), (315, 315, 0), 40)
    s = scene(heightmap, size=(64, 64))
    depth = s.draw(camera, style="depth")[..., 0].astype(int)
    covered = s.picture.coverage()
    rows, cols = np.nonzero((depth >= depth[32, 32] + 2) & covered)
    assert len(rows) > 10 and rows.max() < 20 and cols.min() > 44


def test_normals_are_world_normals(scene):
    y, x = np.mgrid[:33, :33]
    # up 0.5 to the east, down 1 to the north
    heightmap = Heightmap((5.0 * x - 10.0 * (32 - y)).astype("f4"), spacing_m=10.0)
    s = scene(heightmap, size=(33, 33))
    picture = s.draw(from_above(heightmap, 1.0), style="normals")
    normal = np.array([-0.5, 1.0, 1.0]) / 1.5
    assert picture[16, 16, :3] == pytest.approx(255 * (0.5 + 0.5 * normal), abs=1.5)


@pytest.mark.parametrize("tolerance_px", [0.25, 4.0, 40.0])
def test_void_cells_are_holes_exactly(scene, tolerance_px):
    heights = np.zeros((32, 32), "f4")
    heights[0, 0] = 1.0
    heights[10, 12] = heights[31, 31] = heights[20:23, 5:9] = np.nan
    heightmap = Heightmap(heights, spacing_m=10.0)
    s = scene(heightmap, size=(310, 310), samples=1)  # ten pixels a cell
    eye = (155.0, 155.0, 1000.0)
    fov = 2 * np.degrees(np.arctan(155 / 1000))
    s.draw(Camera(eye, (155.0, 155.0, 0.0), fov), tolerance_px, voids="hole")
    void = np.isnan(heights)
    hole = void[:-1, :-1] | void[1:, :-1] | void[:-1, 1:] | void[1:, 1:]
    assert np.array_equal(s.picture.coverage(), ~hole.repeat(10, 0).repeat(10, 1))


def test_shading_does_not_depend_on_the_mesh(scene):
    """Where two meshes show the same place of the map in a pixel, the colour is the same."""
    heightmap = Heightmap(hills(257, 257, relief=60.0), spacing_m=30.0)
    s = scene(heightmap, size=(320, 180), samples=1)
    seen = []
    for tolerance_px in (0.25, 1.0):
        picture = s.draw(Camera.default(heightmap), tolerance_px, grain="off")[..., :3].astype(int)
        places = s.picture.places()[0]
        seen.append((picture, places))
    (fine, place), (coarse, other) = seen
    same = (place[..., 0] >= 0) & (np.abs(place - other).max(-1) < 0.002)
    assert same.sum() > 300
    assert np.abs(fine - coarse)[same].max() <= 3


def test_a_finer_mesh_changes_little(scene):
    heightmap = Heightmap(hills(257, 257, relief=60.0), spacing_m=30.0)
    s = scene(heightmap, size=(320, 180))
    truth, drawn = (s.draw(Camera.default(heightmap), t)[..., :3].astype(int) for t in (0.02, 0.25))
    difference = np.abs(truth - drawn).max(-1)
    assert np.median(difference) <= 1 and (difference > 12).mean() <= 0.02


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, 1), (2, 3), (57, 31)])
def test_any_size_any_style(ctx, scene, sample, size):
    heightmap = Heightmap(hills(64, 65), spacing_m=30.0)
    s = scene(heightmap, size=size)
    for style in sample(STYLES, 3):
        picture = s.draw(Camera.default(heightmap), style=style)
        assert picture.shape == (size[1], size[0], 4) and picture.dtype == np.uint8 and np.all(picture[..., 3] == 255)
        assert np.array_equal(s.draw(Camera.default(heightmap), style=style), picture), style
        assert ctx.error == "GL_NO_ERROR", style


def test_resizing(scene):
    heightmap = Heightmap(hills(64, 65), spacing_m=30.0)
    s = scene(heightmap, size=(80, 45))
    before = s.draw(Camera.default(heightmap))
    for s.size in ((33, 20), (80, 45)):
        s.picture.resize(s.size)
        after = s.draw(Camera.default(heightmap))
        s.draw(Camera.default(heightmap), style="lod")
    assert np.array_equal(before, after)


@pytest.mark.slow
@pytest.mark.parametrize(
    "heights",
    [
        np.zeros((5, 7), "f4"),
        np.full((3, 3), 8848.0, "f4"),
        np.array([[0, 1], [2, np.nan]], "f4"),
        hills(9, 300) * 1e-6,
    ],
    ids=["flat", "high", "2x2", "tiny"],
)
def test_odd_maps_and_suns(ctx, scene, sample, heights):
    heightmap = Heightmap(heights, spacing_m=1.0)
    s = scene(heightmap, size=(40, 30))
    for style in sample(STYLES, 4):
        s.draw(Camera.default(heightmap), style=style)
    for sun in ((0, 90), (123, 0), (200, -30)):
        s.draw(Camera.default(heightmap), sun=sun)
    assert ctx.error == "GL_NO_ERROR"


def test_no_pixel_is_nan(ctx, scene):
    """Colours are written as floats here, where a NaN would be seen."""
    heights = hills(64, 64)
    heights[10:12, 10:12] = np.nan
    heightmap = Heightmap(heights, spacing_m=30.0)
    s = scene(heightmap)
    for camera in (Camera.default(heightmap), from_above(heightmap)):
        s.draw(camera)
        for kind in ("ANY", "NEAR"):
            pixels = s.picture.note("shade/shaded.frag", 4, "f4", kind=kind)
            assert np.all(np.isfinite(pixels)) and pixels.min() >= -0.01 and pixels.max() <= 1.01


def test_error_style_stays_below_the_tolerance(scene):
    heightmap = Heightmap(hills(129, 129), spacing_m=30.0)
    s = scene(heightmap, size=(320, 180))
    picture = s.draw(Camera.default(heightmap), 2.0, style="error")
    beyond = (picture[..., 0] < 5) & (picture[..., 1] > 220) & (picture[..., 2] > 250)
    assert not beyond.any()


@pytest.mark.slow
def test_egl_and_osmesa_give_the_same_bytes():
    heightmap = Heightmap(hills(129, 100), spacing_m=30.0)
    pictures = []
    try:
        contexts = [create_context(backend) for backend in ("egl", "osmesa")]
    except TerrainError as error:
        pytest.skip(str(error))
    must_be_one_driver(*contexts)
    for context in contexts:
        with context:
            s = Scene(context, heightmap)
            pictures.append([s.draw(Camera.default(heightmap), style=style) for style in ("shaded", "error")])
        context.release()
    assert all(np.array_equal(a, b) for a, b in zip(*pictures, strict=True))


def test_show_copies_the_picture(ctx, scene):
    heightmap = Heightmap(hills(64, 65), spacing_m=30.0)
    s = scene(heightmap, size=(80, 46))
    picture = s.draw(Camera.default(heightmap))
    for size in ((80, 46), (40, 23)):
        target = ctx.simple_framebuffer(size)
        s.picture.show(target)
        shown = np.frombuffer(target.read(components=4, alignment=1), "u1").reshape(size[1], size[0], 4)[::-1]
        assert np.abs(shown[..., :3].mean((0, 1)) - picture[..., :3].mean((0, 1))).max() < 2
        if size == (80, 46):
            assert np.array_equal(shown, picture)
        ctx.detect_framebuffer(0).use()
        target.release()


def weights(kernel, drawn, shown):
    """(shown, drawn) weights of drawn pixels in shown ones; beyond the rim the rim is repeated."""
    at, rows = (np.arange(shown) + 0.5) * drawn / shown - 0.5, np.zeros((shown, drawn))
    for k in range(-1, 3):
        column = np.floor(at).astype(int) + k
        np.add.at(rows, (np.arange(shown), np.clip(column, 0, drawn - 1)), kernel(np.abs(at - column)))
    return rows


def keys(t):
    """Keys 1981, equation 15."""
    return np.where(t < 1, 1 + t * t * (1.5 * t - 2.5), 2 + t * (-4 + t * (2.5 - 0.5 * t)))


@pytest.mark.slow
def test_a_small_picture_is_enlarged_by_cubic_convolution(ctx, scene):
    """The corners of the kernel are left out, so it is not quite the same; linear enlargement is much further off."""
    heightmap = Heightmap(hills(64, 65), spacing_m=30.0)
    s = scene(heightmap, size=(80, 46))
    drawn = s.draw(Camera.default(heightmap))[..., :3].astype(float)
    target = ctx.simple_framebuffer((240, 138))
    s.picture.show(target)
    shown = np.frombuffer(target.read(components=3, alignment=1), "u1").reshape(138, 240, 3)[::-1].astype(float)
    ctx.detect_framebuffer(0).use()
    target.release()

    def off(kernel):
        down, across = weights(kernel, 46, 138), weights(kernel, 80, 240)
        return np.sqrt(np.mean((shown - np.clip(np.einsum("ij,jkc,lk->ilc", down, drawn, across), 0, 255)) ** 2))

    assert off(keys) < 0.8 and off(keys) < 0.4 * off(lambda t: np.maximum(1 - t, 0))


def test_memory_is_given_back(ctx):
    heightmap = Heightmap(hills(64, 65), spacing_m=30.0)
    s = Scene(ctx, heightmap)
    s.draw(Camera.default(heightmap), style="lod")
    s.picture.release()
    with pytest.raises((moderngl.Error, AttributeError)):
        s.picture.read()
