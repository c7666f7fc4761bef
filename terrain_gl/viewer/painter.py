"""Draws the picture if anything has changed since the last one.

    the first picture              in steps, because its programs are not compiled yet
    in motion, or without light    at once, coarser if full pictures take long           (frame_budget.py)
    a new split                    at once, as a preview in a plain style, because its programs are not compiled yet
    at rest                        in full size, in steps if it takes long
    then                           light is made, in steps; the picture is drawn again with it
                                   (the tiles of a store get light before the picture is drawn in full size)
    then                           its error is measured, in steps: the largest error first, then all places
    then                           the picture that is expected next is drawn ahead, in steps   (ahead.py)

The record `FrameSpec` holds everything that a picture depends on. After an edit, the old light is used until the new
light is made. A preview of a map gets no light, no bound and no measurement.
"""

import math
from dataclasses import replace

import moderngl

from ..basics.steps import Steps, drain
from ..renderer import Renderer
from ..renderer.frame import DrawnFrame, Stats
from ..renderer.names import Label
from ..renderer.options import LOOSEST_PX, FrameOptions
from .ahead import Ahead, Measured
from .canvas import Canvas
from .frame_budget import COARSEST, FULL, FrameBudget, Way
from .frame_stats import FrameStats, History, drawing_ms, in_window_px, without_bounds
from .light_builder import LightBuilder
from .scene import FrameSpec
from .window_state import Size

REST_S = 0.25  # the full picture is drawn after this time without a change
RIPE_S = 10.0  # longest wait for light of a store's tiles; without it, the full picture would be drawn twice
TOLD_S = 1.0  # seconds between two displays of the progress of light: drawing panels takes time, too
Kind = tuple[object, ...]
FINEST_PX = 0.25  # least tolerance of a picture that will be enlarged, in its own pixels
MEASURED_POSTS = 256  # posts along the side of the squares that are measured


