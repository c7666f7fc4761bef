"""How much a slow camera's picture of distant, rough mountains flickers: with our shading, and by brute force.

The camera moves by a tenth of a pixel in each frame. The truth lights 256 or 1024 places of each pixel.

Run: python benchmarks/flicker.py
"""

import numpy as np
import prefilters
from table import head, row

from terrain_gl import create_context
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import linear_from_srgb
from terrain_gl.light.atmosphere import LUMINANCE
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import Look

FRAMES, SIZE, SUN = 60, (48, 27), (250.0, 25.0)
WAYS = {  # a baseline of `prefilters`, or ours; and places along each side of a pixel
    "merged lobes": {},
    "point samples": {"baseline": "point"},
    "256 places a pixel": {"baseline": "point", "fine": 8},
    "1024 places": {"baseline": "point", "fine": 16},
}


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


def main():
    """Print the table."""
    heightmap, ctx = rough_mountains(), create_context()
    cameras = crawl(heightmap)
    lights = {name: lights_of(heightmap, ctx, cameras, **way) for name, way in WAYS.items()}
    head("", *WAYS)
    few = {name: each[:12] for name, each in lights.items()}
    for what, measure, found in (
        ("standard deviation of a pixel's luminance over 60 frames", deviation, lights),
        (
            "difference between a pixel's luminance and the mean of the frames before and after, over 12 frames",
            shimmer,
            few,
        ),
    ):
        row(what, *(f"{measure(each):.4f}" for each in found.values()))


if __name__ == "__main__":
    main()
