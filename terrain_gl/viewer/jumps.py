"""How far the land jumps from one frame of a flight to the next: docs/guarantee.md, section 10."""

import math
from dataclasses import dataclass

import numpy as np

from ..basics.steps import Steps, portion
from ..camera import Camera
from ..renderer.frame import DrawnFrame
from ..renderer.lines import Line, posts_on_land
from .painter import MEASURED_POSTS, Painter
from .scene import FrameSpec, Scene

LEAST_PX = 0.5  # smaller jumps are not shown
TALLER = 5.0  # height of a bar, in lengths of the jump
_MOST_BARS = 5000
_WITHIN, _OVER = (255, 235, 90, 255), (0, 230, 255, 255)  # colours of jumps: at most the least bound, and above it


@dataclass(frozen=True)
class Jumps:
    """The jumps of one side: its largest one, its bound, and the places that jump by `LEAST_PX` or more."""

    largest_px: float
    bound_px: float | None  # the sum of both certificates; None if a frame has none
    places: np.ndarray  # (n, 3) world metres
    px: np.ndarray  # (n,)


class JumpMeter:
    """Measures, in steps, the jumps from another camera to the picture at rest."""

    def __init__(self, scene: Scene, painter: Painter) -> None:
        self._scene = scene
        self._painter = painter
        self._before: Camera | None = None
        self._steps: Steps[None] | None = None
        self._of: FrameSpec | None = None  # the picture that is measured
        self._sides: list[Jumps] = []
        self._ready: tuple[Camera, FrameSpec, list[Jumps]] | None = None  # measured ahead

    @property
    def at_work(self) -> bool:
        return self._steps is not None

    @property
    def moved_m(self) -> float:
        """Distance between both eyes."""
        return math.dist(self._before.eye, self._of.camera.eye) if self._before and self._of else math.nan

    @property
    def sides(self) -> list[Jumps]:
        """The jumps of each side of the present picture; none until all are measured."""
        return self._sides if self._painter.drawn is not None and self._painter.drawn == self._of else []

    def follow(self, before: Camera | None) -> None:
        """Measure jumps from this camera, as the renderer takes it, from now on; None for no measurement."""
        self._before, self._steps, self._of, self._sides = before, None, None, []

    def step(self, settled: bool) -> None:
        """Measure for a while, if the picture is at rest; begin again if it has changed."""
        painter = self._painter
        if self._before is None or not settled or self._scene.is_paged or not painter.is_measured:
            self._of, self._steps = None if self._steps else self._of, None
            return
        if painter.drawn != self._of:
            self._of, self._sides, self._steps = painter.drawn, [], self._measured_steps(self._before)
            if self._ready and self._ready[:2] == (self._before, self._of):
                self._sides, self._steps = self._ready[2], None
                self._scene.window.refresh()
        if self._steps and painter.go_on(self._steps):
            self._steps = None
            self._scene.window.refresh()

    def _measured_steps(self, before: Camera) -> Steps[None]:
        assert self._of
        self._sides = yield from self._jumps_steps(before, self._of, self._painter.meshes)

    def ahead_steps(self, before: Camera, spec: FrameSpec, meshes: list[DrawnFrame]) -> Steps[None]:
        """Measure the jumps of a picture that is not shown yet."""
        self._ready = before, spec, (yield from self._jumps_steps(before, spec, meshes))

    def _jumps_steps(self, before: Camera, spec: FrameSpec, meshes: list[DrawnFrame]) -> Steps[list[Jumps]]:
        renderer, found = self._scene.renderer, []
        for side, after in enumerate(meshes):
            renderer.choose(before, **vars(spec.sides[side]))
            earlier = renderer.inspector.frame
            assert earlier
            steps = renderer.inspector.jumps_steps(earlier, after, LEAST_PX, MEASURED_POSTS)
            posts, px = yield from portion(steps, side, len(spec.sides))
            sums = [frame.stats["certified_max_error_px"] for frame in (earlier, after)]
            bound_px = None if None in sums or after.options.certified_metric != "max" else sum(filter(None, sums))
            places = posts_on_land(renderer.heightmap, posts)
            found.append(Jumps(float(px.max(initial=0.0)), bound_px, places, px))
        return found

    @property
    def limit_px(self) -> float:
        """The least bound of all sides."""
        return min((each.bound_px for each in self.sides if each.bound_px is not None), default=math.inf)

    def over(self, side: int) -> int:
        """How many posts of a side jump by more than the least bound."""
        return int((self.sides[side].px > self.limit_px).sum())

    def bars(self, side: int) -> list[Line]:
        """A bar over each place of a side that jumps; its height in the picture is about `TALLER` jumps."""
        if side >= len(self.sides):
            return []
        jumps, spec = self.sides[side], self._scene.frame_spec()
        tallest = np.argsort(jumps.px)[-_MOST_BARS:]
        places, px = jumps.places[tallest], jumps.px[tallest]
        away = (places - spec.camera.eye) @ spec.camera.axes[2]
        tall_m = TALLER * px * away / spec.camera.focal_px(spec.size[1])
        ends = np.stack([places, places + np.multiply.outer(tall_m, [0.0, 0.0, 1.0])], 1)
        over = px > self.limit_px
        return [(ends[~over], _WITHIN), (ends[over], _OVER)]
