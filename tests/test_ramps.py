"""Ramps of colours: for values on the ground and for heights; one line of output names the range."""

import numpy as np
import pytest
from rasters import write_raster

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import read_image
from terrain_gl.light.laid import look_into, read_values
from terrain_gl.light.ramps import NAMES, STOPS, Ramp, ramp_for

SHOT = ("shot", "dem.tif", "--size", "64x36", "--grain", "off", "-o")


@pytest.fixture
def placed(folder):
    """A gentle hill, and a difference of −7 m in its west, +3 m in its east, without a value in between."""
    y, x = np.mgrid[0:41, 0:41]
    write_raster("dem.tif", (100 + 20 * np.exp(-((x - 20) ** 2 + (y - 20) ** 2) / 90)).astype("f4"))
    change = np.where(x < 16, -7, np.where(x > 24, 3, np.nan)).astype("f4")
    change[:, 24] = -9999
    write_raster("change.tif", change, nodata=-9999)
    np.save("change.npy", change)
    return tg.Heightmap.open("dem.tif")


@pytest.mark.parametrize(
    ("low", "high", "name", "asked", "expected"),
    [
        (-11.99, 8.99, "auto", None, ("diverging", -12, 12)),
        (3.02, 8.99, "auto", None, ("viridis", 3, 9)),
        (-5, -1, "auto", None, ("viridis", -5, -1)),
        (-5, 1, "viridis", None, ("viridis", -5, 1)),
        (-5, 1, "auto", (-2, 2), ("diverging", -2, 2)),
        (-5, 1, "auto", (0, 2), ("viridis", 0, 2)),
        (0, 0, "auto", None, ("viridis", 0, 1e-6)),
    ],
)
def test_the_ramp_and_its_range_follow_the_values(low, high, name, asked, expected):
    ramp = ramp_for(low, high, name, asked)
    assert ramp.name == expected[0] and ramp[1:] == pytest.approx(expected[1:], abs=1e-6)


@pytest.mark.parametrize("name", sorted({*NAMES} - {"auto"}))
def test_stops_for_the_shader_are_the_ramp(name):
    ramp = Ramp(name, -3.0, 5.0)
    assert len(ramp.stops) == STOPS
    colours, values = np.array(ramp.stops)[:, :3], np.array(ramp.stops)[:, 3]
    assert values[0] == -3 and values[-1] == 5 and (np.diff(values) >= 0).all()
    between = np.linspace(-3, 5, 41)
    shader = np.stack([np.interp(between, values, colours[:, i]) for i in range(3)], -1)
    assert ramp.colours(between) == pytest.approx(shader, abs=1e-5)
    assert np.array_equal(ramp.colours(np.array([-9.0, 99.0])), ramp.colours(np.array([-3.0, 5.0])))


def test_a_diverging_ramp_is_white_at_its_middle():
    red, white, blue = Ramp("diverging", -1.0, 1.0).colours(np.array([-1.0, 0.0, 1.0]))
    assert np.ptp(white) < 1e-3 and white.min() > 0.9 and red[0] > 3 * red[2] and blue[2] > 3 * blue[0]


def test_values_are_placed_and_gaps_are_not_covered(placed):
    draped = read_values("change.tif", placed.georeference)
    assert draped.covered.shape == (41, 41)
    assert draped.values[:, :15] == pytest.approx(-7) and draped.values[:, 26:] == pytest.approx(3)
    assert (draped.covered[:, 18:23] == 0).all() and (draped.covered[:, :15] == 1).all()
    assert draped.ramp("auto", None) == ("diverging", -7, 7)
    assert look_into("change.tif", None, False) == (True, ()) and look_into("missing.tif", None, False) == (False, ())


def test_voids_of_values_are_those_of_maps(placed):
    """Voids may be marked by a value that the file does not declare, a mask or an alpha band; a band may be scaled."""
    expected, change = read_values("change.tif", placed.georeference), np.load("change.npy")
    void = ~np.isfinite(change) | (change == -9999)
    opaque = np.where(void, 0, 255).astype("u1")
    for name in (
        write_raster("undeclared.tif", np.where(void, -9999, change)),
        write_raster("placeless.tif", np.where(void, 1e20, change).astype("f4"), None, None),
        write_raster("masked.tif", np.where(void, 77, change), mask=opaque),
        write_raster("alpha.tif", np.stack([np.where(void, 77, change), opaque.astype("f4")]), ALPHA="YES"),
        write_raster("scaled.tif", np.where(void, -32768, change * 10).astype("i2"), scale=0.1),
    ):
        found = read_values(name, placed.georeference)
        np.testing.assert_array_equal(found.covered, expected.covered, name)
        np.testing.assert_allclose(found.values, expected.values, atol=1e-5, err_msg=name)
        assert look_into(name, None, False)[0]
    np.save("undeclared.npy", np.where(void, -9999, change))
    np.testing.assert_array_equal(read_values("undeclared.npy").values, expected.values)


