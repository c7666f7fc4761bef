"""The restricted quadtree: few triangles for a tolerance, chosen by compute shaders.

    refine    split the nodes in the picture that are too coarse, from the root down     (one dispatch for each level)
    balance   split more nodes, until neighbours differ by at most one level             (one dispatch for each level)
    agree     leaves that are still too coarse ask neighbours to cut edges, or ask to be split
    commit    grant all these requests
    again     if anything changed, balance and agree run again
    tiles     list the tiles of 32 × 32 nodes that contain leaves
    patches   count the patches of each tile; after `offsets`, write them
    offsets   prefix sums of the counts: where each tile's patches begin
    draws     write indirect draw commands

With a budget of triangles for the least squares, refine, balance, tiles and patches run for several prices of a
triangle. `search` finds the price that gives the budget's number of triangles (glsl/lod/quadtree/summary.glsl).
"""

import math
from typing import Any

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..camera import Camera
from ..camera.view import ViewBlock
from ..error import ErrorTables
from ..gpu import gl, layout, shaders
from ..gpu.bindings import bind
from . import budget
from .patches import OfPatches
from .selection import INFINITE_PX, METRES, Goal, Selection

ROUNDS = 16  # the most prices tried for a budget; usually three to five are enough
AGREEING = 8  # rounds of `agree` before Python checks whether more are needed; usually three to six are enough
_TRIANGLES, _COUNT, _EMIT = range(3)  # passes of glsl/lod/quadtree/patches.comp
_ASKING = 16  # byte offset of the dispatch size of `agree` in the list of tiles (glsl/lod/quadtree/tiles.glsl)
# the output of the passes is read as storage, as commands, as vertices, and by Python
_BARRIER = (
    moderngl.SHADER_STORAGE_BARRIER_BIT
    | moderngl.COMMAND_BARRIER_BIT
    | moderngl.VERTEX_ATTRIB_ARRAY_BARRIER_BIT
    | moderngl.BUFFER_UPDATE_BARRIER_BIT
)


def _offset(name: str) -> int:
    """Byte offset of a field of the summary. Fields before `price` are reset for every count."""
    fields = layout.SUMMARY.fields
    assert fields
    return int(fields[name][1])


