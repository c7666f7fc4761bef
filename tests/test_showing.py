"""One line of code shows maps of other libraries: in a window, or in a notebook."""

import sys
import types

import numpy as np
import pytest
from rasters import spaced, write_raster

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import write_image
from terrain_gl.viewer.advice import in_python

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
xarray = pytest.importorskip("xarray", reason="xarray is not installed")
rioxarray = pytest.importorskip("rioxarray", reason="rioxarray is not installed")

ROWS, COLS, STEP = 21, 33, 30.0
WEST, NORTH = 500_000.0, 5_150_000.0


def hill():
    y, x = np.mgrid[0:ROWS, 0:COLS]
    return (1000 + 90 * np.exp(-((x - 25) ** 2 + (y - 6) ** 2) / 40)).astype("f4")


@pytest.fixture
def dem(folder):
    """A GeoTIFF with a void, scaled values in feet, and its map as the reader of files has it."""
    values = np.round(hill() / 0.3048 * 10).astype("i4")
    values[3, 4] = -9999
    write_raster("dem.tif", values, spaced(STEP, WEST, NORTH), "EPSG:32632", nodata=-9999, scale=0.1, unit="ft")
    return tg.Heightmap.open("dem.tif")


def same(heightmap, expected):
    assert heightmap.spacing_m == pytest.approx(expected.spacing_m) and heightmap.voids == expected.voids
    np.testing.assert_allclose(heightmap.heights, expected.heights, rtol=1e-6, equal_nan=True)
    assert heightmap.place.to_map(60.0, 90.0) == pytest.approx(expected.place.to_map(60.0, 90.0))
    assert heightmap.place.middle == pytest.approx(expected.place.middle) and not heightmap.assumes_spacing


def test_a_dataset_of_rasterio(dem):
    with rasterio.open("dem.tif") as data:
        same(tg.Heightmap.of(data), dem)
        assert not data.closed and data.read(1).shape == (ROWS, COLS)


def test_a_dataset_stored_from_south_to_north(folder):
    write_raster("south.tif", hill()[::-1], (STEP, 0, WEST, 0, STEP, NORTH - ROWS * STEP), "EPSG:32632")
    with rasterio.open("south.tif") as data:
        same(tg.Heightmap.of(data), tg.Heightmap.open("south.tif"))


@pytest.mark.parametrize("masked", [True, False])
def test_a_data_array_of_rioxarray(dem, masked):
    """An array with one band, coordinates and a coordinate system."""
    with rioxarray.open_rasterio("dem.tif", masked=masked, mask_and_scale=masked) as array:
        same(tg.Heightmap.of(array), dem)
        same(tg.Heightmap.of(array.squeeze()), dem)
        same(tg.Heightmap.of(array.squeeze().transpose()), dem)
        same(tg.Heightmap.of(array.isel(y=slice(None, None, -1))), dem)
        same(tg.Heightmap.of(array.isel(x=slice(None, None, -1), y=slice(None, None, -1))), dem)


def test_a_crop_lies_where_it_was_cut(dem):
    with rioxarray.open_rasterio("dem.tif", masked=True, mask_and_scale=True) as array:
        crop = tg.Heightmap.of(array[0, 5:15, 10:30])
    np.testing.assert_allclose(crop.heights, dem.heights[5:15, 10:30], rtol=1e-6)
    assert crop.place.to_map(0, 0) == pytest.approx(dem.place.to_map(10 * STEP, (ROWS - 1 - 14) * STEP))


def test_degrees_are_known_by_the_names_of_dimensions():
    lat, lon = 46 + np.arange(ROWS) / 1000, 7 + np.arange(COLS) / 1000
    array = xarray.DataArray(hill()[::-1], {"lat": lat, "lon": lon}, ("lat", "lon"), "hill")
    heightmap = tg.Heightmap.of(array)
    np.testing.assert_array_equal(heightmap.heights, hill())
    assert heightmap.name == "hill" and heightmap.place.to_lonlat(0, 0) == pytest.approx((7, 46))
    assert heightmap.spacing_m == pytest.approx((77.3, 111.2), rel=2e-3)


def test_an_array_without_coordinates_is_posts_a_metre_apart():
    heightmap = tg.Heightmap.of(xarray.DataArray(hill()))
    assert heightmap.spacing_m == (1, 1) and heightmap.place is None and heightmap.assumes_spacing
    assert tg.Heightmap.of(hill(), 20.0).spacing_m == (20, 20)
    assert tg.Heightmap.of(heightmap) is heightmap


