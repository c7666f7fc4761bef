"""The restricted quadtree: few triangles for a tolerance, chosen by compute shaders.

    refine    split the nodes in the picture that are too coarse, from the root down     (one dispatch for each level)
    balance   split more nodes, until neighbours differ by at most one level             (one dispatch for each level)
    agree     leaves that are still too coarse ask neighbours to cut edges, or ask to be split
    commit    grant all these requests; then balance and agree run again
    tiles     list the tiles of 32 × 32 nodes that contain leaves
    patches   count the patches of each tile; after `place`, write them
    place     find where each tile's patches begin, and write indirect draw commands

With a budget of triangles for the least squares, the price of a triangle decides (glsl/lod/quadtree/summary.glsl):
trees are grown for several prices, until the number of triangles is right.
"""

import math
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..camera.view import ViewBlock
from ..error import ErrorTables
from ..gpu import gl, layout, shaders
from ..gpu.bindings import bind
from . import budget
from .patches import BARRIER, OfPatches
from .selection import METRES, Goal, Selection

_PASSES = ("refine", "balance", "agree", "commit", "tiles", "patches", "place")
_NO_TILES = np.array([0, 0, 1, 0], "u4").tobytes()
_BY_TOLERANCE = -1.0  # a price that decides nothing
_ROW = 1024  # work groups of `commit` along x: OpenGL allows at most 65535 in one dimension
_ROUNDS = 16  # the most prices tried for a budget; usually three to five are enough
_ENOUGH = 0.99  # this share of the budget ends the search
_AIM = 0.995  # the share that the search aims at
_SLOPE = 1.7  # at first: octaves of the price for one octave of triangles
_LARGEST_STEP = 20.0  # octaves
_LEAST_STEP = 0.01
_PATIENCE = 4  # rounds of chords; then every other round bisects: on very rough land, the triangles have jumps
_FREE, _HIGHEST = -60.0, 126.0  # log2 of the price that counts as 0, and of the highest one


