"""Frames of the app, without a window: how much their times vary, and whether memory stays constant.

    python benchmarks/viewer_frames.py [FRAMES [WIDTHxHEIGHT [MAP]]]      10000, 160x120, canyon-15m

The camera circles over the map, and rests. There is a brush stroke every hundred frames, and now and then the mesh, a
split picture and frozen levels. For each kind of frame this prints the median and the 99.9th percentile, both of the
processor time of all cores, which does not depend on the load of the machine, and of elapsed time. Then it prints the
memory of the process and the number of OpenGL objects.
"""

from __future__ import annotations

import resource
import sys
from functools import partial
from pathlib import Path

import numpy as np
from flight import objects
from windowless import open_app, opened, time_of

from terrain_gl.renderer import Renderer
from terrain_gl.viewer.app import App

WARM = 300  # frames until everything was used once
Times = dict[str, list[tuple[float, float]]]


def main(frames: str = "10000", size: str = "160x120", name: str = "canyon-15m") -> int:
    """Fly, and print the times."""
    width, height = map(int, size.split("x"))
    app, land = open_app((width, height)), opened(name)
    app.viewer.show(Renderer(land.heightmap, (width, height), ctx=app.viewer.ctx), land)
    print(f"{name}, {frames} frames of {size}, {app.viewer.ctx.info['GL_RENDERER']}")
    times, held = fly(app, int(frames))
    everything = [each for some in times.values() for each in some]
    print(f"{'':24} {'frames':>6}   of work: {'median':>8} {'99.9 %':>8} {'ratio':>6}   by the clock: {'ratio':>6}")
    for what, some in {**dict(sorted(times.items())), "all": everything}.items():
        (clock, middle), (late, slow) = np.median(some, axis=0), np.percentile(some, 99.9, axis=0)
        work = f"{middle:17.1f} {slow:8.1f} {slow / middle:6.2f}"
        print(f"{what:24} {len(some):6} {work}   {late / clock:20.2f}")
    for number, (mib, kinds) in held.items():
        print(f"after {number:6,} frames {mib:7.1f} MiB, {kinds}")
    print(app.viewer.ctx.error)
    app.close()
    return 0


def fly(app: App, count: int) -> tuple[Times, dict[int, tuple[float, dict[str, int]]]]:
    """Elapsed and processor milliseconds of each frame; from time to time MiB, and OpenGL objects by kind."""
    times: Times = {}
    held: dict[int, tuple[float, dict[str, int]]] = {}
    app.viewer.scene.controller.change_mode("orbit")
    app.viewer.scene.controller.press("d")
    for number in range(count + WARM):
        act(app, number)
        what = doing(app)
        took = time_of(partial(app.frame, number / 30), app.viewer.ctx.finish)
        if number >= WARM:
            times.setdefault(what, []).append(took)
        if number == WARM or number == count + WARM - 1 or number % max(1, count // 5) == 0:
            held[number] = resident_mib(), objects(app.viewer.ctx)
    return times, held


def doing(app: App) -> str:
    """The kind of the next frame: what it shows, and what other work it does."""
    settings, sculpts = app.viewer.settings, app.viewer.sculpting.at_work
    shows = "two sides" if settings.split else "the mesh" if settings.options.wires else "the land"
    due = app.viewer.painter.light.is_due(app.viewer.scene.frame_spec().lit_look)
    beside = ", a dab" if sculpts else ", light is made" if due else ""
    return shows + beside if app.viewer.scene.controller.moving or sculpts else "at rest"


def act(app: App, number: int) -> None:
    """Act like a busy user at this frame."""
    keys = {10: "b", 20: "n", 30: "n", 40: "t", 50: "t", 60: "l", 70: "l", 80: "u", 90: "u"}
    if number % 100 == 84:
        app.viewer.scene.controller.let_go("d")
    elif number % 100 == 0:
        app.viewer.scene.controller.press("d")
    if number % 100 in keys and not (number % 100 == 10 and app.viewer.sculpting.brushing):
        app.press(keys[number % 100])
    middle = 0.5 * app.viewer.window.size[0], 0.75 * app.viewer.window.size[1]
    if number % 100 == 15:
        app.viewer.mouse.press("left", *middle)
    elif number % 100 == 17:
        app.viewer.mouse.release("left", *middle)
        app.press("ctrl+z")


def resident_mib() -> float:
    """Memory of the process."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return int(statm.read_text().split()[1]) * resource.getpagesize() / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
