"""The mouse over the land: buttons, motion and wheel. Pixels count from the upper left."""

import math
from collections.abc import Callable

from .pointer import Pointer
from .ruler import Ruler
from .scene import Scene
from .sculpting import Sculpting

CLICK_PX = 4.0  # a press that moves further than this is a drag
DOUBLE_S = 0.3  # longest time between the clicks of a double click


class Mouse:
    """Drags and clicks. The function `on_click` gets the pixel of a single click on the land."""

    def __init__(
        self,
        scene: Scene,
        pointer: Pointer,
        sculpting: Sculpting,
        ruler: Ruler,
        on_click: Callable[[float, float], None],
    ) -> None:
        self._ruler = ruler
        self._scene = scene
        self._pointer = pointer
        self._sculpting = sculpting
        self._on_click = on_click
        self.drag = ""  # what a drag does: "orbit", "look", "pan", "brush" or "divider"; "" without a drag
        self._button = ""  # the button that drags
        self._pressed_at = (0.0, 0.0)
        self._clicked_at: tuple[float, float] | None = None  # a click that may become a double click
        self._waits_until_s: float | None = None
        self._measured_at = (0.0, 0.0)  # the pixel of the last click with the ruler

    @property
    def waits(self) -> bool:
        """Whether a click may still become a double click."""
        return self._clicked_at is not None

    def step(self, now_s: float) -> None:
        """Report a click once it can no longer become a double click."""
        if self._clicked_at is None:
            return
        if self._waits_until_s is None:
            self._waits_until_s = now_s + DOUBLE_S
        elif now_s >= self._waits_until_s:
            at = self._clicked_at
            self._clicked_at = None
            self._on_click(*at)

    def press(self, button: str, x: float, y: float) -> None:
        """A button goes down over the land. Until it comes up, other buttons do nothing."""
        if not self._scene.is_visible or self.drag:
            return
        self._pressed_at = self._pointer.last = (x, y)
        self._button = button
        if button == "left":
            self.drag = self._begin_left(x, y)
        elif button == "right":
            self.drag = "look"
        elif button == "middle":
            self._scene.controller.grab(*self._pointer.tangents(x, y))
            self.drag = "pan"

    def _begin_left(self, x: float, y: float) -> str:
        if self._pointer.is_on_divider(x):
            return "divider"
        if self._sculpting.brushing:
            place = self._pointer.place_under(x, y)
            return "brush" if place is not None and self._sculpting.begin(place) else ""
        if self._scene.controller.mode == "walk":
            return "look"
        self._scene.controller.grab(*self._pointer.tangents(x, y))
        return "orbit"

    def release(self, button: str, x: float, y: float) -> None:
        """A button comes up. If the mouse has hardly moved since the button went down, this is a click."""
        if button != self._button:
            return
        drag, self.drag = self.drag, ""
        if not self._scene.has_map:
            return
        self._scene.controller.release()
        if drag == "brush":
            self._sculpting.end()
        clicked = math.dist((x, y), self._pressed_at) < CLICK_PX * self._scene.window.scale
        if button == "left" and drag in ("orbit", "look") and clicked and self._scene.is_visible:
            self._click(x, y)

    def _click(self, x: float, y: float) -> None:
        """Handle a click. A double click flies to its place; with the ruler, it ends the line."""
        if self._ruler.taken:
            self._measure(x, y)
            return
        first = self._clicked_at
        self._clicked_at = None
        self._waits_until_s = None
        if first and math.dist(first, (x, y)) < 2 * CLICK_PX * self._scene.window.scale:
            self._scene.controller.fly_to(*self._pointer.tangents(x, y))
        else:
            self._clicked_at = x, y

    def _measure(self, x: float, y: float) -> None:
        """Set a corner of the ruler's line, or end the line at its last corner."""
        self._scene.window.refresh()
        last = self._measured_at
        self._measured_at = (x, y)
        if self._ruler.corners and math.dist(last, (x, y)) < 2 * CLICK_PX * self._scene.window.scale:
            self._ruler.end()
        elif (place := self._pointer.place_under(x, y)) is not None:
            self._ruler.add(float(place[0]), float(place[1]))

    def move(self, x: float, y: float, look: bool = False, over_panels: bool = False) -> None:
        """The cursor moves. If `look` is true, the motion turns the camera although no button is held."""
        scene, pointer = self._scene, self._pointer
        settings, window = scene.settings, scene.window
        before = pointer.last or (x, y)
        pointer.last = (x, y)
        pointer.over_land = None if over_panels else (x, y)
        if not scene.has_map:
            return
        drag = "look" if look else self.drag
        dx, dy = (x - before[0]) / window.scale, (y - before[1]) / window.scale
        if drag == "divider":
            settings.split_at(x / max(1, window.size[0]))
            window.refresh()
        elif drag == "look":
            scene.controller.look(dx, dy)
        elif drag == "orbit":
            scene.controller.orbit(dx, dy)
        elif drag == "pan":
            scene.controller.pan(*pointer.tangents(x, y))
        elif settings.split and not over_panels:
            settings.active = pointer.side_at(x)
        if settings.lens or settings.sums or settings.panel or self._sculpting.brushing:
            window.refresh()

    def wheel(self, notches: float, x: float, y: float, action: str = "") -> None:
        """Approach the place under the cursor. Action "zoom" changes the field of view, action "speed" the speed."""
        if not self._scene.has_map:
            return
        controller = self._scene.controller
        if action == "zoom":
            controller.zoom(notches)
        elif action == "speed" or controller.mode == "walk":
            controller.wheel(notches)
        else:
            controller.approach(*self._pointer.tangents(x, y), notches)
        self._scene.window.refresh()