@pytest.mark.parametrize(
    ("array", "text"),
    [
        (xarray.DataArray(np.zeros((2, 5, 6)), dims=("time", "y", "x")), r"\(time: 2, y: 5, x: 6\): select one layer"),
        (xarray.DataArray(np.zeros((5, 3)), {"x": [0.0, 1, 5]}, ("y", "x")), "not evenly spaced along x"),
        (xarray.DataArray(np.zeros(5), dims=("x",)), "expected dimensions y and x"),
    ],
)
def test_arrays_that_are_no_map(array, text):
    with pytest.raises(TerrainError, match=text):
        tg.Heightmap.of(array)


# --- One line ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def shown(monkeypatch):
    """The arguments that the window gets, instead of opening."""
    seen = []
    monkeypatch.setattr("terrain_gl.viewer.run", lambda *told, **options: seen.append((*told, options)) or {"shown": 1})
    return seen


def test_a_script_opens_the_window(dem, shown):
    with rasterio.open("dem.tif") as data:
        for source in ("dem.tif", dem, dem.heights, data, xarray.DataArray(hill())):
            assert tg.show(source, style="normals") == {"shown": 1}
            heightmap, camera, options = shown[-1]
            assert heightmap.heights.shape == (ROWS, COLS) and options["style"] == "normals"
            assert isinstance(camera, tg.Camera)
    tg.show("canyon-15m")
    assert shown[-1][0].name == "canyon-15m" and "sun" in shown[-1][2]
    tg.show(hill(), spacing_m=25.0, size=(300, 200))
    assert shown[-1][0].spacing_m == (25, 25) and shown[-1][2]["size"] == (300, 200)


def test_a_notebook_gets_a_view(dem, shown, monkeypatch):
    pytest.importorskip("jupyter_rfb", reason="the extra [notebook] is not installed")
    kernel = types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(kernel=object()))
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    view = tg.show(xarray.DataArray(hill()), size=(120, 80), style="lambert", spacing_m=30.0)
    try:
        assert not shown and view.picture().shape == (80, 120, 3) and view.picture().std() > 10
    finally:
        view.close()


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ("give --spacing, or --z-scale", "give spacing_m, or z_scale"),
        ("--z-scale 0.005 is chosen; give --look", "z_scale=0.005 is chosen; give look"),
        ("give --nodata -9999", "give nodata=-9999"),
        ("give --nodata none", "give nodata=nan"),
        (
            "give --encoding terrarium, mapbox or gsi; as with --band 1",
            'give encoding="terrarium", mapbox or gsi; as with band=1',
        ),
        ("and the network with --trust", "and the network with trusted=True"),
        ("use a smaller map, or --style lambert", 'use a smaller map, or style="lambert"'),
        ("counts as metres (--spacing)", "counts as metres (spacing_m)"),
        ("terrain-gl --version, --gpu-memory", "terrain-gl --version, --gpu-memory"),
    ],
)
def test_messages_name_arguments_of_python(told, expected):
    assert in_python(told) == expected


def test_show_takes_the_arguments_of_files_and_names_them(folder, monkeypatch, capsys):
    seen = []
    monkeypatch.setattr("terrain_gl.viewer.run", lambda heightmap, *_, **__: seen.append(heightmap))
    heights = hill()
    heights[0, :3] = -77
    np.save("dem.npy", heights)
    tg.show("dem.npy", nodata=-77, spacing_m=30)
    assert seen[0].voids == 3 and seen[0].spacing_m == (30.0, 30.0)
    with pytest.raises(tg.UsageError, match="nodata: only for a path"):
        tg.show(heights, nodata=-77)
    write_image("rgb.png", np.random.default_rng(0).integers(0, 255, (9, 9, 3), np.uint8))
    with pytest.raises(TerrainError, match='encoding="terrarium"') as error:
        tg.show("rgb.png")
    assert "--" not in str(error.value)


def test_an_array_without_a_spacing_gets_the_one_that_its_file_would_get(folder):
    y, x = np.mgrid[0:300, 0:300].astype("f4")
    heights = 1500 + 900 * np.sin(x / 30) * np.cos(y / 40)
    np.save("land.npy", heights)
    of_file, of_array = tg.Heightmap.open("land.npy"), tg.Heightmap.of(heights)
    assert of_array.spacing_m == of_file.spacing_m == (90.0, 90.0)
    assert of_array.notes == of_file.notes and of_array.assumes_spacing
    assert tg.Heightmap.of(heights, 2.0).spacing_m == (2.0, 2.0) and not tg.Heightmap.of(heights, 2.0).notes