class Painter:
    """Draws on a canvas."""

    def __init__(self, ctx: moderngl.Context, budget: FrameBudget) -> None:
        self._budget = budget
        self.canvas = Canvas(ctx)
        self.ahead = Ahead(ctx)
        self.light = LightBuilder(budget)
        self.history = History()
        self.frame = FrameStats("", (0, 0))  # numbers of the last picture
        self.side_stats: list[Stats] = []  # numbers of each side of the last picture
        self.side_measured: Measured = []  # achieved error by metric, as far as it is known
        self.meshes: list[DrawnFrame] = []  # of each side of the last picture
        self.drawn: FrameSpec | None = None  # what the canvas shows; None if the canvas is out of date
        self.has_picture = False  # whether the canvas shows anything
        self.labels: list[Label] = []  # names and heights of contour lines in the picture; pixels of the window
        self._asked: FrameSpec | None = None
        self._announced: Kind = ()  # the kind of picture that was requested last
        self._known: set[Kind] = set()  # kinds of pictures that were drawn in full, so that their programs are compiled
        self._asked_s = self._drawn_s = self._told_s = self._now_s = float("-inf")
        self._unripe_s: float | None = None  # time since when tiles in the picture get light
        self._painting: tuple[FrameSpec, Steps[None]] | None = None
        self._painted, self._painting_s = 0.0, float("-inf")  # its progress, and when it began
        self._measuring: Steps[None] | None = None
        self._unmeasured = False

    # --- Changes from outside -----------------------------------------------------------------------------------------

    def new_map(self, frame: FrameStats) -> None:
        """Forget everything: another map is shown."""
        self.frame = frame
        self._known.clear()
        self.forget()
        self.ahead.release()  # its targets are as those of the renderer before
        self.light.stop()
        self._budget.forget()

    def forget(self, at_once: bool = False) -> None:
        """Note that the land or its light has changed; `at_once`: show that in the next frame, if necessary coarser."""
        self.drawn = None
        self.meshes = []
        if at_once:
            self._asked = None
        self.interrupt()
        self.ahead.forget()

    def interrupt(self) -> None:
        """Stop drawing and measuring in steps, because the renderer is needed for something else."""
        self.ahead.interrupt()
        self._painting = self._measuring = None

    def release(self) -> None:
        self.light.release()
        self.ahead.release()
        self.canvas.release()

    # --- Its state ----------------------------------------------------------------------------------------------------

    def mesh_of(self, renderer: Renderer, spec: FrameSpec, side: int) -> DrawnFrame:
        """The mesh of one side in full size: that of the picture, if it has this size."""
        if self.drawn == spec and self.frame.way.is_full:
            return self.meshes[side]
        return self.choose_mesh(renderer, spec, side)

    def steps_log2(self, renderer: Renderer, side: int) -> list[int]:
        """The levels of the patches of one side in the picture at rest; none in motion."""
        if not self.frame.way.is_full or side >= len(self.meshes):
            return []
        with renderer.session:
            return self.meshes[side].steps_log2

    def choose_mesh(self, renderer: Renderer, spec: FrameSpec, side: int) -> DrawnFrame:
        """Let the renderer choose the mesh of one side in full size."""
        self.interrupt()
        _resize(renderer, spec.size)
        renderer.choose(spec.camera, **vars(spec.sides[side]))
        assert renderer.inspector.frame
        return renderer.inspector.frame

    def is_busy(self, spec: FrameSpec) -> bool:
        under_way = self._painting is not None or self._measuring is not None
        return under_way or spec != self.drawn or self.light.is_due(spec.lit_look) or self._may_draw_ahead(spec)

    def _may_draw_ahead(self, spec: FrameSpec) -> bool:
        """Whether nothing else is to do, and a picture is to be drawn ahead whose light is there."""
        wanted = self.ahead.wanted
        if wanted is None or not self.ahead.is_due or wanted.size != spec.size or self.light.is_due(wanted.lit_look):
            return False
        return self.is_done(spec) and not (self._painting or self._measuring or self._unmeasured)

    def is_done(self, spec: FrameSpec) -> bool:
        """Whether this picture is drawn, in full size and lit. It may not be measured yet."""
        return spec == self.drawn and self.frame.way.is_full and not self.light.is_due(spec.lit_look)

    @property
    def share(self) -> float | None:
        """Progress, 0 to 1, of a picture that takes long, or whose programs must be compiled; None if there is none."""
        if not self._painting and self.drawn:
            return None
        takes_long = self._asked is None or _kind(self._asked) not in self._known
        takes_long = takes_long or bool(self._painting and self._now_s - self._painting_s >= TOLD_S)
        return (self._painted if self._painting else 0.0) if takes_long else None

    @property
    def is_measured(self) -> bool:
        """Whether all places in the picture are measured."""
        return bool(self.side_measured) and not self._unmeasured

    @property
    def waits_for_rest(self) -> bool:
        """Whether there is work that begins when nothing has changed for a while."""
        return not self.frame.way.is_full or self.frame.fps is not None or self._unmeasured

    def step(self, renderer: Renderer, spec: FrameSpec, now_s: float, moving: bool) -> bool:
        """Work for a while; returns whether the canvas or the stats have changed.

        `moving` says that the picture will change again soon.
        """
        self._now_s = now_s
        if renderer.streaming:
            renderer.streaming.terrain.views = len(spec.sides)
        if spec != self._asked:
            self._asked = spec
            self._asked_s = now_s
        if not spec.lit_look.is_lit and self.light.share is not None:
            self.light.stop()
        unlit = self.light.is_due(spec.lit_look)
        fresh = self.drawn is None
        dark = unlit and not (self.light.lit == spec.lit_look and renderer.picture.lighting.is_there)
        hurried = moving or dark or now_s - self._asked_s < REST_S or self._ripens(renderer, spec, now_s)
        changed = False
        if spec != self.drawn and spec == self.ahead.done and not unlit:
            self._take_ahead(renderer, spec)
            changed = True
        elif not hurried and self._may_draw_ahead(spec):
            self._draw_ahead(renderer)
        elif not hurried:
            changed = self._rest(renderer, spec, now_s, measure=not unlit)
        elif spec != self.drawn:
            changed = True
            if not (self.has_picture or self._painting and self._painting[0] != spec):
                self._draw_first(renderer, spec)
            elif not self._announces(spec):
                is_new_split = self.has_picture and len(spec.sides) > 1 and _kind(spec) not in self._known
                self._sketch(renderer, spec) if is_new_split else self._draw(renderer, spec, now_s)
        if not unlit or self.frame.awaits_map or fresh or self._painting:  # a new picture is shown first
            return changed
        if self.light.step(renderer.picture, spec.lit_look, moving):
            self.forget()
            return True
        return self._tells() or changed

    def _tells(self) -> bool:
        """Whether the panels should show again how far a long work is."""
        if self._now_s - self._told_s < TOLD_S:
            return False
        self._told_s = self._now_s
        return True

    def _announces(self, spec: FrameSpec) -> bool:
        """Whether this frame shows the old picture, because the new picture needs programs that are not compiled yet.

        Compiling them can take seconds. Until then the window shows the divider of a new split, and a message.
        """
        before, self._announced = self._announced, _kind(spec)
        return self.has_picture and self._announced != before and self._announced not in self._known

    def _ripens(self, renderer: Renderer, spec: FrameSpec, now_s: float) -> bool:
        """Whether tiles of a store get light of their own, and less than `RIPE_S` have passed since this began."""
        if not (spec.lit_look.is_lit and renderer.picture.lighting.is_coming):
            self._unripe_s = None
        elif self._unripe_s is None:
            self._unripe_s = now_s
        if self._unripe_s is None or now_s - self._unripe_s >= RIPE_S:
            return False
        self.interrupt()  # a full picture has just chosen its tiles, and some of them have no light
        return True

    # --- Drawing ------------------------------------------------------------------------------------------------------

    def _draw(self, renderer: Renderer, spec: FrameSpec, now_s: float) -> None:
        """Draw at once, if necessary coarser."""
        self.interrupt()
        drain(self._draw_steps(renderer, spec, self._budget.way, gradual=False))
        if 0 < (seconds := now_s - self._drawn_s) < 2:
            self.frame.fps = 0.9 * self.frame.fps + 0.1 / seconds if self.frame.fps else 1 / seconds
        self._drawn_s = now_s

    def _draw_first(self, renderer: Renderer, spec: FrameSpec) -> None:
        """Draw the first picture of all for a while, at least one step. Once the camera moves, it is drawn at once."""
        if not self._painting:
            self._paint(spec, self._draw_steps(renderer, spec, self._budget.way))
        self._go_on()

    def go_on(self, steps: Steps[None]) -> bool:
        """Take some steps, as many as a frame has time for, but at least one; returns whether all are taken."""
        return self._budget.run(steps)

    def _paint(self, spec: FrameSpec, steps: Steps[None]) -> None:
        """Begin to draw a picture in steps."""
        self._painting = spec, steps
        self._painted, self._painting_s, self._told_s = 0.0, self._now_s, self._now_s

    def _go_on(self) -> bool:
        """Draw a picture in steps for a while, at least one; returns whether it is complete."""
        assert self._painting
        if not self._budget.run(self._painting[1], self._tell_painted):
            return False
        self._painting = None
        self._drawn_s = self._now_s
        return True

    def _tell_painted(self, share: float) -> None:
        self._painted = share

    def _draw_steps(self, renderer: Renderer, spec: FrameSpec, way: Way, gradual: bool = True) -> Steps[None]:
        """Draw all sides; yields progress from 0 to 1 for each side."""
        _resize(renderer, spec.size, way)
        self.meshes = yield from _sides_steps(renderer, spec, way, gradual, self.canvas, self.meshes)
        self._note(spec, [frame.stats for frame in self.meshes], way, renderer)

    def _draw_ahead(self, renderer: Renderer) -> None:
        """Draw and measure the picture that is expected next, for a while."""

        def work(
            spec: FrameSpec, canvas: Canvas, earlier: list[DrawnFrame]
        ) -> Steps[tuple[list[DrawnFrame], Measured]]:
            meshes = yield from _sides_steps(renderer, spec, FULL, True, canvas, earlier)
            self._known.add(_kind(spec))
            return meshes, (yield from _measured_steps(renderer, meshes))

        self.ahead.step(renderer, work, self.go_on)

    def _take_ahead(self, renderer: Renderer, spec: FrameSpec) -> None:
        """Show the picture that was drawn ahead."""
        self.interrupt()
        _resize(renderer, spec.size)
        self.meshes, measured = self.ahead.take(renderer, self.canvas)
        self.frame.fps = None
        self._note(spec, [frame.stats for frame in self.meshes], FULL, renderer)
        self._note_measured(measured)

    def _sketch(self, renderer: Renderer, spec: FrameSpec) -> None:
        """Draw a preview of a new split: each side by its method, small, in a plain style.

        Its programs are few and short. There is no search for equal triangles, and there are no numbers.
        """
        self.interrupt()
        _resize(renderer, spec.size, COARSEST)
        for side, options in enumerate(spec.sides):
            plain = replace(options, style="lambert", wires=False, contour_m=None)
            renderer.draw(spec.camera, **vars(hastened(plain, COARSEST)))
            self.canvas.take(renderer, spec.size, side)
        self.drawn = spec
        self.labels = []
        self.frame.way = COARSEST
        self.frame.is_sketch = True

    def _rest(self, renderer: Renderer, spec: FrameSpec, now_s: float, measure: bool) -> bool:
        """Draw in full size, then measure; returns whether anything has changed."""
        was_moving = self.frame.fps is not None
        self.frame.fps = None
        if self._painting and self._painting[0] != spec:
            self.interrupt()
        if not self._painting and (spec != self.drawn or not self.frame.way.is_full):
            self.interrupt()
            self._paint(spec, self._draw_steps(renderer, spec, FULL))
            assert self._painting
            if renderer.streaming:  # the picture chooses its tiles, and goes on if all of them have light
                next(self._painting[1])
                return was_moving
        if self._painting:
            return self._go_on() or self._tells() or was_moving
        return (measure and self._measure(renderer)) or was_moving

    def _note(self, spec: FrameSpec, stats: list[Stats], way: Way, renderer: Renderer) -> None:
        if self.frame.is_preview:
            stats = [without_bounds(each) for each in stats]
        stats = [in_window_px(each, way.shrink) for each in stats]
        self.drawn = spec
        self.frame.is_sketch = False
        if way.is_full:
            self._known.add(_kind(spec))
        self.side_stats = stats
        self.canvas.keep(len(spec.sides))
        self.has_picture = True
        self.frame.stats = stats[0]
        self.frame.way = way
        across, down = (n / own for n, own in zip(spec.size, renderer.picture.size, strict=True))
        self.labels = [each._replace(x=across * each.x, y=down * each.y) for each in labels_of(renderer, spec)]
        self.frame.measured_px = None
        self.side_measured = []
        self._unmeasured = not self.frame.is_preview and renderer.streaming is None  # a store's truth is on a disk
        self.history.add(stats[0])
        self._budget.note(sum(map(drawing_ms, stats)), way)

    def _measure(self, renderer: Renderer) -> bool:
        """Measure for a while; returns whether more is known now."""
        if not self._unmeasured:
            return False
        before = self.side_measured
        self._measuring = self._measuring or self._measure_steps(renderer)
        self.go_on(self._measuring)
        return self.side_measured is not before

    def _measure_steps(self, renderer: Renderer) -> Steps[None]:
        """Measure each side; yields progress from 0 to 1 for each.

        First comes the largest error alone, if bounds show soon where it is; then all places of all sides are measured.
        """
        largest = []
        for mesh in self.meshes:
            largest.append((yield from renderer.inspector.largest_steps(MEASURED_POSTS, mesh)))
        self._know([{"max": px} if px is not None else {} for px in largest])
        self._note_measured((yield from _measured_steps(renderer, self.meshes)))

    def _note_measured(self, measured: Measured) -> None:
        """Show achieved errors: all places are measured."""
        self._know(measured)
        self._unmeasured = False
        self._measuring = None

    def _know(self, measured: Measured) -> None:
        """Show achieved errors, one for each side."""
        self.side_measured = measured
        self.frame.measured_px = measured[0] or None
        if (px := self.frame.achieved_px) is not None:
            self.history.add_measured(px)


