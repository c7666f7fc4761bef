"""The GLFW window: opens it, hands its events on, and shows frames. All that is decided is decided elsewhere."""

from __future__ import annotations

import math
from typing import Any

from ..camera import Camera
from ..context import from_glfw_window
from ..drawing import Drawing
from ..heightmap import Heightmap
from ..renderer import Renderer
from .flight import Flight
from .hud import message_panel
from .opening import library, open_window
from .overlay import Overlay
from .settings import Settings

_MOVES = "wasdqe"
_NAMED = ("tab", "home", "escape", "f1")


def run(
    heightmap: Heightmap,
    camera: Camera | None = None,
    *,
    size: tuple[int, int] = (1280, 720),
    name: str = "",
    **options: Any,
) -> int:
    """Open a window on a map and return 0 when it is closed.

    Parameters
    ----------
    camera
        First view; by default `Camera.default`.
    size
        Width and height of the window in screen coordinates.
    name
        What the window's title says; by default the map's name.
    options
        How it is drawn at first: fields of `Drawing`, by name.

    Raises
    ------
    TerrainError
        No display, no OpenGL 4.3, or too little GPU memory.
    """
    settings = Settings(Drawing(**options))
    window = Window(size, name or heightmap.name)
    try:
        window.fly(heightmap, camera or Camera.default(heightmap), settings)
    finally:
        window.close()
    return 0


