"""What a picture in motion costs, and how far it is from the full picture, for sizes and tolerances.

A picture of 1/s of the width and height, with a tolerance of t of its own pixels, takes a share of the processor time
of the full picture. Enlarged to the full size it differs by `rmse` (steps of 1/255). The window uses the sizes and
tolerances that are marked: `viewer.frame_budget.WAYS`. Numbers of several maps have a slash between them.

Run: python benchmarks/motion.py [MAP ...]    first views of bundled maps, 1280 × 720; alpine-30m and canyon-15m
"""

import sys
import time

import numpy as np
from PIL import Image
from table import head, row

from terrain_gl import Camera, Renderer
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.viewer.frame_budget import WAYS

SIZE = (1280, 720)
FRAMES = 5
TRIED = [(1, 1), (1, 2), (1, 4), (2, 1), (2, 2), (2, 4), (3, 1), (3, 2), (4, 1), (4, 2)]


def best_ms(renderer, camera, tolerance):
    """Least processor milliseconds of a few frames, while the eye moves."""
    times = []
    for i in range(FRAMES + 1):
        eye = (camera.eye[0] + i, *camera.eye[1:])
        started = time.process_time()
        renderer.draw(Camera(eye, camera.target, camera.fov_deg), tolerance)
        renderer.ctx.finish()
        times.append(1e3 * (time.process_time() - started))
    return min(times[1:])  # the first compiles shaders


def enlarged(renderer, camera, tolerance):
    """The picture in the full size, as the window shows it."""
    picture = Image.fromarray(renderer.render(camera, tolerance).image[..., :3])
    return np.asarray(picture.resize(SIZE, Image.Resampling.BICUBIC)).astype(float)


def main():
    """Print a line for each way."""
    names = sys.argv[1:] or ("alpine-30m", "canyon-15m")
    ways = {way: [] for way in TRIED}
    for name in names:
        camera = bundled()[name].camera
        with Renderer(open_map(name)[0], SIZE) as renderer:
            full, full_ms = enlarged(renderer, camera, 1.0), best_ms(renderer, camera, 1.0)
            for s, t in TRIED:
                renderer.resize((SIZE[0] // s, SIZE[1] // s))
                ms, rmse = best_ms(renderer, camera, t), np.sqrt(np.mean((enlarged(renderer, camera, t) - full) ** 2))
                ways[s, t].append((f"{ms / full_ms:.2f}", f"{rmse:.1f}"))
    head("width and height, tolerance", "used", "share of the time", "difference")
    for (s, t), found in ways.items():
        used = "yes" if any((s, t) == (way.shrink, way.looser) for way in WAYS) else ""
        row(f"1/{s}, {t} px", used, *(" / ".join(each) for each in zip(*found, strict=True)))


if __name__ == "__main__":
    main()
