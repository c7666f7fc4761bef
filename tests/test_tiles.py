"""Web tiles by other programs: their names place them, and their colours hold heights."""

import math

import numpy as np
import pytest

from terrain_gl import Heightmap
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.readers import Reading
from terrain_gl.readers.windows import open_windows

Image = pytest.importorskip("PIL.Image")
pyproj = pytest.importorskip("pyproj")

Z, X, Y = 12, 2145, 1434


def land(rows, cols, low=-20.0, high=900.0):
    y, x = np.mgrid[:rows, :cols]
    wave = np.sin(x / 40) * np.cos(y / 57)
    return np.round(low + (high - low) * (wave - wave.min()) / np.ptp(wave), 1)


def packed(numbers):
    """24-bit numbers as colours."""
    numbers = np.round(numbers).astype(np.int64) & 0xFFFFFF
    return np.stack([numbers >> 16, numbers >> 8 & 255, numbers & 255], -1).astype(np.uint8)


PACK = {
    "mapbox": lambda z: packed((z + 10000) * 10),
    "terrarium": lambda z: packed((z + 32768) * 256),
    "gsi": lambda z: packed(z * 100),
    "custom:25.6,0.1,0,-500": lambda z: packed((z + 500) * 10 * 256),
}


def write(path, pixels, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path, **options)
    return path


def edge(x, y, z=Z):
    """Longitude and latitude of a tile's north-west corner, by the rule of the OpenStreetMap wiki."""
    return x / 2**z * 360 - 180, math.degrees(math.atan(math.sinh(math.pi * (1 - 2 * y / 2**z))))


NAMES = {
    "12/2145/1434.png": 256,
    "terrain/12/2145/1434@2x.png": 512,
    "12/2145/1434.webp": 512,
    "tile_12_2145_1434.png": 256,
    "dem-12-2145-1434.png": 256,
    "a/12/2145/1434.pngraw": 260,
    "b/12/2145/1434.png": 514,
    "c/12/2145/1434.png": 1024,
}


@pytest.mark.parametrize("name", NAMES)
def test_a_name_places_a_tile(tmp_path, name):
    side = NAMES[name]
    path = tmp_path / name
    how = {"lossless": True} if path.suffix == ".webp" else {"format": "PNG"}
    write(path, PACK["mapbox"](land(side, side)), **how)
    terrain = Heightmap.open(path, encoding="mapbox")
    np.testing.assert_allclose(terrain.heights, land(side, side), rtol=0, atol=1e-3)
    assert terrain.notes == ()
    (west, north), (east, south) = edge(X, Y), edge(X + 1, Y + 1)
    tile = side // 256 * 256
    cut = (side - tile) / 2  # posts beyond the edge
    place = terrain.place
    corner = place.to_lonlat(*((cut - 0.5) * s for s in terrain.spacing_m))
    assert corner == pytest.approx((west, south), abs=1e-9)
    geod = pyproj.Geod(ellps="WGS84")
    middle = (north + south) / 2
    across = geod.inv(west, middle, east, middle)[2] / tile
    down = geod.inv(west, south, west, north)[2] / tile
    assert terrain.spacing_m == pytest.approx((across, down), rel=2e-4)


@pytest.mark.parametrize("name", ["4326/3/9/2.png", "wgs84/3/5/2.png", "3/13/1.png"])
def test_tiles_of_degrees(tmp_path, name):
    terrain = Heightmap.open(write(tmp_path / name, PACK["terrarium"](land(256, 256))), encoding="terrarium")
    x, y = (int(word) for word in name.removesuffix(".png").split("/")[-2:])
    middle = -180 + (x + 0.5) * 22.5, 90 - (y + 0.5) * 22.5
    assert terrain.place.middle == pytest.approx(middle) and terrain.place.name == "EPSG:4326"


@pytest.mark.parametrize("encoding", PACK)
def test_every_encoding(tmp_path, encoding):
    z = land(40, 50)
    path = write(tmp_path / "a.png", PACK[encoding](z))
    assert Heightmap.open(path, encoding=encoding).heights == pytest.approx(z, abs=0.06)


def test_the_voids_of_japan(tmp_path):
    pixels = PACK["gsi"](land(40, 50))
    pixels[:5] = 128, 0, 0
    heights = Heightmap.open(write(tmp_path / "a.png", pixels), encoding="gsi").heights
    assert np.isnan(heights[:5]).all() and heights[5:] == pytest.approx(land(40, 50)[5:], abs=0.006)


