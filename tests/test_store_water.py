"""Water in the heights of a store: found, drawn and edited as in a map in memory."""

import numpy as np
import pytest
from maps import rough
from test_pages import SIZE, all_pages, load, pixels
from test_store import arrays_of, whole

from terrain_gl.camera import Camera
from terrain_gl.gpu.layout import VOID, WET
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.terrain.terrain import Water

pytest.importorskip("zarr")
from terrain_gl.store import StoredMap, build

SMALL = {"tile": 16, "shard": 64, "spacing_m": 20.0}


def coast(rows=200, cols=260):
    """A ring of land between a sea of height 0 and a lake, with a void."""
    y, x = np.mgrid[0:rows, 0:cols]
    away = np.hypot(x - 130, y - 100)
    heights = np.where(away > 88, 0, 20 + rough(rows, cols, seed=2, relief=10.0)).astype(np.float32)
    heights[away < 58] = 12.5
    heights[20:30, 150:160] = np.nan
    return heights


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    path = tmp_path_factory.mktemp("coast") / "s"
    build(coast(), path, **SMALL)
    return Heightmap(coast(), 20.0), path


@pytest.mark.slow
def test_water_is_that_of_the_map_in_memory(maps):
    mine, path = maps
    expected = Water.of(mine.heights)
    assert set(expected.levels_m) >= {0.0, 12.5}
    marks = whole(arrays_of(path), "marks", 0)
    np.testing.assert_array_equal((marks & WET) > 0, expected.posts)
    np.testing.assert_array_equal((marks & VOID) > 0, np.isnan(mine.heights))
    assert StoredMap(path).sea_m == expected.sea_m == 0.0


@pytest.mark.parametrize("shape", [(9, 70), (170, 130)])
def test_land_without_water_has_no_marks(tmp_path, shape):
    build(rough(*shape), tmp_path / "s", **SMALL)
    stored = StoredMap(tmp_path / "s")
    assert not stored.is_marked and stored.sea_m is None and not (tmp_path / "s" / "marks").exists()


@pytest.mark.slow
def test_pictures_show_the_water(maps):
    mine, path = maps
    camera = Camera((2600, -1500, 1500), (2600, 2000, 0))
    how = {"look": "alpine", "style": "shaded", "sun": (180.0, 60.0)}
    with Renderer(mine, SIZE) as one, Renderer(StoredMap(path), SIZE) as other, other.session:
        load(other, all_pages(other.heightmap))
        expected, found = (pixels(renderer, camera, 1.0, how).astype(float) for renderer in (one, other))
        other.terrain.heightmap.sea_m = None
        dry = pixels(other, camera, 1.0, how).astype(float)
    assert np.sqrt(np.mean((expected - found) ** 2)) < 6 < 12 < np.sqrt(np.mean((expected - dry) ** 2))


def test_an_edit_dries_what_it_lifts(maps):
    with Renderer(StoredMap(maps[1]), SIZE) as renderer:
        renderer.edit(slice(80, 90), slice(120, 140), 30.0)
        marks = renderer.heightmap.lattice_marks(0, slice(75, 95), slice(120, 140)) & WET
        assert not marks[5:15].any() and marks[:5].all() and marks[15:].all()
        page = renderer.heightmap.page((0, 5, 8)).marks & WET  # posts 80 to 96, 128 to 144
        assert not page[:10, :12].any() and page[10:].all()
