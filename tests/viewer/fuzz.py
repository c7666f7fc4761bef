"""Random events for an app, and what must hold after each of them."""

import math

import numpy as np

from terrain_gl.viewer.commands import BY_KEY
from terrain_gl.viewer.controller import MOVE_KEYS
from terrain_gl.viewer.lecture import BACK, NEXT

KEYS = [*BY_KEY, *MOVE_KEYS, *NEXT, *BACK, "enter", "backspace", "delete", "end", "tab", ""]
ASK_A_DISK = {"p", "o", "k", "r", "ctrl+s", "ctrl+o", "y"}  # they write files, or list folders
SIZES = [(320, 200), (200, 320), (64, 64), (1, 1), (0, 0), (640, 90), (500, 300)]


class Fuzz:
    """Sends random events to an app, and checks it after each.

    The land may change by strokes and their undoing alone; the window may close, or show another map, only when no
    stroke is lost or the user has been warned.
    """

    def __init__(self, app, seed, asks_disk=True, step_s=0.05):
        self.app, self.viewer = app, app.viewer
        self.random = np.random.default_rng(seed)
        self.keys = [key for key in KEYS if asks_disk or key not in ASK_A_DISK]
        self.step_s = step_s
        self.now_s = self.viewer.window.now_s
        self.at = (10.0, 10.0)
        self.log = []  # the last events

    def run(self, events):
        """Do so many events; raises AssertionError with the last ones if anything does not hold."""
        for _ in range(events):
            before = self.land()
            name, arguments = self.event()
            self.log = [*self.log[-19:], (name, *arguments)]
            self.app.attempt(getattr(self.app, name), *arguments)
            self.now_s += self.step_s * float(self.random.choice([1, 1, 1, 10]))
            self.app.frame(self.now_s)
            try:
                self.check(before)
            except AssertionError as error:
                raise AssertionError(f"{error} after {self.log}") from error

    # --- Events -------------------------------------------------------------------------------------------------------

    def event(self):
        """The name of a method of the app, and its arguments."""
        kind = self.random.choice(["move", "down", "up", "key", "key up", "wheel", "size", "write", "focus"], p=_SHARES)
        if kind == "move":
            width, height = (max(side, 1) for side in self.viewer.window.size)
            far = self.random.random() < 0.1  # a drag goes on outside the window
            x, y = self.random.uniform(-2 if far else 0, 3 if far else 1, 2) * (width, height)
            near = self.random.random() < 0.5
            self.at = (self.at[0] + x / 20, self.at[1] + y / 20) if near else (x, y)
            return "mouse_move", tuple(map(float, self.at))
        if kind in ("down", "up"):
            button = str(self.random.choice(["left", "left", "middle", "right", ""]))
            return f"mouse_{kind}", (button, *self.at)
        if kind == "key":
            key = str(self.random.choice(self.keys))
            return "key_down", (key.split("+")[-1], key, bool(self.random.random() < 0.2), "ctrl" not in key)
        if kind == "key up":
            return "key_up", (str(self.random.choice(MOVE_KEYS)),)
        if kind == "wheel":
            action = str(self.random.choice(["", "", "zoom", "speed"]))
            notches = self.random.choice([-30.0, -1.0, 0.0, 0.3, 1.0, 30.0], 2)
            return "wheel", (*map(float, notches), *self.at, action)
        if kind == "size":
            size = SIZES[self.random.integers(len(SIZES))]
            return "resize", (size, float(self.random.choice([1.0, 1.0, 1.5, 2.0])))
        if kind == "write":
            return "write", (int(self.random.integers(32, 1000)),)
        return "lose_keyboard", ()

    # --- What must hold -----------------------------------------------------------------------------------------------

    def land(self):
        """What identifies the map and its edited land."""
        viewer = self.viewer
        tool = viewer.sculpting.tool
        warned = viewer.sculpting._warned is (tool and tool.land)
        edits = viewer.scene.renderer.terrain.edits
        return viewer.scene.heightmap.name, tool and tool.land, viewer.sculpting.unsaved, warned, edits

    def check(self, before):
        """The camera is finite, OpenGL has no error, no error was shown, no promise is broken, no stroke is lost."""
        app, viewer = self.app, self.viewer
        assert not viewer.alarm.line, viewer.alarm.line
        assert not app.errors, f"{app.errors[0]!r}"
        assert app.gui and viewer.ctx.error == "GL_NO_ERROR"
        controller = viewer.scene.controller
        assert np.isfinite([*controller.eye, controller.azimuth_deg, controller.elevation_deg]).all()
        assert 1 <= controller.fov_deg <= 120 and math.isfinite(controller.speed_m_s)
        name, land, unsaved, warned, edits = before
        now_name, now_land, _, _, now_edits = self.land()
        if viewer.window.closing or now_name != name:
            assert not unsaved or warned, "strokes are lost without a warning"
            viewer.window.closing = False
        elif now_land is not land:
            assert now_edits != edits, "the land changed without a stroke"


_SHARES = np.array([30, 14, 12, 22, 5, 7, 4, 3, 3]) / 100
