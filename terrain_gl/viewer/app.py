"""A viewer with panels: input goes to a panel, to the camera or to a command. Window and notebook both use it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import moderngl

from . import commands
from .controller import MOVE_KEYS
from .frame_budget import FrameBudget
from .gui import Gui
from .memory import Memory
from .panels import Panels, scale_of, taken_px
from .picture_section import IMAGES
from .settings import Settings
from .viewer import Viewer
from .window_state import Size

FAILED_WAIT_S = 0.25  # seconds until the next frame, after a frame that failed
ERROR_S = 15.0  # how long the window shows an error


class App:
    """Takes input and draws frames. An error in a frame is shown in a line, and the app goes on.

    The window and the notebook hand over each event by `attempt`, so the same holds for events.

    Parameters
    ----------
    ctx, target, size, settings, memory, budget
        As `Viewer` takes them.
    scale
        Pixels of the screen per unit of length: more than 1 on fine screens.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        target: moderngl.Framebuffer,
        size: Size,
        settings: Settings,
        memory: Memory | None = None,
        scale: float = 1.0,
        budget: FrameBudget | None = None,
    ) -> None:
        self._screen = scale
        self.gui = Gui(ctx, partial(self.attempt, self.press), scale_of(size, scale, settings.ui_scale))
        self.viewer = Viewer(ctx, target, size, settings, memory, budget)
        self._fit(size)
        self.panels = Panels(self.viewer)
        self.captured = False  # whether the mouse looks around without a button; then panels get no events
        self.errors: list[Exception] = []  # those that the window has shown
        self._failed = False  # whether an error came in the last frame
        self._shown: tuple[object, ...] = ()  # which panels the last frame had
        self._echoes = 0  # frames still to draw after a change: panels find their size in one or two frames

    def close(self) -> None:
        """Release resources, and remember what the next run needs."""
        self.viewer.close()
        self.gui.release()

    # --- Frames -------------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once; otherwise the frame comes after an event or `wait_s`."""
        return not self._failed and (bool(self._echoes) or self.viewer.busy)

    @property
    def wait_s(self) -> float:
        """Seconds until a frame may be due without any event."""
        if self._failed:
            return FAILED_WAIT_S
        lively = self.gui.is_lively(self.viewer.window.now_s)
        return min(self.viewer.wait_s, 0.05) if lively else self.viewer.wait_s

    def frame(self, now_s: float) -> bool:
        """Do one frame, `now_s` seconds after the start; returns whether the target shows a new picture."""
        window = self.viewer.window
        self._failed = False
        self._fit(window.size)
        stale = self.attempt(self.viewer.step, now_s) is not False
        if not window.is_visible or not (stale or self._echoes or self.gui.is_lively(now_s)):
            return False
        self._echoes = 2 if stale else max(0, self._echoes - 1)
        self._draw(now_s)
        if (shown := self.viewer.shown) != self._shown:  # other panels: the next frame, with their sizes, may take long
            self._shown = shown
            for _ in range(2):  # the sections of a new panel need one more frame than the panel
                self._draw(now_s)
        return True

    def _draw(self, now_s: float) -> None:
        """Draw the picture, and the panels over it."""
        size, target = self.viewer.window.size, self.viewer.target
        self.attempt(self.viewer.draw)
        errors = len(self.errors)
        self.attempt(self.gui.draw, self.panels.build, target, size, now_s)
        if len(self.errors) > errors:
            self.attempt(self.gui.draw, self.panels.status_alone, target, size, now_s)

    # --- Errors -------------------------------------------------------------------------------------------------------

    def attempt(self, action: Callable[..., Any], *arguments: object) -> Any:
        """Call a function and return its result. If it raises an error, show the error in a line, and return None.

        If there is no map, and none is being loaded, the app cannot go on, and raises the error.
        """
        try:
            return action(*arguments)
        except Exception as error:
            loader = self.viewer.loader
            if error is loader.fatal or not (self.viewer.scene.has_map or loader.job):
                raise
            self._failed = True
            self.errors.append(error)
            self.viewer.window.say(self.viewer.recover(error), ERROR_S)
            return None

    # --- The window ---------------------------------------------------------------------------------------------------

    def resize(self, size: Size, scale: float) -> None:
        """Follow a new size of the target in pixels, or a new scale."""
        self._screen = scale
        self._fit(size)
        self.viewer.window.resize(size)

    def _fit(self, size: Size) -> None:
        """Fit the sizes of type and panels to a size of the window, and to the user's factor."""
        scale = scale_of(size, self._screen, self.viewer.settings.ui_scale)
        window = self.viewer.window
        if scale != self.gui.widgets.scale:
            self.gui.rescale(scale)
            window.refresh()
        window.scale = scale
        window.panel_px = taken_px(size, scale)

    def drop(self, path: str, x: float, y: float) -> None:
        """Take a file that the user drops on the land, or on a field for an image."""
        self.viewer.tour.end()
        option = IMAGES.get(self.gui.widgets.at(x, y))
        if option:
            self.viewer.images.read(option, path)
        else:
            self.viewer.open(path)

    # --- Keys: named by their place on a US keyboard ------------------------------------------------------------------

    def press(self, key: str, repeated: bool = False) -> None:
        """Execute the command of a key, such as "ctrl+z"."""
        if key == "escape" and self.gui.close_list():
            return
        commands.press(self.viewer, key, repeated)

    def key_down(self, key: str, command: str, repeated: bool = False, moves: bool = True) -> None:
        """A key goes down. `command` is the key with its modifiers, such as "shift+tab".

        A key that is held is `repeated`. Together with Ctrl or Alt, a key moves no camera (`moves`).
        """
        if self.viewer.tour.end():
            return
        self.gui.key(key, True)
        if self.gui.takes_text:
            return
        if self.viewer.lecture and command == key and self.viewer.lecture.press(key):
            return
        if moves and key in MOVE_KEYS:
            if self.viewer.scene.has_map and not repeated:
                self.viewer.scene.controller.press(key)
        elif key == "escape" and self.captured:
            self.press("c")
        else:
            self.press(command, repeated)

    def key_up(self, key: str) -> None:
        self.gui.key(key, False)
        if self.viewer.scene.has_map:
            self.viewer.scene.controller.let_go(key)

    def write(self, character: int) -> None:
        self.gui.write(character)

    def lose_keyboard(self) -> None:
        """Release all keys, because another window has the keyboard now."""
        if self.viewer.scene.has_map:
            self.viewer.scene.controller.let_go_all()

    # --- The mouse: pixels count from the upper left ------------------------------------------------------------------

    def mouse_down(self, button: str, x: float, y: float) -> None:
        self.viewer.tour.end()
        if not self.captured:
            self.gui.button(button, True)
            if self.gui.covers(x, y):
                return
        self.viewer.mouse.press(button, x, y)

    def mouse_up(self, button: str, x: float, y: float) -> None:
        if not self.captured:
            self.gui.button(button, False)
        self.viewer.mouse.release(button, x, y)

    def mouse_move(self, x: float, y: float) -> None:
        self.viewer.tour.touch()
        if not self.captured:
            self.gui.move(x, y)
        over_panels = not self.captured and self.gui.covers(x, y)
        self.viewer.mouse.move(x, y, look=self.captured, over_panels=over_panels)

    def wheel(self, dx: float, dy: float, x: float, y: float, action: str = "") -> None:
        """The wheel turns; `action`: "zoom" with Ctrl, "speed" with Shift."""
        self.viewer.tour.end()
        if not self.captured and self.gui.covers(x, y):
            self.gui.wheel(dx, dy)
        else:
            self.viewer.mouse.wheel(dy or dx, x, y, action)