class QuadtreeSelector(OfPatches):
    """The passes, and the buffers that they fill: `patches` (records `layout.PATCH`) and `draws`."""

    def __init__(self, tables: ErrorTables, view: ViewBlock | None = None) -> None:
        ctx = self.ctx = tables.ctx
        self.tables = tables
        self.terrain = tables.terrain
        defines = {"MOST_VERTICES": gl.MOST_VERTICES}
        names = ("refine", "balance", "agree", "commit", "again", "tiles", "patches", "search", "offsets", "draws")
        self._kernels: dict[str, Any] = {
            name: shaders.compute(ctx, f"lod/quadtree/{name}.comp", defines) for name in names
        }
        last = self.terrain.levels[-1]
        self._tiles = last.first_tile + 1
        self.view = view or ViewBlock(ctx)
        self._own_view = view is None
        self._words = last.first_word + last.words
        # bits: split, cut west, cut north; then the same three as requests (glsl/lod/quadtree/tree.glsl)
        self._split = ctx.buffer(np.zeros(6 * self._words, "u4").tobytes())
        self._active = ctx.buffer(reserve=_ASKING + 16 + 4 * self._tiles)
        self._offsets = ctx.buffer(reserve=4 * layout.SIZES * self._tiles)
        self._summary = ctx.buffer(reserve=layout.SUMMARY.itemsize)
        self._nothing = ctx.buffer(np.array([0, 0, 1, 0] * 2 + [0] * 11, "u4").tobytes())
        self.patches = ctx.buffer(reserve=layout.PATCH.itemsize * 65536)
        self.draws = ctx.buffer(reserve=gl.COMMAND_STRIDE * 64)

    @property
    def bytes(self) -> int:
        """GPU memory of the tree, the lists and the patches."""
        buffers = (self._split, self._active, self._offsets, self._summary, self.patches, self.draws)
        return sum(buffer.size for buffer in buffers)

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the patches for a picture of `size` (width, height).

        With a tolerance, the screen error of the surface is at most `goal.tolerance_px`; with the metric "rms", the
        root mean square of that error. With a tolerance of 0, every cell in the picture is drawn at full resolution.

        With a number of triangles, the mesh has at most that many. With the metric "max", it is the mesh of the
        smallest tolerance. With "rms", it minimises the sum of the squared screen errors of all posts in the picture,
        weighted by `reference.post_weights`. Cells close to the eye become fans if that lowers the error between posts
        (`reference.cell_squares`).
        """
        if goal.triangles and goal.metric == "max":
            return budget.smallest_tolerance(goal, lambda each: self.select(camera, size, near_m, each))
        self.view.write(self.terrain, camera, size, near_m, **goal.settings)
        self._bind()
        self._summary.write(np.float32(0 if goal.triangles else -1).tobytes(), offset=_offset("price"))
        self._summary.write(np.uint32(goal.triangles or 0).tobytes(), offset=_offset("budget"))
        if goal.triangles:
            self._search()
        else:
            self._grow_tree()
        if not goal.triangles and goal.tolerance_px > 0 and goal.metric != "rms":
            summary = self._agree()
        else:
            self._list_tiles()
            summary = self._count_patches()
        selection = self._selection(summary)
        self._make_room(selection)
        bind("lod/quadtree/patches.comp", Patches=self.patches)
        self._look_at_tiles(_EMIT)
        bind("lod/quadtree/draws.comp", Draws=self.draws)
        self._run("draws", max(1, -(-selection.draws // layout.GROUP)))
        return selection

    def select_everywhere(self, max_error_m: float) -> Selection:
        """Choose patches over the whole map whose surface is nowhere further than `max_error_m` from the truth.

        There is no camera. The certified error is in metres, too.
        """
        anywhere = Camera.default(self.terrain.heightmap)
        return self.select(anywhere, (1, 1), 1.0, Goal(max_error_m, METRES, cull=False))

    def update(self, posts: Rect) -> None:
        """Follow an edit. There is nothing to do, because every selection reads the error tables again."""

    def release(self) -> None:
        """Release GPU resources."""
        buffers = (self._split, self._active, self._offsets, self._summary, self._nothing, self.patches, self.draws)
        for resource in (*buffers, *self._kernels.values()):
            resource.release()
        if self._own_view:
            self.view.release()

    def _bind(self) -> None:
        self.bind()
        self.tables.bind()
        lists = {"Active": self._active, "Offsets": self._offsets, "Summary": self._summary}
        bind("lod/quadtree/patches.comp", Split=self._split, **lists)
        bind("lod/quadtree/refine.comp", Gains=self.tables.gains)

    def _search(self) -> None:
        """Grow trees for several prices; when the number of triangles is right, the GPU skips the remaining rounds."""
        for step in range(ROUNDS + 1):
            self._kernels["search"]["u_start"] = step == 0
            self._kernels["search"]["u_last"] = step == ROUNDS
            self._run("search", 1)
            self._grow_tree(skipping=True)
            if step < ROUNDS:
                self._list_tiles(skipping=True)
                self._look_at_tiles(_TRIANGLES)

    def _grow_tree(self, skipping: bool = False) -> None:
        self._run_on_levels("refine", range(self.terrain.top_level, 0, -1), skipping)
        self._balance(skipping)

    def _balance(self, skipping: bool = False) -> None:
        self._run_on_levels("balance", range(1, self.terrain.top_level), skipping)

    def _run_on_levels(self, name: str, levels: range, skipping: bool) -> None:
        for j in levels:
            self._kernels[name]["u_which_level"] = j
            if skipping:
                self._run_as_told(name, "groups", j)
            else:
                columns, rows = self.terrain.levels[j].size
                self._run(name, -(-columns // (layout.TILE * layout.GROUP)), rows)

    def _agree(self) -> np.void:
        """Let leaves over tolerance cut edges or split. When no leaf is over tolerance, the GPU skips further rounds.

        Returns the summary of the mesh. The tiles of the last round are those of the mesh: no new list is needed.
        """
        self._ask_again(start=True)
        while True:
            for _ in range(AGREEING):
                self._run_as_told("tiles", "groups")
                self._run_on_tiles("agree", _ASKING)
                self._run_as_told("commit", "groups_of_words")
                self._ask_again()
                self._balance(skipping=True)
            summary = self._count_patches()
            if summary["groups"][0, 0] == 0:
                return summary

    def _ask_again(self, start: bool = False) -> None:
        self._kernels["again"]["u_start"] = start
        self._run("again", 1)

    def _list_tiles(self, skipping: bool = False) -> None:
        self.ctx.copy_buffer(self._active, self._nothing, 32)
        if skipping:
            self._run_as_told("tiles", "groups")
        else:
            self._run("tiles", -(-self._tiles // layout.GROUP))

    def _count_patches(self) -> np.void:
        """Count the patches of the listed tiles; returns a `layout.SUMMARY`, the only data that a frame waits for."""
        self._look_at_tiles(_COUNT)
        self._run("offsets", 1)
        return np.frombuffer(self._summary.read(layout.SUMMARY.itemsize), layout.SUMMARY)[0]

    def _look_at_tiles(self, what: int) -> None:
        if what != _EMIT:
            self.ctx.copy_buffer(self._summary, self._nothing, _offset("price"), read_offset=32)
        self._kernels["patches"]["u_pass"] = what
        self._run_on_tiles("patches")

    def _selection(self, summary: np.void) -> Selection:
        counts = tuple(int(n) for n in summary["count"][: layout.SIZES])
        draws = sum(-(-n // (gl.MOST_VERTICES // (2**s + 1) ** 2)) for s, n in enumerate(counts))
        triangles = int(summary["triangles"])
        splits = int(summary["splits"])
        most = sum(n * max(8, 2 * 4**s) for s, n in enumerate(counts))
        price = float(summary["price"]) if summary["budget"] else None
        worst_px = float(summary["worst_px"])
        certified_px = worst_px if worst_px < INFINITE_PX else math.inf
        return Selection(self, counts, triangles, most, splits, certified_px, draws, price)

    def _make_room(self, selection: Selection) -> None:
        self.patches = gl.at_least(self.ctx, self.patches, selection.patches * layout.PATCH.itemsize)
        self.draws = gl.at_least(self.ctx, self.draws, selection.draws * gl.COMMAND_STRIDE)

    def _run(self, name: str, *groups: int) -> None:
        self._kernels[name].run(*groups)
        self.ctx.memory_barrier(_BARRIER)

    def _run_as_told(self, name: str, groups: str, i: int = 0) -> None:
        """Run a pass with as many groups as the summary says: 0 if the loop of the pass has ended."""
        self._kernels[name].run_indirect(self._summary, _offset(groups) + 16 * i)
        self.ctx.memory_barrier(_BARRIER)

    def _run_on_tiles(self, name: str, offset: int = 0) -> None:
        self._kernels[name].run_indirect(self._active, offset)
        self.ctx.memory_barrier(_BARRIER)
