"""Every post in the picture: the methods "full" and "truth".

Each patch is a square of at most 32 × 32 cells. The method "full" draws a cell as two triangles. The driver chooses the
cell's diagonal, and near the eye that moves the surface by many pixels. The method "truth" cuts each cell in four; the
middles of its edges and its centre have the means of its posts.

    ┌───────┐      ┌───┬───┐       Posts and edges are the same.
    │     ╱ │      │ ╱ │ ╱ │
    │   ╱   │      ├───┼───┤       The centre lies on the bilinear surface. The largest error is a quarter
    │ ╱     │      │ ╱ │ ╱ │       of that of two triangles.
    └───────┘      └───┴───┘
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from ..camera import Camera
from ..camera.view import ViewBlock
from ..error import ErrorTables
from ..gpu import gl, layout
from ..gpu.buffer_pool import BufferPool
from ..gpu.passes import ComputePass
from .goal import INFINITE_PX, Goal
from .patches import BARRIER, PatchSurface, commands_for, patch_buffers
from .selection import Selection

TRUTH = 2  # segments along a cell's side: then the cell's centre lies on the bilinear surface
_SIDE_LOG2 = 5  # a square has at most 32 cells a side
_GROUP = 64  # threads of a work group of glsl/lod/every_post.comp


class EveryPost(PatchSurface):
    """A `surface.Surface` of all cells in the picture; with `finer` = TRUTH, pictures show each cell cut in four."""

    def __init__(self, tables: ErrorTables, view: ViewBlock, finer: int = 1) -> None:
        ctx = self.ctx = tables.ctx
        self.tables = tables
        self.terrain = tables.terrain
        self.view = view
        self.finer = finer
        self.defines = {"FINER": finer}  # glsl/mesh/patch.tesc: measured and captured, a cell is two triangles
        self._pass = ComputePass(ctx, "lod/every_post.comp", tables.terrain.defines)
        self._corners = ctx.buffer(reserve=8)
        self._found = ctx.buffer(reserve=8)
        self._patches = BufferPool(ctx, layout.PATCH.itemsize)
        self._commands = BufferPool(ctx, gl.COMMAND_STRIDE)

    @property
    def most_vertices(self) -> list[int]:
        """The most vertices of a patch of each size."""
        return [(self.finer * 2**s + 1) ** 2 for s in range(layout.SIZES)]

    @property
    def bytes(self) -> int:
        """GPU memory of the squares, the patches and the draw commands."""
        return self._corners.size + self._found.size + self._patches.made_bytes + self._commands.made_bytes

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose every cell in the picture; without `goal.cull`, of the map. The rest of the goal is not used.

        The bound is that of two triangles against the bilinear surface of a cell. "truth" certifies nothing, because
        errors are measured against its surface.
        """
        settings = Goal(cull=goal.cull).settings
        self.view.write(self.terrain, camera, size, near_m, **settings)
        chosen = np.concatenate(list(self._squares()))
        counts = np.bincount(layout.unpack_patches(chosen).side_log2, minlength=layout.SIZES).tolist()
        commands = np.array(list(commands_for(counts, self.most_vertices)) or [(0,) * 5], "u4")
        buffers = patch_buffers(self._patches.filled(chosen.tobytes()), self._commands.filled(commands.tobytes()))
        triangles = sum(2 * 4**s * n for s, n in enumerate(counts))
        worst_px = float(chosen["bound_px"].max(initial=0.0))
        certified_px = None if self.finer > 1 else worst_px if worst_px < INFINITE_PX else math.inf
        draws = len(commands) if len(chosen) else 0
        numbers = tuple(counts), triangles, self.finer**2 * triangles, 0, certified_px, draws
        return Selection(self, buffers, settings, *numbers)

    def release(self) -> None:
        """Release GPU resources."""
        self._pass.release()
        for resource in (self._corners, self._found, self._patches, self._commands):
            resource.release()

    def _squares(self) -> Iterator[np.ndarray]:
        """The largest squares of cells in the picture, records `layout.PATCH`, small squares first.

        A square that is only partly in the picture or on the map is cut in four.
        """
        heightmap = self.terrain.heightmap
        across, down = (-(-(posts - 1) >> _SIDE_LOG2) for posts in (heightmap.cols, heightmap.rows))
        corners = np.indices((down, across)).reshape(2, -1).T[:, ::-1].astype("i4") << _SIDE_LOG2
        found = []
        for s in range(_SIDE_LOG2, -1, -1):
            cells, bound_px = self._ask(corners, s)
            whole = cells == 4**s
            squares = np.zeros(int(whole.sum()), layout.PATCH)
            squares["corner"] = corners[whole]
            squares["shape"] = layout.shape_word(s, 0, s)
            squares["bound_px"] = bound_px[whole]
            found.append(squares)
            parts = np.array(list(itertools.product((0, 1), repeat=2)), "i4") << max(s - 1, 0)
            corners = (corners[(cells > 0) & ~whole][:, None] + parts).reshape(-1, 2)
        return reversed(found)

    def _ask(self, corners: np.ndarray, side_log2: int) -> tuple[np.ndarray, np.ndarray]:
        """For each square, its cells in the picture, and the largest of their bounds in pixels."""
        if not len(corners):
            return np.zeros(0), np.zeros(0)
        self._corners = gl.at_least(self.ctx, self._corners, corners.nbytes)
        self._found = gl.at_least(self.ctx, self._found, 8 * len(corners))
        self._corners.write(corners.tobytes())
        own = {"Corners": self._corners, "Found": self._found}
        asked = {"squares": len(corners), "side_log2": side_log2}
        tables = {"Counters": self.tables.counters, "Ranges": self.tables.ranges}
        self._pass.run((-(-len(corners) // _GROUP),), {**self.resources, **tables, **own}, asked)
        self.ctx.memory_barrier(BARRIER)
        cells, bound_px = np.frombuffer(self._found.read(8 * len(corners)), "f4").reshape(-1, 2).T
        return cells, bound_px
