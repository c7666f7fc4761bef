"""Visibility: horizons against ray marching, shares of lobes and of the sun, sums, edits, maps of any size."""

import math

import numpy as np
import pytest
from asking import ask
from maps import MAPS, rough

from terrain_gl import reference
from terrain_gl.files.maps import bundled
from terrain_gl.heightmap import Heightmap
from terrain_gl.light import horizon
from terrain_gl.light.ground import towards_sun
from terrain_gl.light.horizon import SUN_RADIUS, TEXEL, SkyVisibility, SunVisibility, Sweep, Visibility
from terrain_gl.terrain import Terrain

AXES = np.array([[0, 0, 1], [0.9, 0, 0.436], [-0.3, -0.8, 0.52], [0, 0.98, 0.2]])
AXES = AXES / np.linalg.norm(AXES, axis=1, keepdims=True)
SHARPNESS = np.array([4.0, 8.0, 6.0, 8.0])
STEPS = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, -0.5), (-0.5, 1), (-1, 0.37), (0.8, -1), (1, 1)]


def swept(ctx, heightmap, towards):
    """Sines of horizons of the points where lines cross the map, (rows, cols), and those points (rows, cols, 2)."""
    terrain = Terrain(ctx, heightmap)
    records = horizon.horizon_texture(terrain, 1)
    Sweep(ctx).run(terrain, towards, records)
    sines = np.frombuffer(records.read(), "u2").reshape(heightmap.rows, heightmap.cols) / 32767.5 - 1
    return sines, line_points(heightmap, towards)


def line_points(heightmap, towards):
    y, x = np.indices((heightmap.rows, heightmap.cols)).astype(float)
    along, across, slide = (x, y, -towards[1]) if abs(towards[0]) >= abs(towards[1]) else (y, x, -towards[0])
    ahead = towards[0] if abs(towards[0]) >= abs(towards[1]) else towards[1]
    drift = slide * (along.max() - along if ahead > 0 else along)
    across += drift - np.floor(drift + 0.5)
    last = (heightmap.rows if across is y else heightmap.cols) - 1
    np.clip(across, 0, last, out=across)
    return np.stack([x, y], -1)


def generated_crop():
    canyon = bundled()["canyon-15m"]
    form = {"spacing_m": canyon.spacing_m, "z_scale": canyon.z_scale, "z_offset_m": canyon.z_offset_m}
    return piece(Heightmap.open(canyon.path, **form), 300, 420)


def real_crop(dem):
    """The steepest piece of 65 × 65 posts without voids."""
    return piece(Heightmap.open(dem / "mt_rainier_90m.tif", spacing_m=(64, 93)), 0, 582)


def piece(heightmap, row, col, n=65):
    heights = np.ascontiguousarray(heightmap.heights[row : row + n, col : col + n])
    assert np.isfinite(heights).all()
    return Heightmap(heights, heightmap.spacing_m)


@pytest.mark.parametrize("towards", STEPS)
@pytest.mark.parametrize("name", ["hills", "cliff", "odd"])
def test_horizons_are_those_of_marching(ctx, name, towards):
    heightmap = {"hills": Heightmap(rough(64, 64, 3, 200), 20.0)}.get(name) or MAPS[name]()
    sines, points = swept(ctx, heightmap, towards)
    truth = reference.horizon_sines(heightmap.heights, points, towards, heightmap.spacing_m)
    off = np.degrees(np.abs(np.arcsin(np.clip(sines, -1, 1)) - np.arcsin(truth)))
    sees_land = (truth > -1) & (sines > -1)
    # along columns and rows both are equal; an oblique line reads the ground where it crosses columns, not the bilinear
    # surface in between: they differ by up to a quarter of the cells' twist, 1.5 m in 28 here
    straight = 0 in towards
    assert off[sees_land].max() < 0.01 if straight else off[sees_land].mean() < 1.0
    assert np.mean((truth > -1) != (sines > -1)) <= (0 if straight else 2 * sum(sines.shape) / sines.size)


