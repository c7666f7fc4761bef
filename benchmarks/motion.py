"""What a picture costs at smaller sizes: processor milliseconds at 1/s of the width and height, for s from 1 to 4.

The window draws motion as large as its time allows (`viewer.frame_budget`). `power` is the exponent p
of a time that falls as s^-p.

Run: python benchmarks/motion.py [MAP ...]    bundled maps; their first views at 1280 × 720
"""

import math
import sys
import time

from terrain_gl import Camera, Renderer
from terrain_gl.files.maps import bundled, open_map

SIZE = (1280, 720)
FRAMES = 4


def best_ms(renderer, camera):
    """Least processor milliseconds of a few frames, while the eye moves."""
    times = []
    for i in range(FRAMES):
        eye = (camera.eye[0] + i, *camera.eye[1:])
        started = time.process_time()
        renderer.draw(Camera(eye, camera.target, camera.fov_deg))
        renderer.ctx.finish()
        times.append(1e3 * (time.process_time() - started))
    return min(times)


def main():
    """Print a line a size."""
    print(f"{'map':10} {'size':>10} {'ms':>7} {'power':>6}")
    for name in sys.argv[1:] or bundled():
        with Renderer(open_map(name)[0], SIZE) as renderer:
            full_ms = best_ms(renderer, bundled()[name].camera)
            for s in (1, 2, 3, 4):
                renderer.resize((SIZE[0] // s, SIZE[1] // s))
                ms = best_ms(renderer, bundled()[name].camera)
                power = f"{math.log(full_ms / ms) / math.log(s):.2f}" if s > 1 else ""
                print(f"{name:10} {SIZE[0] // s:>5} × {SIZE[1] // s:<3} {ms:>6.0f} {power:>6}")


if __name__ == "__main__":
    main()
