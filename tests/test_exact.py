"""Pictures of floats: linear light, unit normals, and depths in metres, from the API and in EXR files."""

import numpy as np
import pytest

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import linear_from_srgb, read_image
from terrain_gl.renderer import Renderer

SIZE = (120, 80)


def slope():
    """A plane that rises to the north-east."""
    y, x = np.mgrid[:41, :41]
    return Heightmap((100 + 3.0 * x - 6.0 * y).astype("f4"), 10.0)


def drawn(heightmap, camera, **options):
    with Renderer(heightmap, SIZE) as renderer:
        return renderer.render(camera, exact=True, **options).image


def test_normals_have_length_1_and_the_sky_is_marked():
    camera = Camera((200.0, -300.0, 200.0), (200.0, 200.0, 0.0))
    image = drawn(slope(), camera, style="normals")
    land = image[..., 3] == 1
    assert image.dtype == np.float32 and 0.2 < land.mean() < 0.9
    assert (image[~land] == 0).all()
    assert np.linalg.norm(image[land][:, :3], axis=-1) == pytest.approx(1, abs=1e-5)
    truth = np.array([-0.3, -0.6, 1.0]) / np.linalg.norm([-0.3, -0.6, 1.0])
    assert np.abs(image[30:50, 50:70, :3] - truth).max() < 1e-3


@pytest.mark.parametrize("exaggeration", [1.0, 4.0])
def test_depths_are_metres_along_the_view_and_infinite_in_the_sky(exaggeration):
    flat = Heightmap(np.full((41, 41), 50, "f4"), 10.0)
    camera = Camera((200.0, -300.0, 250.0), (200.0, 200.0, 50.0))
    image = drawn(flat, camera, style="depth", exaggeration=exaggeration)
    land = image[..., 3] == 1
    assert np.isinf(image[~land][:, :3]).all() and 0.1 < land.mean() < 0.9
    eye, target = (np.array(at) * (1, 1, exaggeration) for at in (camera.eye, camera.target))
    forward = (target - eye) / np.linalg.norm(target - eye)
    tall = Camera(tuple(eye), tuple(target))
    col, row = 61, 45
    tan_x, tan_y = tall.half_extent(SIZE)
    right, up, _ = tall.axes
    ray = forward + (2 * (col + 0.5) / SIZE[0] - 1) * tan_x * right - (2 * (row + 0.5) / SIZE[1] - 1) * tan_y * up
    truth = (50 * exaggeration - eye[2]) / ray[2]
    assert land[row, col] and image[row, col, 0] == pytest.approx(truth, rel=1e-3)


@pytest.mark.parametrize("style", ["lambert", "lod"])
def test_light_is_linear(style):
    camera = Camera((200.0, -300.0, 200.0), (200.0, 200.0, 0.0))
    image = drawn(slope(), camera, style=style)
    with Renderer(slope(), SIZE) as renderer:
        shown = renderer.render(camera, style=style).image
    assert np.abs(image[..., :3] - linear_from_srgb(shown[..., :3])).max() < 0.006  # half a step of 8 bits at white


def test_lit_pictures_have_no_end_at_white():
    camera = Camera((200.0, -300.0, 60.0), (200.0, 200.0, 80.0))
    image = drawn(slope(), camera, sun=(0.0, 12.0))  # the sun's disc is in the picture
    assert image[..., :3].max() > 2 and np.isfinite(image).all()


def test_exr_files_hold_the_same_numbers_and_other_files_stay(folder, run):
    np.save("slope.npy", slope().heights)
    shared = "slope.npy", "--spacing", "10", "--size", "120x80", "--eye=200,-300,200", "--target=200,200,0"
    for style in ("normals", "depth"):
        assert run("shot", *shared, "--fov", "50", "--style", style, "-o", f"{style}.exr")[0] == 0
        camera = Camera((200.0, -300.0, 200.0), (200.0, 200.0, 0.0))
        assert (read_image(f"{style}.exr") == drawn(slope(), camera, style=style)).all()
    assert run("shot", *shared, "--fov", "50", "--style", "normals", "-o", "n.png")[0] == 0
    with Renderer(slope(), SIZE) as renderer:
        assert (read_image("n.png") == renderer.render(camera, style="normals").image).all()


def test_exact_pixels_are_not_reduced():
    with Renderer(slope(), SIZE) as renderer, pytest.raises(UsageError, match="reduced"):
        renderer.render(Camera((200.0, -300.0, 200.0), (200.0, 200.0, 0.0)), exact=True, fine=2)
