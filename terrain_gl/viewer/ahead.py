"""Draws the next picture ahead, while the present picture is at rest; when it is asked for, it is there at once.

It has targets of its own on the GPU, so the depths of the present picture stay: lines over the land need them. The
error is measured ahead, too. Whatever the user does stops the work; a picture that is complete is kept until the land,
its light or the size of the window changes.
"""

from collections.abc import Callable

import moderngl

from ..basics.exceptions import TerrainError
from ..basics.steps import Steps
from ..renderer import Renderer
from ..renderer.frame import DrawnFrame, OtherPicture
from ..shade.targets import Targets
from .canvas import Canvas
from .scene import FrameSpec

Measured = list[dict[str, float]]
After = Callable[[FrameSpec, list[DrawnFrame]], Steps[None]]
# draws all sides of a picture on a canvas, and measures their meshes; the list has earlier ones of these sides
Work = Callable[[FrameSpec, Canvas, list[DrawnFrame]], Steps[tuple[list[DrawnFrame], Measured]]]


class Ahead:
    """One picture at most."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.canvas = Canvas(ctx)
        self.wanted: FrameSpec | None = None  # what to draw ahead
        self.done: FrameSpec | None = None  # what is drawn, and measured
        self.meshes: list[DrawnFrame] = []  # of each side of what is drawn
        self.measured: Measured = []
        self.after: After | None = None  # more work on the picture, when it is measured
        self._steps: Steps[None] | None = None
        self._other: OtherPicture | None = None
        self._refused: FrameSpec | None = None  # what the memory does not suffice for, or what cannot be drawn

    @property
    def is_due(self) -> bool:
        """Whether there is something to draw ahead."""
        return self.wanted is not None and self.wanted not in (self.done, self._refused)

    def want(self, spec: FrameSpec | None, after: After | None = None) -> None:
        """Draw this picture ahead, and then do `after`; None for none."""
        if spec != self.wanted:
            self.interrupt()
            self.wanted = spec
        self.after = after

    def interrupt(self) -> None:
        """Stop: the renderer is needed for the present picture."""
        if self._steps:
            self._steps.close()
            self._steps = None

    def forget(self) -> None:
        """Forget what is drawn: the land or its light has changed."""
        self.interrupt()
        self.wanted = self.done = self._refused = None
        self.meshes = []

    def step(self, renderer: Renderer, work: Work, run: Callable[[Steps[None]], bool]) -> None:
        """Work for a while: `run` takes some steps, and says whether all are taken."""
        assert self.wanted
        if not self._steps:
            if not self._other:
                self._other = OtherPicture(Targets(renderer.ctx, renderer.picture.samples))
            self._other.drawn = self._other.frame = None
            self._steps = self._all_steps(self.wanted, work)
        other = self._other
        assert other
        renderer.exchange(other)
        try:
            if run(self._steps):
                self._steps = None
        except TerrainError:  # the present picture is not to blame
            self._steps, self._refused = None, self.wanted
        finally:
            renderer.exchange(other)

    def _all_steps(self, spec: FrameSpec, work: Work) -> Steps[None]:
        earlier, self.done = self.meshes, None
        meshes, measured = yield from work(spec, self.canvas, earlier)
        if self.after:
            yield from self.after(spec, meshes)
        self.meshes, self.measured, self.done = meshes, measured, spec

    def take(self, renderer: Renderer, canvas: Canvas) -> tuple[list[DrawnFrame], Measured]:
        """Let the picture that was drawn ahead be the last one of the renderer, and of the canvas."""
        assert self._other
        renderer.exchange(self._other)
        canvas.exchange(self.canvas)
        meshes, measured = self.meshes, self.measured
        self.forget()
        return meshes, measured

    def release(self) -> None:
        """Release GPU resources."""
        self.forget()
        self.canvas.release()
        if self._other:
            self._other.targets.release()
            self._other = None
