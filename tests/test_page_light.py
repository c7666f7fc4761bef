"""Light of stores: horizons of pages against their twin and the whole map's, pictures, flights, limits, bad sources."""

import threading

import numpy as np
import pytest
from test_streaming import until

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.ground import towards_sun
from terrain_gl.light.horizon import AZIMUTHS, lattice_direction
from terrain_gl.pages import light as page_light
from terrain_gl.pages import windows as page_windows
from terrain_gl.pages.sweep import PageSweep
from terrain_gl.pages.windows import MARGIN, windows_of
from terrain_gl.renderer import Renderer

pytest.importorskip("zarr")
from terrain_gl.store import build
from terrain_gl.store.opened import StoredMap

SIZE = (96, 54)
LIT = {"style": "shaded", "surroundings": "none", "grain": "off"}
DIRECTIONS = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.25, -1.0), (-1.0, 0.5), (1.0, -1.0), (-0.75, -1.0)]


def load_all(renderer):
    with renderer.session:
        numbering = renderer.terrain.numbering
        renderer.tables.load(map(numbering.key, range(numbering.total)))


def make_light(renderer, sun, keys):
    """Light of some pages for a sun (azimuth, elevation)."""
    with renderer.session:
        renderer.tables.load(keys)
        light = renderer.picture.lighting.visibility
        renderer.terrain.in_use = lambda: [*renderer.terrain.roots, *keys]
        for _ in light.follow_steps(towards_sun(*sun)):
            pass
        assert light.missing == 0 and light.is_there
        return light.sweep


def of_slot(renderer, texture, key, dtype):
    """A page's part of a pool."""
    terrain = renderer.terrain
    pool = np.frombuffer(texture.read(alignment=1), dtype).reshape(texture.height, texture.width, -1)
    side, slot = texture.width // terrain.across, terrain.slot_of[key]
    row, col = slot // terrain.across * side, slot % terrain.across * side
    return pool[row : row + side, col : col + side]


def sines_of(renderer, key):
    """Sines of the sun's horizon of a page's posts."""
    with renderer.session:
        sweep = renderer.picture.lighting.visibility.sweep
        return of_slot(renderer, sweep.sun, key, "u2")[..., 0] / 32767.5 - 1


def degrees(sines):
    return np.degrees(np.arcsin(np.clip(sines, -1, 1)))


def difference(one, other):
    """RMSE of two pictures, in steps of 8 bits."""
    return np.sqrt(np.mean((one[..., :3].astype(float) - other[..., :3]) ** 2))


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    """A plain with a wall of 300 m in the east, 200 posts from its western rim, and its store."""
    heights = np.zeros((97, 257), np.float32)
    heights[:, 250:] = 300
    path = tmp_path_factory.mktemp("store") / "wall"
    build(heights, path, tile=16, shard=64, spacing_m=5.0)
    return Heightmap(heights, 5.0), path


# --- Horizons ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("towards", DIRECTIONS)
def test_horizons_of_a_page_are_those_of_its_twin(hills, towards):
    whole, path = hills
    stored = StoredMap(path)
    with Renderer(stored, SIZE) as renderer, renderer.session:
        sweep = PageSweep(renderer.terrain)
        for key in ((0, 6, 7), (0, 0, 0), (1, 2, 8), (2, 1, 1)):
            windows = windows_of(stored, key)
            sweep.send(windows, key[0])
            for _ in sweep.sun_steps(0, towards):
                pass
            posts, expected = line_posts(stored, windows, towards, key[0])
            records = np.frombuffer(sweep._horizons.read(), "u2").reshape(AZIMUTHS, sweep._side + 1, -1)[0]
            found = records[posts[..., 1], posts[..., 0]] / 32767.5 - 1
            assert (expected > -1).mean() > 0.5
            np.testing.assert_allclose(found, expected, atol=2e-4)  # 16 bits: 1.5e-5; heights of 100 m in 32 bits
        sweep.release()


