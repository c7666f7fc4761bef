"""The canvas puts one or two sides together to one picture, which the window then shows."""

import moderngl

from ..gpu import gl
from ..gpu.passes import DrawPass, State
from ..renderer import Renderer
from .box_sum import BoxSum
from .window_state import Frame, Size


class Canvas:
    """A picture of the size of the window."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._passes: dict[str, DrawPass] = {}
        self._take_size((1, 1))

    def compose(self, renderer: Renderer, size: Size, left: float = 0.0, right: float = 1.0) -> None:
        """Copy the renderer's last picture, stretched to `size`: the columns from `left` to `right`, 0 to 1."""
        if size != self.size:
            gl.release_with_pixels(self._framebuffer)
            self._take_size(size)
        x0, x1 = round(left * size[0]), round(right * size[0])
        renderer.picture.show(self._framebuffer, scissor=(x0, 0, x1 - x0, size[1]))

    def show(
        self,
        target: moderngl.Framebuffer,
        lens: tuple[float, float, float, float] | None = None,
        divider: float | None = None,
    ) -> None:
        """Copy the canvas to a framebuffer.

        `lens` is a magnifying glass: x and y of its middle from the lower left, radius in pixels, magnification. At
        `divider`, 0 to 1, the two sides of a split picture meet.
        """
        divider_px = -1.0 if divider is None else divider * self.size[0]
        uniforms = {"lens": lens or (0.0, 0.0, 0.0, 1.0), "divider_px": divider_px}
        state = State(target, (0, 0, *self.size))
        self._pass("view/canvas.frag").draw(state, {"u_canvas": self._texture}, uniforms)

    def show_sums(self, box: BoxSum, target: moderngl.Framebuffer, frame: Frame) -> None:
        """Draw a summed-area table of heights and a box of it into a frame (left, bottom, width, height)."""
        table = box.table
        where = {"frame_px": frame, "box": box.box, "size": table.size, "first": table.first, "width": table.width}
        self._pass("view/sat.frag").draw(State(target, frame), {"Sums": table.buffer}, where)

    def release(self) -> None:
        gl.release_with_pixels(self._framebuffer)
        for each in self._passes.values():
            each.release()

    def _take_size(self, size: Size) -> None:
        self.size = size
        self._texture = self.ctx.texture(size, 4)
        self._framebuffer = self.ctx.framebuffer([self._texture])

    def _pass(self, fragment: str) -> DrawPass:
        if fragment not in self._passes:
            self._passes[fragment] = DrawPass(self.ctx, {"vertex": "shade/screen.vert", "fragment": fragment})
        return self._passes[fragment]
