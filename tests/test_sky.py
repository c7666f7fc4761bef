"""Skies: the sun's position, clear skies at any hour, pictures of skies, and the lobes that approximate them."""

from datetime import datetime, timedelta, timezone

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.light import atmosphere, sky
from terrain_gl.light import gaussians as light
from terrain_gl.light.ground import towards_sun
from terrain_gl.light.sun import sun_position


def test_the_sun_against_the_almanac():
    """Reda and Andreas 2004, "Solar position algorithm", table A5.1: without refraction and parallax."""
    time = datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7)))
    azimuth, elevation = sun_position(time, 39.742476, -105.1786)
    assert azimuth == pytest.approx(194.34024, abs=0.01)
    assert elevation == pytest.approx(39.872, abs=0.01)


@pytest.mark.parametrize(
    ("date", "declination"),
    [((2026, 3, 20), 0.0), ((2026, 6, 21), 23.44), ((2026, 9, 23), 0.0), ((2026, 12, 21), -23.44)],
)
def test_noon_of_the_seasons(date, declination):
    azimuth, elevation = sun_position(datetime(*date, 12), 50.0)
    assert elevation == pytest.approx(90 - 50 + declination, abs=0.3)  # declination changes by 0.4 a day in spring
    assert azimuth == pytest.approx(180, abs=5)  # the equation of time shifts noon
    assert sun_position(datetime(*date, 6), 0.0)[0] < 180 < sun_position(datetime(*date, 18), 0.0)[0]


def test_places_that_are_none():
    with pytest.raises(UsageError, match="latitude"):
        sun_position(datetime(2026, 1, 1), 91.0)


def test_a_dome_covers_the_sphere():
    directions, weights = sky.dome(96, 64)
    assert weights.sum() == pytest.approx(4 * np.pi)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(len(directions)))
    assert (directions * weights[:, None]).sum(0) == pytest.approx(np.zeros(3), abs=1e-3)
    first_row, middle = directions.reshape(96, 64, 3)[0], directions.reshape(96, 64, 3)[47]
    assert first_row[:, 2].min() > 0.99
    assert middle[31, 1] > 0.99 and middle[16, 0] < -0.9  # north in the middle, west to the left


@pytest.mark.parametrize("elevation", [90, 60, 30, 8, 2, 0, -0.2, -3, -8, -18, -60])
def test_clear_skies_at_any_hour(elevation):
    made = sky.clear_sky(120.0, elevation)
    assert np.isfinite(made.radiance).all() and made.radiance.min() > 0
    assert made.fit_error < 0.06
    amplitude = made.sun["amplitude"] * made.sun["integral"]
    assert np.all(amplitude >= 0) and (amplitude.max() > 0) == (elevation > -0.2665)
    assert made.sun["axis"] == pytest.approx(towards_sun(120.0, elevation), abs=1e-5)


