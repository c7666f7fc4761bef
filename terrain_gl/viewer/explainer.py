"""Shows how detail is chosen: frozen levels, a split picture, an explained patch, a box of the summed-area table."""

import numpy as np

from ..lod import RingsSelector
from ..renderer.lines import posts_on_land
from ..renderer.methods import BASELINES, METHODS
from ..renderer.options import FrameOptions
from ..verify.explain import Explanation
from . import error_box
from .box_sum import BoxSum, box_around
from .error_box import ErrorBox
from .painter import Painter
from .pointer import Pointer
from .scene import Scene
from .settings import BUDGETS, COMPARED, SCALE_PX

LENS = 6.0  # magnification
HIDDEN, BOX = "hidden", "box"  # patches that can be looked for: a hidden one, and one whose box has many tiles
_GREY = 20  # largest difference of the channels of a grey pixel
_TRIED = 64  # most patches that are tried, the largest ones first
_FREE = (0.25, 0.75), (0.4, 0.85)  # the part of the window in which they are looked for, across and down


class Explainer:
    """Shows how the mesh was chosen."""

    def __init__(self, scene: Scene, pointer: Pointer, painter: Painter) -> None:
        self._scene = scene
        self._pointer = pointer
        self._painter = painter
        self._settings = scene.settings
        self._window = scene.window
        self.explanation: Explanation | None = None  # of the patch that was clicked
        self.error_box: ErrorBox | None = None  # its box in the table of error counts; None if no table decided
        self.place: np.ndarray | None = None  # the place that was clicked last, in world metres; None for the sky
        self.at_px = 0.0  # the column of pixels that was clicked last
        self.box: BoxSum | None = None  # the box of the summed-area table under the cursor
        self._worst: dict[int, tuple[object, np.ndarray | None]] = {}  # by side: of which picture, and where
        self._split_from: tuple[FrameOptions, FrameOptions] | None = None  # options before a split, and its left side

    def forget(self) -> None:
        """Forget the explanation and the box, because the map has changed."""
        self.explanation = self.box = None

    def close_one(self) -> bool:
        """End one of the modes that change the view; returns whether there was any."""
        if self._settings.lens:
            self.toggle_lens()
        elif self._settings.sums:
            self.toggle_sums()
        elif self._settings.split:
            self.toggle_split()
        elif self._scene.frozen:
            self.toggle_freeze()
        else:
            return False
        return True

    def toggle_wires(self) -> None:
        self._settings.change(wires=not self._settings.options.wires)

    def toggle_freeze(self) -> None:
        """Freeze the levels as they are for this camera, or let them follow the camera again."""
        if self._scene.frozen:
            self._scene.frozen = None
            self._window.say("the levels follow the camera again")
        else:
            self._scene.frozen = self._scene.controller.camera
            self._window.say("the levels are frozen: fly around and look at them; L ends this")

    def toggle_split(self) -> None:
        """Split the picture, or join it.

        At first its sides show the errors of two methods with equal triangles; of a store, which has one method, the
        errors of two metrics.
        """
        settings = self._settings
        if settings.split:
            self.take_sides([self.unsplit])
            self._window.say("one picture again")
            return
        before = settings.options
        triangles = min(max(self._painter.frame.stats.get("triangles", 0), BUDGETS[0]), COMPARED)
        left = before.otherwise(triangles=triangles, style="error", error_scale_px=SCALE_PX)
        taken_px = self._window.panel_px if settings.panel else 0.0
        settings.split_at(0.5 + 0.5 * taken_px / max(1, self._window.size[0]))  # the middle beside the panel
        if self._scene.is_paged:
            right = left.otherwise(metric="max" if left.metric == "rms" else "rms")
            compared = "least squares, and the smallest largest error"
        else:
            right = left.otherwise(method=BASELINES[0] if left.method not in BASELINES else METHODS[0])
            compared = "two methods"
        settings.sides = [left, right]
        self._split_from = before, left
        self._window.say(f"{compared}, with as many triangles, on one scale of errors; drag the divider; T ends this")

    def swap(self) -> None:
        """Let the sides of the split picture change places; at first split it so that one side fills the picture."""
        if self._settings.split:
            self._settings.swapped = not self._settings.swapped
            return
        self.toggle_split()
        self._settings.split_at(1.0)
        self._window.say("Shift T shows the other side in the same place; drag the divider; T ends this")

    def take_sides(self, sides: list[FrameOptions]) -> None:
        """Show these sides, one or two, from now on."""
        exaggeration = self._scene.exaggeration
        self._settings.sides = [side.otherwise(exaggeration=exaggeration) for side in sides]
        self._settings.active = 0
        self._settings.swapped = False
        self._split_from = None

    @property
    def unsplit(self) -> FrameOptions:
        """The options before the split, with the user's changes of the left side since then."""
        now = self._settings.sides[0]
        if not self._settings.split or not self._split_from:
            return now
        before, split = self._split_from
        return before.otherwise(**{name: value for name, value in vars(now).items() if value != getattr(split, name)})

    def toggle_lens(self) -> None:
        self._settings.lens = 0.0 if self._settings.lens else LENS

    def toggle_sums(self) -> None:
        self._settings.sums = not self._settings.sums

    def explain(self, x: float, y: float) -> None:
        """Explain the patch at a pixel; without land there, close the explanation."""
        self.explanation = None
        self._window.refresh()
        self.at_px = x
        place = self.place = self._pointer.place_under(x, y)
        if place is None or self._painter.drawn is None:
            return
        if self._scene.is_preview:
            self._window.say("this is a preview: patches are explained when the tables are built")
            return
        renderer = self._scene.renderer
        spec = self._scene.frame_spec()
        side = self._pointer.side_at(x)
        mesh = self._painter.mesh_of(renderer, spec, side)
        self.explanation = renderer.inspector.explain(float(place[0]), float(place[1]), mesh)
        self.error_box = error_box.read(renderer, self.explanation) if self.explanation else None
        if self.explanation is None:
            self._window.say(_no_explanation(spec.sides[side].method))

    def worst(self, side: int) -> np.ndarray | None:
        """The place with the largest error that a side shows, (3,) in world metres; None but in the style "error"."""
        scene, painter = self._scene, self._painter
        if side >= len(scene.settings.sides) or scene.settings.sides[side].style != "error":
            return None
        if painter.drawn is None or not painter.frame.way.is_full or painter.drawn != scene.frame_spec():
            return None
        key = painter.drawn, scene.split, side
        if self._worst.get(side, (None,))[0] != key:
            self._worst[side] = key, self._worst_place(side)
        return self._worst[side][1]

    def _worst_place(self, side: int) -> np.ndarray | None:
        """The land under the brightest pixel, or under one that is over the scale."""
        first, last, shift = self._scene.split.parts(self._window.size[0])[side]
        pixels = self._painter.canvas.pixels(side)[:, first - shift : last - shift]
        if not pixels.size:  # the side has no room in the window
            return None
        bright = np.where(np.ptp(pixels, -1) < _GREY, 0, pixels.sum(-1))  # sky, and land without a known error
        is_over = pixels[..., 2] > pixels[..., 0] + 128
        row, col = np.unravel_index((bright + 1000 * is_over).argmax(), bright.shape)
        return self._pointer.place_under(first + float(col) + 0.5, float(row) + 0.5)

    def find(self, what: str) -> tuple[float, float] | None:
        """The pixel of a large patch that the eye sees in the free part of the window, `HIDDEN` or `BOX`; or None.

        A hidden patch can be seen from another place than that of the frozen camera.
        """
        scene, (width, height) = self._scene, self._window.size
        spec = scene.frame_spec()
        selection = self._painter.mesh_of(scene.renderer, spec, 0).selection
        if not isinstance(selection.surface, RingsSelector):
            return None
        with scene.renderer.session:
            patches = selection.surface.chosen(selection)
        places = posts_on_land(scene.heightmap, patches.corner + 0.5 * patches.size)
        at = spec.camera.pixels(np.nan_to_num(places), (width, height))[:, :2]
        (left, right), (top, bottom) = (
            np.array(free) * side for free, side in zip(_FREE, (width, height), strict=True)
        )
        inside = (at[:, 0] > left) & (at[:, 0] < right) & (at[:, 1] > top) & (at[:, 1] < bottom)
        is_hidden = np.arange(len(at)) >= selection.patches
        found = np.flatnonzero(inside & (is_hidden == (what == HIDDEN)) & (patches.step_log2 > 0))
        size = patches.side_log2 if what == HIDDEN else patches.side_log2 - patches.step_log2
        for i in sorted(found.tolist(), key=lambda i: (-size[i], abs(at[i, 0] - 0.5 * width)))[:_TRIED]:
            x, y = map(float, at[i])
            seen = self._pointer.place_under(x, y)
            if seen is not None and np.linalg.norm(seen - places[i]) < 0.5 * patches.size[i, 0] * min(
                scene.heightmap.spacing_m
            ):
                return x, y
        return None

    def follow_cursor(self) -> None:
        at = self._pointer.over_land
        if not self._settings.sums:
            self.box = None
        elif at and (place := self._pointer.place_under(*at)) is not None:
            self.box = box_around(self._scene.renderer, place, self._settings.box)


def _no_explanation(method: str) -> str:
    if method == "sat":
        return "no patch is here: the place was outside the picture when the levels were chosen"
    return f"method {method} gives no explanation; method sat explains its patches (F)"
