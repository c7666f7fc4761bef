"""The window's flight in a notebook: the same camera, keys and panels, drawn without a display and sent as pictures.

    from terrain_gl.notebook import View
    View("alpine")

Where no front end is live (a notebook that is run by a script, or read on a page) the last picture stands instead.
It takes the extra `[notebook]`: jupyter_rfb (https://jupyter-rfb.readthedocs.io) brings pictures out and events in.
"""

from __future__ import annotations

import asyncio
import base64
import os
import time
from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np

try:
    from jupyter_rfb import RemoteFrameBuffer
except ImportError as error:
    raise ImportError(
        f"{error}: the notebook's view needs the extra [notebook]: pip install 'terrain-gl[notebook]'"
    ) from None

from . import gl
from .camera import Camera
from .context import create_context
from .drawing import Drawing
from .exceptions import UsageError
from .heightmap import Heightmap
from .image import png_bytes
from .maps import open_map
from .renderer import Renderer
from .shade import SUN
from .viewer.controller import MOVE_KEYS
from .viewer.flight import Flight
from .viewer.gui import Gui
from .viewer.gui import library as library_of_gui
from .viewer.loading import Opened
from .viewer.overlay import Overlay
from .viewer.settings import Settings
from .views import standard_view

NOTCH_PX = 100.0  # of a wheel, as browsers tell it
_BUTTONS = {1: "left", 2: "right", 3: "middle"}
_NAMED = {"ArrowLeft": "left", "ArrowRight": "right", "ArrowUp": "up", "ArrowDown": "down", " ": "space"}
_DIGITS = dict(zip("!@#$%^&*(", "123456789", strict=True))  # with Shift, on most keyboards