def test_skies_are_as_skies_are():
    noon, dusk = sky.clear_sky(180.0, 60.0), sky.clear_sky(180.0, 1.0)
    above = noon.radiance[:40].mean((0, 1))
    assert above[2] > 1.5 * above[0]  # blue above
    light_of = dusk.sun["amplitude"]
    assert light_of[0] > 3 * light_of[1] > 3 * light_of[2]  # a low sun is red
    rows, cols = dusk.radiance.shape[:2]
    horizon = dusk.radiance[rows // 2 - 4, :, 0]
    assert horizon.argmax() in (0, 1, cols - 2, cols - 1)  # brightest towards the sun: south is at the rim
    assert noon.radiance.sum() > dusk.radiance.sum() > sky.clear_sky(180.0, -6.0).radiance.sum()


def test_the_suns_light_loses_blue_on_its_way():
    for elevation in (1, 5, 20, 90):
        through = atmosphere.sunlight(elevation)
        assert 0 <= through[2] <= through[1] <= through[0] <= 1
    assert atmosphere.sunlight(90)[1] > 0.8 > 0.3 > atmosphere.sunlight(1)[1]


def test_turning_the_sun_turns_the_sky():
    south, west = sky.clear_sky(180.0, 20.0).radiance, sky.clear_sky(270.0, 20.0).radiance
    assert np.roll(south, sky.SHAPE[1] // 4, 1) == pytest.approx(west, rel=1e-9)


def test_a_uniform_sky_lights_all_surfaces_alike():
    """The lobes' white furnace test: within 1 % of 1 on any surface."""
    uniform = sky.Sky(np.ones((*sky.SHAPE, 3)), sky.NO_SUN)
    assert uniform.fit_error < 0.01


def test_sharp_lobes_carry_the_suns_light():
    sun = sky.clear_sky(100.0, 40.0).sun
    irradiance = sky.SUNLIGHT * atmosphere.sunlight(40.0)
    assert sun["amplitude"] * sun["integral"] == pytest.approx(irradiance, rel=1e-5)
    assert sun["sharpness"] == pytest.approx(1 / (1 - np.cos(np.radians(light.SUN_RADIUS_DEG))), rel=1e-5)


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_least_squares_without_negatives(columns, seed):
    """The conditions of Kuhn and Tucker: x ≥ 0, and no change that keeps x ≥ 0 makes the error smaller."""
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(20, columns)), rng.normal(size=20)
    x = light.non_negative_least_squares(A, b)
    gain = A.T @ (b - A @ x)
    assert np.all(x >= 0)
    assert np.all(gain <= 1e-8) and np.all(np.abs(gain[x > 0]) <= 1e-8)


def written(path, pixels):
    pixels = np.ascontiguousarray(pixels, "f4")
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float"))
    assert file.write_image(pixels)
    file.close()
    return path


def test_a_picture_of_a_sky(tmp_path):
    """Blue above, brown below, a sun in the east, 30 degrees up."""
    rows, cols = 90, 180
    pixels = np.empty((rows, cols, 3), "f4")
    pixels[:45], pixels[45:] = (0.3, 0.5, 1.0), (0.2, 0.15, 0.1)
    pixels[29:31, 134:136] = 5000.0
    read = sky.read_sky(written(tmp_path / "sky.exr", pixels))
    assert read.sun["axis"] == pytest.approx(towards_sun(90.0, 30.0), abs=0.02)
    solid_angle = 4 * np.radians(2) ** 2 * np.cos(np.radians(30))
    assert read.sun["amplitude"][0] * read.sun["integral"] == pytest.approx(5000 * solid_angle, rel=0.01)
    assert read.radiance.max() == pytest.approx(1.0, abs=1e-6)  # without the sun
    assert read.radiance[10, 5] == pytest.approx((0.3, 0.5, 1.0))
    assert read.radiance[-10, 5] == pytest.approx((0.2, 0.15, 0.1))
    assert read.fit_error < 0.05


def test_a_dull_sky_has_no_sun(tmp_path):
    read = sky.read_sky(written(tmp_path / "sky.hdr", np.full((4, 8, 3), 0.5, "f4")))
    assert np.all(read.sun["amplitude"] == 0) and read.fit_error < 0.01


@pytest.mark.parametrize(
    ("value", "shape", "words"),
    [
        (np.nan, (4, 8, 3), "not finite"),
        (np.inf, (4, 8, 3), "not finite"),
        (-1.0, (4, 8, 3), "negative"),
        (1.0, (4, 9, 3), "twice as wide"),
        (1.0, (8, 8, 3), "twice as wide"),
    ],
)
def test_pictures_that_are_no_skies(tmp_path, value, shape, words):
    pixels = np.ones(shape, "f4")
    pixels[1, 1] = value
    with pytest.raises(TerrainError, match=words):
        sky.read_sky(written(tmp_path / "sky.exr", pixels))


def test_eight_bits_are_no_light(tmp_path):
    path = tmp_path / "sky.png"
    oiio.ImageBuf(np.full((4, 8, 3), 200, "u1")).write(str(path))
    with pytest.raises(TerrainError, match="hdr"):
        sky.read_sky(path)


def test_no_sky_at_all(tmp_path):
    with pytest.raises(TerrainError, match="No such file"):
        sky.read_sky(tmp_path / "sky.exr")