class Window:
    """A window with an OpenGL context, empty until `fly`."""

    def __init__(self, size: tuple[int, int], name: str) -> None:
        self._glfw = library()
        self.name = name
        self._handle = open_window(self._glfw, size, f"{name} – terrain-gl")
        self.ctx = from_glfw_window(self._handle)
        self._glfw.swap_interval(1)
        self._overlay = Overlay(self.ctx, self._scale)
        self._cursor = (0.0, 0.0)
        self._captured = False
        self._drag = ""

    def fly(self, heightmap: Heightmap, camera: Camera, settings: Settings) -> None:
        """Draw frames until the user closes the window."""
        self._announce("opening …")
        # the window may be out of sight, or larger than what the GPU draws; the first frame will tell
        with Renderer(heightmap, self._pixels_or(1), ctx=self.ctx) as renderer:
            self._flight = Flight(renderer, self._overlay, self.ctx.screen, camera, settings)
            self._listen()
            self._flight.say("H shows the keys", self._now)
            while not self._glfw.window_should_close(self._handle):
                self._turn()

    def close(self) -> None:
        """Close the window and give everything back."""
        self._overlay.release()
        self.ctx.release()
        self._glfw.destroy_window(self._handle)
        self._glfw.terminate()

    def _turn(self) -> None:
        if self._flight.frame(self._now):
            self._glfw.swap_buffers(self._handle)
        if self._flight.busy and min(self._flight.size) > 0:
            self._glfw.poll_events()
        else:
            self._glfw.wait_events_timeout(self._flight.wait_s)

    @property
    def _now(self) -> float:
        return self._glfw.get_time()

    @property
    def _scale(self) -> int:
        return max(1, round(self._glfw.get_window_content_scale(self._handle)[0]))

    def _pixels_or(self, least: int) -> tuple[int, int]:
        width, height = self._glfw.get_framebuffer_size(self._handle)
        return max(least, width), max(least, height)

    def _announce(self, text: str) -> None:
        """Say something before there is a picture."""
        self.ctx.screen.use()
        self.ctx.clear(0.16, 0.19, 0.23)
        self._overlay.draw(self.ctx.screen, self._pixels_or(1), [message_panel(f"{self.name}: {text}")])
        self._glfw.swap_buffers(self._handle)
        self._glfw.poll_events()

    # --- Events -------------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        listeners = {
            "framebuffer_size": lambda _, width, height: self._flight.resize((width, height)),
            "window_refresh": lambda _: self._refresh(),
            "window_content_scale": lambda *_: self._rescale(),
            "window_focus": lambda _, focused: None if focused else self._flight.controller.let_go_all(),
            "key": self._on_key,
            "mouse_button": self._on_button,
            "cursor_pos": self._on_cursor,
            "scroll": self._on_scroll,
        }
        for event, listener in listeners.items():
            getattr(self._glfw, f"set_{event}_callback")(self._handle, listener)
        self._cursor = self._glfw.get_cursor_pos(self._handle)

    def _refresh(self) -> None:
        """While a window is being resized some systems let nothing else run than this."""
        self._flight.resize(self._pixels_or(0))
        if self._flight.frame(self._now):
            self._glfw.swap_buffers(self._handle)

    def _rescale(self) -> None:
        self._overlay.scale = self._scale
        self._flight.resize(self._pixels_or(0))

    def _on_key(self, _: Any, key: int, scancode: int, action: int, mods: int) -> None:
        glfw, controller = self._glfw, self._flight.controller
        place = _place(glfw, key)
        if action == glfw.RELEASE:
            controller.let_go(place)
        elif place in _MOVES or place == "shift":
            controller.press(place)
        elif place == "escape":
            self._escape()
        else:
            self._on_command(place if place in _NAMED else _label(glfw, key, scancode) or place, action)

    def _on_command(self, key: str, action: int) -> None:
        if action == self._glfw.REPEAT and key not in "+=-":
            return
        if key == "c":
            self._capture(not self._captured)
        else:
            self._flight.press(key, self._now)

    def _escape(self) -> None:
        """Give the mouse back, else put the keys' panel away, else quit."""
        if self._captured:
            self._capture(False)
        elif self._flight.settings.keys:
            self._flight.press("h", self._now)
        else:
            self._glfw.set_window_should_close(self._handle, True)

    def _capture(self, captured: bool) -> None:
        glfw = self._glfw
        self._captured = captured
        glfw.set_input_mode(self._handle, glfw.CURSOR, glfw.CURSOR_DISABLED if captured else glfw.CURSOR_NORMAL)
        self._cursor = glfw.get_cursor_pos(self._handle)
        self._flight.say("the mouse looks around: C or Esc lets it go" if captured else "the mouse is free", self._now)

    def _on_button(self, _: Any, button: int, action: int, mods: int) -> None:
        glfw = self._glfw
        names = {glfw.MOUSE_BUTTON_LEFT: "orbit", glfw.MOUSE_BUTTON_RIGHT: "look"}
        self._drag = names.get(button, "") if action == glfw.PRESS else ""
        if self._drag == "orbit":
            self._flight.controller.grab(*self._tangents())
        else:
            self._flight.controller.release()

    def _on_cursor(self, _: Any, x: float, y: float) -> None:
        dx, dy = x - self._cursor[0], y - self._cursor[1]
        self._cursor = x, y
        drag = "look" if self._captured else self._drag
        if drag:
            getattr(self._flight.controller, drag)(dx, dy)
            self._flight.touch(self._now)

    def _on_scroll(self, _: Any, dx: float, dy: float) -> None:
        self._flight.wheel(dy)

    def _tangents(self) -> tuple[float, float]:
        """The cursor as tangents right and up of the picture's middle."""
        width, height = self._glfw.get_window_size(self._handle)
        half = math.tan(math.radians(0.5 * self._flight.controller.fov_deg)) / (0.5 * max(1, height))
        return (self._cursor[0] - 0.5 * width) * half, (0.5 * height - self._cursor[1]) * half


# --- Keys -------------------------------------------------------------------------------------------------------------


def _place(glfw: Any, key: int) -> str:
    """Name of a key by its place on a US keyboard."""
    named = {
        glfw.KEY_LEFT_SHIFT: "shift",
        glfw.KEY_RIGHT_SHIFT: "shift",
        glfw.KEY_TAB: "tab",
        glfw.KEY_HOME: "home",
        glfw.KEY_ESCAPE: "escape",
        glfw.KEY_F1: "f1",
    }
    return named.get(key, chr(key).lower() if 32 < key < 127 else "")


def _label(glfw: Any, key: int, scancode: int) -> str:
    """What is printed on a key, where that is a plain letter."""
    label = glfw.get_key_name(key, scancode) or ""
    return label if label.isascii() else ""
