"""The ground's merged lobes: tables against integration, any footprint, edits, and the shaded result."""

import os

import numpy as np
import pytest
from asking import ask
from hypothesis import given, settings
from hypothesis import strategies as st
from test_shade import hills

from terrain_gl import reference
from terrain_gl.camera import Camera
from terrain_gl.gpu import shaders
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.light import sky
from terrain_gl.light.ground import HeightSums
from terrain_gl.light.lighting import Lighting
from terrain_gl.light.lobes import Cover, LobeTables
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import Look
from terrain_gl.terrain import Terrain


@pytest.fixture
def tables(ctx):
    def make(heightmap, albedo=None):
        terrain = Terrain(ctx, heightmap)
        sums, cover = HeightSums(terrain), Cover(terrain)
        cover.take_picture(albedo)
        return LobeTables(terrain, sums, cover)

    return make


GREY = np.full((1, 1, 3), 0.5)


@pytest.mark.parametrize("size", [(2, 2), (3, 5), (37, 64), (130, 71)])
def test_recorded_values(tables, size):
    """Blocks of 2 × 2 cells: as reference.lobe_values computes them, but for rounding to 2^-15."""
    heightmap = Heightmap(hills(*size), spacing_m=(30.0, 20.0))
    values = tables(heightmap, GREY).read()
    expected = reference.lobe_values(heightmap.heights, heightmap.spacing_m, 0.5, 0.8)
    assert values.shape == expected.shape
    assert values == pytest.approx(expected, abs=1.5 / 32767 + 1e-4)  # and the GPU's normalize and half floats


def asked(ctx, lobes, questions):
    statements = "Merged m = merged_over(a.xy, a.zw); return vec4(m.normal, m.albedo.x);"
    unused = {"Shares": lobes.buffer, "Sunlit": lobes.buffer, "HeightSums": lobes.buffer}  # the file declares them, too
    read = {**lobes.terrain.resources, "Lobes": lobes.buffer, **unused}
    return ask(ctx, "light/merged.glsl", statements, questions, resources=read)