@pytest.mark.parametrize("towards", STEPS)
def test_a_plane_has_its_own_slope_as_horizon(ctx, towards):
    heightmap = MAPS["plane"]()
    sines, _ = swept(ctx, heightmap, towards)
    run = math.hypot(*towards) * 5.0
    slope = (0.37 * towards[0] - 0.21 * towards[1]) / run
    expected = slope / math.hypot(1, slope)
    lands = sines > -1
    assert np.allclose(sines[lands], expected, atol=1e-4)  # sines are stored in steps of 3e-5
    assert lands.sum() >= (heightmap.rows - 1) * (heightmap.cols - 1) * 0.98


@pytest.mark.parametrize("size", [(2, 2), (2, 9), (31, 2), (3, 1000), (65, 130)])
def test_any_size_of_map_is_swept_and_summed(ctx, size):
    heightmap = Heightmap(rough(*size, seed=4, relief=60.0), (12.0, 30.0))
    terrain = Terrain(ctx, heightmap)
    sky, sun = SkyVisibility(terrain, AXES, SHARPNESS), SunVisibility(terrain)
    sky.build()
    sun.follow(towards_sun(200, 30))
    shape = (len(AXES), -(-(size[0] - 1) // TEXEL), -(-(size[1] - 1) // TEXEL))
    assert sky.read().shape == shape and sun.read().shape == (5, size[0] // 2, size[1] // 2)
    assert sky.read().min() >= 0 and sky.read().max() <= 1
    assert sun.read()[0].min() >= 0 and sun.read()[0].max() <= 1


def test_flat_ground_sees_all_of_the_sky(ctx):
    terrain = Terrain(ctx, MAPS["constant"]())
    sky, sun = SkyVisibility(terrain, AXES, SHARPNESS), SunVisibility(terrain)
    sky.build()
    assert sky.read().min() > 0.995
    sun.follow(towards_sun(120, 40))
    assert np.allclose(sun.read()[0], math.sin(math.radians(40)), atol=1 / 8191)
    assert not sun.read()[1:].any()


def test_the_sun_overhead_hides_behind_nothing(ctx):
    sun = SunVisibility(Terrain(ctx, heightmap := MAPS["odd"]()))
    sun.follow((0.0, 0.0, 1.0))
    up = reference.normals_of(heightmap.heights, heightmap.spacing_m)[..., 2]
    assert np.allclose(sun.read()[0], blocks(up), atol=1e-3)


def test_half_a_sun_stands_on_a_level_horizon(ctx):
    heights = np.zeros((5, 400))
    heights[:, -1] = 1000 * math.tan(math.radians(20.0))  # a wall in the east, 20 degrees high at 1 km
    sun = SunVisibility(Terrain(ctx, Heightmap(heights, 10.0)))
    sun.follow(towards_sun(90, 20.0))
    at_1_km = sun.read()[0, :, (399 - 101) // 2].mean()  # the two cells on either side of it
    assert at_1_km == pytest.approx(0.5 * math.sin(math.radians(20)), abs=0.03)
    assert sun.read()[0, :, 170:195].max() == 0 and sun.read()[0, :, :125].min() == pytest.approx(0.342, abs=1e-3)


def blocks(cells):
    """Means over blocks of 2 × 2 cells, fewer at the rim."""
    padded = np.pad(cells, [(0, n % 2) for n in cells.shape], constant_values=np.nan)
    return np.nanmean(padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2), (1, 3))


def assert_visibility(ctx, heightmap):
    """Mean absolute errors of the visible fractions of the sky and of two suns, cosine-weighted, are at most 0.03."""
    terrain = Terrain(ctx, heightmap)
    sky, sunlight = SkyVisibility(terrain, AXES, SHARPNESS), SunVisibility(terrain)
    sky.build()
    shares = sky.read().repeat(TEXEL, 1).repeat(TEXEL, 2)[:, : heightmap.rows - 1, : heightmap.cols - 1]
    lit = [reference.skylit(heightmap.heights, a, s, heightmap.spacing_m) for a, s in zip(AXES, SHARPNESS, strict=True)]
    got, of_all = (np.array(each) for each in zip(*lit, strict=True))
    of_sky = (shares * of_all).sum(0) / of_all.sum(0), got.sum(0) / of_all.sum(0)
    assert np.abs(of_sky[0] - of_sky[1]).mean() <= 0.03
    faces = reference.normals_of(heightmap.heights, heightmap.spacing_m)
    for sun in (towards_sun(300, 12), towards_sun(300, 35)):
        sunlight.follow(sun)
        towards = horizon.lattice_direction(sun, heightmap.spacing_m)
        truth = reference.sunlit(heightmap.heights, sun, SUN_RADIUS, towards, heightmap.spacing_m)
        cosines = (faces @ np.array(sun)).clip(0)
        assert np.abs(sunlight.read()[0] - blocks(truth)).sum() / blocks(cosines).sum() <= 0.03


def test_the_sky_is_swept_over_every_second_post(ctx):
    """No other height changes the sky. The sun's horizon follows every post."""
    heights = rough(41, 62, 3, 200)
    other = heights + 50
    other[::2, ::2] = heights[::2, ::2]
    other[::2, -1] = heights[::2, -1]  # 62 columns: the last post takes the place of one beyond the map
    tables = [Visibility(Terrain(ctx, Heightmap(h, 20.0)), AXES, SHARPNESS) for h in (heights, other)]
    for each in tables:
        each.follow(towards_sun(250, 15))
    one, two = tables
    assert np.array_equal(one.sky.read(), two.sky.read())
    assert not np.array_equal(one.sun.read(), two.sun.read())
    assert one.sky.read().shape == (len(AXES), 20, 31)


@pytest.mark.slow
def test_visible_fractions_of_generated_land(ctx):
    assert_visibility(ctx, generated_crop())


@pytest.mark.slow
def test_visible_fractions_of_real_land(ctx, dem):
    assert_visibility(ctx, real_crop(dem))


def test_visibility_without_a_cosine_as_the_paper_has_it(ctx):
    """Equation A.5 for the sky's lobes; our values differ, as they are weighted by the cosine."""
    heightmap = Heightmap(rough(31, 35, seed=5, relief=80.0), (12.0, 10.0))
    terrain, spacing = Terrain(ctx, heightmap), heightmap.spacing_m
    printed, ours = (SkyVisibility(terrain, AXES, SHARPNESS, step) for step in (1, 0))
    for sky in (printed, ours):
        sky.build()
    truth = [reference.visible_shares(heightmap.heights, a, s, spacing) for a, s in zip(AXES, SHARPNESS, strict=True)]
    texels = np.reshape(truth, (len(AXES), 15, TEXEL, 17, TEXEL)).mean((2, 4))
    assert np.abs(printed.read() - texels).mean() <= 0.03 < np.abs(ours.read() - texels).mean()


def test_a_sun_without_a_cosine_as_the_paper_has_it(ctx):
    """Like the half sun on a level horizon above, but its share alone."""
    heights = np.zeros((5, 400))
    heights[:, -1] = 1000 * math.tan(math.radians(20.0))
    sun = SunVisibility(Terrain(ctx, Heightmap(heights, 10.0)), 1)
    sun.follow(towards_sun(90, 20.0))
    # the tolerance of 0.03 above is for the share times the cosine, 0.342; here it is for the share alone
    assert sun.read()[0, :, (399 - 101) // 2].mean() == pytest.approx(0.5, abs=0.088)
    assert sun.read()[0, :, 170:195].max() == 0 and sun.read()[0, :, :125].min() == pytest.approx(1.0, abs=1e-3)


def test_shares_of_a_valley_are_those_of_its_horizons(ctx):
    """Between two endless walls the horizon of every azimuth is known without rays and tables."""
    # a V along east-west, slopes of 45 degrees
    heights = np.tile(np.abs(np.arange(91) - 45)[:, None] * 10.0, (1, 1501))
    terrain = Terrain(ctx, Heightmap(heights, 10.0))
    sky = SkyVisibility(terrain, np.array([[0.0, 0.0, 1.0]]), np.array([1e-6]))
    sky.build()
    # two walls of equal width at a right angle: each sees the other in 1 - sin 45 degrees of its view (Hottel's crossed
    # strings)
    expected = math.sin(math.radians(45))
    middle = sky.read()[0, :, 250]
    assert middle.mean() == pytest.approx(expected, abs=0.02)


def test_an_edit_makes_the_tables_that_a_new_map_has(ctx):
    before, after = rough(70, 90, 1, 200), rough(70, 90, 1, 200)
    after[20:30, 40:45] += 90
    terrain, other = Terrain(ctx, Heightmap(before, 20.0)), Terrain(ctx, Heightmap(after, 20.0))
    edited, fresh = (Visibility(t, AXES, SHARPNESS) for t in (terrain, other))
    sun = towards_sun(250, 15)
    edited.follow(sun)
    edited.update(terrain.edit(40, 20, after[20:30, 40:45]))
    edited.follow(sun)
    fresh.follow(sun)
    assert np.array_equal(edited.sky.read(), fresh.sky.read())
    assert np.array_equal(edited.sun.read(), fresh.sun.read())


def test_moving_the_sun_leaves_the_sky_alone_and_is_not_done_twice(ctx, monkeypatch):
    visibility = Visibility(Terrain(ctx, MAPS["odd"]()), AXES, SHARPNESS)
    built = []
    for part, steps in (("sun", "follow_steps"), ("sky", "build_steps")):
        monkeypatch.setattr(getattr(visibility, part), steps, lambda *_, of=part: built.append(of) or iter(()))
    for elevation in (10, 10, 20):
        visibility.follow(towards_sun(100, elevation))
    assert built == ["sun", "sky", "sun"]


@pytest.mark.parametrize("posts", [1, 700, 10**9])
def test_tables_made_in_portions_are_those_made_in_one(ctx, posts):
    terrain, sun = Terrain(ctx, MAPS["odd"]()), towards_sun(250, 15)
    whole, parts = (Visibility(terrain, AXES, SHARPNESS) for _ in range(2))
    whole.follow(sun)
    shares = list(parts.follow_steps(sun, posts=posts))
    assert shares == sorted(shares) and shares[0] > 0 and shares[-1] == 1
    assert np.array_equal(parts.sky.read(), whole.sky.read())
    assert np.array_equal(parts.sun.read(), whole.sun.read())


def test_progress_goes_from_nothing_to_all(ctx):
    told = list(SkyVisibility(Terrain(ctx, MAPS["two"]()), AXES, SHARPNESS).build_steps())
    assert told == sorted(told) and 0 < told[0] < 0.1 and told[-1] == 1 and len(told) > 10


STATEMENTS = """
    vec2 post = a.xy, extent = a.zw;
    float here = 0.7 * sun_share(post, vec2(0.0));
    float over = sun_over(post, extent, vec2(0.0));
    float aslant = sun_over(post, extent, vec2(0.4, -0.3));
    return vec4(sky_visible(1, post, extent), here, over, aslant);
"""


def ask_visible(ctx, visibility, questions):
    """Results (n, 4) of horizon/visible.glsl: a sky lobe; the sun at a place, over a footprint, and seen obliquely."""
    read = {**visibility.sky.terrain.resources, **visibility.resources, "Lobes": visibility.sky.buffer}  # not used
    given = {"defines": visibility.defines, "resources": read, "uniforms": visibility.uniforms}
    return ask(ctx, "horizon/visible.glsl", STATEMENTS, questions, **given)


def test_lookups_are_means_over_boxes(ctx):
    heightmap = Heightmap(rough(64, 97, 8, 500), (20.0, 25.0))
    visibility = Visibility(Terrain(ctx, heightmap), AXES, SHARPNESS)
    visibility.follow(towards_sun(60, 20))
    rng = np.random.default_rng(3)
    extents = 6 * rng.integers(1, 4, (40, 2))  # whole blocks, of 2, and whole texels, of 3
    posts = 6 * rng.integers(2, 7, (40, 2)) + extents / 2
    answers = ask_visible(ctx, visibility, np.concatenate([posts, extents], 1))
    sky, sun = visibility.sky.read()[1], visibility.sun.read()
    for (x, y), (w, h), answer in zip(posts, extents, answers, strict=True):
        box = [(int(c - e / 2), int(c + e / 2)) for c, e in ((y, h), (x, w))]
        texels, halves = (tuple(slice(a // n, b // n) for a, b in box) for n in (TEXEL, 2))
        assert answer[0] == pytest.approx(sky[texels].mean(), abs=1e-5)
        light, *of_slope, east, north = (layer[halves].mean() for layer in sun)
        assert answer[2] == pytest.approx(light, abs=1e-5)
        together = np.array(of_slope) - light * np.array([east, north])  # in units of a slope of 4
        assert answer[3] == pytest.approx(np.clip(light - 4 * together @ [0.4, -0.3], 0, 1), abs=1e-4)


def test_what_the_eye_sees_is_weighted_by_projected_area(ctx):
    """Ridges with one side in the sun, one in shade: from above one sees half of each, from the side only one."""
    heights = np.tile(np.abs(np.arange(121) % 8 - 4.0), (81, 1))  # slopes of 1 and -1, east and west
    visibility = Visibility(Terrain(ctx, Heightmap(heights, 1.0)), AXES, SHARPNESS)
    visibility.follow(towards_sun(90, 45))  # in the east: slopes of -1 face it
    kernel_answers = ask_visible(ctx, visibility, np.array([[60.0, 40.0, 48.0, 48.0]]))
    assert kernel_answers[0, 2] == pytest.approx(0.5, abs=0.01)
    # with lean 0.4 to the east, slopes of -1 weigh 1.4 and slopes of 1 weigh 0.6
    assert kernel_answers[0, 3] == pytest.approx(0.7, abs=0.01)


def test_lookups_are_continuous_and_defined_everywhere(ctx):
    heightmap = Heightmap(rough(40, 60, 8, 500), 20.0)
    visibility = Visibility(Terrain(ctx, heightmap), AXES, SHARPNESS)
    visibility.follow(towards_sun(60, 20), radius=math.radians(3))
    along = np.linspace(-5, 65, 7001)
    for extent in (0.01, 2.0, 2.9, 7.3, 5000.0):
        line = np.stack([along, 0.6 * along, np.full(7001, extent), np.full(7001, extent)], -1)
        answers = ask_visible(ctx, visibility, line)
        assert np.isfinite(answers).all() and answers.min() >= 0 and answers.max() <= 1 + 1e-5
        assert np.abs(np.diff(answers, axis=0)).max() < 0.05  # a step of 0.01 posts
    low = ask_visible(ctx, visibility, np.array([[30.0, 20.0, e, e] for e in np.linspace(0.01, 30, 6000)]))
    assert np.abs(np.diff(low, axis=0)).max() < 0.01


def test_tables_stay_within_their_share_of_memory(ctx):
    heightmap = Heightmap(rough(301, 301, 2), 20.0)
    visibility = Visibility(Terrain(ctx, heightmap), np.tile(AXES, (3, 1)), np.tile(SHARPNESS, 3))
    # sky: 12 sums and 4 words of shares for 2 × 2 cells, sun: 5 sums for 2 × 2, and a horizon of two bytes
    assert visibility.bytes / heightmap.heights.size < (12 + 4) * 4 / 4 + 5 * 4 / 4 + 2 + 0.1
