"""Brushes: how each changes the ground, exact undo and redo of strokes, and the certified bound during strokes."""

import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import holes, rough

import terrain_gl as tg
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.basics.rect import Edit
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer.brush import TOOLS, Brush, Sculptor, _means, dabs, places
from terrain_gl.shade.picture import UNLIT

SIZE = (96, 54)
STROKES = int(os.environ.get("TERRAIN_GL_STROKES", "240"))


class Plain:
    """A surface without tables."""

    def __init__(self, heightmap):
        self.heightmap = heightmap.copy()

    def edit(self, rows, cols, heights, settle=True):
        self.heightmap.write(cols.start, rows.start, heights)

    def settle(self):
        pass


def flat(rows=41, cols=61, height=100.0, spacing=(10.0, 20.0)):
    return Heightmap(np.full((rows, cols), height, "f4"), spacing)


def used(heightmap, brush, x, y):
    """The whole map after a dab."""
    plain = Plain(heightmap)
    Sculptor(plain).dab(brush, x, y)
    return plain.heightmap.heights


def random_brush(rng, heightmap):
    tool = TOOLS[rng.integers(len(TOOLS))]
    low, high = heightmap.range_m
    strength = rng.random() if tool in ("smooth", "flatten") else 0.05 * (high - low) * rng.random()
    radius = min(heightmap.extent_m) * rng.uniform(0.01, 0.3)
    return Brush(tool, radius, strength, rng.random(), azimuth_deg=360 * rng.random())


def random_place(rng, heightmap):
    return tuple(rng.uniform(-0.1, 1.1) * extent for extent in heightmap.extent_m)


def test_raise_moves_a_circle_of_metres_around_its_place():
    heightmap = flat()
    after = used(heightmap, Brush("raise", 75.0, 8.0, 0.5), 200.0, 300.0)
    y, x = np.mgrid[: heightmap.rows, : heightmap.cols]
    away = np.hypot(x * 10.0 - 200.0, (heightmap.rows - 1 - y) * 20.0 - 300.0)  # row 0 is north
    assert (after[away >= 75.0] == 100.0).all()
    assert (after[away <= 37.5] == 108.0).all()
    rim = (away > 37.5) & (away < 75.0)
    assert rim.any() and ((after[rim] > 100.0) & (after[rim] < 108.0)).all()
    order = np.argsort(away[rim])
    assert (np.diff(after[rim][order]) <= 0).all()
    assert (used(heightmap, Brush("lower", 75.0, 8.0, 0.5), 200.0, 300.0) - 100.0 == 100.0 - after).all()


def test_flatten_goes_all_the_way_or_a_share_of_it():
    heightmap = Heightmap(rough(40, 40), 10.0)
    after = used(heightmap, Brush("flatten", 100.0, 1.0, 0.0), 200.0, 190.0)
    y, x = np.mgrid[:40, :40]
    away = np.hypot(x * 10.0 - 200.0, (39 - y) * 10.0 - 190.0)
    assert np.unique(after[away < 100]) == heightmap.heights[20, 20]
    half = used(heightmap, Brush("flatten", 100.0, 0.5, 0.0), 200.0, 190.0)
    assert half[away < 100] == pytest.approx((heightmap.heights[away < 100] + heightmap.heights[20, 20]) / 2, abs=1e-5)


def test_flatten_on_a_void_takes_the_mean_of_what_is_known():
    heights = np.full((21, 21), np.nan)
    heights[:, :10], heights[:, 11:] = 2.0, 4.0
    after = used(Heightmap(heights), Brush("flatten", 5.0, 1.0, 0.0), 10.0, 10.0)
    assert np.isnan(after[:, 10]).all() and after[10, 8] == after[10, 12] == 3.0


def test_smooth_keeps_planes_and_calms_what_is_rough():
    y, x = np.mgrid[:60, :60]
    plane = Heightmap(3.0 * x - 2.0 * y)
    assert used(plane, Brush("smooth", 15.0, 1.0, 0.0), 30.0, 30.0) == pytest.approx(plane.heights, abs=1e-4)
    noise = Heightmap(np.random.default_rng(0).normal(size=(60, 60)))
    after = used(noise, Brush("smooth", 20.0, 1.0, 0.0), 30.0, 30.0)
    assert after[20:40, 20:40].std() < 0.4 * noise.heights[20:40, 20:40].std()