def line_posts(stored, windows, towards, level):
    """Posts of a page and its margin on the map, and the sines of the lines' points nearest to them."""
    side = windows.heights.shape[1] - 1
    low, high = (side - stored.tile) // 2 - MARGIN, (side + stored.tile) // 2 + MARGIN
    x, y = np.meshgrid(np.arange(low, high + 1), np.arange(low, high + 1))
    posts = np.stack([x, y], -1)
    posts = posts[((posts >= windows.inside[0, :2]) & (posts <= windows.inside[0, 2:])).all(-1)]
    axis = 0 if abs(towards[0]) >= abs(towards[1]) else 1
    steps = side - posts[:, axis] if towards[axis] > 0 else posts[:, axis]
    drift, points = -towards[1 - axis] * steps, posts.astype(float)
    points[:, 1 - axis] += drift - np.floor(drift + 0.5)
    spacing = tuple(s * 2.0**level for s in stored.spacing_m)
    return posts, reference.windowed_sines(windows, points, towards, spacing)


@pytest.mark.parametrize("azimuth", [90, 180])
def test_horizons_of_pages_are_close_to_the_whole_maps(hills, azimuth):
    """Mean errors of the angle: 0.3 degrees for the finest pages, in windows of 48 posts a side."""
    whole, path = hills
    towards = lattice_direction(towards_sun(azimuth, 20), whole.spacing_m)
    with Renderer(StoredMap(path), SIZE) as renderer:
        keys = [(0, 6, 7), (0, 3, 12), (0, 9, 2)]
        make_light(renderer, (azimuth, 20), keys)
        for _, row, col in keys:
            y, x = np.mgrid[row * 16 : row * 16 + 17, col * 16 : col * 16 + 17]
            truth = degrees(reference.horizon_sines(whole.heights, np.stack([x, y], -1), towards, whole.spacing_m))
            found = degrees(sines_of(renderer, (0, row, col)))
            assert np.abs(found - truth).mean() < 0.3


def test_far_land_still_shades(wall):
    """A wall 1 km away and 300 m high is 16 degrees high. Without coarser windows no horizon contains it."""
    heightmap, path = wall
    with Renderer(StoredMap(path), SIZE) as renderer:
        make_light(renderer, (90, 10), [(0, 3, 3)])
        angle = degrees(sines_of(renderer, (0, 3, 3)))
        x = np.arange(48, 65)
        np.testing.assert_allclose(angle, np.broadcast_to(np.degrees(np.arctan(60 / (250 - x))), (17, 17)), atol=0.6)


def test_without_coarser_windows_far_land_does_not(wall, monkeypatch):
    monkeypatch.setattr(page_windows, "window_count", lambda *_: 2)
    heightmap, path = wall
    with Renderer(StoredMap(path), SIZE) as renderer:
        make_light(renderer, (90, 10), [(0, 3, 3)])
        assert degrees(sines_of(renderer, (0, 3, 3))).max() < 1.0


def test_windows_are_the_lattice_of_their_level(hills):
    whole, path = hills
    windows = windows_of(StoredMap(path), (0, 6, 7))
    x0, y0 = 7 * 16 - 16, 6 * 16 - 16
    for k, (heights, shift, inside) in enumerate(zip(*windows, strict=True)):
        cols = ((np.arange(inside[0], inside[2] + 1) << k) + shift[0] + x0).clip(0, 260)
        rows = ((np.arange(inside[1], inside[3] + 1) << k) + shift[1] + y0).clip(0, 199)
        part = heights[inside[1] : inside[3] + 1, inside[0] : inside[2] + 1]
        np.testing.assert_array_equal(part, whole.heights[np.ix_(rows, cols)])
    assert k >= 3 and cols[0] == 0 and cols[-1] == 260


class Torn(StoredMap):
    """A store of which a fine tile cannot be read."""

    def lattice_heights(self, level, rows, cols):
        if level == 0 and rows.start <= 100 < rows.stop and cols.start <= 130 < cols.stop:
            raise TerrainError("it is damaged")
        return super().lattice_heights(level, rows, cols)


