"""The state of a window: what is seen and done there, frame by frame, in any framebuffer.

Here the parts are put together: the map (land), the eye (controller), the picture (painter), the mouse, and what one
does with them: insight, sculpting, dressing, keeping. Time comes in from outside, so that tests need neither window nor
clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import moderngl

from ..renderer import Renderer
from . import hud, lesson
from .commands import BY_KEY
from .controller import MODES, Controller
from .dressing import Dressing
from .gui import Gui
from .hud import Figures
from .insight import Insight
from .keeping import Keeping
from .land import Land
from .lines import Lines
from .marks import lines_on_land
from .memory import Memory
from .mouse import Mouse
from .overlay import ACCENT, Overlay, Panel, Text
from .pace import Pace
from .painter import REST_S, Painter, Size, Wanted
from .sculpting import Sculpting
from .settings import Settings

MESSAGE_S = 5.0
_LONGEST_S = 0.25  # motion of one frame, even after a longer one
_SKY = (0.16, 0.19, 0.23)
_NO_LENS = (0.0, 0.0, 0.0, 1.0)
_LENS_PX = 110


class Flight:
    """A flight over a map.

    Parameters
    ----------
    overlay
        Draws text in the context that everything else is drawn in.
    target
        Framebuffer that is looked at.
    size
        Its width and height.
    memory
        What is remembered of earlier runs, and for later ones.
    gui
        Panels to see and change everything with; without them there is text alone.
    pace
        How much is done between two looks at the window's events.
    """

    def __init__(
        self,
        overlay: Overlay,
        target: moderngl.Framebuffer,
        size: Size,
        settings: Settings,
        memory: Memory | None = None,
        gui: Gui | None = None,
        pace: Pace | None = None,
    ) -> None:
        self.ctx, self.overlay, self.target, self.size = overlay.ctx, overlay, target, size
        self.settings: Settings = settings
        self.memory, self.gui, self.pace = memory or Memory(None), gui, pace or Pace()
        self.scale = 1.0  # pixels per unit of length
        self.hour, self.factor = 12.0, 1.0  # as the panel's sliders have them: time of day, exaggeration
        self.now_s = 0.0
        self.done = False
        self.message, self._until_s = "", 0.0
        self.on_capture: Callable[[], bool] = lambda: False  # takes the mouse, or gives it back; whether it has it
        self.controller: Controller  # comes with the map
        self.painter: Painter = Painter(self.ctx, self.pace)
        self.land: Land = Land(self)
        self.mouse: Mouse = Mouse(self)
        self.insight: Insight = Insight(self)
        self.sculpting: Sculpting = Sculpting(self)
        self.dressing: Dressing = Dressing(self)
        self.keeping: Keeping = Keeping(self)
        self._lines: Lines | None = None
        self._moved_s: float | None = None
        self._stale = True
        self._echoes = 0  # panels take a frame or two to settle

    @property
    def renderer(self) -> Renderer:
        """What draws the map that is seen."""
        assert self.land.renderer
        return self.land.renderer

    @property
    def has_map(self) -> bool:
        """Whether there is anything to see yet."""
        return self.land.renderer is not None

    @property
    def is_seen(self) -> bool:
        """Whether there is a map, and a window to see it in that is not minimised."""
        return self.has_map and min(self.size) > 0

    @property
    def figures(self) -> Figures:
        """What is known of the last picture."""
        return self.painter.figures

    @property
    def certified_px(self) -> float | None:
        """What was promised of it."""
        return self.figures.stats.get("certified_max_error_px")

    def close(self) -> None:
        """Give everything back, and remember what is to be remembered."""
        self.sculpting.cancel()
        for part in (self.keeping, self.painter):
            part.release()
        for thread in (self.sculpting, self.dressing):
            thread.join()
        self.land.note()
        self.land.release()
        if self._lines:
            self._lines.release()
        self.memory.drawing = self.settings.sides[0]
        self.memory.panels = {"figures": self.settings.figures}
        self.memory.save()

    # --- Commands -----------------------------------------------------------------------------------------------------

    def press(self, key: str, again: bool = False) -> None:
        """A key that is not for the camera's moves; `again` if it is only held. Who sees nothing can only quit."""
        command = BY_KEY.get(key)
        if command and command.act and (command.repeats or not again) and (self.is_seen or key == "escape"):
            command.act(self)
            self._stale = True

    def cycle(self, option: str, step: int = 1) -> None:
        """Take the next choice of a drawing's option."""
        self.say(f"{option}: {self.settings.cycle(option, step)}")

    def toggle(self, panel: str) -> None:
        """Show a panel, or not."""
        setattr(self.settings, panel, not getattr(self.settings, panel))

    def turn_help(self) -> None:
        """Show the keys, their next page, or put them away."""
        pages = 1 if self.gui else len(hud.keys_pages(*self.overlay.room(self.size)))
        self.settings.keys = (self.settings.keys + 1) % (pages + 1)

    def space(self, words: str) -> None:
        """See the map with another distance between posts, as it was typed."""
        try:
            spacing_m = float(words)
        except ValueError:
            self.say(f"spacing: a number of metres is expected, not {words!r}")
        else:
            self.land.space(spacing_m)

    def next_mode(self) -> None:
        """Fly, orbit, walk."""
        mode = MODES[(MODES.index(self.controller.mode) + 1) % len(MODES)]
        self.controller.change_mode(mode)
        self.say({"fly": "flying", "orbit": "orbiting what was in the middle", "walk": "walking at eye height"}[mode])

    def toggle_ground(self) -> None:
        """Stay above ground, or not."""
        self.controller.above_ground = not self.controller.above_ground
        self.say("the eye stays above ground" if self.controller.above_ground else "the eye goes anywhere")

    def go_to(self, number: int) -> None:
        """Travel to a bookmark."""
        if not self.controller.go_to(number):
            self.say(f"no bookmark {number} yet: Ctrl {number} sets it")

    def set_bookmark(self, number: int) -> None:
        """Remember this view."""
        self.controller.set_bookmark(number)
        self.say(f"bookmark {number} is here")

    def capture(self) -> None:
        """Let the mouse look around without a button, or not."""
        captured = self.on_capture()
        self.say("the mouse looks around: C or Esc lets it go" if captured else "the mouse is free")

    def escape(self) -> None:
        """Cancel what is being done, else put away what stands over the land, else quit."""
        if self.gui and self.gui.close_list():
            return
        if self.land.can_cancel:
            self.land.cancel()
            self.say("cancelled")
        elif self.keeping.shot:
            self.keeping.cancel()
        elif self.sculpting.room or self.sculpting.at_work:
            self.sculpting.cancel()
            self.say("cancelled")
        elif self.sculpting.save_as is not None:
            self.sculpting.save_as = None
        elif self.settings.keys:
            self.settings.keys = 0
        elif self.sculpting.brushing:
            self.sculpting.brushing = False
        elif self.insight.explanation:
            self.insight.explanation = None
        elif not self.insight.put_tool_away():
            self.quit()

    def quit(self) -> None:
        """End, unless that would lose what was sculpted; who asks again does so."""
        self.done = self.done or self.sculpting.may_be_left()

    # --- Events -------------------------------------------------------------------------------------------------------

    def resize(self, size: Size) -> None:
        """The target has another size; 0 while it is out of sight."""
        self.size, self._stale = size, True

    def refresh(self) -> None:
        """The target must be shown again."""
        self._stale = True

    def say(self, text: str, seconds: float = MESSAGE_S) -> None:
        """Show a sentence for a while."""
        self.message, self._until_s, self._stale = text, -seconds, True  # time begins with the next frame

    # --- Frames -------------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once; else nothing happens until an event, or `wait_s` have gone."""
        if not self.has_map or self.land.loading or self._stale or self._echoes:
            return True
        if self.keeping.busy or self.sculpting.room or self.sculpting.at_work:
            return True
        return self.controller.moving or self.painter.is_busy(self.wanted())

    @property
    def settled(self) -> bool:
        """Whether the picture is the one that is wanted, drawn in full and lit; figures over it may still change."""
        return self.has_map and not self.land.loading and self.painter.is_done(self.wanted())

    @property
    def wait_s(self) -> float:
        """Seconds until something may have to be drawn without any event."""
        if (self.land.loading and not self.land.loading.opened) or self.dressing.busy:
            return 0.03
        if self.gui is not None and self.gui.lively(self.now_s):
            return 0.05
        return REST_S / 2 if self.message or (self.has_map and self.painter.waits_for_rest) else 1.0

    def frame(self, now_s: float) -> bool:
        """Do what is due; whether the target has a new picture to be shown."""
        self.now_s = now_s
        self.land.step()
        if min(self.size) < 1:
            return False
        self._forget_message()
        self.sculpting.step()
        self.dressing.step()
        if self.has_map and not self.keeping.step():
            self._move()
            self._paint()
        if not (self._stale or self._echoes or (self.gui and self.gui.lively(now_s))):
            return False
        self._echoes = 2 * bool(self.gui) if self._stale else max(0, self._echoes - 1)
        self._stale = False
        self._show()
        return True

    def wanted(self, size: Size | None = None) -> Wanted:
        """What should be seen: in the window, or in a picture of another size."""
        near_m, frozen = self.controller.near_m, self.insight.frozen
        changes: dict[str, Any] = {"near_m": near_m} if near_m else {}
        if frozen:
            changes |= {"chosen_for": frozen, "cull": False}
        sides = [replace(side, **changes) for side in self.settings.sides]
        return Wanted(self.controller.camera, size or self.size, tuple(sides), self.settings.divider)

    def panels(self) -> list[Panel]:
        """What is said over the picture where there are no panels to click."""
        columns, rows = self.overlay.room(self.size)
        panels = self._lessons(columns, rows)
        if self.settings.keys:
            pages = hud.keys_pages(columns, rows)
            panels = [pages[min(self.settings.keys, len(pages)) - 1]]
        elif self.has_map and self.settings.figures and (columns > hud.ROOMY or not panels):
            panels.append(hud.figures_panel(self.figures, self.settings))
        if progress := self.progress:
            panels.append(hud.progress_panel(*progress))
        if self.keeping.filming.running:
            panels.append(Panel([[Text("recording   ", ACCENT), Text("R stops")]], (1.0, 1.0)))
        if self.message:
            panels.append(hud.message_panel(self.message))
        return panels

    def _lessons(self, columns: int, rows: int) -> list[Panel]:
        """What is explained: the sides, the table's box, the patch that was clicked."""
        panels = []
        if self.settings.split and self.settings.figures:
            told = zip(self.settings.sides, self.painter.side_stats, strict=False)
            panels.append(Panel([[Text(lesson.side_line(*side))] for side in told] or [[]], (1.0, 0.0)))
        if self.insight.box and self.settings.figures and rows > 14:  # else it would cover the table
            panels.append(Panel([[Text(line)] for line in self.insight.box.words()], (1.0, 1.0)))
        if self.insight.explanation:
            panels.append(lesson.explanation_panel(self.insight.explanation, columns))
        return panels

    @property
    def progress(self) -> tuple[str, float, bool] | None:
        """What takes long: its name, the share that is done, whether Esc cancels it."""
        if loading := self.land.loading:
            return loading.text, loading.progress, self.land.can_cancel
        if self.sculpting.room:
            return "room for the brush", self.sculpting.share, True
        if self.painter.dawn.share is not None:
            return "light and shadow", self.painter.dawn.share, False
        if shot := self.keeping.shot:
            return f"drawing {shot.path}", shot.share, True
        return None

    def _move(self) -> None:
        if not self.controller.moving:
            self._moved_s = None
            return
        since = 1 / 60 if self._moved_s is None else self.now_s - self._moved_s
        self.controller.step(min(since, _LONGEST_S))
        self._moved_s = self.now_s

    def _paint(self) -> None:
        sculpts = self.sculpting.at_work
        if sculpts:
            self.sculpting.go_on()
        moving = self.controller.moving or sculpts or (self.land.is_coarse and bool(self.land.loading))
        lights = not self.land.is_coarse  # what is coarse goes soon
        self._stale |= self.painter.step(self.renderer, self.wanted(), self.now_s, moving, lights)

    def _forget_message(self) -> None:
        if self.message and self._until_s < 0:
            self._until_s = self.now_s - self._until_s
        if self.message and self.now_s > self._until_s:
            self.message, self._stale = "", True

    def _show(self) -> None:
        self.target.use()
        self.target.viewport = (0, 0, *self.size)
        if self.has_map and self.painter.has_picture:
            self.figures.height_m = self.controller.height_above_ground_m
            self.figures.speed_m_s = self.controller.speed_m_s
            self._show_land()
        else:
            self.ctx.clear(*_SKY)
        if self.gui:
            self.gui.draw(self, self.target, self.size, self.now_s)
        else:
            self.overlay.draw(self.target, self.size, self.panels())

    def _show_land(self) -> None:
        canvas, film = self.painter.canvas, self.keeping.filming
        if film.running:
            film.add(canvas.read(), self.now_s)
        canvas.show(self.target, self._lens, self.settings.divider if self.settings.split else None)
        self.insight.follow_cursor()
        if lines := lines_on_land(self):
            self._lines = self._lines or Lines(self.ctx, self.renderer.picture.samples)
            self._lines.draw(self.renderer, self.controller.camera, self.target, self.size, lines, 2 * self.scale)
        if box := self.insight.box:
            canvas.show_sums(self.renderer, self.target, self.insight.sums_frame, box.box)

    @property
    def _lens(self) -> tuple[float, float, float, float]:
        if not (self.settings.lens and self.mouse.cursor):
            return _NO_LENS
        x, y = self.mouse.cursor
        return x, self.size[1] - y, _LENS_PX * self.scale, self.settings.lens