@given(st.integers(2, 30), st.integers(2, 30), st.integers(1, 6), st.integers(1, 6), st.integers(0, 99))
def test_means_are_those_of_the_known_heights_around(rows, cols, across, along, seed):
    heights = rough(rows, cols, seed) + 1000
    heights[np.random.default_rng(seed).random(heights.shape) < 0.2] = np.nan
    heights[0, 0] = 1000.0
    whole = slice(0, rows), slice(0, cols)
    means = _means(Edit(0, 0, heights), heights.shape, *whole, (across, along))
    for y in range(rows):
        for x in range(cols):
            box = heights[max(0, y - along) : y + along + 1, max(0, x - across) : x + across + 1].astype("f8")
            known = box[np.isfinite(box)]
            if known.size:
                assert means[y, x] == pytest.approx(known.mean(), abs=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_dabs_at_once_are_dabs_one_after_the_other(seed):
    """Bit by bit; over voids, at the map's edge and over earlier dabs, too."""
    rng = np.random.default_rng(seed)
    heights = rough(60, 47, seed)
    heights[rng.random(heights.shape) < 0.1] = np.nan
    heightmap = Heightmap(heights, (10.0, 14.0))
    brush, middles = random_brush(rng, heightmap), [random_place(rng, heightmap) for _ in range(9)]
    together, apart = Plain(heightmap), Plain(heightmap)
    patch = Sculptor(together).dabs(brush, middles)
    sculptor = Sculptor(apart)
    for middle in middles:
        sculptor.dab(brush, *middle)
    assert np.array_equal(together.heightmap.heights, apart.heightmap.heights, equal_nan=True)
    assert patch is None or not np.array_equal(patch.heights, heights[patch.rows, patch.cols], equal_nan=True)


def test_cliff_faces_where_it_is_told_to():
    after = used(flat(), Brush("cliff", 150.0, 30.0, 0.0, azimuth_deg=180.0), 300.0, 410.0)
    raised = np.flatnonzero((after > 100.0).any(1))
    assert raised.max() == 20 - 1 + 0 and (after[19, 25:36] == 130.0).all() and (after[20] == 100.0).all()
    east = used(flat(), Brush("cliff", 150.0, 30.0, 0.0, azimuth_deg=90.0), 305.0, 410.0)
    assert (east[:, 31:] == 100.0).all() and east[20, 30] == 130.0


@pytest.mark.parametrize("tool", TOOLS)
def test_voids_stay_voids_and_the_rest_of_the_map_as_it_was(tool):
    heightmap = Heightmap(holes(150), 10.0)
    brush = Brush(tool, 300.0, 0.7, 0.3)
    after = used(heightmap, brush, 500.0, 800.0)
    assert (np.isnan(after) == np.isnan(heightmap.heights)).all()
    y, x = np.mgrid[: heightmap.rows, : heightmap.cols]
    outside = np.hypot(x * 10.0 - 500.0, (heightmap.rows - 1 - y) * 10.0 - 800.0) >= 300.0
    assert np.array_equal(after[outside], heightmap.heights[outside], equal_nan=True)
    assert not np.array_equal(after, heightmap.heights, equal_nan=True)


def test_beside_the_map_there_is_nothing_to_do():
    assert dabs(flat(), Brush("raise", 5.0), [(-50.0, 0.0)]) is None
    assert dabs(flat(), Brush("raise", 0.1), [(5.0, 5.0)]) is None  # between posts


def test_places_go_from_point_to_point_in_even_steps():
    way = list(places((0.0, 0.0), (30.0, 40.0), 8.0))
    assert way[-1] == (30.0, 40.0) and len(way) == 7
    assert np.hypot(*np.diff([(0.0, 0.0), *way], axis=0).T) == pytest.approx(50 / 7)
    assert list(places((1.0, 2.0), (1.0, 2.0), 3.0)) == [(1.0, 2.0)]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"tool": "paint"}, "expected one of raise"),
        ({"radius_m": 0.0}, "radius"),
        ({"radius_m": float("nan")}, "radius"),
        ({"strength": -1.0}, "strength"),
        ({"tool": "smooth", "strength": 1.5}, "from 0 to 1"),
        ({"falloff": 2.0}, "falloff"),
    ],
)
def test_brushes_out_of_range_are_refused(wrong, says):
    with pytest.raises(UsageError, match=says):
        Brush(**wrong)


