"""How long a user waits for the window: the time of each frame, by the work that is done in it. It needs no window.

    python benchmarks/viewer_latency.py [WIDTHxHEIGHT [MAP [EVENT ...]]]      1280x720, alpine-30m, all events
    python benchmarks/viewer_latency.py 1280x720 alpine flight                no events, no glances: only the flight

First it sends events to the picture at rest, and prints how long the first frame that differs takes to come, and the
whole picture. The panel, which changes with every event, is not looked at; so these are changes of the land. The
divider of a new split covers less than a hundredth of it, so for a split the first frame has both sides.

Then it flies forwards (W), and prints the frames a second, how they were drawn, and the time from the release of the
key to the whole picture, to its achieved error, and to the measurement of all places.

An event waits for the present frame, and the next frame shows it. So the longest step (of loading, light, the full
picture, measuring) should take no longer than a frame in motion. This prints both, in elapsed milliseconds and in
processor milliseconds of all cores, which do not depend on the load of the machine.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial

import numpy as np
from table import head, row
from windowless import open_app, opened, time_of

from terrain_gl.viewer.app import App
from terrain_gl.viewer.painter import REST_S

NEVER_S = 20.0  # an event that has changed nothing by then changes nothing
CHANGED = 0.01  # least share of the numbers of the land's pixels
GLANCES = 5  # turns of the camera, each followed by rest
FLOWN = 40  # frames of a flight; the first half chooses how the second half is drawn
Times = dict[str, list[tuple[float, float]]]


def main(size: str = "1280x720", name: str = "alpine-30m", *only: str) -> int:
    """Load, look around, rest; print the times."""
    width, height = map(int, size.split("x"))
    app = open_app((width, height))
    app.viewer.loader.load(name, lambda progress: opened(name))
    print(f"{name}, {size}, {app.viewer.ctx.info['GL_RENDERER']}")
    times: Times = {}
    come_to_rest(app, times)
    for use in ("first", "second"):  # programs are compiled at their first use
        head(f"event, {use} use", "first changed frame, s", "of the processor, s", "whole picture, s", "processor, s")
        for event in [event for event in EVENTS if not only or event.startswith(only)]:
            act = EVENTS[event]
            row(event, *(f"{seconds:.2f}" for pair in changes(app, act) for seconds in pair))
    for _ in range(0 if only else GLANCES):
        for _ in range(3):
            app.viewer.scene.controller.look(10, 0)
            frame(app, times, "in motion")
        time.sleep(REST_S)
        come_to_rest(app, times)
    fly(app)
    head("a frame with a step of", "frames", "ms, median", "95 %", "longest", "processor ms, median", "longest")
    for doing, each in times.items():
        wall, work = np.array(each).T
        numbers = np.median(wall), np.percentile(wall, 95), wall.max(), np.median(work), work.max()
        row(doing, len(wall), *(f"{ms:.0f}" for ms in numbers))
    app.close()
    return 0


EVENTS: dict[str, Callable[[App], object]] = {
    "right drag": lambda app: app.viewer.scene.controller.look(60, 10),
    "wheel": lambda app: app.wheel(0.0, 2.0, 900.0, 500.0),
    "tolerance (+)": lambda app: app.press("+"),
    "mesh over the picture (N)": lambda app: app.press("n"),
    "no mesh (N)": lambda app: app.press("n"),
    "contour lines (Shift C)": lambda app: app.press("shift+c"),
    "style (Tab)": lambda app: app.press("tab"),
    "style before (Shift Tab)": lambda app: app.press("shift+tab"),
    "freeze (L)": lambda app: app.press("l"),
    "look around, frozen": lambda app: app.viewer.scene.controller.look(-60, 0),
    "thaw (L)": lambda app: app.press("l"),
    "split (T)": lambda app: app.press("t"),
    "right drag, split": lambda app: app.viewer.scene.controller.look(60, 0),
    "one picture (T)": lambda app: app.press("t"),
    "first view (Home)": lambda app: app.press("home"),
}


Seconds = tuple[float, float]  # elapsed, and of the processor


def changes(app: App, act: Callable[[App], object]) -> tuple[Seconds, Seconds]:
    """Seconds from an event to the first frame that shows a change, and to the whole picture."""
    before, first = land(app), None
    begun = time.perf_counter(), time.process_time()
    act(app)
    while first is None or not app.viewer.settled:
        shown = app.frame(time.perf_counter())
        app.viewer.ctx.finish()
        now = time.perf_counter() - begun[0], time.process_time() - begun[1]
        if first is None and shown and (land(app) != before).mean() > CHANGED:
            first = now
        if first is None and app.viewer.settled and now[0] > NEVER_S:
            first = float("nan"), float("nan")
    while app.busy or app.viewer.painter.waits_for_rest:
        app.frame(time.perf_counter())
    return first, now


def fly(app: App) -> None:
    """Fly forwards, stop, and print the times."""
    begun, ways = _now(), Counter[str]()
    app.key_down("w", "w")
    for i in range(FLOWN):
        if i == FLOWN // 2:
            begun = _now()
        app.frame(time.perf_counter())
        app.viewer.ctx.finish()
        ways[
            app.viewer.painter.frame.way.words(app.viewer.painter.frame.stats["requested_max_error_px"]) or "full size"
        ] += i >= FLOWN // 2
    clock_s, work_s = _now() - begun
    print(f"flight: {FLOWN / 2 / clock_s:.1f} frames/s, {2e3 * work_s / FLOWN:.0f} ms of the processor a frame")
    print(f"        {', '.join(f'{count} frames in {way}' for way, count in ways.items() if count)}")
    app.key_up("w")
    begun = _now()
    while app.viewer.scene.controller.moving or not app.viewer.settled:
        app.frame(time.perf_counter())
    whole = _now() - begun
    while app.viewer.painter.frame.achieved_px is None:
        app.frame(time.perf_counter())
    measured = _now() - begun
    while not app.viewer.painter.is_measured:
        app.frame(time.perf_counter())
    found = {"whole picture": whole, "achieved error": measured, "achieved error, all places": _now() - begun}
    for what, (clock_s, work_s) in found.items():
        print(f"        {what} {clock_s:.2f} s after the key ({work_s:.2f} of the processor)", flush=True)


def _now() -> np.ndarray:
    """Elapsed seconds, and seconds of the processor."""
    return np.array([time.perf_counter(), time.process_time()])


def land(app: App) -> np.ndarray:
    """The pixels that panels do not cover, as one sees them now."""
    width, height = app.viewer.window.size
    left = round(app.viewer.window.panel_px)
    data = app.viewer.target.read((left, 0, width - left, height), components=3, alignment=1)
    pixels = np.frombuffer(data, np.uint8).reshape(height, width - left, 3)
    return pixels[height // 4 : 3 * height // 4]  # below and above are messages, legends and the north arrow


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
