"""The canvas puts one or two sides together to one picture, which the window then shows."""

from typing import Any

import moderngl

from ..gpu import gl, shaders
from ..gpu.bindings import bind
from ..renderer import Renderer
from .box_sum import BoxSum
from .window_state import Frame, Size


class Canvas:
    """A picture of the size of the window."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._programs: dict[str, tuple[Any, moderngl.VertexArray]] = {}
        self._take_size((1, 1))

    def compose(self, renderer: Renderer, size: Size, left: float = 0.0, right: float = 1.0) -> None:
        """Copy the renderer's last picture, stretched to `size`: the columns from `left` to `right`, 0 to 1."""
        if size != self.size:
            gl.use_default_framebuffer(self.ctx)  # moderngl must not use a framebuffer that is released
            gl.release_with_pixels(self._framebuffer)
            self._take_size(size)
        x0, x1 = round(left * size[0]), round(right * size[0])
        self._framebuffer.viewport = (0, 0, *size)
        self._framebuffer.scissor = (x0, 0, x1 - x0, size[1])
        renderer.picture.show(self._framebuffer)

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
        program, vao = self._program("view/canvas.frag")
        program["u_lens"] = lens or (0.0, 0.0, 0.0, 1.0)
        program["u_divider_px"] = -1.0 if divider is None else divider * self.size[0]
        target.use()
        target.viewport = (0, 0, *self.size)
        self.ctx.enable_only(moderngl.NOTHING)
        bind("view/canvas.frag", u_canvas=self._texture)
        vao.render(vertices=3)

    def show_sums(self, box: BoxSum, target: moderngl.Framebuffer, frame: Frame) -> None:
        """Draw a summed-area table of heights and a box of it into a frame (left, bottom, width, height)."""
        program, vao = self._program("view/sat.frag")
        table = box.table
        program["u_frame_px"] = frame
        program["u_box"] = box.box
        program["u_size"] = table.size
        program["u_first"] = table.first
        program["u_width"] = table.width
        bind("view/sat.frag", Sums=table.buffer)
        target.use()
        target.viewport = frame
        self.ctx.enable_only(moderngl.NOTHING)
        vao.render(vertices=3)
        target.viewport = (0, 0, *self.size)

    def release(self) -> None:
        gl.release_with_pixels(self._framebuffer)
        for program, vao in self._programs.values():
            vao.release()
            program.release()

    def _take_size(self, size: Size) -> None:
        self.size = size
        self._texture = self.ctx.texture(size, 4)
        self._framebuffer = self.ctx.framebuffer([self._texture])

    def _program(self, fragment: str) -> tuple[Any, moderngl.VertexArray]:
        if fragment not in self._programs:
            program = shaders.program(self.ctx, vertex="shade/screen.vert", fragment=fragment)
            self._programs[fragment] = program, self.ctx.vertex_array(program, [])
        return self._programs[fragment]
