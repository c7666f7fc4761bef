"""Streaming: a flight never waits, takes what it needs first, keeps its limits, and survives a bad source."""

import math
import shutil
import threading
import time

import numpy as np
import pytest
from maps import rough

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.steps import drain
from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_view
from terrain_gl.lod import Goal
from terrain_gl.pages.loader import Loader
from terrain_gl.pages.streaming import Motion
from terrain_gl.pages.wanted import DrawnPatches
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions

pytest.importorskip("zarr")
from terrain_gl.store import build
from terrain_gl.store.opened import StoredMap

SIZE = (160, 90)
SMALL = {"tile": 16, "shard": 64, "spacing_m": 2.0}


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The store of another map of that size."""
    path = tmp_path_factory.mktemp("other") / "s"
    build(rough(200, 261, relief=60, seed=8), path, **SMALL)
    return path


class Slow(StoredMap):
    """A store whose pages wait until they are let go."""

    def __init__(self, path):
        super().__init__(path)
        self.gate, self.asked = threading.Event(), []

    def page(self, key):
        if key[0] < self.top:
            self.asked.append(key)
            self.gate.wait(20)
        return super().page(key)


def flying(stored):
    renderer = Renderer(stored, SIZE)
    renderer.streaming.waits = False
    return renderer


def until(condition, seconds=80.0):
    """Wait for a condition, partly asleep: threads that read pages need the time."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def largest_px(renderer):
    return drain(renderer.inspector.measure_steps()).max_px


# --- What is asked for ------------------------------------------------------------------------------------------------


def wanted_by_loops(terrain, patches, tolerance_px):
    """`Patches.wanted`, one patch after the other."""
    worth, log2 = {}, terrain.heightmap.tile.bit_length() - 1

    def over(low, end, level):
        rows, cols = terrain.heightmap.pages(level)
        x0, x1 = (min(int(at[0]) >> level + log2, cols - 1) for at in (low, end))
        y0, y1 = (min(int(at[1]) >> level + log2, rows - 1) for at in (low, end))
        return [(level, y, x) for y in range(y0, y1 + 1) for x in range(x0, x1 + 1)]

    boxes = zip(
        patches.boxes.low, patches.boxes.end, patches.bound_px, patches._side_log2, patches.areas(), strict=True
    )
    for low, end, bound_px, side_log2, area in boxes:
        if bound_px <= tolerance_px:
            continue
        finest = max(0, min(int(side_log2) - 6, terrain.top_level))
        while not all(key in terrain.slot_of for key in over(low, end, finest)):
            finest += 1
        if finest == 0:
            continue
        steps = min(max(1, math.ceil(math.log2(min(bound_px / tolerance_px, 8.0)))), finest)
        while len(over(low, end, finest - steps)) > 32 and steps > 1:
            steps -= 1
        for key in over(low, end, finest - steps):
            if key not in terrain.slot_of:
                worth[key] = worth.get(key, 0.0) + bound_px * area
    return worth


@pytest.mark.slow
def test_what_patches_ask_for_is_what_loops_find(hills):
    whole, path = hills
    rng = np.random.default_rng(2)
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        terrain = renderer.terrain
        for name in ("default", "valley", "high"):
            camera = standard_view(whole, name)
            keys = [terrain.numbering.key(int(n)) for n in rng.integers(0, terrain.numbering.total, 9)]
            with renderer.session:
                renderer.tables.load(keys)
                renderer.streaming.select = lambda choose, camera, goal: (choose(camera), {})
                selection = renderer.select(camera, SIZE, FrameOptions(0.5)).selection
                patches = DrawnPatches(terrain, selection, camera)
                numbers, worth = patches.wanted(Goal(0.5))
                expected = wanted_by_loops(terrain, patches, 0.5)
                assert expected
                assert {terrain.numbering.key(int(n)) for n in numbers} == set(expected)
                np.testing.assert_allclose(worth, [expected[terrain.numbering.key(int(n))] for n in numbers], rtol=1e-9)
                assert (np.diff(worth) <= 0).all()