def test_a_missing_tile_is_replaced_by_a_coarser_one(hills):
    whole, path = hills
    torn, sound = windows_of(Torn(path), (0, 6, 7)), windows_of(StoredMap(path), (0, 6, 7))
    differs = torn.heights != sound.heights
    assert differs[0].any() and not differs[1:].any()
    row, col = np.argwhere(differs[0]).T
    assert row.min() >= 16 and col.min() >= 32  # the tile of the posts 96 to 111 and 128 to 143
    assert np.abs(torn.heights - sound.heights).max() < 0.2 * np.ptp(whole.heights)


# --- Pictures ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_lit_picture_of_all_tiles_is_close_to_that_of_the_map_in_memory(hills):
    """The difference is mostly in the edges of shadows; without the light it is several times as large."""
    whole, path = hills
    stored = StoredMap(path)
    stored.look = whole.look = "alpine"
    with Renderer(whole, (192, 108)) as one, Renderer(stored, (192, 108)) as other:
        load_all(other)
        camera = standard_view(whole, "default")
        expected = one.render(camera, 1.0, sun=(300, 25), **LIT).image
        frame = other.render(camera, 1.0, sun=(300, 25), **LIT)
        assert frame.stats["complete"] and frame.stats["tiles_unlit"] == 0
        assert difference(frame.image, expected) < 2.0  # measured: 0.53
        plain = other.render(camera, 1.0, style="lambert").image
        assert difference(plain, expected) > 12.0


def test_light_does_not_depend_on_what_came_before(hills):
    whole, path = hills
    first, then = (standard_view(whole, name) for name in ("default", "ridge"))
    found = []
    for views in ([then], [first, then]):
        with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
            for camera in views:
                renderer.draw(camera, 2.0, sun=(200, 20), **LIT)
            sweep, keys = renderer.picture.lighting.visibility.sweep, renderer.terrain.in_use()
            with renderer.session:
                found.append({k: [of_slot(renderer, t, k, d).copy() for t, d in pools(sweep)] for k in keys})
    both = found[0].keys() & found[1].keys()  # finer pages of the first view may be used in place of coarse ones
    assert len(both) > 9
    for key in both:
        for part, other in zip(found[0][key], found[1][key], strict=True):
            np.testing.assert_array_equal(part, other)


def pools(sweep):
    return (sweep.sun, "u2"), (sweep.sky, "u4")


