"""What values of files mean: units, depths, and values that contradict the land of the Earth. Files are by GDAL."""

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl import Heightmap
from terrain_gl.readers.windows import open_windows, windows_of

rasterio = pytest.importorskip("rasterio")
pytest.importorskip("pyproj")
xarray = pytest.importorskip("xarray")

FOOT, US_FOOT = 0.3048, 1200 / 3937


def land(low=400.0, high=800.0, shape=(65, 81)):
    """Smooth hills: the slope is below 1 with 20 m between posts."""
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    wave = np.sin(x / 13) * np.cos(y / 17)
    return (low + (high - low) * (wave - wave.min()) / np.ptp(wave)).astype(np.float32)


def write(path, heights, step=20.0, **options):
    return write_raster(path, heights, spaced(step), **options)


def asked(terrain):
    """Notes that ask for a scale."""
    return [note for note in terrain.notes if "--z-scale" in note]


WKT = rasterio.crs.CRS.from_epsg(32633).to_wkt()
DOWN_IN_FEET = f'COMPD_CS["x",{WKT},VERT_CS["d",VERT_DATUM["d",2005],UNIT["foot",0.3048],AXIS["Depth",DOWN]]]'
ESRI_DOWN = 'VERTCS["x",VDATUM["x"],PARAMETER["Vertical_Shift",0.0],PARAMETER["Direction",-1.0],UNIT["Meter",1.0]]'
# how a file is written; metres of one unit of value, below 0 for depths
DECLARED = {
    "vertical system, US feet": ({"crs": "EPSG:2260+6360"}, US_FOOT),
    "vertical system, US feet, GeoTIFF 1.0": ({"crs": "EPSG:2260+6360", "GEOTIFF_VERSION": "1.0"}, US_FOOT),
    "vertical system, feet": ({"crs": "EPSG:4269+8228", "step": 0.0002}, FOOT),
    "depth, metres": ({"crs": "EPSG:32633+5715"}, -1.0),
    "depth, metres, GeoTIFF 1.0": ({"crs": "EPSG:32633+5715", "GEOTIFF_VERSION": "1.0"}, -1.0),
    "depth, US feet": ({"crs": "EPSG:32633+6358"}, -US_FOOT),
    "depth, feet, a system of its own": ({"crs": DOWN_IN_FEET, "driver": "PNG"}, -FOOT),
    "depth, a system of ESRI": ({"crs": f'COMPD_CS["x",{WKT},{ESRI_DOWN}]', "driver": "PNG"}, -1.0),
    "Black Sea depth": ({"crs": "EPSG:32633+5336"}, -1.0),
    "band unit, US feet": ({"unit": "US survey foot"}, US_FOOT),
    "band unit, feet, over a vertical system in metres": ({"crs": "EPSG:32633+5773", "unit": "ft"}, FOOT),
    "band unit, centimetres": ({"unit": "cm"}, 0.01),
    "band unit with a full stop": ({"unit": "U.S. survey feet"}, US_FOOT),
    "attribute positive": ({"tags": [{"positive": "down", "units": "m"}]}, -1.0),
    "attribute standard_name": ({"tags": [{"standard_name": "sea_floor_depth_below_geoid"}]}, -1.0),
    "attribute units": ({"tags": [{"units": "feet"}]}, FOOT),
    "positive is up, whatever the name": ({"tags": [{"positive": "up", "standard_name": "depth"}]}, 1.0),
    "unit and a comma": ({"unit": "m, positive down"}, -1.0),
    "unit in brackets": ({"unit": "[ft]"}, FOOT),
    "geopotential of a weather model": ({"unit": "m**2 s**-2"}, 1 / 9.80665),
    "geopotential metres": ({"unit": "gpm"}, 1.0),
    "metres above sea level": ({"unit": "m.a.s.l."}, 1.0),
    "a unit that says nothing, in US feet": ({"unit": "unitless", "crs": "EPSG:2260+6360"}, US_FOOT),
    "a comment": ({"tags": [{"comment": "soundings, positive down"}]}, -1.0),
}


