"""A sky that is not drawn: alpha is the share of land in each pixel. Haze: how much of it is in the air."""

import numpy as np
import pytest
from commands import refused
from maps import rough

import terrain_gl as tg
from terrain_gl.image import linear_from_srgb, read_image, reduced

SIZE = (96, 64)
CAMERA = tg.Camera((320.0, -250.0, 160.0), (320.0, 320.0, 40.0), 45.0)
LAMBERT_SKY = (0.35, 0.50, 0.75)  # glsl/shade/lambert.frag


@pytest.fixture(scope="module")
def renderer():
    with tg.Renderer(tg.Heightmap(rough(65, 40), 10.0), SIZE) as renderer:
        yield renderer


@pytest.mark.parametrize("style", ["shaded", "lambert", "normals", "depth", "lod", "wireframe", "error", "ambient"])
def test_alpha_is_the_share_of_land(renderer, style):
    image = renderer.render(CAMERA, style=style, sky="none", surroundings="none").image
    with renderer.session:
        land = 1 - renderer.picture.sky_share()
    assert ((land > 0) & (land < 1)).any() and (land == 0).any()
    bar = np.zeros(land.shape, bool)
    bar[-8:, :30] = style == "error"  # the bar of the colours hides the sky
    assert np.array_equal(image[..., 3][~bar], np.rint(255 * land)[~bar])
    assert not image[(land == 0) & ~bar].any()
    assert (renderer.render(CAMERA, style=style, surroundings="none").image[..., 3] == 255).all()


def test_over_its_sky_it_is_the_usual_picture(renderer):
    """The sky of this style has one colour, so the picture with a sky is the clear one over that colour."""
    clear = renderer.render(CAMERA, style="lambert", sky="none").image
    usual = renderer.render(CAMERA, style="lambert").image
    alpha = clear[..., 3:] / 255
    over = alpha * linear_from_srgb(clear[..., :3]) + (1 - alpha) * LAMBERT_SKY
    # two roundings to 8 bits, each of half a step
    assert np.abs(over - linear_from_srgb(usual[..., :3])).max() < 1.1 / 255 * 2.4


def test_floats_are_multiplied_by_alpha(renderer):
    clear = renderer.render(CAMERA, style="lambert", sky="none", exact=True).image
    usual = renderer.render(CAMERA, style="lambert", exact=True).image
    over = clear[..., :3] + (1 - clear[..., 3:]) * LAMBERT_SKY
    assert np.abs(over - usual[..., :3]).max() < 1e-5
    normals = renderer.render(CAMERA, style="normals", sky="none", exact=True).image
    assert np.array_equal(normals, renderer.render(CAMERA, style="normals", exact=True).image)


def test_the_plain_around_the_map_is_not_sky(renderer):
    below = renderer.render(tg.Camera((320.0, -250.0, 160.0), (320.0, 320.0, -900.0)), sky="none").image
    with renderer.session:
        assert (below[..., 3] == 255).all() and (renderer.picture.sky_share() > 0).any()


def test_fewer_pixels_have_the_mean_of_what_is_there():
    pixels = np.zeros((2, 2, 4), "u1")
    pixels[0, 0] = 200, 100, 50, 255
    assert reduced(pixels, 2).tolist() == [[[200, 100, 50, 64]]]


def test_haze_grows(renderer):
    """The more haze, the nearer is the land's colour to that of the sky behind it; 1 is the usual amount."""

    def picture(haze):
        return renderer.render(CAMERA, surroundings="none", haze=haze).image[..., :3].astype(float)

    land = renderer.render(CAMERA, surroundings="none", sky="none").image[..., 3] == 255
    usual = picture(1.0)
    with renderer.session:
        sky = usual[renderer.picture.sky_share() == 1].mean(0)
    away = [np.abs(picture(haze)[land] - sky).mean() for haze in (0.0, 10.0, 100.0)]
    assert away[0] > 1.01 * away[1] > 1.02 * away[2]
    assert np.array_equal(usual, renderer.render(CAMERA, surroundings="none").image[..., :3])
    for wrong in (-1.0, float("nan"), float("inf")):
        with pytest.raises(tg.UsageError, match="haze"):
            renderer.render(CAMERA, haze=wrong)


def test_commands(run, folder):
    np.save("land.npy", rough(33, 40))
    words = ("shot", "land.npy", "--size", "64x36", "--sky", "none", "--surroundings", "none")
    assert run(*words, "-o", "a.png")[0] == run(*words, "-o", "a.exr")[0] == 0
    png, exr = read_image("a.png"), read_image("a.exr")
    assert np.abs(png[..., 3] / 255 - exr[..., 3]).max() < 0.6 / 255 and (png[..., 3] == 0).any()
    refused(run(*words, "-o", "a.jpg"), 2, "a.jpg: has no alpha")
    refused(run("fly", *words[1:], "-o", "film/"), 2, "--sky none")
