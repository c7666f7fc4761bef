"""How long the window keeps one waiting, without a window: the time of each frame by what was done in it.

    python benchmarks/viewer_latency.py [WIDTHxHEIGHT [MAP]]      1280x720, alpine

An event waits for the frame that is under way, and is seen with the next one, in motion: the longest of the portions
(loading, light, the full picture, measuring) is to be no longer than a frame in motion. Prints both, in milliseconds
by the clock and of all cores' work, which does not depend on what else a machine is at.
"""

from __future__ import annotations

import sys
import time
from functools import partial

import numpy as np
from windowless import open_flight, opened, time_of

from terrain_gl.viewer.flight import Flight
from terrain_gl.viewer.painter import REST_S

GLANCES = 5  # times that the head is turned, and the picture comes to rest
Times = dict[str, list[tuple[float, float]]]


def main(size: str = "1280x720", name: str = "alpine") -> int:
    """Load, look around, rest; print what it took."""
    width, height = map(int, size.split("x"))
    flight = open_flight((width, height))
    flight.land.load(name, lambda progress: opened(name))
    print(f"{name}, {size}, {flight.ctx.info['GL_RENDERER']}")
    times: Times = {}
    come_to_rest(flight, times)
    for _ in range(GLANCES):
        for _ in range(3):
            flight.controller.look(10, 0)
            frame(flight, times, "in motion")
        time.sleep(REST_S)
        come_to_rest(flight, times)
    print(f"{'':12} {'frames':>6} {'median':>8} {'95 %':>8} {'longest':>8}   of work: {'median':>8} {'longest':>8}")
    for doing, each in times.items():
        (wall, work), most = np.array(each).T, np.max(each, axis=0)
        middle, late = np.median(wall), np.percentile(wall, 95)
        by_clock = f"{doing:12} {len(wall):6} {middle:8.1f} {late:8.1f} {most[0]:8.1f}"
        print(f"{by_clock}{'':12}{np.median(work):9.1f} {most[1]:8.1f}")
    flight.close()
    return 0


def come_to_rest(flight: Flight, times: Times) -> None:
    """Frames until there is nothing more to do."""
    while flight.busy or not flight.settled:
        frame(flight, times, doing(flight))


def frame(flight: Flight, times: Times, what: str) -> None:
    """One frame, and how long it took: milliseconds by the clock, and of work."""
    took = time_of(partial(flight.frame, time.perf_counter()), flight.ctx.finish)
    times.setdefault(what, []).append(took)


def doing(flight: Flight) -> str:
    """What the next frame is likely to do."""
    if flight.land.loading or not flight.has_map:
        return "loading"
    if flight.painter.dawn.is_due(flight.wanted().lit_look):
        return "light"
    return "in full" if not flight.settled else "measuring"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