class View(RemoteFrameBuffer):
    """A flight over a map, as a widget.

    Parameters
    ----------
    source
        A heightmap, a file, or the name of a bundled map.
    camera
        First view; by default the map's own.
    size
        Width and height of the widget in the page's pixels; it can be dragged to another.
    panels
        Show panels to see and change everything with, if the extra `[gui]` is installed; else text alone.
    backend
        As for `Renderer`.
    options
        Fields of `Drawing` by name: how it is drawn at first.

    Raises
    ------
    TerrainError
        No OpenGL 4.3, or too little GPU memory.
    UsageError
        An option outside its range.
    """

    _closed = True  # until all is there

    def __init__(
        self,
        source: Heightmap | str | os.PathLike[str] = "alpine",
        camera: Camera | None = None,
        *,
        size: tuple[int, int] = (640, 360),
        panels: bool = False,
        backend: str = "auto",
        **options: Any,
    ) -> None:
        heightmap, known = (source, None) if isinstance(source, Heightmap) else open_map(os.fspath(source))
        if min(size) < 1 or max(size) > 8192:
            raise UsageError(f"the view's size must be from 1x1 to 8192x8192, got {size[0]}x{size[1]}")
        sun = options.pop("sun", known.sun if known else SUN)
        settings = Settings([Drawing(**options, sun=sun)], figures=panels)
        super().__init__(css_width=f"{size[0]}px", css_height=f"{size[1]}px")
        self._started_s = time.monotonic()
        self._timer: asyncio.TimerHandle | None = None
        self._told = False
        self._ratio = 1.0
        self.ctx = create_context(backend)
        with self.ctx:
            self._target = self._framebuffer(size)
            self._overlay = Overlay(self.ctx)
            self._gui = Gui(self.ctx) if panels and library_of_gui() else None
            self.flight = Flight(self._overlay, self._target, size, settings, gui=self._gui)
            start = camera or (known.camera if known else standard_view(heightmap))
            self._closed = False
            self.flight.land.show(
                Renderer(heightmap, size, ctx=self.ctx), Opened(heightmap, start, sun, heightmap.name, True)
            )

    # --- What it shows ------------------------------------------------------------------------------------------------

    @property
    def camera(self) -> Camera:
        """Where the eye is now."""
        return self.flight.controller.camera

    @property
    def stats(self) -> dict[str, Any]:
        """What is known of the last frame: docs/stats.md."""
        return self.flight.figures.stats

    def draw(self, **options: Any) -> None:
        """Draw otherwise from now on: fields of `Drawing` by name."""
        self.flight.settings.draw_both(**options)
        self.request_draw()

    def picture(self) -> np.ndarray:
        """(height, width, 3) uint8: what the widget shows, as soon as that is drawn in full."""
        with self.ctx:
            self._fit()
            for _ in range(3):  # panels take a frame or two to settle
                self.flight.frame(self._now_s)
            while not (self.flight.settled or self.flight.controller.moving):
                self.flight.frame(self._now_s)
            return self._pixels()

    def close(self, *args: Any, **kwargs: Any) -> None:
        """Close all views, and give everything back."""
        if not self._closed:
            super().close(*args, **kwargs)

    # --- What jupyter_rfb asks for ------------------------------------------------------------------------------------

    def get_frame(self) -> np.ndarray | None:
        """Pixels of the next frame, None where nothing has changed."""
        if self._closed:
            return None
        with self.ctx:
            self._fit()
            pixels = self._pixels() if self.flight.frame(self._now_s) else None
        self._come_again()
        return pixels

    def handle_event(self, event: dict[str, Any]) -> None:
        """What the user does."""
        if self._closed:
            return
        react: Callable[[dict[str, Any]], None] | None = getattr(self, f"_on_{event['type']}", None)
        if event["type"] == "close":
            self._release()
        elif react:
            with self.ctx:
                react(event)
            self.request_draw()

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        """The widget, and beside it a picture for where there is no widget."""
        result = super()._repr_mimebundle_(**kwargs)
        data = result[0] if isinstance(result, tuple) else result
        if data is not None and not self._closed:
            data["image/png"] = base64.b64encode(png_bytes(self.picture())).decode("ascii")
        return result

    def _come_again(self) -> None:
        """Have the next frame drawn as soon as there is something to see."""
        if self.flight.busy:
            self.request_draw()
            return
        if self._timer:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_later(self.flight.wait_s, self.request_draw)

    @property
    def _now_s(self) -> float:
        return time.monotonic() - self._started_s

    # --- Pixels -------------------------------------------------------------------------------------------------------

    def _framebuffer(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        return self.ctx.framebuffer([self.ctx.renderbuffer(size, 4)])

    def _fit(self) -> None:
        """Give the target the size that the flight has been told of."""
        size = self.flight.size
        if min(size) > 0 and self._target.size != size:
            gl.use_default_framebuffer(self.ctx)  # the one in use must not be one that is gone
            gl.release_with_pixels(self._target)
            self._target = self.flight.target = self._framebuffer(size)

    def _pixels(self) -> np.ndarray:
        width, height = self._target.size
        rows = np.frombuffer(self._target.read(components=3, alignment=1), np.uint8).reshape(height, width, 3)
        return np.ascontiguousarray(rows[::-1])

    def _release(self) -> None:
        self._closed = True
        if self._timer:
            self._timer.cancel()
        with self.ctx:
            gl.use_default_framebuffer(self.ctx)
            gl.release_with_pixels(self._target)
            for part in (self._overlay, self._gui):
                if part:
                    part.release()
            self.flight.close()
        self.ctx.release()

    # --- Events -------------------------------------------------------------------------------------------------------

    def _on_resize(self, event: dict[str, Any]) -> None:
        self._ratio = float(event.get("ratio") or 1.0)
        width, height = (max(0, min(8192, round(event[side] * self._ratio))) for side in ("width", "height"))
        self._overlay.scale = max(1, int(self._ratio))
        if self._gui:
            self._gui.scale = self._ratio
        self.flight.scale = max(1.0, self._ratio)
        self.flight.resize((width, height))
        if not self._told:
            self._told = True
            self.flight.say("click here: W A S D fly, H shows all keys")

    def _on_pointer_down(self, event: dict[str, Any]) -> None:
        button, at = _BUTTONS.get(event["button"], ""), self._at(event)
        if self._gui and button:
            self._gui.button(button, True)
            if self._gui.covers(*at):
                return
        self.flight.mouse.press(button, *at)

    def _on_pointer_up(self, event: dict[str, Any]) -> None:
        button = _BUTTONS.get(event["button"], "")
        if self._gui and button:
            self._gui.button(button, False)
        self.flight.mouse.let_go(button, *self._at(event))

    def _on_pointer_move(self, event: dict[str, Any]) -> None:
        at = self._at(event)
        if self._gui:
            self._gui.move(*at)
        self.flight.mouse.point(*at, over_panels=bool(self._gui and self._gui.covers(*at)))

    def _on_wheel(self, event: dict[str, Any]) -> None:
        dx, dy = -event["dx"] / NOTCH_PX, -event["dy"] / NOTCH_PX
        if self._gui and self._gui.covers(*self._at(event)):
            self._gui.wheel(dx, dy)
        else:
            self.flight.mouse.wheel(dy, zoom="Control" in event["modifiers"])

    def _on_key_down(self, event: dict[str, Any]) -> None:
        key, held = _key(event["key"]), event["modifiers"]
        if self._gui:
            self._gui.key(key, True)
            if self._gui.writes:
                return
        if key in MOVE_KEYS and not {"Control", "Alt", "Meta"} & set(held):
            self.flight.controller.press(key)
            return
        names = (("ctrl", {"Control", "Meta"}), ("shift", {"Shift"}))
        self.flight.press("+".join([name for name, keys in names if keys & set(held)] + [key]))
        self.flight.done = False  # there is no window to be closed

    def _on_key_up(self, event: dict[str, Any]) -> None:
        if self._gui:
            self._gui.key(_key(event["key"]), False)
        self.flight.controller.let_go(_key(event["key"]))

    def _on_char(self, event: dict[str, Any]) -> None:
        if self._gui:
            for character in event.get("data") or "":
                self._gui.write(ord(character))

    def _on_hide(self, event: dict[str, Any]) -> None:
        """Out of sight: nobody will tell of keys that come up."""
        self.flight.controller.let_go_all()

    def _at(self, event: dict[str, Any]) -> tuple[float, float]:
        """The cursor in pixels of the picture."""
        return event["x"] * self._ratio, event["y"] * self._ratio


def _key(name: str) -> str:
    """A browser's name of a key as the flight has it."""
    return _NAMED.get(name) or _DIGITS.get(name) or name.lower()