@pytest.mark.parametrize("size", [(9, 12), (37, 64), (130, 71)])
def test_means_over_any_box(ctx, tables, size):
    heightmap = Heightmap(hills(*size), spacing_m=30.0)
    lobes = tables(heightmap, GREY)
    rng = np.random.default_rng(2)
    posts = rng.uniform(0, 1, (200, 2)) * [size[1] - 1, size[0] - 1]
    questions = np.concatenate([posts, rng.uniform(2, 60, (200, 2))], 1)
    values = lobes.read()
    for question, answer in zip(questions, asked(ctx, lobes, questions), strict=True):
        half = np.maximum(question[2:], 2) / 4
        shape = np.array([size[1] // 2, size[0] // 2])
        a = np.clip(question[:2] / 2 - half, 0, shape - 0.5)
        c = np.clip(question[:2] / 2 + half, 0.5, shape)
        mean = [reference.box_mean(layer, a, c) for layer in values]
        assert answer[3] == pytest.approx(mean[6], abs=2e-4)
        assert answer[:3] == pytest.approx(np.array(mean[:3]) / mean[6], abs=2e-3)


def test_boxes_stay_exact_far_into_a_large_map(ctx, tables):
    y, x = np.mgrid[:1400, :1500]
    heightmap = Heightmap((3.0 * x - 4.0 * y).astype("f4"), spacing_m=10.0)
    lobes = tables(heightmap, GREY)
    questions = np.array([[1450, 1350, 20, 20], [1450.3, 1349.7, 90, 7], [700, 900, 500, 500]])
    normal = np.array([-0.3, -0.4, 1.0]) / np.sqrt(1.25)
    for answer in asked(ctx, lobes, questions):
        assert answer[:3] == pytest.approx(normal, abs=2e-4)


def test_an_edit_equals_a_rebuild(ctx):
    heights = hills(90, 110)
    heights[0, :2] = -5000, 5000  # the span stays
    terrain = Terrain(ctx, Heightmap(heights))
    sums, cover = HeightSums(terrain), Cover(terrain)
    lobes = LobeTables(terrain, sums, cover)
    edited = heights.copy()
    edited[40:45, 50:57] += 7
    rect = terrain.edit(50, 40, edited[40:45, 50:57])
    sums.update(rect)
    lobes.update(rect)
    fresh_terrain = Terrain(ctx, Heightmap(edited))
    fresh_sums = HeightSums(fresh_terrain)
    fresh = LobeTables(fresh_terrain, fresh_sums, cover)
    assert lobes.buffer.read() == fresh.buffer.read()


def test_tables_follow_the_look(ctx):
    """The kernel has macros for one look: with another look, it is another kernel."""
    terrain = Terrain(ctx, Heightmap(hills(40, 50), spacing_m=30.0))
    sums, cover = HeightSums(terrain), Cover(terrain)
    tables, before = LobeTables(terrain, sums, cover), {}
    for look in ("alpine", "arid", "tint", "viridis", "alpine"):
        cover.take_look(look)
        tables.build()
        assert tables.buffer.read() == LobeTables(terrain, sums, cover).buffer.read()
        assert before.setdefault(look, tables.buffer.read()) == tables.buffer.read()
    assert len(set(before.values())) == 4


@pytest.mark.parametrize("rough", [0.0, 40.0], ids=["plain", "hills"])
def test_white_furnace(ctx, monkeypatch, rough):
    """White land without shadows, lit equally from all directions, reflects all the light it receives, within 1 %."""
    uniform = sky.Sky(np.ones((*sky.SHAPE, 3)), sky.NO_SUN)
    monkeypatch.setattr("terrain_gl.light.lighting.sky_seen", lambda *_: uniform)
    monkeypatch.setattr("terrain_gl.light.lighting.exposure", lambda sky: 1.0)
    read = shaders._read

    def unexposed(path, included_from):  # the light itself, before tone mapping and the sRGB curve
        text = read(path, included_from).replace(
            "tone_mapped(2.0 * u_exposure * lit_ground(g).ambient)", "lit_ground(g).ambient"
        )
        return text.replace("#define SHOWN srgb_encoded\n", "")

    monkeypatch.setattr(shaders, "_read", unexposed)
    for name in ("_lines", "_body"):  # without their caches
        monkeypatch.setattr(shaders, name, getattr(shaders, name).__wrapped__)
    heightmap = Heightmap(hills(129, 129, relief=rough), spacing_m=30.0)
    with Renderer(heightmap, size=(160, 90), ctx=ctx) as renderer:
        picture = renderer.picture
        renderer.draw(Camera.default(heightmap), style="ambient")
        light = picture.note("shade/ambient.frag", 4, "f4")[..., 0]
        land = picture.coverage()
        assert land.sum() > 2000
        assert light[land].min() > 0.99 and light[land].max() < 1.01


LANDS = {
    "flat": lambda: np.zeros((17, 19)),
    "step": lambda: np.repeat([[0.0], [1000.0]], 9, 0) * np.ones((1, 19)),
    "spike": lambda: np.where(np.arange(17 * 19).reshape(17, 19) == 150, 1e4, 0.0),
    "noise": lambda: np.random.default_rng(0).random((17, 19)) * 100,
    "void": lambda: np.where(np.random.default_rng(0).random((17, 19)) < 0.1, np.nan, 3.0),
}


@pytest.mark.slow
@pytest.mark.parametrize(("land", "spacing"), list(zip(LANDS, (1.0, 0.01, 30.0, 1000.0, 10.0), strict=True)))
def test_no_pixel_is_ever_nan(ctx, land, spacing):
    """For any land, sun and water. Colours are written as floats here, where a NaN would be seen."""
    heightmap = Heightmap(LANDS[land]().astype("f4"), spacing_m=spacing)
    cameras = Camera.default(heightmap), Camera((0, 0, 5 * spacing + 2e4), (spacing, spacing, 0))
    with Renderer(heightmap, size=(32, 18), ctx=ctx) as renderer:
        picture = renderer.picture
        texture = ctx.texture((32, 18), 4, dtype="f4")
        picture.targets.screen.release()
        picture.targets.screen = ctx.framebuffer([texture])
        picture.targets._made[-1] = picture.targets.screen

        @given(
            st.tuples(st.floats(-360, 360, width=16), st.one_of(st.floats(-90, 90, width=16), st.just(0.0))),
            st.sampled_from([None, -1e6, 0.5, 1e6]),
            st.sampled_from(["shaded", "direct", "lobes"]),
            st.sampled_from(cameras),
        )
        @settings(max_examples=8)
        def check(sun, water, style, camera):
            renderer.draw(camera, style=style, sun=sun, water_m=water)
            pixels = np.frombuffer(texture.read(), "f4")
            assert np.all(np.isfinite(pixels)) and pixels.min() >= -0.01 and pixels.max() <= 1.01

        check()
        texture.release()


def test_a_picture_of_the_ground_lies_as_the_map_does(tmp_path, ctx):
    """The north-eastern quarter is red: seen from above it is up and to the right."""
    colours = np.full((64, 64, 3), 128, "u1")
    colours[:32, 32:] = 250, 20, 20
    write_image(tmp_path / "ground.png", colours)
    heightmap = Heightmap(np.zeros((65, 65), "f4"), spacing_m=10.0)
    camera = Camera((320, 320, 2000), (320, 320, 0), 15)
    with Renderer(heightmap, size=(64, 64), ctx=ctx) as renderer:
        picture = renderer.render(camera, material=str(tmp_path / "ground.png"), sun=(90, 60)).image.astype(int)
    red = picture[..., 0] - picture[..., 1]
    assert red[8:24, 40:56].min() > 40 > 20 > np.abs(red[40:56]).max()


def test_pictures_that_change_under_their_name_are_read_anew(tmp_path, ctx):
    ground, dome = str(tmp_path / "ground.png"), str(tmp_path / "sky.exr")
    heightmap, camera = Heightmap(np.zeros((33, 33), "f4"), spacing_m=10.0), Camera((160, 160, 900), (160, 160, 0), 15)
    seen = []
    with Renderer(heightmap, size=(16, 16), ctx=ctx) as renderer:
        for colour, light in ((200, 0.5), (40, 0.5), (40, 3.0)):
            write_image(ground, np.full((8, 8, 3), colour, "u1"))
            write_image(dome, np.full((32, 64, 3), [light, 0.5, 0.5], "f4"))
            os.utime(ground, ns=(0, len(seen)))  # clocks of files may be coarse
            os.utime(dome, ns=(0, len(seen)))
            seen.append(renderer.render(camera, material=ground, sky=dome).image[8, 8].astype(int))
    assert seen[0][1] > seen[1][1] + 20 and seen[2][0] - seen[2][1] > seen[1][0] - seen[1][1] + 20


def test_water_covers_what_lies_below_it(ctx):
    y, x = np.mgrid[:65, :65]
    heightmap = Heightmap((x - 32.0).astype("f4"), spacing_m=10.0)  # rises to the east through 0
    camera = Camera((320, 320, 2000), (320, 320, 0), 15)
    with Renderer(heightmap, size=(64, 64), ctx=ctx) as renderer:
        dry = renderer.render(camera, sun=(180, 50)).image.astype(int)
        wet = renderer.render(camera, sun=(180, 50), water_m=0.0).image.astype(int)
    changed = np.abs(wet - dry).max(-1) > 12
    assert changed[:, :28].mean() > 0.95 and not changed[:, 36:].any()


@pytest.mark.slow
def test_light_does_not_depend_on_what_was_drawn_before(ctx):
    heightmap = Heightmap(hills(65, 65, relief=60.0), spacing_m=30.0)
    camera = Camera.default(heightmap)
    with Renderer(heightmap, size=(64, 36), ctx=ctx) as renderer:
        first = renderer.render(camera, sun=(250, 20)).image
        renderer.render(camera, sun=(90, -5), water_m=3.0)
        assert np.array_equal(renderer.render(camera, sun=(250, 20)).image, first)


def test_memory_of_all_light_is_at_most_33_bytes_a_post(ctx):
    heightmap = Heightmap(hills(400, 300), spacing_m=30.0)
    with Renderer(heightmap, size=(16, 9), ctx=ctx) as renderer:
        renderer.draw(Camera.default(heightmap), style="lambert")
        sums_of_heights = 4 * 400 * 300
        assert 0 <= renderer.resources.gpu_bytes["shade"] - sums_of_heights < 100  # no light has been made
        renderer.draw(Camera.default(heightmap))
        lighting = renderer.picture.lighting
        assert isinstance(lighting, Lighting) and lighting.lobes
        assert renderer.picture.bytes == renderer.resources.gpu_bytes["shade"] <= 33 * 400 * 300
        assert lighting.lobes.bytes == 9 * 400 * 300


def test_looks_are_values():
    assert Look() == Look() and hash(Look(sun=(1.0, 2.0))) == hash(Look(sun=(1.0, 2.0)))
