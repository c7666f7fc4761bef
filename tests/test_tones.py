"""Pictures of the ground by other programs' writers: which bands are colours, and which values are black and white."""

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import linear_from_srgb
from terrain_gl.light.laid import look_into, read_ground
from terrain_gl.readers.georeference import Georeference, Grid

rasterio = pytest.importorskip("rasterio")
Image = pytest.importorskip("PIL.Image")
C = rasterio.enums.ColorInterp

ONTO = Georeference(Grid(5.0, 0.0, 500000.0, 0.0, -5.0, 5000000.0), "EPSG:32633", (160, 120))
# four fields of sRGB: red, green, blue, yellow
FIELDS = np.array([(200, 0, 0), (0, 180, 0), (0, 0, 220), (200, 200, 40)], np.uint8)


def photo():
    """(3, 120, 160) uint8."""
    colours = np.repeat(np.repeat(FIELDS.reshape(2, 2, 3), 60, 0), 80, 1)
    return np.moveaxis(colours, -1, 0)


def write(path, bands, **options):
    return str(write_raster(path, bands, spaced(5), **options))


def fields(albedo):
    """The albedo in the middle of each field."""
    rows, cols = albedo.shape[:2]
    return np.array([albedo[rows * y // 4, cols * x // 4] for y in (1, 3) for x in (1, 3)], float)


WHITE = 255.0
NIR = np.full((1, 120, 160), 90, np.uint8)
RGB, BGR = photo(), photo()[::-1]
BGRN = np.concatenate([BGR, NIR])
PLAIN = {"photometric": "MINISBLACK"}
WAVES = [{"wavelength": str(nm)} for nm in (480.0, 560.0, 665.0, 840.0)]
# how a picture is written; the 8-bit value of white; whether a line names the stretch
PICTURES = {
    "8 bits": ((RGB, {}), WHITE, False),
    "12 bits declared": ((RGB * np.uint16(16), {"NBITS": 12}), 4095 / 16, False),
    "12 bits": ((RGB * np.uint16(16), {"photometric": "RGB"}), 220.0, True),
    "16 bits": ((RGB * np.uint16(257), {"photometric": "RGB"}), WHITE, False),
    "10 bits declared": ((RGB * np.uint16(4), {"NBITS": 10}), 1023 / 4, False),
    "signed reflectance": ((RGB * np.int16(12), {}), 220.0, True),
    "32 bits": ((RGB * np.uint32(1000), {}), 220.0, True),
    "32 bits with a sign": ((RGB * np.int32(1000), {}), 220.0, True),
    "floats up to 255": ((RGB.astype("f4"), {}), WHITE, True),
    "percent": ((RGB.astype("f4") * np.float32(0.4), {}), 220.0, True),
    "blue first, by meaning": ((BGRN, PLAIN | {"colorinterp": [C.blue, C.green, C.red, C.undefined]}), WHITE, False),
    "blue first, by names": ((BGRN * np.uint16(257), {"descriptions": ("blue", "green", "red", "nir")}), WHITE, False),
    "eight bands": (
        (
            np.concatenate([NIR, BGR[:1], NIR, BGR[1:2], NIR, BGR[2:], NIR, NIR]) * np.uint16(257),
            {"descriptions": ("coastal_blue", "blue", "green_i", "green", "yellow", "red", "rededge", "nir")},
        ),
        WHITE,
        False,
    ),
    "Sentinel-2": ((BGRN * np.uint16(40), {"descriptions": ("B02", "B03", "B04", "B08")}), 220.0, True),
    "Sentinel-2 of Earth Engine": ((BGRN * np.uint16(40), {"descriptions": ("B2", "B3", "B4", "B8")}), 220.0, True),
    "wavelengths": ((BGRN * np.uint16(257), {"tags": WAVES}), WHITE, False),
    "infrared first, by its meaning": (
        (np.concatenate([NIR, RGB]), PLAIN | {"colorinterp": [C.nir, C.red, C.green, C.blue]}),
        WHITE,
        False,
    ),
    "lines of JPEG": ((RGB, {"driver": "JPEG", "quality": 100}), WHITE, False),
    "PNG of 16 bits": ((RGB * np.uint16(257), {"driver": "PNG"}), WHITE, False),
}


@pytest.mark.parametrize("name", PICTURES)
def test_colours_are_those_of_the_picture(tmp_path, name):
    (bands, how), white, is_told = PICTURES[name]
    path = write(tmp_path / "p", bands, **how)
    albedo = fields(read_ground(path, ONTO))
    assert albedo[:, 3] == pytest.approx(1)
    assert albedo[:, :3] == pytest.approx(linear_from_srgb(np.clip(FIELDS * (255 / white), 0, 255)), abs=6e-3)
    assert any("--range" in note for note in look_into(path, None, True)[1]) == is_told


def test_the_range_that_is_asked_for(tmp_path):
    path = write(tmp_path / "p", RGB * np.int16(12))
    assert look_into(path, (0.0, 3060.0), True)[1] == ()
    albedo = fields(read_ground(path, ONTO, asked=(0.0, 3060.0)))
    assert albedo[:, :3] == pytest.approx(linear_from_srgb(FIELDS), abs=2e-3)


def test_bands_that_say_nothing_get_a_line(tmp_path):
    (note,) = look_into(write(tmp_path / "p", BGRN * np.uint16(257)), None, True)[1]
    assert "gdal_translate -b" in note
    with pytest.raises(TerrainError, match="inks"):
        read_ground(write(tmp_path / "q", BGRN, colorinterp=[C.cyan, C.magenta, C.yellow, C.black]), ONTO)


@pytest.mark.parametrize(("scale", "offset"), [(1e-4, 0.0), (1e-4, -0.1)])
def test_a_reflectance_with_a_scale_is_linear_light(tmp_path, scale, offset):
    reflectance = 0.002 * RGB
    path = write(
        tmp_path / "p", np.round((reflectance - offset) / scale).astype(np.uint16), colorinterp=[C.red, C.green, C.blue]
    )
    with rasterio.open(path, "r+") as file:
        file.scales, file.offsets = (scale,) * 3, (offset,) * 3
    assert fields(read_ground(path, ONTO))[:, :3] == pytest.approx(0.002 * FIELDS, abs=1e-3)
    assert look_into(path, None, True)[1] == ()


def test_a_grey_picture_of_classes_is_nearly_black(tmp_path):
    path = write(tmp_path / "p", (RGB[:1] // 50).astype(np.uint8))
    (note,) = look_into(path, None, True)[1]
    assert "--range 0,4" in note and look_into(path, (0.0, 4.0), True)[1] == ()
    assert look_into(write(tmp_path / "q", RGB[:1]), None, True)[1] == ()


PALETTE = {i: (*map(int, colour), 255) for i, colour in enumerate(FIELDS)} | {4: (0, 0, 0, 0)}
INDICES = np.repeat(np.repeat(np.arange(4, dtype=np.uint8).reshape(1, 2, 2), 60, 1), 80, 2)


@pytest.mark.parametrize("driver", ["GTiff", "PNG", "GIF"])
def test_a_palette_has_the_colours_of_its_entries(tmp_path, driver):
    indices = INDICES.copy()
    indices[:, :8] = 4
    albedo = read_ground(write(tmp_path / "p", indices, driver=driver, palette=PALETTE), ONTO)
    assert fields(albedo)[:, :3] == pytest.approx(linear_from_srgb(FIELDS), abs=2e-3)
    if driver == "PNG":  # the palettes of the others are written without opacity
        assert (albedo[:7, :, 3] == 0).all() and (albedo[9:, :, 3] == 1).all()


def test_no_colour_lies_between_two_entries_of_a_palette(tmp_path):
    """Half a pixel beside the map's posts; the mean of the entries 0 and 3 would be another colour."""
    indices = np.where(INDICES % 2 == 0, 0, 3).astype(np.uint8)
    path = write(tmp_path / "p", indices, palette=PALETTE)
    aside = ONTO._replace(grid=ONTO.grid._replace(c=ONTO.grid.c + 2.4))
    albedo = read_ground(path, aside).astype("f4")
    colours = np.unique(np.round(albedo[albedo[..., 3] == 1][:, :3], 2), axis=0)
    assert colours == pytest.approx(np.unique(np.round(linear_from_srgb(FIELDS[[0, 3]]), 2), axis=0), abs=0.011)


# pictures with a western half that is not there
WEST = np.broadcast_to(np.arange(160) < 80, (120, 160))
HOLES = {
    "no-data value": (np.where(WEST, 0, RGB).astype(np.uint8), {"nodata": 0}),
    "no-data value of 16 bits": (np.where(WEST, 65535, RGB * np.uint16(16)).astype(np.uint16), {"nodata": 65535}),
    "NaN": (np.where(WEST, np.nan, RGB / np.float32(255)).astype("f4"), {}),
    "alpha": (np.concatenate([RGB, np.where(WEST, 0, 255)[None]]).astype(np.uint8), {"alpha": "YES"}),
    "alpha first": (
        np.concatenate([np.where(WEST, 0, 255)[None], BGR]).astype(np.uint8),
        {"colorinterp": [C.alpha, C.blue, C.green, C.red]},
    ),
    "alpha of 12 bits": (
        np.concatenate([RGB * np.uint16(16), np.where(WEST, 0, 4095)[None]]).astype(np.uint16),
        {"NBITS": 12, "photometric": "RGB", "alpha": "YES"},
    ),
    "alpha of 255 in 16 bits": (
        np.concatenate([RGB * np.uint16(257), np.where(WEST, 0, 255)[None]]).astype(np.uint16),
        {"photometric": "RGB", "alpha": "YES"},
    ),
}


@pytest.mark.parametrize("name", HOLES)
def test_holes_of_pictures_show_the_land(tmp_path, name):
    bands, how = HOLES[name]
    albedo = read_ground(write(tmp_path / "p", bands, **how), ONTO)
    assert (albedo[:, :78, 3] == 0).all() and albedo[:, 82:, 3] == pytest.approx(1)
    assert albedo[80:, 82:, :2].min() > 0.3  # yellow


def test_pictures_without_a_place_have_opacity_too(tmp_path):
    pixels = np.dstack([np.moveaxis(RGB, 0, -1), np.where(WEST, 0, 255)]).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "p.png")
    albedo = read_ground(str(tmp_path / "p.png"), ONTO)
    assert (albedo[:, :80] == 0).all() and (albedo[:, 80:, 3] == 1).all()
    grey = (RGB[1] * np.uint16(12)).astype(np.uint16)
    Image.fromarray(grey).save(tmp_path / "g.png")
    assert "0 to 2400 of 65535" in look_into(str(tmp_path / "g.png"), None, True)[1][0]
    assert float(read_ground(str(tmp_path / "g.png"), ONTO).max()) == 1


_RANDOM = np.random.default_rng(3)
_ACROSS = np.broadcast_to(np.arange(160), (120, 160))
# values of a fourth band that the TIFF declares as opacity, and whether it is opacity
FOURTH = {
    "near infrared": (_RANDOM.integers(1, 200, (120, 160)), False),
    "near infrared with a collar": (np.where(WEST, 0, _RANDOM.integers(1, 200, (120, 160))), False),
    "none or full": (np.where(WEST, 0, 255), True),
    "full": (np.full((120, 160), 255), True),
    "a soft edge": (np.clip(9 * (_ACROSS - 40), 0, 255), True),
    "one level": (np.full((120, 160), 128), True),
}


@pytest.mark.parametrize("name", FOURTH)
@pytest.mark.parametrize("has_place", [True, False])
def test_a_fourth_band_of_8_bits_is_opacity_by_its_values(tmp_path, name, has_place):
    values, is_opacity = FOURTH[name]
    bands = np.concatenate([RGB, values[None].astype(np.uint8)])
    path = write(tmp_path / "p.tif", bands)
    with rasterio.open(path) as file:
        assert file.colorinterp[3] == C.alpha, "as GDAL writes four bands if nobody says what they are"
    if not has_place:
        Image.fromarray(np.moveaxis(bands, 0, -1)).save(path)
    notes = look_into(path, None, True)[1]
    assert [("infrared" in note) for note in notes] == [True] * (not is_opacity)
    albedo = read_ground(path, ONTO).astype(float)
    share = values / 255 if is_opacity else np.ones((120, 160))
    expected = linear_from_srgb(np.moveaxis(RGB, 0, -1)) * share[..., None]
    np.testing.assert_allclose(albedo[..., :3], expected, atol=2e-3)
    assert albedo.shape[2] == 3 or np.abs(albedo[..., 3] - share).max() < 2e-3
    Image.fromarray(np.moveaxis(bands, 0, -1)).save(tmp_path / "p.png")
    assert look_into(str(tmp_path / "p.png"), None, True)[1] == ()
    png = read_ground(str(tmp_path / "p.png"), ONTO)
    np.testing.assert_allclose(png[..., 3], values / 255, atol=2e-3)


@pytest.mark.parametrize("how", [{"photometric": "RGB"}, PLAIN, {"colorinterp": [C.red, C.green, C.blue, C.nir]}])
def test_a_fourth_band_that_is_not_declared_is_no_opacity(tmp_path, how):
    bands = np.concatenate([RGB, FOURTH["near infrared with a collar"][0][None].astype(np.uint8)])
    albedo = read_ground(write(tmp_path / "p.tif", bands, **how), ONTO)
    np.testing.assert_allclose(albedo[..., :3], linear_from_srgb(np.moveaxis(RGB, 0, -1)), atol=2e-3)
    assert (albedo[..., 3] == 1).all()
