"""Draws Dear ImGui's triangles with moderngl into any framebuffer.

Each frame, ImGui gives lists of triangles, and a list of textures to create, update or destroy. This is the
protocol "renderer has textures" of ImGui 1.92: a glyph is drawn into a texture when it is first needed.
"""

import ctypes
from typing import Any

import moderngl
import numpy as np

from ..gpu.passes import DrawPass, Feed, State
from ..gpu.session import Resource


class GuiDraw:
    """Draws the frames of ImGui's current context; `imgui` is its module."""

    def __init__(self, ctx: moderngl.Context, imgui: Any) -> None:
        self.ctx = ctx
        self.imgui = imgui
        self._pass = DrawPass(ctx, {"vertex": "view/gui.vert", "fragment": "view/gui.frag"})
        self._textures: dict[int, moderngl.Texture] = {}
        self._vertices, self._indices = (ctx.buffer(reserve=1, dynamic=True) for _ in range(2))
        content = [(self._vertices, "2f4 2f4 4f1", "in_at_px", "in_texel", "in_color")]
        self._feed = Feed(content, self._indices, imgui.INDEX_SIZE)
        imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures

    def draw(self, framebuffer: moderngl.Framebuffer, size: tuple[int, int], data: Any) -> None:
        """Draw a frame over the picture in a framebuffer of `size` (width, height)."""
        for texture in self.imgui.get_platform_io().textures:
            self._follow(texture)
        for triangles in data.cmd_lists:
            _upload(self._vertices, triangles.vtx_buffer, self.imgui.VERTEX_SIZE)
            _upload(self._indices, triangles.idx_buffer, self.imgui.INDEX_SIZE)
            for command in triangles.cmd_buffer:
                left, top, right, bottom = (max(round(side), 0) for side in command.clip_rect)
                if right > left and bottom > top:
                    scissor = left, size[1] - bottom, right - left, bottom - top
                    state = State(framebuffer, (0, 0, *size), scissor, blends=True)
                    read = {"u_texture": self._textures[command.tex_ref.get_tex_id()]}
                    part = {"vertices": command.elem_count, "first": command.idx_offset}
                    self._pass.draw(state, read, {"size_px": size}, self._feed, **part)

    def release(self) -> None:
        made: list[Resource] = [*self._textures.values(), self._vertices, self._indices, self._pass]
        for resource in made:
            resource.release()

    def _follow(self, texture: Any) -> None:
        """Create, update or destroy a texture as ImGui asks."""
        status = self.imgui.ImTextureStatus
        if texture.status == status.want_create:
            made = self.ctx.texture((texture.width, texture.height), 4, _pixels(texture))
            self._textures[made.glo] = made
            texture.set_tex_id(made.glo)
            texture.set_status(status.ok)
        elif texture.status == status.want_updates:
            self._textures[texture.get_tex_id()].write(_pixels(texture))
            texture.set_status(status.ok)
        elif texture.status == status.want_destroy:
            self._textures.pop(texture.get_tex_id()).release()
            texture.set_tex_id(0)
            texture.set_status(status.destroyed)


def _upload(buffer: moderngl.Buffer, vector: Any, itemsize: int) -> None:
    """Write one of ImGui's own vectors to a buffer, in new memory: the GPU may still read the last frame's."""
    data = ctypes.string_at(vector.data_address(), vector.size() * itemsize)
    buffer.orphan(len(data))
    buffer.write(data)


def _pixels(texture: Any) -> bytes:
    return np.ascontiguousarray(texture.get_pixels_array()).tobytes()