def test_heights_of_resident_pages_are_those_that_are_drawn(hills):
    whole, path = hills
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        terrain, heights = renderer.terrain, whole.heights
        step, last = 1 << terrain.top_level, [n - 1 for n in heights.shape]
        posts = np.ix_(*(np.minimum(np.arange(0, n + step, step), n) for n in last))
        np.testing.assert_array_equal(terrain.filled[posts], heights[posts])
        with renderer.session:
            renderer.tables.load(map(terrain.numbering.key, range(terrain.numbering.total)))
            np.testing.assert_array_equal(terrain.filled[:, :], heights)
            assert terrain.filled[199, 260] == heights[199, 260]


# --- Loader threads ---------------------------------------------------------------------------------------------------


def test_what_is_not_wanted_any_more_is_not_read(hills):
    stored = Slow(hills[1])
    loader = Loader(stored, threads=1)
    first, then = [(0, 0, col) for col in range(5)], [(0, 1, 0), (0, 1, 1)]
    loader.want(first)
    until(lambda: stored.asked)
    loader.want(then)
    stored.gate.set()
    until(lambda: len(dict(loader._ready)) == 2)
    assert stored.asked == [first[0], *then]  # one was under way
    assert [key for key, _ in loader.take()] == then
    loader.release()


def test_a_page_that_gives_no_answer_counts_as_missing(hills):
    stored = Slow(hills[1])
    loader = Loader(stored, threads=1, patience_s=0.05)
    loader.want([(0, 0, 0)])
    until(lambda: loader.wait(0.01) or loader.failed)
    assert "no answer" in loader.failed[0, 0, 0]
    stored.gate.set()
    loader.want([(0, 0, 1)])
    until(lambda: loader._ready)
    assert [key for key, _ in loader.take()] == [(0, 0, 1)]
    loader.release()


@pytest.mark.slow
def test_pages_on_their_way_keep_the_limit_of_memory(hills):
    stored = Slow(hills[1])
    stored.limit(stored.gpu_bytes, 200 << 10)
    loader = Loader(stored, threads=4)
    stored.gate.set()
    loader.want([(0, row, col) for row in range(12) for col in range(16)])
    most = came = 0
    while came < 192:
        most = max(most, loader.bytes)
        came += len(loader.take())
        time.sleep(0.001)
        assert stored.tiles.bytes <= 50 << 10
    assert 0 < most <= 50 << 10
    loader.release()


def test_heights_of_resident_pages_keep_the_limit_of_memory(hills):
    stored = StoredMap(hills[1])
    stored.limit(8 << 20, 200 << 10)
    with Renderer(stored, SIZE) as renderer, renderer.session:
        stats = renderer.choose(standard_view(hills[0], "default"), 2.0)
        assert renderer.terrain.filled.copies.nbytes <= 100 << 10
        assert stats["gpu_bytes"]["heights"] + stats["gpu_bytes"]["sat"] <= 8 << 20
        assert stats["tiles_resident"] <= renderer.terrain.slots < renderer.terrain.numbering.total


# --- Flights ----------------------------------------------------------------------------------------------------------


def test_a_frame_never_waits_and_its_bound_holds(hills):
    whole, path = hills
    stored = Slow(path)
    camera = standard_view(whole, "default")
    with flying(stored) as renderer:
        stats = renderer.draw(camera, 0.4, style="lambert")  # every page below the roots is held back
        assert not stats["complete"] and 0 <= stats["within_tolerance"] < 1
        assert {tile["reason"] for tile in stats["tiles_missing"]} == {"loading"}
        assert largest_px(renderer) <= stats["certified_max_error_px"]
        assert stats["certified_max_error_px"] > 0.4
        stored.gate.set()
        shares = []
        while not stats["complete"]:
            until(lambda: renderer.streaming.has_news)
            stats = renderer.draw(camera, 0.4, style="lambert")
            shares.append(stats["within_tolerance"])
            assert renderer.streaming.is_loading or stats["complete"]
        assert largest_px(renderer) <= stats["certified_max_error_px"] <= 0.4
        assert shares[-1] == 1.0 == stats["within_tolerance"]


def test_a_flight_ends_with_the_mesh_of_a_picture_that_waits(hills):
    whole, path = hills
    camera = standard_view(whole, "ridge")
    with Renderer(StoredMap(path), SIZE) as one, flying(StoredMap(path)) as other:
        waited = one.draw(camera, 0.5, style="lambert")
        until(lambda: other.draw(camera, 0.5, style="lambert")["complete"])
        assert abs(other.draw(camera, 0.5, style="lambert")["triangles"] / waited["triangles"] - 1) < 0.1


