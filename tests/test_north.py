"""Azimuths count from true north, in every coordinate system: the sun, its time, skies, the arrow of the furniture."""

import numpy as np
import pytest
from rasters import write_raster

from terrain_gl.camera import Camera
from terrain_gl.cli.records import SunOptions
from terrain_gl.cli.scene import clock_sun
from terrain_gl.files.furniture import north_of
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.light.lighting import sky_seen
from terrain_gl.readers.georeference import Georeference, Grid
from terrain_gl.renderer import Renderer

pyproj = pytest.importorskip("pyproj")

N = 65
# a coordinate system, a place there, and true north clockwise from the grid's, by the longitude of its middle meridian
SYSTEMS = {
    "arctic": ("EPSG:3413", -150.0, 70.0, 105.0),
    "antarctic": ("EPSG:3031", 90.0, -75.0, 90.0),
    "Greenland": ("EPSG:3995", 45.0, 80.0, -45.0),
    "Mercator": ("EPSG:3857", 30.0, 60.0, 0.0),
    "degrees": ("EPSG:4326", 30.0, 60.0, 0.0),
    "utm, in the middle": ("EPSG:32633", 15.0, 53.0, 0.0),
    "utm, at the edge": ("EPSG:32633", 18.0, 60.0, None),
    "europe": ("EPSG:3035", -9.0, 53.0, None),
    "canada": ("EPSG:3979", -130.0, 60.0, None),
    "new zealand": ("EPSG:3994", 160.0, -40.0, None),
}


def convergence(crs, lon, lat):
    """True north clockwise from the grid's, by PROJ's own factors of the projection."""
    if pyproj.CRS(crs).is_geographic:
        return 0.0
    return -pyproj.Proj(crs).get_factors(lon, lat).meridian_convergence


def cone(crs, lon, lat, step=60.0):
    if pyproj.CRS(crs).is_geographic:
        step = 6e-4
    x, y = pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True).transform(lon, lat)
    row, col = np.mgrid[:N, :N]
    heights = np.maximum(0.0, 1500.0 - 45 * np.hypot(col - N // 2, row - N // 2))
    heightmap = Heightmap(heights, (30.0, 60.0) if crs == "EPSG:4326" else 60.0)
    grid = Grid(step, 0.0, x - N * step / 2, 0.0, -step, y + N * step / 2)
    heightmap.georeference = Georeference(grid, crs, (N, N))
    return heightmap


@pytest.mark.parametrize("name", SYSTEMS)
def test_true_north_is_known(name):
    crs, lon, lat, by_meridian = SYSTEMS[name]
    found = cone(crs, lon, lat).north_deg
    assert found == pytest.approx(convergence(crs, lon, lat), abs=0.01)
    if by_meridian is not None:
        assert found == pytest.approx(by_meridian, abs=0.01)


def test_without_a_system_north_is_the_grids():
    assert Heightmap(np.zeros((3, 3))).north_deg == 0
    heightmap = cone("EPSG:3413", -150.0, 70.0)
    heightmap.georeference = heightmap.georeference._replace(crs=None)
    assert heightmap.north_deg == 0


@pytest.mark.parametrize("name", ["arctic", "antarctic", "europe", "utm, in the middle"])
@pytest.mark.parametrize("style", ["shaded", "lambert"])
def test_the_sun_shines_from_its_true_azimuth(ctx, name, style):
    crs, lon, lat, _ = SYSTEMS[name]
    heightmap = cone(crs, lon, lat)
    middle = heightmap.extent_m[0] / 2
    down = Camera((middle, middle, 12000.0), (middle, middle, 0.0), 14.0)
    with Renderer(heightmap, (128, 128), ctx=ctx) as renderer:
        image = renderer.render(down, sun=(90, 30), style=style, look="grey").image[..., :3].astype(float).mean(-1)
    y, x = np.mgrid[:128, :128] - 63.5
    ring = (np.hypot(x, y) > 15) & (np.hypot(x, y) < 40)
    azimuth = np.degrees(np.arctan2(x, -y))[ring]
    light = image[ring] - image[ring].mean()
    brightest = np.degrees(np.angle((light * np.exp(1j * np.radians(azimuth))).sum()))
    turned = (brightest - 90 - convergence(crs, lon, lat) + 180) % 360 - 180
    assert abs(turned) < 4


@pytest.mark.parametrize("name", ["arctic", "europe"])
def test_the_arrow_points_to_true_north(name):
    crs, lon, lat, _ = SYSTEMS[name]
    heightmap = cone(crs, lon, lat)
    middle = heightmap.extent_m[0] / 2
    down = Camera((middle, middle, 12000.0), (middle, middle, 0.0), 14.0)
    right, up = north_of(down, heightmap.north_deg)
    place = heightmap.place
    (x0, y0), (x1, y1) = place.from_lonlat(lon, lat), place.from_lonlat(lon, lat + 1e-3)
    assert (right, up) == pytest.approx(np.array([x1 - x0, y1 - y0]) / np.hypot(x1 - x0, y1 - y0), abs=1e-3)


def test_a_sky_of_a_file_is_turned_with_north(folder):
    light = np.full((64, 128, 3), 0.1, np.float32)
    light[16, 96] = 1e4  # a sun in the east, 45 degrees high
    write_image("sky.exr", light)
    for north in (0.0, 90.0, -45.0):
        east, along, _ = (float(v) for v in sky_seen((0.0, 0.0), "sky.exr", north_deg=north).sun["axis"])
        assert np.degrees(np.arctan2(east, along)) % 360 == pytest.approx((91.4 + north) % 360, abs=1.5)


def test_the_time_of_day_gives_a_true_azimuth():
    """At solar noon the sun is in the south of a northern map, wherever its grid points."""
    from datetime import datetime

    heightmap = cone(*SYSTEMS["arctic"][:3])
    noon = SunOptions(time=datetime(2026, 6, 21, 12))
    azimuth, _ = clock_sun(noon, heightmap)
    assert azimuth == pytest.approx(180, abs=1)


def test_a_turned_grid_gets_a_line(run, folder):
    for name in ("arctic", "Mercator"):
        heightmap = cone(*SYSTEMS[name][:3])
        write_raster("a.tif", heightmap.heights, heightmap.georeference.grid, heightmap.georeference.crs)
        _, said, told = run("shot", "a.tif", "-o", "a.png", "--size", "64x36", "--furniture")
        assert ("true north, from which the sun's azimuth counts, is 105.0 degrees clockwise" in told) == (
            name == "arctic"
        )
        _, said, _ = run("info", "a.tif")
        assert ("true north is 105.00 degrees" in said) == (name == "arctic")
