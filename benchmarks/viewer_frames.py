"""Frames of the window, without a window: whether they are even, and whether memory stays as it is.

    python benchmarks/viewer_frames.py [FRAMES [WIDTHxHEIGHT [MAP]]]      10000, 160x120, canyon

The eye circles over the map with panels, and rests; a brush stroke every hundred frames, the mesh, a split and frozen
levels now and then. Prints the middle and the slowest of a thousand times for each kind of frame, for two sides are two
pictures and a mesh is more than none, and for all of them: of all cores' work, which does not depend on what else a
machine is at, and by the clock; then the process's memory and how many objects OpenGL has.
"""

from __future__ import annotations

import resource
import sys
from functools import partial
from pathlib import Path

import numpy as np
from flight import objects
from windowless import open_flight, opened, time_of

from terrain_gl.renderer import Renderer
from terrain_gl.viewer.flight import Flight

WARM = 300  # frames until everything was used once
Times = dict[str, list[tuple[float, float]]]


def main(frames: str = "10000", size: str = "160x120", name: str = "canyon") -> int:
    """Fly, and print what came of it."""
    width, height = map(int, size.split("x"))
    flight, land = open_flight((width, height)), opened(name)
    flight.land.show(Renderer(land.heightmap, (width, height), ctx=flight.ctx), land)
    print(f"{name}, {frames} frames of {size}, {flight.ctx.info['GL_RENDERER']}")
    times, held = fly(flight, int(frames))
    everything = [each for some in times.values() for each in some]
    print(f"{'':24} {'frames':>6}   of work: {'median':>8} {'99.9 %':>8} {'ratio':>6}   by the clock: {'ratio':>6}")
    for what, some in {**dict(sorted(times.items())), "all": everything}.items():
        (clock, middle), (late, slow) = np.median(some, axis=0), np.percentile(some, 99.9, axis=0)
        work = f"{middle:17.1f} {slow:8.1f} {slow / middle:6.2f}"
        print(f"{what:24} {len(some):6} {work}   {late / clock:20.2f}")
    for number, (mib, kinds) in held.items():
        print(f"after {number:6,} frames {mib:7.1f} MiB, {kinds}")
    print(flight.ctx.error)
    flight.close()
    return 0


def fly(flight: Flight, count: int) -> tuple[Times, dict[int, tuple[float, dict[str, int]]]]:
    """Milliseconds of each frame, by the clock and of work; now and then MiB, and OpenGL's objects by kind."""
    times: Times = {}
    held: dict[int, tuple[float, dict[str, int]]] = {}
    flight.controller.change_mode("orbit")
    flight.controller.press("d")
    for number in range(count + WARM):
        act(flight, number)
        what = doing(flight)
        took = time_of(partial(flight.frame, number / 30), flight.ctx.finish)
        if number >= WARM:
            times.setdefault(what, []).append(took)
        if number == WARM or number == count + WARM - 1 or number % max(1, count // 5) == 0:
            held[number] = resident_mib(), objects(flight.ctx)
    return times, held


def doing(flight: Flight) -> str:
    """What the next frame shows, and what is made beside it."""
    settings, sculpts = flight.settings, flight.sculpting.at_work
    shows = "two sides" if settings.split else "the mesh" if settings.drawing.wires else "the land"
    due = flight.painter.dawn.is_due(flight.wanted().lit_look)
    beside = ", a dab" if sculpts else ", light is made" if due else ""
    return shows + beside if flight.controller.moving or sculpts else "at rest"


def act(flight: Flight, number: int) -> None:
    """What a restless user does."""
    keys = {10: "b", 20: "n", 30: "n", 40: "t", 50: "t", 60: "l", 70: "l", 80: "u", 90: "u"}
    if number % 100 == 84:
        flight.controller.let_go("d")
    elif number % 100 == 0:
        flight.controller.press("d")
    if number % 100 in keys and not (number % 100 == 10 and flight.sculpting.brushing):
        flight.press(keys[number % 100])
    middle = 0.5 * flight.size[0], 0.75 * flight.size[1]
    if number % 100 == 15:
        flight.mouse.press("left", *middle)
    elif number % 100 == 17:
        flight.mouse.let_go("left", *middle)
        flight.press("ctrl+z")


def resident_mib() -> float:
    """Memory of the process."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return int(statm.read_text().split()[1]) * resource.getpagesize() / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