def test_motion_goes_on_as_it_was():
    motion = Motion()
    assert motion.ahead(Camera((0, 0, 10), (1, 0, 10)), 0.0) is None
    ahead = motion.ahead(Camera((1, 0, 10), (2, 0, 10)), 0.1)
    np.testing.assert_allclose([*ahead.eye, *ahead.forward], [11, 0, 10, 1, 0, 0])
    assert motion.ahead(Camera((1, 0, 10), (2, 0, 10)), 0.2) is None
    turned = motion.ahead(Camera((1, 0, 10), (2, 0.01, 10)), 0.3)
    assert turned.forward[1] > 0.05


@pytest.mark.parametrize("looks_ahead", [True, False])
def test_a_flight_is_complete_more_often_if_it_looks_ahead(hills, looks_ahead, monkeypatch):
    """Pages come between two frames; those of the view ahead are there when the camera arrives."""
    if not looks_ahead:
        monkeypatch.setattr(Motion, "ahead", lambda *_: None)
    whole, path = hills
    (width, depth), high = whole.extent_m, whole.range_m[1]
    with flying(StoredMap(path)) as renderer:
        complete = 0
        for frame in range(24):
            eye = width * (0.1 + 0.033 * frame), 0.2 * depth, high + 15
            renderer.streaming.clock = lambda frame=frame: 0.25 * frame
            camera = Camera(eye, (eye[0] + 20, eye[1] + 30, 0))
            complete += renderer.draw(camera, 1.0, style="lambert")["complete"]
            until(lambda: not renderer.streaming.loader._begun and not renderer.streaming.loader._wanted)
    assert (complete > 12) == looks_ahead, complete


def test_a_flight_looks_ahead_once_its_own_tiles_are_there(hills):
    """Until then, frames take half the time to choose; what was wanted ahead stays wanted, and is read once."""
    whole, path = hills
    (width, depth), high = whole.extent_m, whole.range_m[1]
    with flying(StoredMap(path)) as renderer, renderer.session:
        streaming, selector = renderer.streaming, renderer.selectors["sat"]
        meshes, select, was_complete = [], selector.select, False
        selector.select = lambda *args: meshes.append(args) or select(*args)
        for frame in range(40):
            eye = width * (0.1 + 0.004 * frame), 0.2 * depth, high + 15
            streaming.clock = lambda frame=frame: 0.25 * frame
            meshes.clear()
            stats = renderer.draw(Camera(eye, (eye[0] + 20, eye[1] + 30, 0)), 1.0, style="lambert")
            assert len(meshes) == (2 if was_complete else 1)
            was_complete = stats["complete"]
            assert not set(streaming.loader._wants) & renderer.terrain.slot_of.keys()
            until(lambda: not streaming.loader._begun and not streaming.loader._wanted)


# --- A bad source -----------------------------------------------------------------------------------------------------


