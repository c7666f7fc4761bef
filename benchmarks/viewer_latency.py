"""How long a user waits for the window: the time of each frame, by the work that is done in it. It needs no window.

    python benchmarks/viewer_latency.py [WIDTHxHEIGHT [MAP]]      1280x720, alpine

An event waits for the present frame, and the next frame shows it. So the longest step (of loading, light, the full
picture, measuring) should take no longer than a frame in motion. This prints both, in elapsed milliseconds and in
processor milliseconds of all cores, which do not depend on the load of the machine.
"""

from __future__ import annotations

import sys
import time
from functools import partial

import numpy as np
from windowless import open_app, opened, time_of

from terrain_gl.viewer.app import App
from terrain_gl.viewer.painter import REST_S

GLANCES = 5  # turns of the camera, each followed by rest
Times = dict[str, list[tuple[float, float]]]


def main(size: str = "1280x720", name: str = "alpine") -> int:
    """Load, look around, rest; print the times."""
    width, height = map(int, size.split("x"))
    app = open_app((width, height))
    app.viewer.loader.load(name, lambda progress: opened(name))
    print(f"{name}, {size}, {app.viewer.ctx.info['GL_RENDERER']}")
    times: Times = {}
    come_to_rest(app, times)
    for _ in range(GLANCES):
        for _ in range(3):
            app.viewer.scene.controller.look(10, 0)
            frame(app, times, "in motion")
        time.sleep(REST_S)
        come_to_rest(app, times)
    print(f"{'':12} {'frames':>6} {'median':>8} {'95 %':>8} {'longest':>8}   of work: {'median':>8} {'longest':>8}")
    for doing, each in times.items():
        (wall, work), most = np.array(each).T, np.max(each, axis=0)
        middle, late = np.median(wall), np.percentile(wall, 95)
        by_clock = f"{doing:12} {len(wall):6} {middle:8.1f} {late:8.1f} {most[0]:8.1f}"
        print(f"{by_clock}{'':12}{np.median(work):9.1f} {most[1]:8.1f}")
    app.close()
    return 0


def come_to_rest(app: App, times: Times) -> None:
    """Draw frames until there is nothing more to do."""
    while app.busy or not app.viewer.settled:
        frame(app, times, doing(app))


def frame(app: App, times: Times, what: str) -> None:
    """Draw one frame, and note its elapsed and processor milliseconds."""
    took = time_of(partial(app.frame, time.perf_counter()), app.viewer.ctx.finish)
    times.setdefault(what, []).append(took)


def doing(app: App) -> str:
    """The kind of work that the next frame will probably do."""
    if app.viewer.loader.job or not app.viewer.scene.has_map:
        return "loading"
    if app.viewer.painter.light.is_due(app.viewer.scene.frame_spec().lit_look):
        return "light"
    return "in full" if not app.viewer.settled else "measuring"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