@pytest.mark.parametrize("name", ["rough", "holes"])
def test_undoing_all_strokes_brings_every_bit_back_and_redoing_them_too(name):
    plain = Plain(Heightmap({"rough": rough(80, 90), "holes": holes(100)}[name], (30.0, 20.0)))
    sculptor, rng = Sculptor(plain), np.random.default_rng(3)
    states = [plain.heightmap.heights.tobytes()]
    for _ in range(60):
        sculptor.begin()
        brush, start = random_brush(rng, plain.heightmap), random_place(rng, plain.heightmap)
        for place in places(start, random_place(rng, plain.heightmap), brush.radius_m / 2):
            sculptor.dab(brush, *place)
        states.append(plain.heightmap.heights.tobytes())
    done = sculptor.can_undo
    for _ in range(2):
        for _ in range(done):
            assert sculptor.undo()
        assert not sculptor.undo() and plain.heightmap.heights.tobytes() == states[0]
        for _ in range(done):
            assert sculptor.redo()
        assert not sculptor.redo() and plain.heightmap.heights.tobytes() == states[-1]
    assert sculptor.can_undo == done and sculptor.can_redo == 0


def test_a_new_stroke_ends_what_could_be_redone():
    sculptor = Sculptor(Plain(flat()))
    sculptor.dab(Brush("raise", 50.0), 100.0, 100.0)
    sculptor.undo()
    sculptor.begin()
    sculptor.dab(Brush("lower", 50.0), 100.0, 100.0)
    assert not sculptor.redo() and sculptor.can_undo == 1


def test_memory_of_strokes_is_bounded_and_overlapping_dabs_share_it():
    plain = Plain(flat(400, 400, spacing=10.0))
    sculptor, brush = Sculptor(plain), Brush("raise", 200.0)
    sculptor.begin()
    for i in range(100):
        sculptor.dab(brush, 1000.0 + 2 * i, 2000.0)
    assert sculptor.bytes < 2 * 4 * 41 * (41 + 20 + 2)
    bounded = Sculptor(plain, most_bytes=100_000)
    for i in range(50):
        bounded.begin()
        bounded.dab(brush, 60.0 * i, 60.0 * i)
        assert bounded.bytes <= 100_000
    assert 1 <= bounded.can_undo < 50
    tiny = Sculptor(plain, most_bytes=1)
    tiny.dab(brush, 1000.0, 1000.0)
    assert tiny.can_undo == 1


def tables_of(renderer):
    names = ("nodes", "ranges", "counters", "squares", "contributions")
    return [getattr(renderer.tables, name).read() for name in names]


def check_rebuild(renderer):
    """The GPU's resources equal those of a map that had these heights from the beginning."""
    with tg.Renderer(renderer.heightmap, SIZE) as fresh, fresh.session:
        expected = tables_of(fresh), fresh.picture.sums.buffer.read(), fresh.terrain.heights.read()
    with renderer.ctx:
        assert (tables_of(renderer), renderer.picture.sums.buffer.read(), renderer.terrain.heights.read()) == expected


@pytest.mark.slow
def test_the_bound_holds_after_many_strokes():
    before = Heightmap(holes(150), 10.0)
    rng = np.random.default_rng(5)
    with tg.Renderer(before, SIZE) as renderer:
        sculptor = Sculptor(renderer)
        for i in range(STROKES):
            sculptor.begin()
            sculptor.dab(random_brush(rng, renderer.heightmap), *random_place(rng, renderer.heightmap))
            if 4 * (i + 1) % STROKES == 0:
                renderer.draw(tg.Camera.default(renderer.heightmap), 1.0, style=UNLIT)
                stats = renderer.measure()
                assert stats["max_error_px"] <= stats["certified_max_error_px"] <= 1.0
                assert stats["holes"] == 0
        check_rebuild(renderer)
        while sculptor.undo():
            pass
        assert renderer.heightmap.heights.tobytes() == before.heights.tobytes()
        check_rebuild(renderer)
