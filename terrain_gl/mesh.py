"""The mesh: selected patches through the tessellation stages, into a picture or into a buffer.

A patch is one vertex of two words; the control shader sets its levels, the evaluation shader puts vertices on posts
(glsl/mesh/lattice.glsl).
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from . import gl, shaders
from .exceptions import TerrainError
from .lod import Levels, Selection

PATCH_STAGES: dict[str, Any] = {"vertex": "mesh/patch.vert", "tess_control": "mesh/patch.tesc"}
_VERTEX = np.dtype([("col", "f4"), ("row", "f4"), ("height_m", "f4")])


class PatchDraw:
    """A program over patches, and the vertex array that feeds it.

    Parameters
    ----------
    levels
        Whose patches are drawn.
    stages
        The program's further stages, as `shaders.program` takes them.
    """

    def __init__(self, levels: Levels, **stages: Any) -> None:
        self.ctx, self.levels = levels.ctx, levels
        self.program: Any = shaders.program(levels.ctx, **PATCH_STAGES, **stages)
        self._vao: moderngl.VertexArray | None = None
        self._patches: moderngl.Buffer | None = None

    @property
    def vao(self) -> moderngl.VertexArray:
        """The vertex array over the patches' present buffer."""
        if self._vao is None or self._patches is not self.levels.patches:
            if self._vao:
                self._vao.release()
            self._patches = self.levels.patches
            self._vao = self.ctx.vertex_array(self.program, [(self._patches, "2u4", "in_patch")])
        return self._vao

    def draw(self, selection: Selection) -> None:
        """Draw the selected patches into the framebuffer in use."""
        self._bind()
        if selection.draws:  # the whole map may be out of the picture
            self.vao.render_indirect(self.levels.draws, moderngl.PATCHES, count=selection.draws)

    def capture(self, selection: Selection, vertex_bytes: int) -> bytes:
        """Record the triangles that tessellation makes, three vertices each."""
        if not selection.draws:
            return b""
        self._bind()
        most = sum(n * max(8, 2 * 4**s) for s, n in enumerate(selection.counts))
        out = self.ctx.buffer(reserve=max(1, most) * 3 * vertex_bytes)
        triangles = gl.capture_patches(self.ctx, self.program, self.vao, out, self.levels.draws, count=selection.draws)
        data = out.read(triangles * 3 * vertex_bytes)
        out.release()
        return data

    def release(self) -> None:
        """Give the GPU's memory back."""
        if self._vao:
            self._vao.release()
        self.program.release()

    def _bind(self) -> None:
        self.ctx.patch_vertices = 1
        self.levels.terrain.bind()
        self.levels.view.bind()


def captured_triangles(levels: Levels, selection: Selection) -> np.ndarray:
    """Triangles as drawn, as posts: (n, 3, 2) int32 columns and rows, counter-clockwise seen from above.

    Those of no area, where a fan reaches over the map's edge, are left out.

    Raises
    ------
    TerrainError
        If the GPU drew a vertex at another height than its post's.
    """
    draw = PatchDraw(levels, tess_evaluation="mesh/capture.tese", varyings=("v_vertex",))
    data = draw.capture(selection, _VERTEX.itemsize)
    draw.release()
    vertices = np.frombuffer(data, _VERTEX).reshape(-1, 3)
    posts = np.stack([vertices["col"], vertices["row"]], -1).astype(np.int32)
    heights = levels.terrain.filled[posts[..., 1], posts[..., 0]] - np.float32(levels.terrain.base_m)
    if not np.array_equal(heights, vertices["height_m"]):
        raise TerrainError("the GPU drew vertices beside their posts: this driver's tessellation is not exact")
    a, b, c = (posts[:, i].astype(np.int64) for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return posts[area != 0]
