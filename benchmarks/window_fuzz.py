"""Random events for the window: mouse, keys, sizes, focus; it needs no window system.

    python benchmarks/window_fuzz.py [SECONDS [SEED]]      300 s, seed 1

After each event the camera must be finite, OpenGL without error, and no stroke lost without a warning
(tests/viewer/fuzz.py; a short form is in tests/viewer/test_fuzz.py). Each run of 1000 events begins with another seed,
and with another map: a small one, one with voids, one of a single height. Every other run has the lecture. Type and
panels have 0.5 to 4 times their size. This prints how many events were sent.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "viewer"))
from fuzz import Fuzz  # noqa: E402  the tests' own events
from viewers import hills, set_budget, slow  # noqa: E402
from windowless import open_app  # noqa: E402

from terrain_gl.camera import Camera  # noqa: E402
from terrain_gl.heightmap import Heightmap  # noqa: E402
from terrain_gl.renderer import Renderer  # noqa: E402
from terrain_gl.viewer.loading import Opened  # noqa: E402

EVENTS = 1000
SCALES = (0.5, 1.0, 2.0, 4.0)


def maps() -> list[Heightmap]:
    """Small maps of different kinds."""
    voids = hills(65).heights.copy()
    voids[20:40, 10:30] = np.nan
    flat = np.full((33, 49), 7.0, np.float32)
    return [hills(65), Heightmap(voids, 10.0, "voids"), Heightmap(flat, 10.0, "flat")]


def main(seconds: str = "300", seed: str = "1") -> int:
    """Send events until the time is over."""
    os.chdir(tempfile.mkdtemp())  # events save pictures, meshes and maps
    end = time.monotonic() + float(seconds)
    events = 0
    number = int(seed)
    while time.monotonic() < end:
        heightmap = maps()[number % 3]
        app = open_app((320, 200))
        opened = Opened(heightmap, Camera.default(heightmap), key=heightmap.name)
        app.viewer.show(Renderer(heightmap, (80, 50), ctx=app.viewer.ctx), opened)
        set_budget(app.viewer, slow())
        app.viewer.settings.ui_scale = SCALES[number % len(SCALES)]
        if number % 2:
            viewer = app.viewer
            viewer.give_lecture()
        fuzz = Fuzz(app, number)
        for _ in range(EVENTS):
            fuzz.run(1)
            events += 1
            if time.monotonic() > end:
                break
        print(f"seed {number}, {heightmap.name}: {events} events, none failed", flush=True)
        app.close()
        number += 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
