"""How long a lecturer waits after the key for the next station: until its picture is complete, and all it shows.

    python benchmarks/lecture_keys.py [WIDTHxHEIGHT [MAP [REST_S]]]      1280x720, alpine-30m, until nothing is done

A row for each key that leads to another station. "All" also has the achieved error, the explained patch, the colours
of errors that end at a bound, and jumps. The camera travels for 0.8 s. Before each key the window works until nothing
is left to do, or for REST_S seconds at most; this time is in the table, and the longest frame in it, in seconds of the
processor: an event waits for it. It needs no window.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from table import head, row
from windowless import open_app, opened

from terrain_gl.renderer import Renderer
from terrain_gl.viewer.app import App


def main(size: str = "1280x720", name: str = "alpine-30m", rest_s: str = "600") -> int:
    """Give the lecture, and print the times."""
    width, height = map(int, size.split("x"))
    app = open_app((width, height))
    land = opened(name)
    app.viewer.show(Renderer(land.heightmap, (width, height), ctx=app.viewer.ctx), land)
    app.viewer.give_lecture()
    lecture = app.viewer.lecture
    assert lecture
    head(
        "station",
        "complete picture, s",
        "of the processor, s",
        "all, s",
        "of the processor, s",
        "rest before, s",
        "longest frame, s",
    )
    for number in range(1, len(lecture.stations)):
        rested, longest = rest(app, float(rest_s))
        while lecture.number != number:
            begun = now()
            lecture.press("right")
        picture = all_shown = None
        while all_shown is None:
            app.frame(time.perf_counter())
            app.viewer.ctx.finish()
            there = app.viewer.settled and not app.viewer.scene.controller.moving
            picture = picture if picture is not None else now() - begun if there else None
            all_shown = now() - begun if there and shows_all(app) else None
        row(number + 1, *(f"{value:.2f}" for value in (*picture, *all_shown, rested, longest)))
    app.close()
    return 0


def shows_all(app: App) -> bool:
    """Whether a station at rest has all that it shows."""
    viewer, lecture = app.viewer, app.viewer.lecture
    assert lecture and lecture.station
    if lecture.station.store and not viewer.scene.is_paged:
        return False
    if lecture.station.before and not lecture.jumps.sides:
        return False
    return bool(viewer.painter.is_measured or viewer.scene.is_paged) and not (lecture._fits or lecture._click)


def rest(app: App, most_s: float) -> tuple[float, float]:
    """Do frames until there is nothing more to do, or the time is over; returns the seconds, and the longest frame."""
    viewer, begun, longest = app.viewer, now(), 0.0
    while True:
        before = now()
        app.frame(time.perf_counter())
        viewer.ctx.finish()
        longest = max(longest, float((now() - before)[1]))
        waits = viewer.painter.waits_for_rest or viewer.lecture_store.at_work
        if (viewer.settled and not (app.busy or waits)) or now()[0] - begun[0] > most_s:
            return float(now()[0] - begun[0]), longest


def now() -> np.ndarray:
    """Elapsed seconds, and seconds of the processor."""
    return np.array([time.perf_counter(), time.process_time()])


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