@pytest.mark.parametrize("name", DECLARED)
def test_what_a_file_declares_is_believed(tmp_path, name):
    how, unit_m = DECLARED[name]
    values = np.round(land(5, 80)).astype(np.uint16)
    path = write(tmp_path / "a.tif", values, **how)
    with rasterio.open(path) as data:
        ways = [Heightmap.open(path), open_windows([path])]
        ways += [Heightmap.of(data)] if how.get("GEOTIFF_VERSION") is None else []
        for terrain in ways:
            heights = terrain.heights if isinstance(terrain, Heightmap) else terrain.read(slice(0, 65), slice(0, 81))
            np.testing.assert_allclose(heights, values * unit_m, rtol=1e-6)
            assert not asked(terrain)
            assert ("down" in terrain.values) == (unit_m < 0)


@pytest.mark.parametrize(
    ("driver", "ending", "header", "line", "unit_m"),
    [
        ("SAGA", "sdat", "sgrd", ("UNIT\t=", "UNIT\t= feet"), FOOT),
        ("SAGA", "sdat", "sgrd", ("Z_FACTOR\t= 1.0", "Z_FACTOR\t= 0.1"), 0.1),
        ("SAGA", "sdat", "sgrd", ("", ""), 1.0),
        ("AAIGrid", "asc", "prj", ("", "Zunits        FEET\n"), FOOT),
        ("AAIGrid", "asc", "prj", ("", "Zunits        100\n"), 0.01),
        ("AAIGrid", "asc", "prj", ("", "Zunits        NO\n"), 1.0),
    ],
)
def test_headers_that_gdal_does_not_read(tmp_path, driver, ending, header, line, unit_m):
    path = write(tmp_path / f"a.{ending}", land(5, 80), driver=driver)
    (tmp_path / f"a.{ending}.aux.xml").unlink(missing_ok=True)
    beside = path.with_suffix(f".{header}")
    old = "Projection UTM\nZone 33\nDatum WGS84\nUnits METERS\n"
    text = beside.read_text().replace(*line, 1) if driver == "SAGA" else old + line[1] + "Parameters\n"
    beside.write_text(text)
    with rasterio.open(path) as data:
        for terrain in (Heightmap.open(path), Heightmap.of(data)):
            np.testing.assert_allclose(terrain.heights, land(5, 80) * unit_m, rtol=1e-5)


def test_a_declared_unit_is_not_called_another(tmp_path):
    note = asked(Heightmap.open(write(tmp_path / "a.tif", land() * 100, unit="ft")))[0]
    assert "--z-scale 0.003048" in note and "for" not in note.split("--z-scale", 1)[1]


@pytest.mark.parametrize(
    ("attributes", "unit_m"),
    [
        ({"units": "m", "positive": "down"}, -1.0),
        ({"units": "ft"}, FOOT),
        ({"units": "m", "standard_name": "sea_floor_depth_below_sea_surface"}, -1.0),
        ({"units": "fathoms", "positive": "down"}, -1.8288),
        ({"units": "m", "standard_name": "height_above_geopotential_datum"}, 1.0),
        ({"units": "cm", "positive": "up"}, 0.01),
        ({"units": "m", "standard_name": "sea_floor_depth_below_geoid", "positive": "up"}, 1.0),
    ],
)
def test_netcdf_and_arrays_mean_the_same(tmp_path, attributes, unit_m):
    lat, lon = 45 - np.arange(65) / 3600, 7 + np.arange(81) / 3600
    axes = {
        "lat": ("lat", lat, {"units": "degrees_north", "standard_name": "latitude"}),
        "lon": ("lon", lon, {"units": "degrees_east", "standard_name": "longitude"}),
    }
    data = xarray.Dataset({"bed": (("lat", "lon"), land(5, 80), attributes)}, axes)
    path = tmp_path / "a.nc"
    data.to_netcdf(path, format="NETCDF3_CLASSIC", engine="scipy")
    with xarray.open_dataset(path) as opened:
        for terrain in (Heightmap.open(path), Heightmap.of(opened.bed), Heightmap.of(data), windows_of(data.bed, "a")):
            heights = terrain.heights if isinstance(terrain, Heightmap) else terrain.read(slice(0, 65), slice(0, 81))
            np.testing.assert_allclose(heights, land(5, 80) * unit_m, rtol=1e-6)


