"""The same land, given in twelve ways: each has the same heights and the same picture, or a line that asks."""

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl import Camera, Heightmap, Renderer

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


def write(path, values, crs=UTM, step=STEP, grid=None, **more):
    return write_raster(path, values, grid or spaced(step, WEST, NORTH), crs, **more)


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
    return Heightmap.open(write(folder / "a.tif", SEA - land(), tags=[{"positive": "down", "units": "m"}]))


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
    return Heightmap.open(write(folder / "a.tif", land()[::-1], grid=(STEP, 0, WEST, 0, STEP, NORTH - STEP * ROWS)))


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
def test_the_same_land(tmp_path, way, ctx):
    terrain = way(tmp_path)
    asks = WAYS[way]
    lines = [note for note in terrain.notes if "--z-scale" in note]
    if asks:
        assert len(lines) == 1 and asks in lines[0]
        return
    assert not lines
    heights = terrain.part(slice(0, ROWS), slice(0, COLS))
    np.testing.assert_allclose(heights, land() - SEA * (way is depth), atol=0.05)
    steps, turned = at_place(way)
    assert terrain.spacing_m == pytest.approx(steps, rel=1e-3 if way in (tile, polar) else 1e-6)
    expected = picture(Heightmap(land(), steps), ctx, turned)
    assert difference(picture(terrain, ctx), expected) < SAME
    for wrong in (land() / FOOT, -land(), land()[::-1]):
        assert difference(picture(Heightmap(wrong, steps), ctx, turned), expected) > 20 * SAME


SAME = 0.5  # of 255, mean over the picture: meshes within a tenth of a pixel, spacings within 0.1 %
SUN = (300.0, 35.0)


def picture(terrain, ctx, turned=0.0):
    """A small picture by daylight, which shows slopes; `turned`: true north, clockwise from the map's."""
    how = {"style": "lambert", "look": "grey", "curvature": "off", "surroundings": "none"}
    with Renderer(terrain, (64, 64), ctx=ctx) as renderer:
        camera = Camera.default(terrain.coarse())
        return renderer.render(camera, 0.1, sun=((SUN[0] + turned) % 360, SUN[1]), **how).image[..., :3].astype(int)


def difference(one, other):
    return float(np.abs(one - other).mean())


def at_place(way):
    """Metres between posts, and true north clockwise from the grid's, by pyproj."""
    if way is tile:  # a cell of Web Mercator, measured on the ellipsoid in the middle of its map
        from pyproj import Geod, Transformer

        cell = 2 * np.pi * 6378137 / 2**12 / 256
        x, y = ((2211.5 / 2**11 - 1) * np.pi * 6378137, (1 - 1475.5 / 2**11) * np.pi * 6378137)
        turn = Transformer.from_crs("EPSG:3857", "EPSG:4326", always_xy=True)
        ends = [turn.transform(x + dx * cell, y + dy * cell) for dx, dy in ((0, 0), (1, 0), (0, 1))]
        return tuple(Geod(ellps="WGS84").inv(*ends[0], *end)[2] for end in ends[1:]), 0.0
    if way is not polar:
        return (STEP, STEP), 0.0
    from pyproj import Geod, Proj, Transformer

    x, y = WEST + STEP * COLS / 2, NORTH - STEP * ROWS / 2
    turn = Transformer.from_crs("EPSG:3413", "EPSG:4326", always_xy=True)
    places = [turn.transform(x + dx, y + dy) for dx, dy in ((-10, 0), (10, 0), (0, -10), (0, 10))]
    steps = [Geod(ellps="WGS84").inv(*a, *b)[2] for a, b in (places[:2], places[2:])]
    convergence = Proj("EPSG:3413").get_factors(*turn.transform(x, y)).meridian_convergence
    return tuple(steps), -convergence


@pytest.mark.parametrize(("bits", "kind", "line"), [(8, "u1", False), (16, "u2", False), (12, "u2", True)])
def test_the_same_photo_of_more_bits(tmp_path, ctx, bits, kind, line):
    from terrain_gl.light.laid import look_into

    terrain = metres(tmp_path)
    y, x = np.mgrid[:ROWS, :COLS]
    photo = np.stack([x, y, 255 - x]).astype(np.uint16)
    pictures = []
    for name, values in (("eight", photo), ("more", photo * {8: 1, 16: 257, 12: 16}[bits])):
        dtype = "u1" if name == "eight" else kind
        write(tmp_path / f"{name}.tif", values.astype(dtype), photometric="RGB")
        with Renderer(terrain, (64, 64), ctx=ctx) as renderer:
            frame = renderer.render(Camera.default(terrain), 0.1, sun=SUN, material=str(tmp_path / f"{name}.tif"))
            pictures.append(frame.image[..., :3].astype(int))
    assert bool(look_into(str(tmp_path / "more.tif"), None, True)[1]) == line
    assert difference(*pictures) < SAME
