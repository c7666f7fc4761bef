"""The same land, given in twelve ways: each is the same heights at the same places, or has a line that asks."""

import numpy as np
import pytest

from terrain_gl import Heightmap

rasterio = pytest.importorskip("rasterio")
xarray = pytest.importorskip("xarray")
pytest.importorskip("zarr")
Image = pytest.importorskip("PIL.Image")

ROWS, COLS = 256, 256
FOOT, US_FOOT = 0.3048, 1200 / 3937
SEA = np.float32(800.0)  # the land is a sea bed, if its heights are depths
UTM, STEP, WEST, NORTH = "EPSG:32633", 20.0, 500000.0, 5000000.0


def land(low=100.0, high=700.0):
    """Hills in whole metres, so that every unit below holds them to a centimetre."""
    y, x = np.mgrid[:ROWS, :COLS]
    wave = np.sin(x / 23) * np.cos(y / 31)
    return np.round(low + (high - low) * (wave - wave.min()) / np.ptp(wave)).astype(np.float32)


def write(path, values, crs=UTM, step=STEP, unit=None, tags=None, south_up=False):
    place = rasterio.transform.from_origin(WEST, NORTH, step, step)
    if south_up:
        place = rasterio.Affine(step, 0, WEST, 0, step, NORTH - step * ROWS)
        values = values[::-1]
    about = {"width": COLS, "height": ROWS, "count": 1, "dtype": values.dtype, "crs": crs, "transform": place}
    with rasterio.open(path, "w", driver="GTiff", **about) as file:
        file.write(values[None])
        if unit:
            file.set_band_unit(1, unit)
        if tags:
            file.update_tags(1, **tags)
    return path


def array():
    x, y = WEST + STEP * (np.arange(COLS) + 0.5), NORTH - STEP * (np.arange(ROWS) + 0.5)
    made = xarray.DataArray(land(), dims=("y", "x"), coords={"y": y, "x": x}, attrs={"units": "m"}, name="z")
    return made.assign_coords(spatial_ref=((), 0, {"crs_wkt": rasterio.crs.CRS.from_string(UTM).to_wkt()}))


def metres(folder):
    return Heightmap.open(write(folder / "a.tif", land()))


def feet_declared(folder):
    return Heightmap.open(write(folder / "a.tif", land() / np.float32(US_FOOT), "EPSG:32633+6360"))


def feet_undeclared(folder):
    return Heightmap.open(write(folder / "a.tif", land() / np.float32(US_FOOT), "EPSG:2260", STEP / US_FOOT))


def centimetres(folder):
    return Heightmap.open(write(folder / "a.tif", (land() * 100).astype(np.int32)))


def centimetres_declared(folder):
    return Heightmap.open(write(folder / "a.tif", (land() * 100).astype(np.int32), unit="cm"))


def depth(folder):
    return Heightmap.open(write(folder / "a.tif", SEA - land(), tags={"positive": "down", "units": "m"}))


def tile(folder):
    number = ((land() + 10000) * 10).astype(np.int64)
    path = folder / "12/2211/1475.png"
    path.parent.mkdir(parents=True)
    Image.fromarray(np.stack([number >> 16, number >> 8 & 255, number & 255], -1).astype(np.uint8)).save(path)
    return Heightmap.open(path, encoding="mapbox")


def data_array(folder):
    return Heightmap.of(array())


def netcdf(folder):
    array().to_dataset().to_netcdf(folder / "a.nc", format="NETCDF3_CLASSIC", engine="scipy")
    return Heightmap.open(folder / "a.nc")


def south_up(folder):
    return Heightmap.open(write(folder / "a.tif", land(), south_up=True))


def store(folder):
    from terrain_gl.store import StoredMap, build

    build(write(folder / "a.tif", land()), folder / "a.zarr")
    return StoredMap(folder / "a.zarr")


def polar(folder):
    return Heightmap.open(write(folder / "a.tif", land(), "EPSG:3413"))


# a way; metres of land in a metre of its heights if nothing asks for more, or None if a line does
WAYS = {
    metres: None,
    feet_declared: None,
    feet_undeclared: "--z-scale 0.3048006096",
    centimetres: "--z-scale 0.01",
    centimetres_declared: None,
    depth: None,
    tile: None,
    data_array: None,
    netcdf: None,
    south_up: None,
    store: None,
    polar: None,
}


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_the_same_land(tmp_path, way):
    terrain = way(tmp_path)
    asks = WAYS[way]
    lines = [note for note in terrain.notes if "--z-scale" in note]
    if asks:
        assert len(lines) == 1 and asks in lines[0]
        return
    assert not lines
    heights = terrain.part(slice(0, ROWS), slice(0, COLS))
    np.testing.assert_allclose(heights, land() - SEA * (way is depth), atol=0.05)
    if way is tile:  # 2 pi a / 2^12 / 256 times the cosine of its latitude
        assert terrain.spacing_m[0] == pytest.approx(38.2185 * np.cos(np.radians(44.53)), rel=5e-3)
    elif way is polar:  # this place is far from the pole, where a unit of the system is no metre
        from pyproj import Geod, Transformer

        middle = WEST + STEP * COLS / 2, NORTH - STEP * ROWS / 2
        ends = [(middle[0] - STEP / 2, middle[1]), (middle[0] + STEP / 2, middle[1])]
        turned = Transformer.from_crs("EPSG:3413", "EPSG:4326", always_xy=True)
        (lon, lat), (lon1, lat1) = (turned.transform(*end) for end in ends)
        assert terrain.spacing_m[0] == pytest.approx(Geod(ellps="WGS84").inv(lon, lat, lon1, lat1)[2], rel=1e-3)
    else:
        assert terrain.spacing_m == pytest.approx((STEP, STEP), rel=1e-6)
