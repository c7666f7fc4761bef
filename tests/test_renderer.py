"""The renderer: frames, edits, sizes and contexts in any order."""

import ctypes
import itertools
import re
from collections import deque

import moderngl
import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.basics.steps import drain
from terrain_gl.comparison.curves import details_of
from terrain_gl.gpu import gl, layout
from terrain_gl.gpu.packing import MOST_SPANS
from terrain_gl.heightmap import MAX_HEIGHT_M
from terrain_gl.shade.picture import UNLIT, Look

SIZE = (64, 48)


@pytest.fixture
def heightmap():
    rng = np.random.default_rng(3)
    return tg.Heightmap(np.cumsum(rng.normal(size=(65, 97)), 1), (20.0, 30.0), "ridges")


@pytest.fixture
def kept_units(monkeypatch):
    """Maps in memory keep their units as long as stores do."""
    monkeypatch.setattr("terrain_gl.terrain.terrain.KEPT_SPANS", MOST_SPANS)


def read_tables(renderer):
    return [getattr(renderer.tables, name).read() for name in ("nodes", "ranges", "counters", "squares")]


def test_drawn_height_is_the_truth_at_full_resolution(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        r.draw(tg.Camera((960, 960, 5000), (960, 960, 0)), method="full", style=UNLIT)
        for row, col in ((10, 20), (33, 5), (60, 90)):
            x, y = col * 20.0, (64 - row) * 30.0
            assert r.height_at(x, y) == pytest.approx(heightmap.heights[row, col])
            assert r.drawn_height_at(x, y) == pytest.approx(heightmap.heights[row, col], abs=1e-6)
        middle = r.height_at(20.0 * 10.5, 30.0 * 10)
        assert middle == pytest.approx(heightmap.heights[54, 10:12].mean(), rel=1e-6)


def test_drawn_height_is_near_the_truth_and_nan_outside(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        r.render(tg.Camera.default(heightmap), max_error_px=4.0)
        errors = r.measure()
        assert errors["max_error_px"] <= errors["certified_max_error_px"] <= 4.0
        assert abs(r.drawn_height_at(700.0, 900.0) - r.height_at(700.0, 900.0)) < np.ptp(heightmap.heights)
        assert np.isnan(r.height_at(-1.0, 10.0))
        assert np.isnan(r.drawn_height_at(-1.0, 10.0))


def test_height_over_a_void_is_nan():
    heights = np.zeros((9, 9))
    heights[4, 4] = np.nan
    with tg.Renderer(tg.Heightmap(heights, 10.0), SIZE) as r:
        r.render(tg.Camera.default(r.heightmap))
        assert np.isnan(r.height_at(42.0, 38.0)) and r.drawn_height_at(42.0, 38.0) == 0.0  # filled from the rim
        r.render(tg.Camera.default(r.heightmap), voids="hole")
        assert np.isnan(r.drawn_height_at(42.0, 38.0))
        assert r.height_at(10.0, 10.0) == 0.0


@pytest.mark.parametrize("up_m", [450.0, -450.0])
@pytest.mark.usefixtures("kept_units")
def test_an_edit_far_beyond_the_units_keeps_the_bound(heightmap, up_m):
    """Tables are those of a map with the same units that was never edited. Without `beyond_m`, the bound breaks."""
    place = np.s_[40:60], np.s_[40:70]
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as r, r.session:
        units_m = r.heightmap.quantised_m
        r.edit(*place, heightmap.heights[place] + np.float32(up_m))
        assert r.heightmap.quantised_m == units_m and not units_m[0] <= r.heightmap.range_m[up_m > 0] <= units_m[1]
        for max_error_px in (1.0, 8.0, 40.0):
            r.draw(camera, max_error_px, style=UNLIT)
            found = r.measure()
            assert found["max_error_px"] <= found["certified_max_error_px"] <= max_error_px and found["holes"] == 0
        made, image = read_tables(r), r.render(camera).image
        wide = tg.Heightmap(r.heightmap.heights, heightmap.spacing_m)
        wide.quantised_m = units_m
        with tg.Renderer(wide, SIZE) as rebuilt, rebuilt.session:
            assert read_tables(rebuilt) == made and (rebuilt.render(camera).image == image).all()


@pytest.mark.usefixtures("kept_units")
def test_what_no_class_holds_is_bounded_by_all_heights(heightmap):
    """From far away, a tolerance is larger than all old errors. The block's `beyond_m` says that a peak is higher."""
    far = tg.Camera((1000.0, -20000.0, 9000.0), (900.0, 900.0, 0.0), 20.0)
    with tg.Renderer(heightmap, SIZE) as r, r.session:
        r.edit(50, 50, 12 * heightmap.range_m[1])

        def share():
            r.draw(far, 1.0, metric="max", style=UNLIT)
            found = r.measure()
            return found["max_error_px"] / found["certified_max_error_px"]

        assert share() <= 1
        block = np.frombuffer(r.terrain.block.read(), layout.TERRAIN).copy()
        block["beyond_m"] = 0
        r.terrain.block.write(block)
        assert share() > 1


@pytest.mark.parametrize("base_m, height_m", [(0.0, 0.9 * MAX_HEIGHT_M), (0.0, -150.0), (9000.0, 200.0)])
def test_an_edit_that_needs_other_units_chooses_them_and_undoing_it_the_old_ones(heightmap, base_m, height_m):
    """Heights in more than two spans, or so far below a base that float32 cannot hold the difference."""
    land = tg.Heightmap(heightmap.heights + np.float32(base_m), heightmap.spacing_m)
    with tg.Renderer(land, SIZE) as r, r.session:
        before = read_tables(r)
        r.edit(3, 4, height_m)
        fresh = tg.Heightmap(r.heightmap.heights, land.spacing_m)
        assert r.heightmap.quantised_m == fresh.quantised_m == fresh.range_m
        with tg.Renderer(fresh, SIZE) as rebuilt, rebuilt.session:
            assert read_tables(rebuilt) == read_tables(r)
        r.draw(tg.Camera.default(land), 4.0, style=UNLIT)
        errors = r.measure()
        assert errors["max_error_px"] <= errors["certified_max_error_px"]
        r.edit(3, 4, land.heights[3, 4])
        assert r.heightmap.quantised_m == land.range_m and read_tables(r) == before


def test_a_plain_can_be_edited(heightmap):
    """Units of a flat map come from its spacing."""
    with tg.Renderer(tg.Heightmap(np.full((40, 50), 7.0), 30.0), SIZE) as r:
        r.edit(slice(10, 20), slice(10, 30), 60.0)
        assert r.heightmap.quantised_m == (7.0, 37.0)
        r.edit(slice(10, 20), slice(10, 30), 900.0)
        assert r.heightmap.quantised_m == (7.0, 900.0)
        r.draw(tg.Camera.default(r.heightmap), 1.0, style=UNLIT)
        found = r.measure()
        assert found["max_error_px"] <= found["certified_max_error_px"] <= 1


def test_edit_gives_the_tables_and_the_picture_of_a_rebuild(heightmap):
    new = np.full((12, 9), np.nan)
    new[3:, 2:] = 40.0
    heights = heightmap.heights.copy()
    heights[20:32, 50:59] = new
    camera = tg.Camera.default(heightmap)
    rebuilt = tg.Heightmap(heights, (20.0, 30.0))
    with tg.Renderer(heightmap, SIZE) as edited, edited.session:
        edited.render(camera)
        edited.edit(slice(20, 32), slice(50, 59), new)
        after = [getattr(edited.tables, name).read() for name in ("nodes", "ranges", "counters", "squares")]
        rebuilt.quantised_m = edited.heightmap.quantised_m
        with tg.Renderer(rebuilt, SIZE) as built, built.session:
            image = built.render(camera).image
            assert after == [getattr(built.tables, name).read() for name in ("nodes", "ranges", "counters", "squares")]
        assert (edited.render(camera).image == image).all()
        assert edited.measure()["holes"] == 0


def test_light_that_has_lagged_behind_edits_settles_as_if_built_anew(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as lagging, tg.Renderer(heightmap, SIZE) as prompt:
        before = lagging.render(camera).image
        for place in (np.s_[10:20, 10:30], np.s_[30:41, 60:80]):
            lagging.edit(*place, 15.0, settle=False)
            prompt.edit(*place, 15.0)
        assert (lagging.render(camera).image != before).any()
        assert lagging.render(camera).stats["certified_max_error_px"] <= 1.0
        lagging.settle()
        assert (lagging.render(camera).image == prompt.render(camera).image).all()


@pytest.mark.parametrize("portions", [1, 3, 8, 40])
def test_an_edit_between_portions_of_light_is_not_lost(heightmap, portions):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as edited, tg.Renderer(heightmap, SIZE) as prompt:
        light = edited.picture.light_steps(Look())
        with edited.ctx:
            deque(itertools.islice(light, portions), maxlen=0)
        for r in (edited, prompt):
            r.edit(np.s_[10:20], np.s_[10:30], 15.0)
        with edited.ctx:
            deque(light, maxlen=0)
        assert (edited.render(camera).image == prompt.render(camera).image).all()


def test_edit_leaves_the_callers_heights_alone(heightmap):
    before = heightmap.heights.copy()
    with tg.Renderer(heightmap, SIZE) as r:
        r.edit(slice(0, 5), slice(0, 5), 100.0)
        assert r.height_at(0.0, 64 * 30.0) == 100.0
    assert (heightmap.heights == before).all()


def test_edit_hides_what_a_mask_hides(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        r.edit(slice(3, 5), slice(6, 8), np.ma.masked_greater([[1, 2], [3, 9]], 5))
        assert np.array_equal(r.heightmap.heights[3:5, 6:8], [[1, 2], [3, np.nan]], equal_nan=True)
        assert r.heightmap.voids == 1


@pytest.mark.parametrize(
    "heights", [1j, np.ones((2, 2), complex), "high", [["1", "2"], ["3", "4"]], None, [[1, 2], [3]]]
)
def test_edit_by_no_heights_is_refused(heightmap, heights):
    with tg.Renderer(heightmap, SIZE) as r:
        with pytest.raises(UsageError, match="edit: expected real heights, got .+"):
            r.edit(slice(0, 2), slice(0, 2), heights)
        assert np.array_equal(r.heightmap.heights, heightmap.heights)


@pytest.mark.parametrize(
    "which", [65, -66, 1.5, "3", None, True, slice(0, 9, 0), slice(0, 9, 2), slice("a", 3), [3, 4], [[1], [2]]]
)
def test_edit_of_posts_that_there_are_not_is_refused(heightmap, which):
    with tg.Renderer(heightmap, SIZE) as r:
        with pytest.raises(UsageError, match=f"edit: rows must be .* from -65 to 64, got {re.escape(repr(which))}"):
            r.edit(which, 3, 5.0)
        with pytest.raises(UsageError, match="edit: cols must be .* from -97 to 96, got 97"):
            r.edit(3, 97, 5.0)
        assert np.array_equal(r.heightmap.heights, heightmap.heights)


def test_edit_of_another_shape_is_refused(heightmap):
    with tg.Renderer(heightmap, SIZE) as r, pytest.raises(UsageError, match="edit"):
        r.edit(slice(0, 5), slice(0, 5), np.zeros((3, 3)))


def test_measure_speaks_of_the_frame_at_hand_only(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as r:
        with pytest.raises(TerrainError, match="render a frame first"):
            r.measure()
        r.render(camera)
        r.resize((200, 100))
        with pytest.raises(TerrainError, match="render a frame first"):
            r.measure()
        assert r.render(camera).image.shape == (100, 200, 4)
        assert r.measure()["width"] == 200


def test_what_was_chosen_but_not_drawn_is_not_measured(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as r:
        r.draw(camera)
        chosen = r.choose(camera, 4.0)
        assert drain(r.inspector.measure_steps()).max_px <= chosen["certified_max_error_px"]
        for ask in (r.measure, r.inspector.error_map):
            with pytest.raises(TerrainError, match="draw a frame first"):
                ask()
        r.draw(camera)
        details_of(r, camera, "clipmap", 300)
        with pytest.raises(TerrainError, match="render a frame first"):
            r.measure()


def test_edit_of_what_float32_cannot_hold_is_refused(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        before = r.heightmap.heights.copy()
        with pytest.raises(tg.TerrainError, match="beyond"):
            r.edit(slice(3, 5), 4, [[1.0], [1e39]])
        assert np.array_equal(before, r.heightmap.heights) and r.heightmap.voids == 0
        r.edit(3, 4, 5.0)
        assert r.heightmap.heights[3, 4] == 5.0


def test_nothing_is_drawn_after_release(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        pass
    with pytest.raises(tg.TerrainError, match="released"):
        r.render(tg.Camera.default(heightmap))


def half_done(r):
    """All work that is done in steps, after the first step."""
    camera = tg.Camera.default(r.heightmap)
    r.draw(camera)
    portions = r.inspector.measure_steps(tile=16), r.render_steps(camera, size=(200, 100)), r.draw_steps(camera)
    for each in portions:
        next(each)
    return list(portions)


@pytest.mark.slow
def test_portions_after_release_are_refused_or_closed(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as other:
        before = other.render(camera).image
        for goes_on in (True, False):
            r = tg.Renderer(heightmap, SIZE)
            late, portions = r.draw_steps(camera), half_done(r)
            r.release()
            other.ctx.__enter__()
            for each in (late, *portions):
                if goes_on:
                    with pytest.raises(TerrainError, match="released"):
                        next(each)
                each.close()
            assert other.ctx.error == "GL_NO_ERROR"
            assert (other.render(camera).image == before).all()


def test_portions_given_up_take_nothing_from_another_renderer(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as r, tg.Renderer(heightmap, SIZE) as other:
        portions = half_done(r)
        other.edit(3, 4, 0.9 * MAX_HEIGHT_M)  # so that the same numbers name textures of its own
        before = [each.render(camera).image for each in (r, other)]
        for each in portions:
            with other.ctx:
                each.close()
        assert other.ctx.error == "GL_NO_ERROR"
        assert all((each.render(camera).image == image).all() for each, image in zip((r, other), before, strict=True))


def test_a_building_released_half_way_is_refused(heightmap):
    r = tg.Renderer(heightmap, SIZE, build=False)
    next(r.build_steps)
    r.release()
    with pytest.raises(TerrainError, match="released"):
        next(r.build_steps)


def test_a_picture_for_which_memory_is_short_leaves_the_one_before(heightmap, monkeypatch):
    with tg.Renderer(heightmap, SIZE) as r:
        before = r.render(tg.Camera.default(heightmap)).image
        with monkeypatch.context() as short:
            short.setattr(
                "terrain_gl.shade.targets.depth_texture", lambda *_: (_ for _ in ()).throw(moderngl.Error("none"))
            )
            with pytest.raises(tg.TerrainError, match="a picture of 80x40 needs"):
                r.resize((80, 40))
        assert r.size == SIZE
        assert (r.render(tg.Camera.default(heightmap)).image == before).all()


def test_renderers_of_a_shared_context_leave_nothing_behind(ctx, heightmap):
    def left():
        names = ("glIsTexture", "glIsBuffer", "glIsFramebuffer", "glIsRenderbuffer", "glIsQuery", "glIsProgram")
        alive = {name: gl.function(ctx, name, ctypes.c_ubyte, ctypes.c_uint) for name in names}
        return {name: sum(alive[name](i) for i in range(1, 4000)) for name in names}

    def draw():
        with tg.Renderer(heightmap, SIZE, ctx=ctx) as r:
            r.timer.waits = False
            for style in ("shaded", "lod", "promise"):
                r.render(tg.Camera.default(heightmap), style=style)
            r.measure()
            with pytest.raises(tg.TerrainError):
                r.render(tg.Camera.default(heightmap), material="nowhere.png")

    draw()
    before = left()
    draw()
    assert left() == before


def test_released_twice(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        r.release()


def in_turns(*works):
    """Results of several generators of steps; each does one step in turn."""
    results = [None] * len(works)

    def keeping(i, steps):
        results[i] = yield from steps

    assert len(list(itertools.zip_longest(*map(keeping, range(len(works)), works)))) > 2
    return results


def test_portions_take_turns(heightmap):
    camera = tg.Camera.default(heightmap)
    other = tg.Heightmap(-heightmap.heights, (20.0, 30.0))
    with tg.Renderer(heightmap, SIZE, build=False) as a, tg.Renderer(other, SIZE, build=False) as b:
        for _ in zip(a.build_steps, b.build_steps, strict=True):
            pass
        alone = [r.draw(camera, style="depth") | r.measure() for r in (a, b)]
        together = in_turns(a.inspector.measure_steps(tile=16), b.inspector.measure_steps(tile=16))
        assert [each.max_px for each in together] == [stats["max_error_px"] for stats in alone]


def test_pieces_without_waiting(heightmap):
    with tg.Renderer(heightmap, SIZE) as r:
        r.timer.waits = False
        assert r.render(tg.Camera.default(heightmap), size=(200, 100), style="depth").image.std() > 0


@pytest.mark.slow
def test_two_renderers_take_turns(heightmap):
    camera = tg.Camera.default(heightmap)
    other = tg.Heightmap(-heightmap.heights, (20.0, 30.0))
    with tg.Renderer(heightmap, SIZE) as a, tg.Renderer(other, SIZE) as b:
        first, second = a.render(camera).image, b.render(camera).image
        assert (a.render(camera).image == first).all()
        assert (b.render(camera).image == second).all()
        assert a.measure()["holes"] == b.measure()["holes"] == 0
        assert (first != second).any()


def test_failed_renderer_leaves_the_context_usable(ctx, heightmap):
    with pytest.raises(UsageError, match="picture size"):
        tg.Renderer(heightmap, (0, 10), ctx=ctx)
    r = tg.Renderer(heightmap, SIZE, ctx=ctx)
    assert r.render(tg.Camera.default(heightmap)).image.std() > 0
    r.release()


def test_sides_beyond_fifteen_levels_are_refused():
    with pytest.raises(TerrainError, match="16386 x 2 posts"):
        tg.Heightmap(np.zeros((2, 16386), "f4"))


def test_height_on_a_post_beside_a_void():
    heights = np.arange(25.0).reshape(5, 5)
    heights[3, 3] = np.nan
    with tg.Renderer(tg.Heightmap(heights, 10.0), SIZE) as r:
        assert [r.height_at(10.0 * col, 10.0 * (4 - row)) for row, col in ((2, 2), (2, 4), (4, 4))] == [
            12.0,
            14.0,
            24.0,
        ]
        assert np.isnan(r.height_at(30.0, 10.0))


def test_tables_built_in_portions_equal_tables_built_at_once(ctx):
    heightmap = tg.Heightmap(rough(500, 600), 10.0)
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as at_once, tg.Renderer(heightmap, SIZE, ctx=ctx, build=False) as later:
        parts = []
        for part in later.build_steps:
            parts.append(part)
            at_once.draw(tg.Camera.default(heightmap), 8.0)  # what is drawn in between does not matter
        assert parts == sorted(parts) and parts[-1] == 1 and len(parts) > 20
        for table in ("nodes", "ranges", "counters", "squares"):
            assert getattr(later.tables, table).read() == getattr(at_once.tables, table).read()
        camera = tg.Camera.default(heightmap)
        assert np.array_equal(later.render(camera).image, at_once.render(camera).image)


def test_building_given_up_leaves_nothing(ctx):
    renderer = tg.Renderer(tg.Heightmap(rough(300, 300)), SIZE, ctx=ctx, build=False)
    for _ in range(5):
        next(renderer.build_steps)
    renderer.build_steps.close()
    assert renderer.session.kept == []


def test_error_map_shows_the_measured_errors(heightmap):
    camera = tg.Camera((960, 960, 4000), (960, 961, 0))
    with tg.Renderer(heightmap, (200, 150)) as r, r.session:
        r.draw(camera, 4.0, style=UNLIT)
        achieved = r.measure()
        errors = r.inspector.error_map()
        assert errors.shape == (150, 200)
        assert (
            np.isnan(errors) == (r.picture.sky_share() == 1)
        ).mean() > 0.99  # at the rim the true place may be outside the picture
        assert 0.8 * achieved["max_error_px"] < np.nanmax(errors) <= achieved["max_error_px"] * (1 + 1e-6)
        r.draw(camera, method="full", style=UNLIT)
        exact = r.measure()  # at posts; between them two triangles differ from the bilinear truth
        assert exact["max_error_posts_px"] == 0
        assert np.nanmax(r.inspector.error_map()) <= exact["max_error_px"] * (1 + 1e-6)


def test_places_and_sky_of_a_picture(heightmap):
    camera = tg.Camera((960, 960, 9000), (960, 961, 0))
    with tg.Renderer(heightmap, (200, 150)) as r, r.session:
        r.draw(camera)
        places, sky = r.picture.places(), r.picture.sky_share()
        assert ((places[..., 0] < 0).mean(0) == sky).all()
        assert 0 < sky.mean() < 1 and ((sky == 0) == r.picture.coverage()).all()
        middle = places[:, 75, 100].mean(0)
        half_pixel_m = 0.5 * 9000 / camera.focal_px(150)  # the picture's middle is between four pixels
        assert middle == pytest.approx([48 + half_pixel_m / 20, 32 + half_pixel_m / 30], abs=0.05)
        assert (places[:, 75, 110, 0] > middle[0]).all() and (places[:, 65, 100, 1] < middle[1]).all()


def test_a_picture_in_portions_is_the_same(heightmap, monkeypatch):
    monkeypatch.setattr("terrain_gl.camera.pieces.cut.__defaults__", (1, 48))  # a large picture comes in pieces
    camera = tg.Camera.default(heightmap)
    for how in ({}, {"style": "lod", "wires": True}, {"method": "clipmap", "style": "normals"}):
        with tg.Renderer(heightmap, (150, 101)) as r, r.session:
            whole = r.render(camera, 2.0, **how)
            r.draw(camera, 50.0)
            shares, drawing = [], r.draw_steps(camera, 2.0, **how)
            while (share := next(drawing, None)) is not None:
                shares.append(share)
            assert len(shares) >= 4 and shares == sorted(shares) and shares[-1] == pytest.approx(1)
            assert np.array_equal(r.picture.read(), whole.image)
            measured = r.measure()
            assert measured["triangles"] == whole.stats["triangles"] and measured["holes"] == 0
            assert r.choose(camera, 2.0, **how)["triangles"] == whole.stats["triangles"]
            assert drain(r.inspector.measure_steps()).rms_px == measured["rms_error_px"]
            large = drain(r.render_steps(camera, 2.0, size=(150, 101), **how))
            assert np.array_equal(large.image, r.render(camera, 2.0, size=(150, 101), **how).image)
            assert large.stats["triangles"] == whole.stats["triangles"]
