"""Frames of a flight, in any framebuffer: draws what changed, measures while nothing does.

Time comes in from outside, so that tests need neither window nor clock.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import moderngl

from ..camera import Camera
from ..exceptions import TerrainError
from ..image import write_png
from ..measure import Achieved
from ..renderer import Renderer
from . import hud
from .controller import Controller
from .hud import Figures, drawing_ms
from .overlay import Overlay, Panel
from .settings import Settings

REST_S = 0.25  # without motion until a full frame is drawn
MESSAGE_S = 4.0
SMOOTH_MS, COARSE_MS = 50.0, 200.0  # full frames slower than these are drawn at half, at a quarter size in motion
PORTION = 512  # posts a side that are measured between two looks at the window's events
_LONGEST_S = 0.25  # motion of one frame, even after a longer one


class Flight:
    """The state of a window: where it looks, what it draws, what it knows.

    Parameters
    ----------
    renderer, overlay
        Of the same context.
    target
        Framebuffer that is looked at.
    """

    def __init__(
        self, renderer: Renderer, overlay: Overlay, target: moderngl.Framebuffer, camera: Camera, settings: Settings
    ) -> None:
        self.renderer, self.overlay, self.target, self.settings = renderer, overlay, target, settings
        self.controller = Controller(renderer.heightmap, camera)
        self.figures = Figures(renderer.heightmap.name, (renderer.heightmap.cols, renderer.heightmap.rows))
        self.size = renderer.size
        self._measuring: Iterator[Achieved] | None = None
        self._achieved: Achieved | None = None
        self._changed, self._stale = True, True
        self._touched_s = self._drawn_s = self._said_s = float("-inf")
        self._moved_s: float | None = None
        self._full_ms = 0.0
        self._message = ""
        self._shoot = False

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once; else nothing happens until an event, or `wait_s` have gone."""
        return self._changed or self._stale or self.controller.moving or self._measuring is not None

    @property
    def wait_s(self) -> float:
        """Seconds until something may have to be drawn without any event."""
        return REST_S / 2 if self._message or self.figures.shrunk > 1 or self.figures.fps else 1.0

    # --- Events -------------------------------------------------------------------------------------------------------

    def touch(self, now_s: float) -> None:
        """The camera was moved by hand."""
        self._touched_s, self._changed = now_s, True

    def resize(self, size: tuple[int, int]) -> None:
        """The target has another size; 0 while it is out of sight."""
        self.size, self._changed = size, True

    def press(self, key: str, now_s: float) -> None:
        """A key that is not for the controller's moves."""
        if key == "home":
            self.controller.home()
        elif key == "g":
            self.controller.above_ground = not self.controller.above_ground
            self.say("the eye stays above ground" if self.controller.above_ground else "the eye goes anywhere", now_s)
        elif key == "p":
            self._shoot = True
        before = self.settings.drawing
        self.settings.press(key)
        self._changed |= key in ("home", "p") or self.settings.drawing != before
        self._stale = True

    def wheel(self, notches: float) -> None:
        """Change the speed."""
        self.controller.wheel(notches)
        self.figures.speed_m_s, self._stale = self.controller.speed_m_s, True

    def say(self, text: str, now_s: float) -> None:
        """Show a sentence for a while."""
        self._message, self._said_s, self._stale = text, now_s, True

    # --- Frames -------------------------------------------------------------------------------------------------------

    def frame(self, now_s: float) -> bool:
        """Do what is due; whether the target has a new picture to be shown."""
        if min(self.size) < 1:
            return False
        in_motion = self.controller.moving or now_s - self._touched_s < REST_S
        self._move(now_s)
        self._forget_message(now_s)
        if self._changed or (not in_motion and self.figures.shrunk > 1):
            self._draw(now_s, in_motion)
        elif not in_motion:
            self._rest()
        if not self._stale:
            return False
        self._show()
        return True

    def panels(self) -> list[Panel]:
        """What is said over the picture."""
        panels = [hud.figures_panel(self.figures, self.settings)] if self.settings.figures else []
        if self.settings.keys:
            panels.append(hud.keys_panel())
        if self._message:
            panels.append(hud.message_panel(self._message))
        return panels

    def _move(self, now_s: float) -> None:
        if not self.controller.moving:
            self._moved_s = None
            return
        since = 1 / 60 if self._moved_s is None else now_s - self._moved_s
        self.controller.step(min(since, _LONGEST_S))
        self._moved_s, self._changed = now_s, True

    def _draw(self, now_s: float, in_motion: bool) -> None:
        shrink = self._shrink() if in_motion and not self._shoot else 1
        size = max(1, self.size[0] // shrink), max(1, self.size[1] // shrink)
        if size != self.renderer.size:
            self.renderer.resize(size)
        stats = self.renderer.draw(self.controller.camera, **vars(self.settings.drawing))
        if shrink == 1:
            self._full_ms = drawing_ms(stats)
        self._note(stats, shrink, now_s, in_motion)
        if self._shoot:
            self._save(now_s)

    def _shrink(self) -> int:
        """Window pixels across one of the picture in motion: more where full frames would stutter."""
        return 1 + (self._full_ms > SMOOTH_MS) + 2 * (self._full_ms > COARSE_MS)

    def _note(self, stats: dict[str, Any], shrink: int, now_s: float, in_motion: bool) -> None:
        self.figures.stats, self.figures.shrunk, self.figures.measured_px = stats, shrink, None
        self.figures.height_m = self.controller.height_above_ground_m
        self.figures.speed_m_s = self.controller.speed_m_s
        self.figures.fps = self._pace(now_s - self._drawn_s) if in_motion else None
        self._drawn_s = now_s
        self._measuring = None if in_motion else self.renderer.measuring(PORTION)
        self._changed, self._stale = False, True

    def _pace(self, seconds: float) -> float | None:
        if not 0 < seconds < 2:
            return self.figures.fps
        return 1 / seconds if not self.figures.fps else 0.9 * self.figures.fps + 0.1 / seconds

    def _rest(self) -> None:
        """Nothing moves: measure on, one portion a frame."""
        if self.figures.fps is not None:
            self.figures.fps, self._stale = None, True
        if self._measuring is None and self.figures.measured_px is None:
            self._measuring = self.renderer.measuring(PORTION)
        if self._measuring is not None:
            portion = next(self._measuring, None)
            if portion is not None:
                self._achieved = portion
            elif self._achieved is not None:
                self.figures.measured_px = {"max": self._achieved.max_px, "rms": self._achieved.rms_px}
                self._measuring, self._stale = None, True

    def _forget_message(self, now_s: float) -> None:
        if self._message and now_s - self._said_s > MESSAGE_S:
            self._message, self._stale = "", True

    def _show(self) -> None:
        self.target.viewport = (0, 0, *self.size)
        self.renderer.picture.show(self.target)
        self.overlay.draw(self.target, self.size, self.panels())
        self._stale = False

    def _save(self, now_s: float) -> None:
        """Write the picture, without words over it, beside earlier ones in the working directory."""
        self._shoot = False
        path = free_name(self.renderer.heightmap.name)
        try:
            write_png(str(path), self.renderer.picture.read())
        except (TerrainError, OSError) as error:
            self.say(str(error), now_s)
        else:
            self.say(f"saved {path}", now_s)


def free_name(map_name: str) -> Path:
    """First of name-001.png, name-002.png, ... that is not there yet."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while (path := Path(f"{stem}-{number:03d}.png")).exists():
        number += 1
    return path