def _sides_steps(
    renderer: Renderer, spec: FrameSpec, way: Way, gradual: bool, canvas: Canvas, earlier: list[DrawnFrame]
) -> Steps[list[DrawnFrame]]:
    """Draw all sides on a canvas; yields progress from 0 to 1 for each side, and returns their meshes."""
    drawn: list[DrawnFrame] = []
    for side in _last_first(spec):
        options = vars(hastened(spec.sides[side], way))
        before = earlier[side] if side < len(earlier) else None
        yield from renderer.draw_steps(spec.camera, gradual=gradual, earlier=before, **options)
        assert renderer.inspector.frame
        drawn.insert(0, renderer.inspector.frame)
        canvas.take(renderer, spec.size, side)
    return drawn


def _measured_steps(renderer: Renderer, meshes: list[DrawnFrame]) -> Steps[Measured]:
    """Measure each mesh; yields progress from 0 to 1 for each, and returns the errors by metric."""
    measured = []
    for mesh in meshes:
        achieved = yield from renderer.inspector.measure_steps(MEASURED_POSTS, mesh)
        measured.append({"max": achieved.max_px, "rms": achieved.rms_px})
    return measured


def labels_of(renderer: Renderer, spec: FrameSpec) -> list[Label]:
    """Names, and heights of contours that all sides have, in the last picture."""
    first = spec.sides[0]
    same = len({side.contour_m for side in spec.sides}) == 1
    return renderer.labels() + renderer.contour_labels(first.contour_m if same else None, first.water_m, first.units)