def test_the_sun_moves_without_the_sky(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        renderer.draw(camera, 4.0, sun=(100, 15), **LIT)
        sweep = renderer.picture.lighting.visibility.sweep
        sun, sky = (texture.read() for texture, _ in pools(sweep))
        monkey = sweep.sky_steps
        sweep.sky_steps = lambda slot: pytest.fail("the sky is made again")
        image = renderer.render(camera, 4.0, sun=(280, 15), **LIT).image
        sweep.sky_steps = monkey
        assert sweep.sun.read() != sun and sweep.sky.read() == sky
        with Renderer(StoredMap(path), SIZE) as fresh:
            assert difference(fresh.render(camera, 4.0, sun=(280, 15), **LIT).image, image) < 0.5


@pytest.mark.parametrize("kib", [300, 500])
def test_light_is_within_the_limit_of_memory(hills, kib):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = kib << 10
    with Renderer(stored, SIZE) as renderer:
        stats = renderer.draw(standard_view(whole, "default"), 3.0, **LIT)
        assert stats["gpu_bytes"]["shade"] > 100 << 10 and stats["tiles_unlit"] == 0
        assert sum(stats["gpu_bytes"][part] for part in ("heights", "sat", "shade")) <= kib << 10


# --- Flights ----------------------------------------------------------------------------------------------------------


class Held(StoredMap):
    """A store whose heights wait until they are let go, for light alone."""

    def __init__(self, path):
        super().__init__(path)
        self.gate = threading.Event()

    def lattice_heights(self, level, rows, cols):
        self.gate.wait(100)
        return super().lattice_heights(level, rows, cols)


FINE_PX = 0.05  # so fine that all pages in the picture are loaded, whatever came before


@pytest.mark.slow
def test_a_flight_does_not_wait_for_light_and_gets_it(hills, monkeypatch):
    monkeypatch.setattr(page_light, "PATIENCE_S", 600.0)
    whole, path = hills
    camera = standard_view(whole, "default")
    stored = Held(path)
    with Renderer(stored, SIZE) as renderer, Renderer(StoredMap(path), SIZE) as other:
        renderer.streaming.waits = False
        until(lambda: renderer.draw(camera, FINE_PX, sun=(300, 12), **LIT)["complete"])
        dark = renderer.render(camera, FINE_PX, sun=(300, 12), **LIT)
        assert dark.stats["tiles_unlit"] > 3  # pages whose surroundings nobody has read
        stored.gate.set()
        until(lambda: not renderer.draw(camera, FINE_PX, sun=(300, 12), **LIT)["tiles_unlit"])
        lit = renderer.render(camera, FINE_PX, sun=(300, 12), **LIT).image
        expected = other.render(camera, FINE_PX, sun=(300, 12), **LIT).image
        assert difference(lit, expected) < 0.5 < 2.0 < difference(dark.image, expected)


@pytest.mark.slow
@pytest.mark.parametrize("rehearses", [True, False])
def test_a_flight_compiles_nothing_when_light_comes(hills, monkeypatch, rehearses):
    """Its first picture runs all passes of light once; otherwise a frame in the middle would take much longer."""
    if not rehearses:
        monkeypatch.setattr(page_light.PageVisibility, "rehearse", lambda self: False)
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        renderer.streaming.waits = False
        renderer.draw(camera, FINE_PX, **LIT)
        picture = renderer.picture
        programs = len(picture.programs)
        assert not picture.lighting.is_there
        until(lambda: (stats := renderer.draw(camera, FINE_PX, **LIT))["complete"] and not stats["tiles_unlit"])
        assert (len(picture.programs) == programs) == rehearses
        lit = renderer.render(camera, FINE_PX, **LIT).image
    with Renderer(StoredMap(path), SIZE) as other:
        assert difference(lit, other.render(camera, FINE_PX, **LIT).image) < 0.5


def test_a_page_that_comes_is_lit_by_the_page_above_until_it_has_light(hills):
    whole, path = hills
    camera = Camera((200, 150, 200), (260, 200, 0))
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        renderer.draw(camera, 8.0, **LIT)
        terrain = renderer.terrain
        before = {key for key in terrain.slot_of if terrain.is_lit(key)}
        renderer.draw(camera, 0.5, style="lambert")
        came = terrain.slot_of.keys() - before
        assert came and not any(map(terrain.is_lit, came))
        assert renderer.draw(camera, 0.5, **LIT)["tiles_unlit"] == 0
        assert all(map(terrain.is_lit, terrain.in_use()))


def test_light_of_a_page_whose_surroundings_cannot_be_read_is_missing(hills):
    class Blind(StoredMap):
        def lattice_heights(self, level, rows, cols):
            raise TerrainError("it is damaged")

    with Renderer(Blind(hills[1]), SIZE) as renderer:
        stats = renderer.draw(standard_view(hills[0], "default"), 4.0, **LIT)
        assert stats["complete"] and stats["tiles_unlit"] > 0  # drawn as lambert


def test_normals_of_coarse_pages_have_no_steps(tmp_path, alone):
    """On a parabola the slope grows evenly. With boxes smaller than a cell it would jump at every 8th post."""
    x = np.arange(129, dtype=np.float32) - 64
    build(np.broadcast_to(0.005 * x * x, (129, 129)).copy(), tmp_path / "s", tile=16, shard=64, spacing_m=1.0)
    with Renderer(StoredMap(tmp_path / "s"), (96, 54)) as renderer, renderer.session:
        assert renderer.terrain.top_level >= 3  # the coarsest pages alone
        above = Camera((64, 64, 120), (64, 64.01, 0), fov_deg=40)
        red = renderer.render(above, 1.0, style="normals").image[27, 8:-8, 0].astype(int)
    steps = np.abs(np.diff(red))
    assert np.ptp(red) > 40 and steps.max() <= 6  # measured: 3; with jumps: 61