class QuadtreeSelector(OfPatches):
    """The passes, and the buffers that they fill: `patches` (records `layout.PATCH`) and `draws`."""

    def __init__(self, tables: ErrorTables, view: ViewBlock | None = None) -> None:
        ctx = self.ctx = tables.ctx
        self.tables = tables
        self.terrain = tables.terrain
        self._kernels: dict[str, Any] = {name: shaders.compute(ctx, f"lod/quadtree/{name}.comp") for name in _PASSES}
        last = self.terrain.levels[-1]
        self._tiles = last.first_tile + 1
        self.view = view or ViewBlock(ctx)
        self._words = last.first_word + last.words
        # bits: split, cut west, cut north; then the same three as requests (glsl/lod/quadtree/tree.glsl)
        self._split = ctx.buffer(np.zeros(6 * self._words, "u4").tobytes())
        self._active = ctx.buffer(reserve=len(_NO_TILES) + 4 * self._tiles)
        self._summary = ctx.buffer(reserve=layout.SUMMARY.itemsize + 4 * layout.SIZES * self._tiles)
        self.patches = ctx.buffer(reserve=layout.PATCH.itemsize * 65536)
        self.draws = ctx.buffer(reserve=gl.COMMAND_STRIDE * 64)

    @property
    def bytes(self) -> int:
        """GPU memory of the tree, the lists and the patches."""
        return sum(buffer.size for buffer in self._buffers)

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
        self.bind()
        self.tables.bind()
        bind("lod/quadtree/patches.comp", Split=self._split, Active=self._active, Summary=self._summary)
        if goal.triangles:
            return self._written(self._search(goal.triangles))
        self._grow_tree(_BY_TOLERANCE)
        if goal.tolerance_px > 0 and goal.metric != "rms":
            self._agree()
        return self._written(self._counted(_BY_TOLERANCE))

    def select_everywhere(self, max_error_m: float) -> Selection:
        """Choose patches over the whole map whose surface is nowhere further than `max_error_m` from the truth.

        There is no camera. The certified error is in metres, too.
        """
        anywhere = Camera.default(self.terrain.heightmap)
        return self.select(anywhere, (1, 1), 1.0, Goal(max_error_m, METRES, cull=False))

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (*self._buffers, *self._kernels.values()):
            resource.release()

    @property
    def _buffers(self) -> tuple[moderngl.Buffer, ...]:
        return self._split, self._active, self._summary, self.patches, self.draws

    def _search(self, triangles: int) -> Selection:
        """Count the mesh of the lowest price with at most so many triangles: false position, with logarithmic axes.

        If one end of the interval stays the same twice, its distance from the aim is halved, so that it moves later
        (the Illinois method: Dowell, Jarratt 1971).
        """
        aim = math.log2(_AIM * triangles)
        too_many: tuple[float, float] | None = None  # log2 of a price, and of its triangles
        fitting: tuple[float, float] | None = None
        did_fit: bool | None = None
        at = min(max(29.0 - _SLOPE * math.log2(triangles), -20.0), 40.0)
        for step in range(_ROUNDS):
            mesh = self._at_price(at)
            tried = at, math.log2(max(mesh.triangles, 1))
            fits = mesh.triangles <= triangles
            if fits:
                fitting = tried
                if did_fit and too_many:
                    too_many = too_many[0], (too_many[1] + aim) / 2
            else:
                too_many = tried
                if did_fit is False and fitting:
                    fitting = fitting[0], (fitting[1] + aim) / 2
            did_fit = fits
            is_sure = fitting is not None and too_many is not None and fitting[0] - too_many[0] < _LEAST_STEP
            if fits and (mesh.triangles >= _ENOUGH * triangles or at <= _FREE or is_sure):
                return mesh
            if is_sure:
                break
            octaves = _SLOPE * 2.0**step  # steps grow while they go in one direction
            if fitting is None:
                at = min(at + min(max(octaves * (tried[1] - aim), 0.5), _LARGEST_STEP), _HIGHEST)
            elif too_many is None:
                at = max(at - min(max(octaves * (aim - tried[1]), 0.5), _LARGEST_STEP), _FREE)
            elif step >= _PATIENCE and step % 2:
                at = (too_many[0] + fitting[0]) / 2
            else:
                share = min(max((too_many[1] - aim) / (too_many[1] - fitting[1]), 0.02), 0.98)
                at = too_many[0] + share * (fitting[0] - too_many[0])
        return self._at_price(fitting[0] if fitting else _HIGHEST)

    def _at_price(self, log2_price: float) -> Selection:
        """Count the mesh for a price of a triangle."""
        price = 2.0**log2_price if log2_price > _FREE else 0.0
        self._grow_tree(price)
        return replace(self._counted(price), price=price)

    def _grow_tree(self, price: float) -> None:
        self._reset(price)
        bind("lod/quadtree/refine.comp", Gains=self.tables.gains)
        self._run_on_levels("refine", range(self.terrain.top_level, 0, -1))
        self._balance()

    def _balance(self) -> None:
        self._run_on_levels("balance", range(1, self.terrain.top_level))

    def _run_on_levels(self, name: str, levels: range) -> None:
        for j in levels:
            self._kernels[name]["u_which_level"] = j
            columns, rows = self.terrain.levels[j].size
            self._run(name, -(-columns // (layout.TILE * layout.GROUP)), rows)

    def _agree(self) -> None:
        """Let leaves over tolerance cut edges or split, until no leaf is over tolerance."""
        while True:
            self._reset(_BY_TOLERANCE)
            self._run_on_tiles("agree")
            self._run("commit", *_commit_groups(self._words))
            if not self._read_summary()["asked"]:
                return
            self._balance()

    def _counted(self, price: float) -> Selection:
        """Count the patches of the tree's leaves, and place them in the list."""
        while True:
            self._reset(price)
            self._kernels["patches"]["u_emits"] = False
            self._run_on_tiles("patches")
            bind("lod/quadtree/place.comp", Draws=self.draws)
            self._kernels["place"]["u_most_draws"] = self.draws.size // gl.COMMAND_STRIDE
            self._run("place", 1)
            selection = self.selection_of(self._read_summary())
            if selection.draws * gl.COMMAND_STRIDE <= self.draws.size:
                return selection
            self.draws = gl.at_least(self.ctx, self.draws, selection.draws * gl.COMMAND_STRIDE)

    def _written(self, selection: Selection) -> Selection:
        """Write the patches that were counted last. A search counts meshes far larger than the one it finds."""
        self.patches = gl.at_least(self.ctx, self.patches, selection.patches * layout.PATCH.itemsize)
        bind("lod/quadtree/patches.comp", Patches=self.patches)
        self._kernels["patches"]["u_emits"] = True
        self._run_on_tiles("patches", is_listed=True)
        return selection

    def _reset(self, price: float) -> None:
        summary = np.zeros((), layout.SUMMARY)
        summary["price"] = price
        self._summary.write(summary)

    def _read_summary(self) -> np.void:
        """A record `layout.SUMMARY`. Reading it waits for the GPU."""
        return np.frombuffer(self._summary.read(layout.SUMMARY.itemsize), layout.SUMMARY)[0]

    def _run(self, name: str, *groups: int) -> None:
        self._kernels[name].run(*groups)
        self.ctx.memory_barrier(BARRIER)

    def _run_on_tiles(self, name: str, is_listed: bool = False) -> None:
        """Run a pass with one work group for each tile that contains leaves."""
        if not is_listed:
            self._active.write(_NO_TILES)
            self._run("tiles", -(-self._tiles // layout.GROUP))
        self._kernels[name].run_indirect(self._active)
        self.ctx.memory_barrier(BARRIER)


def _commit_groups(words: int) -> tuple[int, int]:
    """Work groups for three bits of each node: columns and rows."""
    groups = -(-3 * words // layout.GROUP)
    return min(groups, _ROW), -(-groups // _ROW)
