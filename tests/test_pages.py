"""Paged maps: the certificate holds for any loaded pages; with all pages, the mesh is that of the whole map."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import refused, spawn
from hostile import cut_heights
from maps import cliff, rough, spike
from ring_scenes import doubled_areas

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.basics.steps import drain
from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_view
from terrain_gl.film.tour import tour
from terrain_gl.gpu import layout
from terrain_gl.gpu.packing import ERROR_UNIT
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image
from terrain_gl.light.ground import HeightSums
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.renderer.overlay import Overlay

pytest.importorskip("zarr")
from terrain_gl.pages.map import above as page_above
from terrain_gl.pages.sums import sums_of
from terrain_gl.store import build
from terrain_gl.store.opened import StoredMap
from terrain_gl.terrain import Terrain, quantisation_range, steps_of
from terrain_gl.verify.measure import TILE

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from huge import Endless, over_middle

SIZE = (160, 90)
METRICS = ["max", "rms"]
SMALL = {"tile": 16, "shard": 64, "spacing_m": 2.0}


@pytest.fixture(scope="module", params=["cliff", "spike"])
def steep(request, tmp_path_factory):
    """A map as a whole, and its store."""
    heights = {"cliff": cliff, "spike": spike}[request.param]()
    path = tmp_path_factory.mktemp("store") / "s"
    build(np.asarray(heights, np.float32), path, **SMALL)
    return Heightmap(heights, 2.0), path


@pytest.fixture(scope="module")
def pair(hills):
    """Renderers of a map in memory and of its store, which has loaded all pages."""
    whole, path = hills
    with Renderer(whole, SIZE) as one, Renderer(StoredMap(path), SIZE) as other:
        load(other, all_pages(other.heightmap))
        yield one, other


def random_view(heightmap, rng):
    """A camera anywhere around the map, close to the ground or high above it, that looks at a place on the map."""
    (width, depth), (low, high) = heightmap.extent_m, heightmap.range_m
    x, y = rng.uniform(-0.2, 1.2, 2) * (width, depth)
    z = high + rng.choice([2.0, 20.0, 200.0]) * rng.random()
    target = (*(rng.random(2) * (width, depth)), low)
    return Camera((x, y, z), target, rng.uniform(20, 70))


def all_pages(heightmap):
    return [
        (level, row, col)
        for level in range(heightmap.top, -1, -1)
        for row in range(heightmap.pages(level)[0])
        for col in range(heightmap.pages(level)[1])
    ]


def choose(renderer, camera, **options):
    """Choose a mesh from the loaded pages only; returns its certified error."""
    frame = renderer.inspector.frame = renderer.select(camera, renderer.size, FrameOptions(**options))
    return frame.selection


def patches_of(renderer):
    with renderer.session:
        selection = renderer.inspector.frame.selection
        return selection.buffers.patches.read(selection.patches * layout.PATCH.itemsize)


def load(renderer, keys):
    with renderer.session:
        renderer.tables.load(keys)


def seen_by(renderer):
    """The place of the map that each sample of the last picture sees: its depth."""
    with renderer.session:
        return renderer.picture.places()


def achieved(renderer):
    return drain(renderer.inspector.measure_steps())


@pytest.mark.parametrize("is_store", [False, True])
def test_the_largest_error_alone_is_that_of_all_places_before_and_after_an_edit(tmp_path, is_store):
    heights = np.float32(rough(300, 320, 3, 1500.0))
    if is_store:
        build(heights, tmp_path / "s", tile=64, shard=256, spacing_m=30.0)
    heightmap = Heightmap(heights, 30.0)
    with Renderer(StoredMap(tmp_path / "s") if is_store else heightmap, (1280, 720)) as renderer:
        for _ in range(2):
            renderer.draw(Camera.default(heightmap), 0.3, style="lambert")
            found = drain(renderer.inspector.largest_steps(64))
            assert found is not None and found == achieved(renderer).max_px
            renderer.edit(np.s_[100:140], np.s_[90:150], heights[100:140, 90:150] + 60)


def check_sides_agree(corners, heights_m):
    """Each vertex place has the same height in all its triangles: so there are no cracks."""
    assert (doubled_areas(corners) > 0).all()
    places, which = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    lowest, highest = np.full(len(places), np.inf), np.full(len(places), -np.inf)
    np.minimum.at(lowest, which.ravel(), heights_m.ravel())
    np.maximum.at(highest, which.ravel(), heights_m.ravel())
    assert (lowest == highest).all()


# --- What is certified ------------------------------------------------------------------------------------------------


def check_equal(maps, views, metrics, **options):
    """With all pages, patches, certificates, depths and pictures are those of the whole map."""
    whole, path = maps
    rng = np.random.default_rng(3)
    with Renderer(whole, SIZE) as one, Renderer(StoredMap(path), SIZE) as other, other.session:
        load(other, all_pages(other.heightmap))
        assert len(other.terrain.slot_of) == len(all_pages(other.heightmap))
        for number in range(views):
            camera, error_px = random_view(whole, rng), float(rng.choice([0.3, 1.0, 4.0]))
            how = {"metric": metrics[number % len(metrics)], "style": "depth"} | options
            first, second = (renderer.draw(camera, error_px, **how) for renderer in (one, other))
            assert patches_of(one) == patches_of(other)
            assert second["certified_max_error_px"] == first["certified_max_error_px"]
            np.testing.assert_array_equal(seen_by(other), seen_by(one))
            style = ("lambert", "normals", "lod")[number % 3]
            np.testing.assert_array_equal(*(pixels(r, camera, error_px, how | {"style": style}) for r in (one, other)))


def pixels(renderer, camera, error_px, how):
    return renderer.render(camera, error_px, **how).image


def check_bounds(maps, rounds, views, metrics, **options):
    """With any pages, achieved ≤ certified, and there are no holes. Hidden land is drawn, so that all is measured."""
    options |= {"occlusion": "off"}
    whole, path = maps
    rng = np.random.default_rng(7)
    with Renderer(whole, SIZE) as one:
        for _ in range(rounds):
            with Renderer(StoredMap(path), SIZE) as other:
                keys = all_pages(other.heightmap)
                for number in range(views):
                    load(other, [keys[i] for i in rng.integers(0, len(keys), 6)])
                    camera, error_px = random_view(whole, rng), float(rng.choice([0.3, 1.0, 4.0]))
                    metric = metrics[number % len(metrics)]
                    selection = choose(other, camera, max_error_px=error_px, metric=metric, **options)
                    found = achieved(other)
                    most_px = found.max_px if metric == "max" else found.rms_px
                    assert most_px <= selection.certified_px
                    assert found.uncovered == 0
                    with other.session:
                        check_sides_agree(*other.inspector.frame.triangles)
                    choose(one, camera, max_error_px=error_px, metric=metric, **options)
                    assert found.posts == achieved(one).posts


@pytest.mark.slow
def test_on_a_round_earth_stores_are_drawn_and_certified_as_whole_maps(hills, alone, monkeypatch):
    """A planet of 3 km: the map is 500 m wide, so land at its other side is drawn 50 m lower."""
    monkeypatch.setattr("terrain_gl.sight.WGS84", (3000.0, 0.0))
    round_ = {"curvature": "on"}
    check_equal(hills, 2, METRICS, **round_)
    check_bounds(hills, 1, 3, METRICS, **round_)


def test_with_all_pages_the_mesh_is_that_of_the_whole_map(hills):
    check_equal(hills, 4, METRICS)


@pytest.mark.slow
def test_whatever_is_there_achieves_what_is_certified(hills, alone):
    check_bounds(hills, 1, 4, METRICS)


@pytest.mark.parametrize(
    "style", ["lambert", "normals", "lod", "wireframe", "segments", "promise", "error", "voids", "depth", "cracks"]
)
def test_with_all_pages_pictures_are_those_of_the_whole_map(pair, style):
    camera = standard_view(pair[0].heightmap, "default")
    np.testing.assert_array_equal(*(each.render(camera, 1.0, style=style, contour_m=5.0).image for each in pair))


@pytest.mark.parametrize("view", ["default", "valley"])
def test_the_style_error_loads_the_true_heights_of_the_land_in_the_picture(hills, view):
    whole, path = hills
    camera = standard_view(whole, view)
    with Renderer(whole, SIZE) as one, Renderer(StoredMap(path), SIZE) as other:
        others = other.draw(camera, 3.0, style="promise")["tiles_resident"]
        found = [renderer.render(camera, 3.0, style="error") for renderer in (one, other)]
        stats = found[1].stats
        assert stats["complete"] and others < stats["tiles_resident"] < other.heightmap.numbering.total
    assert stats["triangles"] == found[0].stats["triangles"]
    # at the rim of the picture, normals are those of coarser pages beyond it
    assert np.abs(np.subtract(*(each.image.astype(int) for each in found))).max() <= 1


def test_the_style_error_is_grey_where_the_true_heights_have_no_room(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    stored = StoredMap(path)
    stored.gpu_bytes = 1500 << 10
    with Renderer(whole, SIZE) as one, Renderer(stored, SIZE) as other:
        assert other.draw(camera, 3.0, style="promise")["complete"]
        right, found = (renderer.render(camera, 3.0, style="error") for renderer in (one, other))
        with one.session:
            places = one.picture.places()[0]
    assert not found.stats["complete"] and "no room" in found.stats["tiles_missing"][0]["reason"]
    assert found.stats["certified_max_error_px"] <= 3.0
    is_land = places[..., 0] >= 0
    is_grey = np.ptp(found.image[..., :3].astype(int), -1) <= 1
    assert 0.1 < is_grey[is_land].mean() < 0.9
    differ = np.abs(found.image.astype(int) - right.image).max(-1)[is_land & ~is_grey]
    assert (differ > 1).mean() < 0.01  # beside missing pages, normals are those of coarser pages: another shade


def test_lines_lie_on_the_land_of_a_store_as_in_memory(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    line = np.stack([np.linspace(3, whole.cols - 5, 40), np.linspace(whole.rows - 9, 4, 40)], -1)
    found = []
    with Renderer(whole, SIZE) as one, Renderer(StoredMap(path), SIZE) as other:
        load(other, all_pages(other.heightmap))
        bare = one.render(camera, 1.0, style="lambert").image
        for renderer in (one, other):
            renderer.overlays = (Overlay((line,), line[::9] + 6),)
            found.append(renderer.render(camera, 1.0, style="lambert").image)
    np.testing.assert_array_equal(*found)
    assert (found[0] != bare).any(-1).sum() > 50


def test_without_the_sums_of_its_pages_a_picture_is_another(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        load(renderer, all_pages(renderer.heightmap))
        right = renderer.render(camera, 1.0, style="normals").image
        sums = renderer.terrain.height_sums
        with renderer.session:
            sums.write(bytes(sums.size))
            assert (renderer.render(camera, 1.0, style="normals").image != right).any(-1).mean() > 0.1


@pytest.mark.parametrize("offset_m", [0.0, -3.7, 91234.0])
def test_pages_sum_the_steps_of_the_map_in_memory(ctx, tmp_path, offset_m):
    heights = rough(70, 93, relief=123.4) + np.float32(offset_m)
    build(heights, tmp_path / "s", tile=16, shard=64, spacing_m=2.0)
    stored, terrain = StoredMap(tmp_path / "s"), Terrain(ctx, Heightmap(heights, 2.0))
    sums = HeightSums(terrain)
    (found,) = sums.values()
    above = heights - np.float32(terrain.base_m)
    base_m, low_m, span_m = quantisation_range(*terrain.heightmap.quantised_m)
    np.testing.assert_array_equal(found, steps_of(above, low_m - base_m, span_m))
    rows, cols = stored.pages(0)
    for row, col in np.ndindex(rows, cols):
        table = sums_of(stored, (0, row, col)).height_sums
        part = found[16 * row : 16 * row + 17, 16 * col : 16 * col + 17]
        expected = reference.sat(part.astype(np.int64))[-part.shape[0] :, -part.shape[1] :]
        np.testing.assert_array_equal(table[: part.shape[0], : part.shape[1]], expected)


@pytest.mark.slow
def test_with_all_pages_pictures_of_a_real_map_are_those_of_the_whole_map(dem, tmp_path):
    heights = np.nan_to_num(Heightmap.open(dem / "mt_rainier_90m.tif").heights[300:620, 200:500])
    build(heights, tmp_path / "s", tile=32, shard=128, spacing_m=60.0)
    check_equal((Heightmap(heights, 60.0), tmp_path / "s"), 3, METRICS)


@pytest.mark.parametrize("metric", METRICS)
def test_with_all_pages_steep_meshes_are_those_of_the_whole_map(steep, metric):
    check_equal(steep, 3, [metric])


@pytest.mark.slow
@pytest.mark.parametrize("metric", METRICS)
def test_whatever_is_there_of_steep_maps_achieves_what_is_certified(steep, metric, alone):
    check_bounds(steep, 1, 3, [metric])


def test_a_view_loads_what_it_needs_and_no_more(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        for error_px, least in ((8.0, 0), (0.4, 1)):
            before = len(renderer.terrain.slot_of)
            stats = renderer.draw(camera, error_px, style="lambert")
            assert stats["complete"] and stats["tiles_missing"] == []
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"] <= error_px
            assert stats["tiles_resident"] >= before + least
        assert stats["tiles_resident"] < len(all_pages(renderer.heightmap))


@pytest.mark.parametrize("gpu_kib", [4000, 420])
def test_a_repeatable_picture_does_not_depend_on_earlier_ones(hills, gpu_kib):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = gpu_kib << 10
    width, depth = whole.extent_m
    above, here = (Camera((0.5 * width, 0.5 * depth, z), (0.5 * width + 1, 0.6 * depth, 0)) for z in (300, 90))

    def picture():
        return renderer.render(above, 2.0, style="normals").image

    with Renderer(stored, SIZE) as renderer, renderer.session:
        alone = picture()
        renderer.draw(here, 0.3, style="normals")
        changed = picture()
        renderer.streaming.is_repeatable = True
        same = picture()
        resident = renderer.draw(here, 0.3, style="normals")["tiles_resident"]
        assert resident <= renderer.terrain.slots
        np.testing.assert_array_equal(picture(), alone)
        renderer.streaming.is_repeatable = False
        assert renderer.draw(above, 2.0, style="normals")["tiles_resident"] >= resident
        loaded = renderer.terrain.slot_of
        assert all(key in renderer.terrain.roots or page_above(key) in loaded for key in loaded)
    np.testing.assert_array_equal(same, alone)
    assert (changed != alone).any()


def test_a_small_pool_is_never_exceeded_and_says_what_has_no_room(hills):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = 300 << 10
    with Renderer(stored, SIZE) as renderer, renderer.session:
        stats = renderer.draw(standard_view(whole, "default"), 0.2, style="lambert")
        assert renderer.terrain.slots < len(all_pages(stored))
        assert stats["tiles_resident"] <= renderer.terrain.slots
        assert stats["gpu_bytes"]["heights"] + stats["gpu_bytes"]["sat"] <= 300 << 10
        assert not stats["complete"] and "no room" in stats["tiles_missing"][0]["reason"]
        assert 0.2 < stats["certified_max_error_px"] >= renderer.measure()["max_error_px"]


def test_a_pool_that_is_full_of_other_places_makes_room(hills):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = 420 << 10
    width, depth = whole.extent_m
    with Renderer(stored, SIZE) as renderer, renderer.session:
        seen = set()
        for x, y in ((0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (0.1, 0.1)):
            eye = x * width, y * depth, whole.range_m[1] + 20
            stats = renderer.draw(Camera(eye, (eye[0] + 1, eye[1], 0)), 0.5, style="lambert")
            assert stats["complete"] and stats["tiles_resident"] <= renderer.terrain.slots
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"] <= 0.5
            seen |= renderer.terrain.slot_of.keys()
        assert len(seen) > renderer.terrain.slots


# --- Faults -----------------------------------------------------------------------------------------------------------


class Faulty(StoredMap):
    """A store of which every third fine tile fails."""

    def page(self, key):
        if key[0] < 2 and sum(key) % 3 == 0:
            raise TerrainError(f"{key}: its checksum does not fit")
        return super().page(key)


@pytest.mark.slow
def test_tiles_that_fail_are_named_and_bounded_by_coarser_ones(hills):
    whole, path = hills
    rng = np.random.default_rng(5)
    with Renderer(Faulty(path), SIZE) as renderer:
        named = False
        for _ in range(4):
            stats = renderer.draw(random_view(whole, rng), 0.5, style="lambert")
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"]
            assert stats["complete"] or stats["tiles_missing"]
            named = named or any("checksum" in tile["reason"] for tile in stats["tiles_missing"])
        assert named


def test_other_methods_are_refused(hills):
    with Renderer(StoredMap(hills[1]), SIZE) as renderer, pytest.raises(UsageError, match="store"):
        renderer.draw(Camera((100, 100, 300), (100, 200, 0)), 1, method="full")


def test_the_smallest_budgets_give_a_mesh_of_few_triangles(hills):
    whole, path = hills
    with Renderer(StoredMap(path), SIZE) as renderer:
        for camera in (Camera((100, 100, 300), (100, 200, 0)), standard_view(whole, "valley")):
            stats = renderer.draw(camera, triangles=2, style="lambert")
            assert stats["complete"] and stats["triangles"] < 100
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"]


def test_a_context_draws_whole_maps_after_a_store(ctx, hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(whole, SIZE, ctx=ctx) as renderer:
        expected = renderer.draw(camera, 1.0, style="depth")["triangles"]
    with Renderer(StoredMap(path), SIZE, ctx=ctx) as renderer:
        renderer.draw(camera, 1.0, style="depth")
    with Renderer(whole, SIZE, ctx=ctx) as renderer:
        assert renderer.draw(camera, 1.0, style="depth")["triangles"] == expected
        assert renderer.measure()["max_error_px"] <= 1.0


# --- Maps larger than any memory --------------------------------------------------------------------------------------


class Watched(Endless):
    """200,000 × 90,000 posts in small pages; it remembers the largest window that was read."""

    tile, gpu_bytes, most = 64, 64 << 20, 0

    def lattice_heights(self, level, rows, cols):
        self.most = max(self.most, (rows.stop - rows.start) * (cols.stop - cols.start))
        return super().lattice_heights(level, rows, cols)


@pytest.mark.slow
def test_a_map_of_eighteen_thousand_million_posts_is_drawn_and_measured():
    endless = Watched()
    assert math.prod(endless.heights.shape) == 18_000_000_000
    with Renderer(endless, SIZE) as renderer, renderer.session:
        for camera in (over_middle(endless, 300.0, 500.0), over_middle(endless, 40_000.0, 9000.0)):
            stats = renderer.draw(camera, 2.0, style="lambert")
            assert stats["complete"] and stats["certified_max_error_px"] <= 2.0
            assert stats["tiles_resident"] <= renderer.terrain.slots < 2000
        renderer.draw(over_middle(endless, 300.0, 500.0), 2.0, style="lambert")
        assert endless.most <= 66**2
        assert 0 < renderer.measure()["max_error_px"] <= stats["certified_max_error_px"]
    assert endless.most <= (TILE + 2) ** 2  # the truth is read tile by tile


def off_two_triangles(posts):
    """How far posts lie off two triangles between their four corners, with either diagonal."""
    u, v = np.meshgrid(*[np.linspace(0, 1, len(posts))] * 2)
    for h in (posts.astype(float), posts[:, ::-1].astype(float)):
        (a, b), (c, d) = h[:: len(h) - 1, :: len(h) - 1]
        drawn = np.where(u >= v, a + u * (b - a) + v * (d - b), a + v * (c - a) + u * (d - c))
        yield np.abs(drawn - h).max()


def test_the_records_of_the_endless_land_hold():
    """On random nodes: windows of any stride have the same posts; errors and ranges are within the records."""
    endless, rng = Endless(), np.random.default_rng(3)
    _, low_m, span_m = quantisation_range(*endless.quantised_m)
    tightest = np.inf
    for level in (1, 2, 3, 4, 6):
        n = 1 << level
        for row, col in rng.integers(0, np.array(endless.nodes(level)) - 1, (10, 2)):
            page = endless.page((level, int(row) // endless.tile, int(col) // endless.tile))
            y, x = row % endless.tile, col % endless.tile
            posts = endless.heights[row * n : row * n + n + 1, col * n : col * n + n + 1]
            assert (page.heights[y : y + 2, x : x + 2] == posts[::n, ::n]).all()
            assert (
                endless.heights[row * n : row * n + n + 1 : n, col * n : col * n + n + 1 : 2] == posts[::n, ::2]
            ).all()
            largest_m = float(np.uint16(page.errors[y, x] & 0xFFFF).view(np.float16)) * span_m * ERROR_UNIT
            found_m = max(off_two_triangles(posts))
            assert found_m <= largest_m
            tightest = min(tightest, largest_m / found_m)
            lowest_m, highest_m = page.ranges[:, y, x] / 65535 * span_m + low_m
            assert lowest_m <= posts.min() and posts.max() <= highest_m
    assert tightest < 5  # the bounds say something


# --- The command line -------------------------------------------------------------------------------------------------


def test_commands_read_stores(store, run):
    status, out, _ = run("measure", store, "--size", "96x64", "--max-error", "2", "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats["complete"] and stats["within_tolerance"] == 1
    assert stats["max_error_px"] <= stats["certified_max_error_px"] <= 2 and stats["holes"] == 0
    told = json.loads(run("info", store, "--json", "-")[1])["map"]
    assert (told["cols"], told["rows"], told["store"]["tile"]) == (261, 200, 16)


def test_a_flight_over_a_store_waits_for_each_frame(store, run):
    size = ("--size", "64x48", "--seconds", "0.2", "--fps", "10", "--max-error", "2", "--style", "lambert")
    status, _, err = run("fly", store, "-o", "frames/", *size, "--measure", "--json", "n.json")
    frames = json.loads(Path("n.json").read_text())["frames"]
    assert (status, err, len(list(Path("frames").glob("*.png")))) == (0, "", 2)
    assert all(frame["complete"] and frame["max_error_px"] <= frame["certified_max_error_px"] <= 2 for frame in frames)


def test_frames_over_a_store_are_pictures_of_their_own(store, run):
    words = ("--size", "96x54", "--seconds", "0.3", "--fps", "10", "--max-error", "2", "--style", "normals")
    assert run("fly", store, "-o", "frames/", *words)[0] == 0
    stored = StoredMap(store)
    *_, last = tour(stored).poses(3)
    with Renderer(stored, (96, 54)) as renderer:
        alone = renderer.render(last.camera, max_error_px=2, style="normals").image
    np.testing.assert_array_equal(read_image("frames/frame-00003.png"), alone[..., :3])


@pytest.mark.slow
def test_a_damaged_tile_ends_a_shot_with_one_line(store):
    cut_heights(store)
    words = ("--size", "96x64", "--max-error", "0.05", "--view", "ridge", "--style", "lambert", "--json", "n.json")
    done = spawn("shot", store, "-o", "p.png", *words)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "not complete" in done.stderr
    stats = json.loads(Path("n.json").read_text())
    assert not stats["complete"] and stats["certified_max_error_px"] > 0.05 and stats["within_tolerance"] < 1
    assert all("heights/0" in tile["reason"] for tile in stats["tiles_missing"])


@pytest.mark.slow
def test_a_damaged_tile_ends_a_measurement_and_a_flight_with_one_line(store, run):
    path = [{"eye": [x, 100, 90], "target": [200, 200, 0]} for x in (100, 150)]
    Path("path.json").write_text(json.dumps({"keyframes": path}))
    cut_heights(store)
    refused(run("measure", store, "--size", "96x64"), 1, "heights/0")
    words = ("--path", "path.json", "--size", "64x48", "--seconds", "0.2", "--fps", "10", "--max-error", "0.01")
    status, _, err = run("fly", store, "-o", "frames/", *words)
    assert status == 1 and err.count("\n") == 1 and "not complete" in err and "heights/0" in err


def test_what_cannot_read_stores_says_so(store, run):
    readers = "shot, measure, mesh, tiles, check, fly, view and info"
    refused(run("compare", store, "-o", "f.png"), 1, "is a store", readers)
    refused(run("shot", store, "-o", "p.png", "--spacing", "3"), 2, "has its own scales")
    refused(run("shot", store, "-o", "p.png", "--gpu-memory", "1", "--memory", "1", "--method", "full"), 2, "sat")
    Path(store, "zarr.json").write_text("{}")
    refused(run("info", store), 1, "is damaged, or of no store", "--mend")
