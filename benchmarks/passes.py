"""Processor time of each pass of method `sat`: the first view of the bundled range, 1280 × 720, one pixel.

Processor milliseconds of all threads of a software renderer, the least of the frames; what is left of the whole is
Python and the driver.

Run: python benchmarks/passes.py [FRAMES]; by default 40 frames.
"""

import sys
import time
from collections import defaultdict

from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map

SIZE = (1280, 720)


class Clock:
    """Times the passes of a selector."""

    def __init__(self, selector):
        self.selector, self.run, self.ms = selector, selector._run, defaultdict(list)

    def __enter__(self):
        self.selector._run = self.timed
        return self

    def __exit__(self, *_):
        self.selector._run = self.run

    def timed(self, name, *args, **uniforms):
        """Run a pass and wait for it."""
        started = time.process_time()
        self.run(name, *args, **uniforms)
        self.selector.ctx.finish()
        self.ms[name].append(1e3 * (time.process_time() - started))


def main():
    """Print a line for each pass."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    heightmap, camera = open_map("alpine-30m")[0], bundled()["alpine-30m"].camera
    least, whole = defaultdict(lambda: float("inf")), float("inf")
    with tg.Renderer(heightmap, SIZE) as renderer:
        renderer.choose(camera)
        for _ in range(frames):
            started = time.process_time()
            renderer.choose(camera)
            whole = min(whole, 1e3 * (time.process_time() - started))
            with renderer.session, Clock(renderer.selectors["sat"]) as clock:
                renderer.choose(camera)
            for name, times in clock.ms.items():
                least[name] = min(least[name], sum(times))
    head("pass", "ms")
    for name, ms in [*least.items(), ("`lod` in all, with Python and the driver", whole)]:
        row(name, f"{ms:.1f}")


if __name__ == "__main__":
    main()