# how a file is written; the option that its line names; the heights
UNDECLARED = {
    "US state plane": ({"crs": "EPSG:2260", "step": 60.0}, land(), f"{US_FOOT:.10g}"),
    "state plane in feet": ({"crs": "EPSG:2222", "step": 60.0}, land(), "0.3048"),
    "centimetres": ({}, (land() * 100).astype(np.int32), "0.01 for centimetres"),
    "millimetres": ({}, (land() * 1000).astype(np.int32), "0.001 for millimetres"),
    "millimetres as floats": ({}, land() * 1000, "0.001 for millimetres"),
    "decimetres, only too steep": ({}, (land() * 10).astype(np.int16), "0.1 for decimetres"),
    "feet above Everest": ({"step": 500.0}, land(9000, 25000), "0.3048 for feet"),
    "centimetres in degrees": ({"crs": "EPSG:4326", "step": 0.0002}, (land() * 100).astype(np.int32), "0.01"),
    "named depth": ({"descriptions": ["depth"]}, land(5, 80), "give --z-scale -1"),
    "long_name": ({"tags": [{"long_name": "Bathymetry"}]}, land(5, 80), "give --z-scale -1"),
    "declared as depth, but below 0": ({"tags": [{"positive": "down"}]}, -land(5, 80), "--z-scale 1"),
    "an unknown unit": ({"unit": "cubits"}, land(), "unknown"),
}


@pytest.mark.parametrize("name", UNDECLARED)
def test_what_a_file_does_not_say_is_asked(tmp_path, name):
    how, heights, option = UNDECLARED[name]
    path = write(tmp_path / "a.tif", heights, **how)
    with rasterio.open(path) as data:
        for terrain in (Heightmap.open(path), open_windows([path]), Heightmap.of(data)):
            (note,) = asked(terrain)
            assert option in note
    assert not asked(Heightmap.open(path, z_scale=0.5)) and not asked(Heightmap.open(path, z_offset_m=1.0))


@pytest.mark.parametrize(
    ("how", "heights"),
    [
        ({}, land()),
        ({}, land(-120, -5)),
        ({"crs": "EPSG:32633+5773"}, land()),
        ({"crs": "EPSG:2260+5703", "step": 60.0}, land()),  # feet on the ground, metres up
        ({"descriptions": ["depth"]}, land(-120, -5)),
        ({"tags": [{"long_name": "Topography and bathymetry"}]}, land()),
        ({"crs": "+proj=eqc +R=3396190 +units=m", "step": 100.0}, land(9000, 21000)),  # Mars has such heights
        ({"step": 0.5}, land(0, 60)),  # walls and trees
    ],
)
def test_usual_maps_have_no_line(tmp_path, how, heights):
    assert not asked(Heightmap.open(write(tmp_path / "a.tif", heights, **how)))


def test_a_store_says_what_was_asked_of_its_files(tmp_path):
    pytest.importorskip("zarr")
    from terrain_gl.store import StoredMap, build

    path = write(tmp_path / "a.tif", (land() * 1000).astype(np.int32))
    build(path, tmp_path / "a.zarr", tile=8, shard=16)
    assert asked(StoredMap(tmp_path / "a.zarr"))
    path = write(tmp_path / "b.tif", land(), crs="EPSG:2260+6360")
    build(path, tmp_path / "b.zarr", tile=8, shard=16)
    stored = StoredMap(tmp_path / "b.zarr")
    assert stored.values == "US survey feet" and stored.range_m == pytest.approx((400 * US_FOOT, 800 * US_FOOT))
