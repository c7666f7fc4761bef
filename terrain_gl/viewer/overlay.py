"""Text over the picture: panels and glyphs in one instanced draw, in any framebuffer."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from .. import shaders
from . import font

RECT = np.dtype([("box", "4i4"), ("glyph", "i4"), ("color", "4u1")])  # glsl/view/overlay.vert
MOST = 4096  # glyphs and panels at a time
LEADING = 21  # units from line to line
PADDING = 12  # units between a panel's edge and its text
BRIGHT, SOFT, ACCENT = (255, 255, 255, 240), (255, 255, 255, 150), (255, 205, 120, 255)
_PANEL = (10, 14, 20, 175)
Color = tuple[int, int, int, int]


class Text(NamedTuple):
    """A run of text in one colour."""

    text: str
    color: Color = BRIGHT


class Panel(NamedTuple):
    """Lines of text on a panel; `anchor` says where it stands: 0 to 1 from left to right and from top to bottom."""

    lines: list[list[Text]]
    anchor: tuple[float, float] = (0.0, 0.0)


class Overlay:
    """Draws panels; allocates nothing on the GPU after its beginning, but for a change of scale."""

    def __init__(self, ctx: moderngl.Context, scale: int = 1) -> None:
        self.ctx = ctx
        self._program: Any = shaders.program(ctx, vertex="view/overlay.vert", fragment="view/overlay.frag")
        self._rects = ctx.buffer(reserve=MOST * RECT.itemsize, dynamic=True)
        content = [(self._rects, "4i4 1i4 4f1 /i", "in_box", "in_glyph", "in_color")]
        self._vao = ctx.vertex_array(self._program, content)
        self._atlas: moderngl.Texture | None = None
        self.scale = scale

    @property
    def scale(self) -> int:
        """Pixels per unit of the typeface."""
        return self._scale

    @scale.setter
    def scale(self, scale: int) -> None:
        self._scale = max(1, scale)
        pixels = font.atlas(self._scale)
        if self._atlas:
            self._atlas.release()
        self._atlas = self.ctx.texture(pixels.shape[::-1], 1, pixels.tobytes(), alignment=1)

    def room(self, size: tuple[int, int]) -> tuple[int, int]:
        """Characters a line, and lines, of the largest panel in a picture of `size`."""
        width, height = (side / self._scale - 4 * PADDING for side in size)  # within the panel's edges, and around it
        return int(width // font.WIDTH), int((height + LEADING - font.HEIGHT) // LEADING)

    def draw(self, framebuffer: moderngl.Framebuffer, size: tuple[int, int], panels: list[Panel]) -> None:
        """Draw panels over what is in the framebuffer of `size` (width, height)."""
        parts = [_lay_out(panel, size, self._scale) for panel in panels]
        rects = np.concatenate(parts or [np.zeros(0, RECT)])[:MOST]
        if not len(rects):
            return
        self._rects.write(rects.tobytes())
        framebuffer.use()
        framebuffer.viewport = (0, 0, *size)
        self._program["u_size_px"], self._program["u_radius_px"] = size, 8.0 * self._scale
        assert self._atlas
        self._atlas.use(0)
        self.ctx.enable_only(moderngl.BLEND)
        self.ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        self._vao.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(rects))
        self.ctx.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        """Give the GPU's memory back."""
        assert self._atlas
        for resource in (self._atlas, self._vao, self._rects, self._program):
            resource.release()


def _lay_out(panel: Panel, size: tuple[int, int], scale: int) -> np.ndarray:
    """Records `RECT` of a panel: the panel itself, then glyph by glyph."""
    across, down = font.WIDTH * scale, LEADING * scale
    columns = max(sum(len(run.text) for run in line) for line in panel.lines)
    width = columns * across + 2 * PADDING * scale
    height = len(panel.lines) * down + (2 * PADDING - LEADING + font.HEIGHT) * scale
    margin = PADDING * scale
    left = round(margin + panel.anchor[0] * (size[0] - width - 2 * margin))
    top = round(margin + panel.anchor[1] * (size[1] - height - 2 * margin))
    rects: list[Any] = [((left, top, width, height), -1, _PANEL)]
    for row, line in enumerate(panel.lines):
        x, y = left + PADDING * scale, top + PADDING * scale + row * down
        for run in line:
            for glyph in font.indices(run.text):
                rects.append(((x, y, across, font.HEIGHT * scale), glyph, run.color))
                x += across
    return np.array(rects, RECT)