def _kind(spec: FrameSpec) -> Kind:
    """What decides which programs a picture needs: style and method of each side, and whether it has contour lines."""
    return tuple((side.style, side.method, side.contour_m is None) for side in spec.sides)


def _last_first(spec: FrameSpec) -> range:
    """The order of drawing: the first side comes last, so that its labels can be asked of the renderer."""
    return range(len(spec.sides) - 1, -1, -1)


def hastened(side: FrameOptions, way: Way) -> FrameOptions:
    """The same side as it is drawn in motion: with a multiple of its tolerance.

    A mesh for a number of triangles takes many tries, so a tolerance takes its place. It is one of the largest error,
    for which the programs are compiled.
    """
    if way.is_full:
        return side
    tolerance_px = min(way.looser * (side.max_error_px or 1.0), math.nextafter(LOOSEST_PX, 0.0))
    tolerance_px = max(tolerance_px, FINEST_PX) if way.shrink > 1 else tolerance_px
    return replace(side, triangles=None, max_error_px=tolerance_px, metric="max" if side.triangles else side.metric)


def _resize(renderer: Renderer, size: Size, way: Way = FULL) -> None:
    """Let the renderer draw pictures for a window of `size`, in a way that may make them smaller."""
    width, height = (max(1, side // way.shrink) for side in size)
    if (width, height) != renderer.size:
        renderer.resize((width, height))