@pytest.mark.parametrize("wrong", ["lerc", "custom:1,2,3", "custom:1,2,3,x", "custom:1,2,3,nan"])
def test_wrong_encodings_are_refused(wrong):
    with pytest.raises(UsageError, match="encoding"):
        Reading(encoding=wrong)


def test_another_encoding_is_suspected(tmp_path):
    path = write(tmp_path / "12/2145/1434.png", PACK["terrarium"](land(256, 256)))
    (note,) = Heightmap.open(path, encoding="mapbox").notes
    assert "another --encoding" in note


@pytest.mark.parametrize(
    "name", ["2024/11/5.png", "a.png", "3/2/1.png", "12/9000/1.png", "12/1/5000.png", "map.12.png"]
)
def test_other_names_place_nothing(tmp_path, name):
    plain = Heightmap.open(write(tmp_path / name, np.zeros((256, 256), np.uint8)))
    assert plain.place is None and plain.spacing_m == (1.0, 1.0)


def test_a_tile_without_a_name_has_a_guess(tmp_path):
    terrain = Heightmap.open(write(tmp_path / "a.png", PACK["mapbox"](land(256, 256))), encoding="mapbox")
    assert terrain.spacing_m != (1.0, 1.0) and "--spacing" in terrain.notes[0]


@pytest.mark.parametrize(
    ("beside", "text", "is_south"),
    [
        ("tms/12", None, True),
        ("12", ("tilemapresource.xml", "<TileMap/>"), True),
        ("12", ("metadata.json", '{"scheme": "tms"}'), True),
        ("12", ("metadata.json", '{"scheme": "xyz"}'), False),
        ("items/12", None, False),
    ],
)
def test_rows_that_count_from_the_south(tmp_path, beside, text, is_south):
    path = write(tmp_path / beside / f"{X}/{2**Z - 1 - Y}.png", PACK["terrarium"](land(256, 256)))
    if text:
        (tmp_path / text[0]).write_text(text[1])
    latitude = Heightmap.open(path, encoding="terrarium").place.middle[1]
    assert latitude == pytest.approx((1 if is_south else -1) * edge(X + 0.5, Y + 0.5)[1], abs=1e-3)


@pytest.mark.parametrize(("name", "how"), [("a.jpg", {"quality": 98}), ("a.webp", {"quality": 98})])
def test_losses_spoil_packed_heights(tmp_path, name, how):
    path = write(tmp_path / name, PACK["mapbox"](land(256, 256)), **how)
    with pytest.raises(TerrainError, match="losses"):
        Heightmap.open(path, encoding="mapbox")


@pytest.mark.parametrize("folder", ["", "12"])
def test_a_folder_of_tiles_is_told_of_build(tmp_path, folder):
    for zoom in (9, 12):
        write(tmp_path / f"{zoom}/{X >> 12 - zoom}/{Y >> 12 - zoom}.png", PACK["mapbox"](land(256, 256)))
    with pytest.raises(TerrainError) as caught:
        Heightmap.open(tmp_path / folder)
    assert str(caught.value).endswith(f"terrain-gl build {tmp_path}/12/*/*.png")


def test_plain_heights_are_placed_with_a_line(tmp_path):
    terrain = Heightmap.open(write(tmp_path / "12/2145/1434.png", land(256, 256, 0).astype(np.uint16)))
    assert terrain.spacing_m[0] == pytest.approx(25.9, abs=0.1) and "tile 12/2145/1434" in terrain.notes[0]


@pytest.mark.parametrize("zoom", [12, 3])
def test_tiles_make_a_mosaic(tmp_path, zoom):
    z = land(512, 512)
    x0, y0 = (X, Y) if zoom == 12 else (4, 2)
    paths = []
    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
        tile = z[256 * j : 256 * (j + 1), 256 * i : 256 * (i + 1)]
        paths.append(write(tmp_path / f"{zoom}/{x0 + i}/{y0 + j}.png", PACK["terrarium"](tile)))
    mosaic = open_windows(paths, Reading(encoding="terrarium"))
    assert mosaic.read(slice(0, 512), slice(0, 512)) == pytest.approx(z, abs=0.003)
    middle = edge(x0 + 1, y0 + 1, zoom)[1]
    east_m = 2 * math.pi * 6378137 * math.cos(math.radians(middle)) / 2**zoom / 256
    assert mosaic.spacing_m[0] == pytest.approx(east_m, rel=4e-3)  # the ellipsoid is a third of a percent wider
