"""A camera that moves slowly towards distant, rough mountains: their shading must not flicker."""

import sys
from pathlib import Path

import numpy as np
import pytest

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import linear_from_srgb
from terrain_gl.light.atmosphere import LUMINANCE
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import Look

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import prefilters

FRAMES, SIZE, SUN = 60, (48, 27), (250.0, 25.0)


def rough_mountains(n=513):
    """Ridges that are rough to the last post."""
    rng = np.random.default_rng(3)
    heights = np.zeros((n, n))
    for k in range(1, 9):
        cells = 2**k
        grid = rng.normal(size=(cells + 2, cells + 2))
        at = np.linspace(0, cells, n)
        i, t = np.minimum(at.astype(int), cells), at % 1
        rows = grid[i] * (1 - t)[:, None] + grid[i + 1] * t[:, None]
        heights += 0.55**k * (rows[:, i] * (1 - t) + rows[:, i + 1] * t)
    return Heightmap((900 * heights).astype("f4"), spacing_m=30.0)


def crawl(heightmap):
    """Cameras far away, each a little nearer, so that the picture's rim moves by a tenth of a pixel."""
    east, north = heightmap.extent_m
    target, away = (east / 2, north / 2, 0.0), 4 * east
    step = 0.1 * away / (SIZE[0] / 2)
    eyes = [(target[0], target[1] - away + i * step, 0.3 * (away - i * step)) for i in range(FRAMES)]
    return [Camera(eye, target, 9.0) for eye in eyes]


def luminance(picture, fine=1):
    """(height, width) linear light of a picture, the mean of `fine` × `fine` pixels each."""
    light = linear_from_srgb(picture[..., :3]) @ LUMINANCE
    rows, cols = light.shape
    return light.reshape(rows // fine, fine, cols // fine, fine).mean((1, 3))


def deviation(lights):
    """Standard deviation of each pixel's luminance over time, averaged over the pixels."""
    return float(np.stack(lights)[:, 4:-4, 4:-4].std(0, ddof=1).mean())


def shimmer(lights):
    """Mean distance of a pixel's luminance from the mean of the frames before and after.

    It measures flicker: a luminance that changes evenly has none.
    """
    lights = np.stack(lights)[:, 4:-4, 4:-4]
    return float(np.abs(lights[1:-1] - (lights[:-2] + lights[2:]) / 2).mean())


def lights_of(heightmap, ctx, cameras, baseline=None, fine=1):
    """Luminances of our own shading, or of a baseline's, each pixel the mean of `fine` × `fine`."""
    with Renderer(heightmap, size=(SIZE[0] * fine, SIZE[1] * fine), ctx=ctx) as renderer:
        mipmaps, lights = prefilters.Mipmaps(renderer.picture), []
        for camera in cameras:
            picture = renderer.render(camera, sun=SUN, surroundings="none").image  # of the land alone
            if baseline:
                prefilters.shade_as(baseline, renderer.picture, mipmaps, camera, Look(sun=SUN))
                picture = renderer.picture.read()
            lights.append(luminance(picture, fine))
        mipmaps.release()
    return lights


@pytest.mark.slow
def test_far_mountains_do_not_shimmer(ctx):
    heightmap = rough_mountains()
    cameras = crawl(heightmap)[:12]
    assert shimmer(lights_of(heightmap, ctx, cameras, "point")) >= 4 * shimmer(lights_of(heightmap, ctx, cameras))


@pytest.mark.slow
def test_far_mountains_change_no_more_than_the_truth_does(ctx):
    """The truth: 256 places a pixel, each lit with its own normal, in every tenth of sixty frames."""
    heightmap = rough_mountains()
    cameras = crawl(heightmap)[::10]
    truth = deviation(lights_of(heightmap, ctx, cameras, "point", fine=8))
    assert deviation(lights_of(heightmap, ctx, cameras)) <= 1.2 * truth
