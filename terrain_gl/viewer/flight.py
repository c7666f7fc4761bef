"""Frames of a flight, in any framebuffer: draws what changed, measures and loads while nothing does.

What should be seen is a record (`Wanted`); a frame draws it if it is not what was drawn last. Time comes in from
outside, so that tests need neither window nor clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from ..brush import TOOLS
from ..camera import Camera, Vector
from ..drawing import METHODS, Drawing
from ..exceptions import TerrainError
from ..explain import Explanation
from ..heightmap import Heightmap
from ..image import write_png
from ..measure import Achieved
from ..renderer import Renderer
from ..shade import Look
from . import hud
from .canvas import Canvas
from .charts import History
from .commands import BY_KEY
from .controller import MODES, Controller, hit_ground
from .dawn import Dawn
from .editing import Editing, Saving, suggested_path
from .filming import Filming, film_suffix
from .gui import Gui
from .hud import Figures, drawing_ms
from .lesson import BoxSum
from .lines import Lines
from .loading import Loading, Opened, Opener, coarse
from .marks import Frame, box_under, lines_on_land, sums_frame
from .memory import Memory
from .overlay import Overlay, Panel
from .settings import Settings

REST_S = 0.25  # without a change until a full frame is drawn
MESSAGE_S = 5.0
SMOOTH_MS, COARSE_MS = 50.0, 200.0  # full frames slower than these are drawn at half, at a quarter size in motion
PORTION = 512  # posts a side that are measured between two looks at the window's events
BUILD_S = 0.03  # spent on tables between two looks at the window's events
_LONGEST_S = 0.25  # motion of one frame, even after a longer one
_SKY = (0.16, 0.19, 0.23)
_NO_LENS = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Wanted:
    """Everything that a picture depends on, the map aside."""

    camera: Camera
    size: tuple[int, int]
    sides: tuple[Drawing, ...]
    divider: float


class Flight:
    """The state of a window: where it looks, what it draws, what it knows.

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
    """

    def __init__(
        self,
        overlay: Overlay,
        target: moderngl.Framebuffer,
        size: tuple[int, int],
        settings: Settings,
        memory: Memory | None = None,
        gui: Gui | None = None,
    ) -> None:
        self.ctx, self.overlay, self.target, self.size = overlay.ctx, overlay, target, size
        self.settings, self.memory, self.gui = settings, memory or Memory(None), gui
        self.history = History()
        self.hour, self.exaggeration = 12.0, 1.0
        self._factor = 1.0  # of the heights that are seen to `_plain`; `_next_factor` of those that are on their way
        self._next_factor: float | None = None
        self._plain: Heightmap | None = None
        self.scale = 1.0  # pixels per unit of length
        self.canvas = Canvas(self.ctx)
        self._lines: Lines | None = None
        self.frozen: Camera | None = None
        self.editing: Editing | None = None
        self.brushing = False
        self.saving: Saving | None = None
        self.save_as: str | None = None  # the path that is being asked for
        self.filming = Filming(self.say)
        self.line_of: Callable[..., str] | None = None  # a view as a command line
        self.on_copy: Callable[[str], None] = lambda text: None  # to the clipboard
        self.explanation: Explanation | None = None
        self.box: BoxSum | None = None
        self.side_stats: list[dict[str, Any]] = []
        self.cursor: tuple[float, float] | None = None  # pixels from the upper left, over the land
        self._drag, self._pressed_at = "", (0.0, 0.0)
        self._pointed: tuple[float, float] | None = None
        self.loading: Loading | None = None
        self.done = False
        self.on_capture: Callable[[], bool] = lambda: False  # takes the mouse, or gives it back; whether it has it
        self._renderer: Renderer | None = None
        self._coarse = False
        self._asked: Wanted | None = None
        self._asked_s = float("-inf")
        self._drawn: Wanted | None = None
        self._measuring: Iterator[Achieved] | None = None
        self._achieved: Achieved | None = None
        self._stale = True
        self._echoes = 0  # panels take a frame or two to settle
        self._now_s = 0.0
        self._drawn_s = float("-inf")
        self._moved_s: float | None = None
        self._full_ms = float("inf")  # nobody knows yet: the first picture comes quickly
        self.dawn = Dawn()
        self.message, self._until_s = "", 0.0
        self._shoot = False

    # --- The map ------------------------------------------------------------------------------------------------------

    @property
    def renderer(self) -> Renderer:
        """What draws the map that is seen."""
        assert self._renderer
        return self._renderer

    @property
    def has_map(self) -> bool:
        """Whether there is anything to see yet."""
        return self._renderer is not None

    def load(self, name: str, opener: Opener) -> None:
        """Begin to load a map; the present one stays until that is done."""
        self.cancel_loading()
        self.loading, self._next_factor = Loading(name, opener), None

    def exaggerate(self) -> None:
        """Begin to multiply all heights by `exaggeration`."""
        if not self.has_map or self._coarse:
            return
        ratio = self.exaggeration / self._factor
        now, start = self.renderer.heightmap, self.controller.start
        plain = self._plain or Heightmap(now.heights / np.float32(self._factor), now.spacing_m, now.name)
        factor = np.float32(self.exaggeration)
        camera = replace(start, eye=_raised(start.eye, ratio), target=_raised(start.target, ratio))

        def opener(progress: Callable[[float], None]) -> Opened:
            scaled = Heightmap(plain.heights * factor, plain.spacing_m, plain.name) if factor != 1 else plain
            return replace(self.opened, heightmap=scaled, camera=camera, sun=self.settings.drawing.sun)

        self.load(f"{now.name} × {self.exaggeration:.2f}", opener)
        self._next_factor, self._plain = self.exaggeration, plain

    def cancel_loading(self) -> None:
        """Stop loading, if anything is loading."""
        if self.loading:
            self.loading.cancel()
            self.loading = None
            self._stale = True

    def show(self, renderer: Renderer, opened: Opened) -> None:
        """See a map from now on; the renderer of the one before is released, this one will be."""
        self._note_map()
        self.dawn.stop()
        before, was_coarse = self._renderer, self._coarse
        if before:
            self._measuring = None
            before.release()
        self._renderer, self._coarse = renderer, renderer.heightmap is not opened.heightmap
        if not (before and was_coarse):
            self._enter(opened)
        renderer.picture.waits_for_light = False
        self.editing = None if self._coarse else Editing(renderer)
        self._drawn, self._full_ms = None, float("inf")
        self.explanation = self.box = None

    def close(self) -> None:
        """Give everything back, and remember what is to be remembered."""
        self.cancel_loading()
        self.filming.stop()
        self.filming.join()
        if self.saving:
            self.saving.join()
        self.dawn.stop()
        self._note_map()
        if self._renderer:
            self._renderer.release()
        self.canvas.release()
        if self._lines:
            self._lines.release()
        self.memory.drawing = self.settings.sides[0]
        self.memory.panels = {"figures": self.settings.figures}
        self.memory.save()

    def _enter(self, opened: Opened) -> None:
        heightmap = opened.heightmap
        self.opened = opened
        self.figures = Figures(Path(heightmap.name).name, (heightmap.cols, heightmap.rows))
        if self._next_factor is not None:
            self._raise(opened, self._next_factor)
            return
        self._plain, self._factor, self.exaggeration = heightmap, 1.0, 1.0
        self.controller = Controller(heightmap, opened.camera, bookmarks=self.memory.bookmarks(opened.key))
        if (pose := self.memory.last_pose(opened.key)) and not opened.camera_given:
            self.controller.pose = pose
        self.settings.draw_both(sun=opened.sun)

    def _raise(self, opened: Opened, factor: float) -> None:
        """The same land as before, higher or lower: the eye goes with it, the rest stays."""
        before, pose = self.controller, self.controller.pose
        self.controller = Controller(
            opened.heightmap, opened.camera, before.above_ground, before.bookmarks, before.held
        )
        self.controller.pose = replace(pose, eye=_raised(pose.eye, factor / self._factor))
        self.controller.change_mode(before.mode)
        self._factor, self._next_factor = factor, None

    def _note_map(self) -> None:
        if self.has_map:
            self.memory.note_map(self.opened.key, self.controller.pose, self.controller.bookmarks)

    def _load(self) -> None:
        loading = self.loading
        if not loading:
            return
        loading.step(self.ctx, self._some_size, BUILD_S)
        self._stale = True
        if loading.error:
            self.loading = None
            if not self.has_map or self._coarse:
                raise loading.error
            self.say(str(loading.error) or "not enough memory", 2 * MESSAGE_S)
        elif loading.renderer and loading.opened:
            self.show(loading.take(), loading.opened)
            self.loading = None
        elif loading.opened and not self.has_map and (few := coarse(loading.opened.heightmap)):
            self.show(Renderer(few, self._some_size, ctx=self.ctx), loading.opened)

    @property
    def _some_size(self) -> tuple[int, int]:
        """The window may be out of sight, or larger than what the GPU draws; the first frame will tell."""
        return max(1, self.size[0] // 4), max(1, self.size[1] // 4)

    # --- Commands -----------------------------------------------------------------------------------------------------

    def press(self, key: str, again: bool = False) -> None:
        """A key that is not for the camera's moves; `again` if it is only held."""
        command = BY_KEY.get(key)
        if command and command.act and (command.repeats or not again) and (self.has_map or key == "escape"):
            command.act(self)
            self._stale = True

    def cycle(self, option: str, step: int = 1) -> None:
        """Take the next choice of a drawing's option."""
        self.say(f"{option}: {self.settings.cycle(option, step)}")

    def loosen(self, steps: float) -> None:
        """Change the tolerance."""
        self.settings.loosen(steps)

    def toggle(self, panel: str) -> None:
        """Show a panel, or not."""
        setattr(self.settings, panel, not getattr(self.settings, panel))

    def toggle_wires(self) -> None:
        """Draw the mesh over the picture, or not."""
        self.settings.draw(wires=not self.settings.drawing.wires)

    def toggle_freeze(self) -> None:
        """Keep the levels that were chosen for the eye where it is now, or choose again."""
        self.frozen = None if self.frozen else self.controller.camera
        self.say("levels stay: fly around them; L lets go" if self.frozen else "levels follow the eye again")

    def toggle_split(self) -> None:
        """Two sides to compare, or one."""
        settings = self.settings
        if settings.split:
            settings.sides, settings.active = [settings.sides[0]], 0
            self.say("one picture again")
        else:
            other = [method for method in METHODS if method != settings.drawing.method][0]
            settings.sides = [settings.drawing, replace(settings.drawing, method=other, triangles=None)]
            self.say("two sides: keys and controls change the one under the cursor; drag the line between them")

    def toggle_lens(self) -> None:
        """A magnifying glass under the cursor, or none."""
        self.settings.lens = 0.0 if self.settings.lens else 6.0

    # --- Sculpting ----------------------------------------------------------------------------------------------------

    def toggle_brush(self) -> None:
        """Take the brush, or lay it down."""
        self.brushing = not self.brushing and self.editing is not None
        if self.brushing:
            low, high = self.renderer.heightmap.range_m
            self.renderer.make_room(0.5 * (high - low), 0.5 * (high - low))  # no stroke is to wait for it
            self._land_changed(settled=True)
            self.say("drag on the land to sculpt it; the right button still looks around; B lays the brush down")

    def next_tool(self) -> None:
        """Take another tool."""
        if self.editing:
            self.editing.tool = TOOLS[(TOOLS.index(self.editing.tool) + 1) % len(TOOLS)]
            self.say(f"tool: {self.editing.tool}")

    def widen(self, steps: float) -> None:
        """Change the brush's radius."""
        if self.editing:
            self.editing.widen(steps)

    def strengthen(self, steps: float) -> None:
        """Change the brush's strength."""
        if self.editing:
            self.editing.strengthen(steps)

    def undo(self) -> None:
        """Take the last stroke back."""
        if self.editing and self.editing.undo():
            self._land_changed(settled=True)
        else:
            self.say("nothing to undo")

    def redo(self) -> None:
        """Do it again."""
        if self.editing and self.editing.redo():
            self._land_changed(settled=True)
        else:
            self.say("nothing to do again")

    def ask_to_save(self) -> None:
        """Ask for a path; without panels, take one that is free."""
        path = suggested_path(self.renderer.heightmap.name)
        if self.gui:
            self.save_as = path
        else:
            self.save(path)

    def save(self, path: str) -> None:
        """Write the land to a file, in a thread."""
        self.save_as = None
        if self.saving:
            self.say(f"{self.saving.path} is still being written")
            return
        try:
            self.saving = Saving(path, self.renderer.heightmap, self._factor)
        except TerrainError as error:
            self.say(str(error))

    def _land_changed(self, settled: bool) -> None:
        """The land is another: what is known of it is no longer so."""
        self.controller.heightmap = self.renderer.heightmap
        self._drawn = self._measuring = self.explanation = None
        if self.editing and self.editing.edited:
            self._plain = None
        if settled:
            self.dawn.stop()

    def _sculpt(self, now_s: float) -> None:
        """The brush is held: where the cursor is now."""
        place = self.place_under(*self._pointed) if self._pointed else None
        if place is not None and self.editing:
            self.editing.move(place, now_s)
            self._land_changed(settled=False)

    # --- Films --------------------------------------------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Record what is seen, without panels, until it is called again."""
        if self.filming.running:
            self.filming.stop()
        else:
            self.filming.begin(free_name(self.renderer.heightmap.name, film_suffix()), self._now_s)

    def tell_line(self) -> None:
        """This view as a command line, on the clipboard."""
        if not self.line_of:
            return
        wanted = self._wanted()
        try:
            line = self.line_of(self.renderer.heightmap, wanted.camera, wanted.size, self.settings.drawing)
        except TerrainError as error:
            self.say(str(error))
        else:
            self.on_copy(line)
            self.say(f"copied: {line}", 3 * MESSAGE_S)

    def home(self) -> None:
        """Back to the first view."""
        self.controller.home()

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

    def shoot(self) -> None:
        """Save the next full frame."""
        self._shoot, self._drawn = True, None

    def escape(self) -> None:
        """Cancel what is being done, else put the help away, else quit."""
        if self.can_cancel:
            self.cancel_loading()
            self.say("cancelled")
        elif self.save_as is not None:
            self.save_as = None
        elif self.settings.keys:
            self.settings.keys = False
        elif self.brushing:
            self.brushing = False
        elif self.explanation:
            self.explanation = None
        else:
            self.done = True

    @property
    def certified_px(self) -> float | None:
        """What was promised of the last frame."""
        return self.figures.stats.get("certified_max_error_px")

    @property
    def can_cancel(self) -> bool:
        """Whether there would still be a map to see without the one that is loading."""
        return self.loading is not None and self.has_map and not self._coarse

    def wheel(self, notches: float, zoom: bool = False) -> None:
        """Change the speed, or the field of view."""
        if not self.has_map:
            return
        if zoom:
            self.controller.zoom(notches)
        else:
            self.controller.wheel(notches)
        self._stale = True

    # --- The mouse, in pixels from the upper left ---------------------------------------------------------------------

    def press_button(self, name: str, x: float, y: float) -> None:
        """A mouse button goes down over the land."""
        if not self.has_map:
            return
        self._pressed_at = self._pointed = x, y
        controller, settings = self.controller, self.settings
        if name == "left" and settings.split and abs(x - settings.divider * self.size[0]) < 8 * self.scale:
            self._drag = "divider"
        elif name == "left" and self.brushing and self.editing:
            if (place := self.place_under(x, y)) is not None:
                self._drag = "brush"
                self.editing.begin(place, self._now_s)
                self._land_changed(settled=False)
        elif name == "left" and controller.mode != "walk":
            self._drag = "orbit"
            controller.grab(*self._tangents(x, y))
        else:
            self._drag = {"left": "look", "right": "look"}.get(name, "")

    def let_go_button(self, name: str, x: float, y: float) -> None:
        """It comes up again: where it went down, that was a click."""
        drag, self._drag = self._drag, ""
        if not self.has_map:
            return
        self.controller.release()
        if drag == "brush" and self.editing:
            self.editing.end()
            self._land_changed(settled=True)
        if name == "left" and drag in ("orbit", "look") and math.dist((x, y), self._pressed_at) < 4 * self.scale:
            self.explain(x, y)

    def point(self, x: float, y: float, look: bool = False, over_panels: bool = False) -> None:
        """The cursor comes to a place; `look`: the head turns with it, whether or not a button is held."""
        before, self._pointed = self._pointed or (x, y), (x, y)
        self.cursor = None if over_panels else (x, y)
        if not self.has_map:
            return
        drag = "look" if look else self._drag
        dx, dy = (x - before[0]) / self.scale, (y - before[1]) / self.scale
        if drag == "divider":
            self.settings.divider = min(max(x / max(1, self.size[0]), 0.02), 0.98)
            self._stale = True
        elif drag in ("look", "orbit"):
            getattr(self.controller, drag)(dx, dy)
        elif self.settings.split and not over_panels:
            self.settings.active = int(x > self.settings.divider * self.size[0])
        if self.settings.lens or self.settings.sums or self.brushing:
            self._stale = True

    def place_under(self, x: float, y: float) -> np.ndarray | None:
        """World metres of the land at a pixel; None for the sky."""
        ray = np.array([*self._tangents(x, y), 1.0]) @ self.controller.axes
        return hit_ground(self.controller.heightmap, self.controller.eye, ray)

    def explain(self, x: float, y: float) -> None:
        """Explain the patch at a pixel, or put the explanation away where there is none."""
        self.explanation, self._stale = None, True
        place = self.place_under(x, y)
        wanted = self._wanted()
        side = int(self.settings.split and x > self.settings.divider * self.size[0])
        if place is None or self._drawn is None:
            return
        if self.renderer.size != self.size or side or wanted != self._drawn:
            self._draw_side(wanted, side, self.size)
            self._drawn = None
        self.explanation = self.renderer.explain(float(place[0]), float(place[1]))
        if self.explanation is None:
            method = self.settings.sides[side].method
            self.say(f"no patch of the quadtree there: method {method} makes no promise to explain")

    def _tangents(self, x: float, y: float) -> tuple[float, float]:
        """A pixel as tangents right and up of the picture's middle."""
        width, height = self.size
        half = math.tan(math.radians(0.5 * self.controller.fov_deg)) / (0.5 * max(1, height))
        return (x - 0.5 * width) * half, (0.5 * height - y) * half

    def resize(self, size: tuple[int, int]) -> None:
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
        if not self.has_map or self.loading or self._stale or self._echoes:
            return True
        if self.filming.running or self._drag == "brush":
            return True
        return (
            self.dawn.is_due(self._lit_look)
            or self.controller.moving
            or self._wanted() != self._drawn
            or self._measuring is not None
        )

    @property
    def settled(self) -> bool:
        """Whether the picture is the one that is wanted, drawn in full and lit; figures over it may still change."""
        if not self.has_map or self.loading or self.dawn.is_due(self._lit_look):
            return False
        return self._wanted() == self._drawn and self.figures.shrunk == 1

    @property
    def wait_s(self) -> float:
        """Seconds until something may have to be drawn without any event."""
        if self.loading and not self.loading.opened:
            return 0.03
        lively = self.gui is not None and self.gui.lively(self._now_s)
        if lively:
            return 0.05
        return REST_S / 2 if self.message or (self.has_map and (self.figures.shrunk > 1 or self.figures.fps)) else 1.0

    def frame(self, now_s: float) -> bool:
        """Do what is due; whether the target has a new picture to be shown."""
        self._now_s = now_s
        self._load()
        if min(self.size) < 1:
            return False
        self._forget_message(now_s)
        if self.saving and self.saving.message:
            self.say(self.saving.message, 2 * MESSAGE_S)
            self.saving = None
        if self.has_map:
            self._move(now_s)
            self._draw_or_rest(now_s)
        if not (self._stale or self._echoes or (self.gui and self.gui.lively(now_s))):
            return False
        self._echoes = 2 * bool(self.gui) if self._stale else max(0, self._echoes - 1)
        self._stale = False
        self._show(now_s)
        return True

    def panels(self) -> list[Panel]:
        """What is said over the picture."""
        panels = []
        if self.has_map and self.settings.figures:
            panels.append(hud.figures_panel(self.figures, self.settings))
        if self.settings.keys:
            panels.append(hud.keys_panel())
        if self.loading:
            panels.append(hud.progress_panel(self.loading.text, self.loading.progress, self.can_cancel))
        elif self.dawn.share is not None:
            panels.append(hud.progress_panel("light and shadow", self.dawn.share, False))
        if self.message:
            panels.append(hud.message_panel(self.message))
        return panels

    def _wanted(self) -> Wanted:
        near_m = self.controller.near_m
        changes: dict[str, Any] = {"near_m": near_m} if near_m else {}
        if self.frozen:
            changes |= {"chosen_for": self.frozen, "cull": False}
        sides = [replace(side, **changes) for side in self.settings.sides]
        return Wanted(self.controller.camera, self.size, tuple(sides), self.settings.divider)

    def _move(self, now_s: float) -> None:
        if not self.controller.moving:
            self._moved_s = None
            return
        since = 1 / 60 if self._moved_s is None else now_s - self._moved_s
        self.controller.step(min(since, _LONGEST_S))
        self._moved_s = now_s

    def _draw_or_rest(self, now_s: float) -> None:
        if self._drag == "brush":
            self._sculpt(now_s)
            self._asked_s = now_s
        wanted = self._wanted()
        if wanted != self._asked:
            self._asked, self._asked_s = wanted, now_s
        moving = self.controller.moving or now_s - self._asked_s < REST_S or (self._coarse and bool(self.loading))
        unlit, fresh = self.dawn.is_due(self._lit_look), self._drawn is None
        if wanted != self._drawn or (not (moving or unlit) and self.figures.shrunk > 1):
            self._draw(wanted, now_s, moving or unlit)
        elif not (moving or unlit):
            self._rest()
        if unlit and not fresh and not self._coarse:  # what is new is shown first; what is coarse goes soon
            self._stale = True
            if self.dawn.go_on(self.renderer.picture, self._lit_look, BUILD_S):
                self._drawn = None

    @property
    def _lit_look(self) -> Look:
        """What light is made for."""
        looks = [side.look for side in self.settings.sides]
        return next((look for look in looks if look.is_lit), looks[0])

    def _draw(self, wanted: Wanted, now_s: float, in_motion: bool) -> None:
        shoot = self._shoot and not self.dawn.is_due(self._lit_look)
        shrink = self._shrink() if in_motion and not shoot else 1
        size = max(1, self.size[0] // shrink), max(1, self.size[1] // shrink)
        self.side_stats = [self._draw_side(wanted, side, size) for side in reversed(range(len(wanted.sides)))][::-1]
        stats = self.side_stats[0]
        if shrink == 1:
            self._full_ms = sum(map(drawing_ms, self.side_stats))
        self._note(stats, shrink, now_s, in_motion)
        self._drawn, self._stale = wanted, True
        if shoot:
            self._save()

    def _draw_side(self, wanted: Wanted, side: int, size: tuple[int, int]) -> dict[str, Any]:
        """Draw a side, and take it to the canvas."""
        if size != self.renderer.size:
            self.renderer.resize(size)
        stats = self.renderer.draw(wanted.camera, **vars(wanted.sides[side]))
        self.canvas.compose(self.renderer, self.size, *self.settings.part(side))
        return stats

    def _shrink(self) -> int:
        """Window pixels across one of the picture in motion: more where full frames would stutter."""
        return 1 + (self._full_ms > SMOOTH_MS) + 2 * (self._full_ms > COARSE_MS)

    def _note(self, stats: dict[str, Any], shrink: int, now_s: float, in_motion: bool) -> None:
        self.figures.stats, self.figures.shrunk, self.figures.measured_px = stats, shrink, None
        self.figures.fps = self._pace(now_s - self._drawn_s) if in_motion else None
        self._drawn_s = now_s
        self.history.add(stats)
        self._measuring = None if in_motion else self.renderer.measuring(PORTION)

    def _pace(self, seconds: float) -> float | None:
        if not 0 < seconds < 2:
            return self.figures.fps
        return 1 / seconds if not self.figures.fps else 0.9 * self.figures.fps + 0.1 / seconds

    def _rest(self) -> None:
        """Nothing moves: measure a portion of the last frame."""
        self._stale |= self.figures.fps is not None
        self.figures.fps = None
        if self._measuring is None:
            return
        achieved = next(self._measuring, None)
        if achieved is None:  # the whole map is measured
            self._measuring, self._stale = None, True
            if self._achieved:
                self.figures.measured_px = {"max": self._achieved.max_px, "rms": self._achieved.rms_px}
                self.history.measured(self.figures.measured_px[self.settings.drawing.metric])
        self._achieved = achieved

    def _forget_message(self, now_s: float) -> None:
        if self.message and self._until_s < 0:
            self._until_s = now_s - self._until_s
        if self.message and now_s > self._until_s:
            self.message, self._stale = "", True

    def _show(self, now_s: float) -> None:
        self.target.use()
        self.target.viewport = (0, 0, *self.size)
        if self.has_map and self._drawn:
            self.figures.height_m = self.controller.height_above_ground_m
            self.figures.speed_m_s = self.controller.speed_m_s
            self._show_land()
        else:
            self.ctx.clear(*_SKY)
        if self.gui:
            self.gui.draw(self, self.target, self.size, now_s)
        else:
            self.overlay.draw(self.target, self.size, self.panels())

    def _show_land(self) -> None:
        if self.filming.running:
            self.filming.add(self.canvas.read(), self._now_s)
        lens = (*self._cursor_from_below(), 110 * self.scale, self.settings.lens) if self._sees_lens else _NO_LENS
        self.canvas.show(self.target, lens, self.settings.divider if self.settings.split else None)
        self.box = self._box_under_cursor() if self.settings.sums else None
        if lines := lines_on_land(self):
            self._lines = self._lines or Lines(self.ctx, self.renderer.picture.samples)
            self._lines.draw(self.renderer, self.controller.camera, self.target, self.size, lines, 2 * self.scale)
        if self.box:
            self.canvas.show_sums(self.renderer, self.target, self.sums_frame, self.box.box)

    @property
    def _sees_lens(self) -> bool:
        return bool(self.settings.lens and self.cursor)

    def _cursor_from_below(self) -> tuple[float, float]:
        assert self.cursor
        return self.cursor[0], self.size[1] - self.cursor[1]

    @property
    def sums_frame(self) -> Frame:
        """Where the summed-area table is shown: left, bottom, width, height from the lower left."""
        return sums_frame(self.renderer.heightmap, self.size, self.scale)

    def _box_under_cursor(self) -> BoxSum | None:
        place = self.place_under(*self.cursor) if self.cursor else None
        return self.box if place is None else box_under(self, place)

    def _save(self) -> None:
        """Write the picture, without words over it, beside earlier ones in the working directory."""
        self._shoot = False
        path = free_name(self.renderer.heightmap.name)
        try:
            write_png(str(path), self.renderer.picture.read())
        except (TerrainError, OSError) as error:
            self.say(str(error))
        else:
            self.say(f"saved {path}")


def _raised(place: Vector, ratio: float) -> Vector:
    return place[0], place[1], ratio * place[2]


def free_name(map_name: str, suffix: str = ".png") -> Path:
    """First of name-001.png, name-002.png, ... that is not there yet."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while (path := Path(f"{stem}-{number:03d}{suffix}")).exists():
        number += 1
    return path
