"""Random events for a real window under Xvfb: drags into the sky, all buttons and keys, sizes, a lost focus.

    python benchmarks/window_events.py [EVENTS [SEED [SECONDS]]]      20,000 events, seed 1, no limit of time

The X server gets the events by its extension XTest, so they take the way of a user's own. After each event the camera
must be finite, OpenGL without error, and no stroke lost without a warning (`Fuzz.check` of tests/viewer/fuzz.py). Each
run of 1000 events has a window of its own, with another seed: every other one with the lecture, and type and panels at
0.5 to 4 times their size. It needs Xvfb and python-xlib. benchmarks/window_fuzz.py needs neither.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "viewer"))
from fuzz import Fuzz  # noqa: E402  the tests' own invariant
from screen import Screen, own_lines  # noqa: E402
from viewers import hills  # noqa: E402

from terrain_gl.viewer import window  # noqa: E402

EVENTS = 1000  # of one window
SCALES = (0.5, 1.0, 2.0, 4.0)
SIZES = ((320, 200), (200, 320), (64, 64), (1, 1), (640, 90), (500, 300), (800, 500))
_KINDS = ("move", "button", "key", "chord", "size", "focus")
_SHARES = (0.36, 0.24, 0.26, 0.08, 0.04, 0.02)
_HELD = ("Control_L", "Shift_L")
_NAMED = (
    "Tab",
    "Return",
    "Escape",
    "BackSpace",
    "Delete",
    "Home",
    "End",
    "Prior",
    "Next",
    "space",
    "F1",
    "plus",
    "minus",
)
_KEYS = (*"abcdefghijklmnopqrstuvwxyz0123456789[]", *_NAMED, "Left", "Right", "Up", "Down")


class Hand:
    """A user's hand: sends one random event after the other to the window of this process."""

    def __init__(self, seed: int, window_number: int) -> None:
        from Xlib import XK, X, display
        from Xlib.ext import xtest

        self._x, self._keys, self._send = X, XK, xtest.fake_input
        self.display = display.Display()
        self.random = np.random.default_rng(seed)
        self.window = self.display.create_resource_object("window", window_number)
        self.down: set[int] = set()  # buttons

    def do(self) -> str:
        """Send an event; returns its name."""
        kind = str(self.random.choice(_KINDS, p=_SHARES))
        act: Callable[[], Any] = getattr(self, f"_{kind}")
        told = f"{kind} {act()}"
        self.display.sync()
        return told

    def _move(self) -> tuple[int, int]:
        size = self.window.get_geometry()
        x, y = self.random.uniform(-0.1, 1.2, 2) * (size.width, size.height)
        self._send(self.display, self._x.MotionNotify, x=max(int(x), 0), y=max(int(y), 0))
        return int(x), int(y)

    def _button(self) -> int:
        button = int(self.random.choice([1, 1, 2, 3, 4, 5, 6, 7, 8]))
        is_down = button in self.down
        self._send(self.display, self._x.ButtonRelease if is_down else self._x.ButtonPress, button)
        self.down ^= {button}
        return button

    def _key(self, held: str = "") -> str:
        name = str(self.random.choice(_KEYS))
        codes = [self.display.keysym_to_keycode(self._keys.string_to_keysym(_SYMBOLS.get(n, n))) for n in (held, name)]
        down = [code for code in codes if code]
        for code in down:
            self._send(self.display, self._x.KeyPress, code)
        for code in reversed(down):
            self._send(self.display, self._x.KeyRelease, code)
        return f"{held} {name}"

    def _chord(self) -> str:
        return self._key(str(self.random.choice(_HELD)))

    def _size(self) -> tuple[int, int]:
        width, height = SIZES[self.random.integers(len(SIZES))]
        self.window.configure(width=width, height=height)
        return width, height

    def _focus(self) -> str:
        lost = bool(self.random.random() < 0.5)
        target = self.display.screen().root if lost else self.window
        self.display.set_input_focus(target, self._x.RevertToParent, self._x.CurrentTime)
        return "lost" if lost else "taken"


_SYMBOLS = {"[": "bracketleft", "]": "bracketright"}


class Fuzzed(window.Window):
    """A window that gets an event before each turn, and is checked after it."""

    events = EVENTS
    seed = 1

    def _turn(self) -> None:
        if not self._app.viewer.scene.has_map:
            super()._turn()
            return
        if not hasattr(self, "fuzz"):
            self.fuzz = Fuzz(self._app, self.seed)
            self.hand = Hand(self.seed, self._glfw.get_x11_window(self._handle))
            self.sent: list[str] = []
        before = self.fuzz.land()
        self.sent = [*self.sent[-19:], self.hand.do()]
        super()._turn()
        try:
            self.fuzz.check(before)
        except AssertionError as error:
            raise AssertionError(f"{error} after {self.sent}") from (self._app.errors or [error])[0]
        self.events -= 1
        if not self.events:
            self._app.viewer.window.closing = True


def run_one(seed: int, events: int) -> None:
    """Open a window on a small map, and send it events; raises AssertionError if anything does not hold."""
    Fuzzed.seed, Fuzzed.events = seed, events
    window.Window = Fuzzed  # type: ignore[misc]
    lecture = "" if seed % 2 else None
    scale = SCALES[seed % len(SCALES)]
    window.run(hills(65), size=(480, 300), fresh=True, style="lambert", lecture=lecture, ui_scale=scale)


def main(events: str = "20000", seed: str = "1", seconds: str = "1e9") -> int:
    """Open one window after the other until all events are sent, or the time is over; print how many were."""
    end = time.monotonic() + float(seconds)
    sent, number = 0, int(seed)
    with tempfile.TemporaryDirectory() as folder:
        screen = Screen(Path(folder))
        try:
            while sent < int(events) and time.monotonic() < end:
                count = min(EVENTS, int(events) - sent)
                one = [sys.executable, __file__, "one", str(number), str(count)]
                ended = subprocess.run(one, env=screen.environment, cwd=folder, capture_output=True, text=True)
                if ended.returncode:
                    print(json.dumps({"seed": number, "after": sent}), *own_lines(ended.stderr), sep="\n", flush=True)
                    return 1
                sent += count
                print(f"seed {number}: {sent:,} events, none failed", flush=True)
                number += 1
        finally:
            screen.server.terminate()
            screen.server.wait()
    return 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["one"]:
        os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
        run_one(int(sys.argv[2]), int(sys.argv[3]))
    else:
        sys.exit(main(*sys.argv[1:]))