def test_colours_beyond_light_are_clipped_or_stretched_with_a_line(placed, run):
    for name, most in (("light.tif", 1.0), ("bright.tif", 1.2), ("counts.tif", 9.0)):
        write_raster(name, np.linspace(0, most, 3 * 41 * 41).reshape(3, 41, 41).astype("f4"))
    assert run(*SHOT, "a.png", "--material", "light.tif")[2] == ""
    assert "bright.tif: floats are linear light" in run(*SHOT, "a.png", "--overlay", "bright.tif")[2]
    assert "counts.tif: has values 0 to 9: black is 0" in run(*SHOT, "a.png", "--overlay", "counts.tif")[2]


def test_a_file_without_values_is_refused(placed):
    write_raster("none.tif", np.full((41, 41), np.nan, "f4"), nodata=-9999)
    with pytest.raises(TerrainError, match=r"none\.tif: has no values on the map"):
        read_values("none.tif", placed.georeference)


def test_pictures_show_the_ramp_and_say_its_range(placed, run):
    down = ("--eye", "200,200,600", "--target", "200,200,100", "--fov", "30")
    code, _, told = run(*SHOT, "a.png", *down, "--overlay", "change.tif")
    assert code == 0 and told == "terrain-gl: note: change.tif: ramp diverging from -7 to 7\n"
    picture = read_image("a.png").astype(int)
    west, east = picture[10:26, 20:24].mean((0, 1)), picture[10:26, 40:44].mean((0, 1))
    assert west[0] > west[2] + 40 and east[2] > east[0] + 20
    code, _, told = run(*SHOT, "b.png", *down, "--drape", "change.tif", "--range=-1,1", "--ramp", "viridis")
    assert code == 0 and "ramp viridis from -1 to 1" in told
    assert (np.abs(read_image("b.png").astype(int) - picture).max(-1) > 40).mean() > 0.3
    code, _, told = run(*SHOT, "c.png", *down, "--material", "change.tif")
    assert code == 0 and "change.tif: holds values, not colours: they are shown as by --drape" in told
    assert (read_image("c.png") == picture).all()


def test_heights_take_a_range(placed, run):
    assert run(*SHOT, "a.png", "--look", "viridis", "--range", "0,6000")[::2] == (0, "")
    assert run(*SHOT, "b.png", "--look", "viridis", "--range", "100,120")[::2] == (0, "")
    assert run(*SHOT, "c.png", "--look", "diverging", "--range", "100,120")[::2] == (0, "")
    plain, ranged, diverging = (read_image(f"{name}.png").astype(int) for name in "abc")
    assert (np.abs(ranged - plain).max(-1) > 40).mean() > 0.1 and (np.abs(diverging - ranged).max(-1) > 40).mean() > 0.1
    code, _, told = run(*SHOT, "d.png", "--look", "viridis")
    assert code == 0 and told.startswith("terrain-gl: note: --look viridis: from 100 to ") and "diverging" not in told
    assert (np.abs(read_image("d.png").astype(int) - plain).max(-1) > 40).mean() > 0.1


def test_albedo_of_one_band_stays_light(placed, run):
    for name, most in (("light.tif", 1.0), ("metres.tif", 1.1)):
        write_raster(name, np.full((41, 41), np.linspace(0.1, most, 41), "f4"), nodata=-9999)
    assert run(*SHOT, "a.png", "--material", "light.tif")[::2] == (0, "")
    assert run(*SHOT, "b.png", "--material", "metres.tif")[2].endswith("metres.tif: ramp viridis from 0.1 to 1.1\n")
    grey, coloured = (read_image(name)[20:30, 20:40, :3].astype(int) for name in ("a.png", "b.png"))
    assert np.ptp(grey, axis=-1).mean() + 30 < np.ptp(coloured, axis=-1).mean()


def test_a_range_without_a_ramp_is_told_and_a_wrong_one_refused(placed, run):
    code, _, told = run(*SHOT, "a.png", "--range", "1,2", "--style", "shaded", "--look", "grey")
    assert code == 0 and "--range: without effect" in told
    assert run(*SHOT, "a.png", "--range", "2,1")[0] == 2
    assert run(*SHOT, "a.png", "--drape", "change.tif", "--material", "change.tif")[0] == 2
