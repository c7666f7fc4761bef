"""The canvas holds the picture of each side, and puts them together in the window."""

import moderngl
import numpy as np

from ..gpu import gl
from ..gpu.passes import DrawPass, State
from ..renderer import Renderer
from .box_sum import BoxSum
from .split import WHOLE, Split
from .window_state import Frame, Size


class Canvas:
    """The pictures of all sides, in the size of the window."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.size: Size = (1, 1)
        self._passes: dict[str, DrawPass] = {}
        self._pictures: dict[int, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}  # by side

    def take(self, renderer: Renderer, size: Size, side: int = 0) -> None:
        """Keep the renderer's last picture, stretched to `size`, as that of a side."""
        if size != self.size:
            self.keep(0)
            self.size = size
        if side not in self._pictures:
            texture = self.ctx.texture(size, 4)
            self._pictures[side] = texture, self.ctx.framebuffer([texture])
        renderer.picture.show(self._pictures[side][1])

    def keep(self, sides: int) -> None:
        """Forget the pictures of other sides than the first ones."""
        for side in [each for each in self._pictures if each >= sides]:
            gl.release_with_pixels(self._pictures.pop(side)[1])

    def exchange(self, other: "Canvas") -> None:
        """Show the pictures of another canvas, which gets ours."""
        self.size, other.size = other.size, self.size
        self._pictures, other._pictures = other._pictures, self._pictures

    def pixels(self, side: int) -> np.ndarray:
        """(height, width, 3): the picture of a side, the top row first."""
        width, height = self.size
        pixels = np.frombuffer(self._pictures[side][0].read(), np.uint8)
        return pixels.reshape(height, width, 4)[::-1, :, :3].astype(int)

    def show(
        self,
        target: moderngl.Framebuffer,
        split: Split = WHOLE,
        lens: tuple[float, float, float, float] | None = None,
    ) -> None:
        """Put the sides together in a framebuffer.

        A side without a picture of its own shows that of another side. `lens` is a magnifying glass: x and y of its
        middle from the lower left, radius in pixels, magnification.
        """
        any_picture = next(iter(self._pictures.values()))
        pictures = [self._pictures.get(side, any_picture)[0] for side in range(split.sides)]
        shifts = [part.shift for part in split.parts(self.size[0])]
        order = sorted(range(split.sides), key=split.is_right)
        left, right = order[0], order[-1]
        uniforms = {
            "lens": lens or (0.0, 0.0, 0.0, 1.0),
            "divider_px": split.divider * self.size[0] if split.sides > 1 else -1.0,
            "shift": (shifts[left], shifts[right]),
        }
        state = State(target, (0, 0, *self.size))
        read = {"u_left": pictures[left], "u_right": pictures[right]}
        self._pass("view/canvas.frag").draw(state, read, uniforms)

    def show_sums(self, box: BoxSum, target: moderngl.Framebuffer, frame: Frame) -> None:
        """Draw a summed-area table of heights and a box of it into a frame (left, bottom, width, height)."""
        table = box.table
        where = {"frame_px": frame, "box": box.box, "size": table.size, "first": table.first, "width": table.width}
        self._pass("view/sat.frag").draw(State(target, frame), {"Sums": table.buffer}, where)

    def release(self) -> None:
        self.keep(0)
        for each in self._passes.values():
            each.release()

    def _pass(self, fragment: str) -> DrawPass:
        if fragment not in self._passes:
            self._passes[fragment] = DrawPass(self.ctx, {"vertex": "shade/screen.vert", "fragment": fragment})
        return self._passes[fragment]