class Bad:
    """Reads of a store, some of which go wrong: always the same places, but for delays and drops."""

    def __init__(self, stored, harm, other):
        self._read, self.harm, self._rng = stored.arrays.read, harm, np.random.default_rng(4)
        self._other, self._tile, self.harmed = StoredMap(other).arrays.read, stored.tile, 0

    def __call__(self, name, level, where):
        row, col = (s.start // self._tile for s in where)
        if level > 2 or (row + 2 * col + level) % 3:
            return self._read(name, level, where)
        self.harmed += 1
        return getattr(self, self.harm)(name, level, where)

    def delay(self, *at):
        time.sleep(0.05 * self._rng.random())
        return self._read(*at)

    def drop(self, *at):
        if self._rng.random() < 0.5:
            raise ConnectionError("the line is dead")
        return self._read(*at)

    def truncate(self, *at):
        return self._read(*at)[..., :-1]

    def corrupt(self, *at):
        values = self._read(*at).copy()
        values.view(np.uint8)[..., 0, 3] ^= 1
        return values

    def reorder(self, name, level, where):
        rows = slice(0, where[0].stop - where[0].start)
        return self._read(name, level, (rows, where[1]))

    def stale(self, *at):
        return self._other(*at)


def with_truth(stored, heights):
    """Measure by the true heights of all posts, not by what the bad source gives."""
    lattice, stored.heights = stored.lattice_heights, heights
    stored.lattice_heights = lambda level, *part: lattice(level, *part) if level else heights[part]
    return stored


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["delay", "drop", "truncate", "corrupt", "reorder", "stale"])
def test_whatever_the_source_does_the_bound_holds(hills, other, harm):
    whole, path = hills
    stored = with_truth(StoredMap(path), whole.heights)
    bad = stored.arrays.read = Bad(stored, harm, other)
    rng, reasons = np.random.default_rng(1), set()
    with flying(stored) as renderer, renderer.session:
        for _ in range(12):
            x, y = rng.random(2) * whole.extent_m
            camera = Camera((x, y, whole.range_m[1] + 20), (*(rng.random(2) * whole.extent_m), 0))
            stats = renderer.choose(camera, 0.5)
            time.sleep(0.02)
            stats = renderer.choose(camera, 0.5)
            assert largest_px(renderer) <= stats["certified_max_error_px"]
            reasons |= {tile["reason"] for tile in stats["tiles_missing"]}
        renderer.streaming.waits = True
        stats = renderer.choose(standard_view(whole, "default"), 0.3)
        assert largest_px(renderer) <= stats["certified_max_error_px"]
        reasons |= {tile["reason"] for tile in stats["tiles_missing"]}
    assert bad.harmed
    told = {"drop": "the line is dead", "delay": ""}.get(harm, "is not the tile that was built")
    assert any(told in reason for reason in reasons), reasons
    if harm == "delay":
        assert stats["complete"]


def test_without_checks_a_stale_tile_breaks_the_bound(hills, other, monkeypatch):
    """So the checksums are needed to find it."""
    whole, path = hills
    monkeypatch.setattr("terrain_gl.store.tiles.checksums", lambda values, tile: None)
    monkeypatch.setattr("terrain_gl.store.tiles.np.array_equal", lambda *_: True)
    stored = with_truth(StoredMap(path), whole.heights)
    stored.arrays.read = Bad(stored, "stale", other)
    with Renderer(stored, SIZE) as renderer:
        stats = renderer.choose(standard_view(whole, "default"), 0.3)
        assert largest_px(renderer) > stats["certified_max_error_px"]


def test_a_damaged_list_of_checksums_is_refused(hills, tmp_path):
    shutil.copytree(hills[1], tmp_path / "s")
    chunk = next(file for file in (tmp_path / "s/checks/c").rglob("*") if file.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-9])
    with pytest.raises(TerrainError, match="list of checksums"):
        StoredMap(tmp_path / "s")


# --- Views that take turns --------------------------------------------------------------------------------------------


def test_views_that_take_turns_are_complete_together(hills):
    """As the sides of a split picture: the last view alone is complete long before the first."""
    whole, path = hills
    camera = standard_view(whole, "default")
    with flying(StoredMap(path)) as renderer:
        streaming = renderer.streaming
        streaming.terrain.views = 2

        def both():
            return [renderer.choose(camera, px)["complete"] for px in (0.3, 30.0)]

        assert not all(both())
        end = time.monotonic() + 60
        while streaming.is_loading or streaming.has_news:
            assert time.monotonic() < end
            both()
        assert all(both())


@pytest.mark.slow
def test_views_that_take_turns_keep_their_pages_in_a_small_pool(hills):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = 600 << 10
    with flying(stored) as renderer:
        streaming = renderer.streaming
        streaming.terrain.views = 2
        top = whole.range_m[1]
        cameras = [Camera((x, 0.75 * x, top + 60), (x, 0.75 * x + 1, 0)) for x in (80, 440)]

        def turn(camera):
            missing = len(renderer.choose(camera, 0.1)["tiles_missing"])
            until(lambda: streaming.has_news or not streaming.is_loading)
            return missing

        for _ in range(60):
            missing = [turn(camera) for camera in cameras]
        assert max(missing) > 0 == streaming.terrain.free  # they have no room for all pages of both
        loaded = set(streaming.terrain.slot_of)
        for camera in 3 * cameras:
            turn(camera)
            assert set(streaming.terrain.slot_of) == loaded
