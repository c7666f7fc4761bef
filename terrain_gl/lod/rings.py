"""Level of detail by summed-area tables: a clipmap around the eye. The tables give the spacing of each patch.

    cull     list the blocks that are in the picture                          glsl/lod/rings/cull.comp
    decide   cut each block into squares, look up their spacing               glsl/lod/rings/decide.comp, three rounds
    spawn    make blocks of units that need 8 segments a side or more         after the first and the second round
    horizon  find the horizon around the eye                                  glsl/lod/rings/horizon.comp
    agree    neighbours agree on edges; split leaves with more than 64        two rounds, or four, ...
    count    leave out hidden leaves, compute the bounds of the others        glsl/lod/rings/hidden.glsl
    place    compute prefix sums, and write draw commands
    emit     write the patches

A frame takes twelve dispatches; further rounds of `agree` add more. Only blocks of the rings are visited, never the
whole map.
Specification: `reference.rings`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..camera.view import ViewBlock
from ..error import ErrorTables
from ..gpu import gl, layout
from ..gpu.buffer_pool import BufferPool
from ..gpu.passes import NOTHING_MORE, ComputePass, Resources
from . import budget
from .goal import METRES, Goal
from .hiding import FARTHEST, NO_HIDING, Hiding, hiding, horizon_texture, slopes_of
from .patches import BARRIER, PatchSurface, patch_buffers
from .ring_layout import BLOCK_SIDE, BLOCKS_ACROSS, Ring, across_for, ring_over, rings_around, rings_in_picture
from .selection import Selection
from .surface import MeshBuffers

AGREEING = 2  # rounds of `agree` that run at once; only then Python checks whether leaves are still queued
ROUNDS = 3  # rounds of `decide`: in each, the blocks have units an eighth as large
PRICED = ("budget", "mean")  # a price decides, not a tolerance
SQUARES = 85  # squares of a block: glsl/lod/rings/rings.glsl
_UNITS = BLOCK_SIDE * BLOCK_SIDE
_VARIANTS: dict[str, dict[str, dict[str, object]]] = {  # defines of passes that differ between metrics and budgets
    "count": {"mean": {"MEAN": 1}},
    "decide": {"search": {"PATCH_COST": budget.PATCH_COST}},
    "weigh": {"mean": {"MEAN": 1, "FARTHEST": FARTHEST["rms"]}},
    "spend": dict.fromkeys(("budget", "mean"), {"PATCH_COST": budget.PATCH_COST}),
}


class RingsSelector(PatchSurface):
    """The passes, and the buffers in which they work. Each mesh has patches and draw commands of its own."""

    cuts_edges = True

    def __init__(self, tables: ErrorTables, view: ViewBlock | None = None) -> None:
        ctx = self.ctx = tables.ctx
        self.tables = tables
        self.terrain = tables.terrain
        self.view = view or ViewBlock(ctx)
        self._kernels: dict[tuple[str, str, bool], ComputePass] = {}
        self._variant = "max"
        self._last_stamp = 0
        # a software renderer runs eight threads at a time, and more threads cost more to start
        self._threads = 8 if gl.wants_few_groups(ctx) else 64
        self._squares_px2 = ctx.buffer(reserve=4)
        self._rings = ctx.buffer(reserve=layout.RINGS.itemsize)
        self._defines = {"THREADS": self._threads}
        self._horizon = horizon_texture(ctx, self.terrain.heightmap)
        self._hiding = NO_HIDING
        self._settings: dict[str, Any] = {}
        self._patches = BufferPool(ctx, layout.PATCH.itemsize * 16384)
        self._commands = BufferPool(ctx, gl.COMMAND_STRIDE * 256)
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._reserve(blocks=1024)

    @property
    def bytes(self) -> int:
        """GPU memory of the blocks, the patches and the draw commands."""
        meshes = self._patches.made_bytes + self._commands.made_bytes
        own = sum(buffer.size for buffer in self._buffers.values())
        return 4 * self._horizon.width * self._horizon.height + own + meshes

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the patches for a picture of `size` (width, height).

        With a tolerance, the screen error of the surface is at most `goal.tolerance_px`; with the metric "rms", the
        root mean square of that error over the drawn land in the picture. With a number of triangles, the mesh has at
        most this number. With the metric "max", a search finds the smallest tolerance whose mesh is that small. With
        "rms", the mesh minimises the sum of squared screen errors, weighted by `reference.post_weights`.
        """
        if goal.triangles and goal.metric == "max":
            return budget.smallest_tolerance(
                goal, lambda each: self._choose(camera, size, near_m, each, goal.triangles)
            )
        return self._choose(camera, size, near_m, goal)

    def _choose(
        self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal, searched: int | None = None
    ) -> Selection:
        """Choose patches for a tolerance, a mean, or a budget of least squares.

        `searched` is a budget of triangles, set while the search tries tolerances; patches then cost less.
        """
        self._settings = goal.settings
        self.view.write(self.terrain, camera, size, near_m, **self._settings)
        triangles = goal.triangles
        self._hiding = hiding(self.terrain, self.view, camera, size, goal)
        view = self.terrain.heightmap, camera, size, near_m

        def rings_for(across: int = BLOCKS_ACROSS, left_out: int = 0) -> list[Ring]:
            rings = self._rings_of(camera, across, left_out)
            return rings_in_picture(rings, *view) if goal.cull else rings

        has_mean = goal.metric == "rms" and not triangles and goal.tolerance_px > 0
        if has_mean and (mesh := self._within_mean(rings_for(), goal)):
            return mesh
        if not triangles:
            self._variant = "search" if searched else "max"
            return self._within_tolerance(rings_for(across_for(searched)) if searched else rings_for())
        self._variant = "budget"
        for left_out in range(self.terrain.coarsest_ring):  # all rings together may need more triangles than allowed
            selection = self._spend(rings_for(across_for(triangles), left_out), triangles)
            if selection.triangles <= triangles:
                break
        return selection

    def select_everywhere(self, max_error_m: float) -> Selection:
        """Choose patches over the whole map whose surface is nowhere further than `max_error_m` from the truth.

        There is no camera. The certified error is in metres, too.
        """
        heightmap = self.terrain.heightmap
        goal = Goal(max_error_m, METRES, cull=False)
        self._settings = goal.settings
        self.view.write(self.terrain, Camera.default(heightmap), (1, 1), 1.0, **self._settings)
        self._variant = METRES
        self._hiding = NO_HIDING
        last_post = heightmap.cols - 1, heightmap.rows - 1
        return self._within_tolerance(ring_over(last_post, heightmap.spacing_m, self.terrain.coarsest_ring))

    def _within_tolerance(self, rings: list[Ring]) -> Selection:
        """Choose patches for the tolerance."""

        def decide() -> None:
            for r in range(ROUNDS):
                self._run("decide", _work("round", r) if r else _work("seen"), round=r)
                if r + 1 < ROUNDS:
                    self._run("spawn", round=r)

        return self._made(rings, decide)[0]

    def _spend(self, rings: list[Ring], triangles: int) -> Selection:
        """Choose patches for a budget of least squares."""

        def mesh_at(log2_price: float) -> Selection:
            return self._at_price(rings, 2.0**log2_price)[0]

        self._weigh(rings)
        return budget.smallest(triangles, mesh_at, lambda mesh: mesh.triangles, budget.PRICE, 0.0)

    def _within_mean(self, rings: list[Ring], goal: Goal) -> Selection | None:
        """Choose patches for a mean over the picture. None if the tables prove none; then each patch must keep it."""
        hiding = self._hiding
        tolerance_px = float(goal.settings["tolerance_px"])

        def mesh_at(x: float) -> Selection:
            self._hiding = hiding  # the mesh tried before may have had to show hidden land
            mesh, summary = self._at_price(rings, tolerance_px**2 * 2.0**-x)
            return replace(
                mesh, certified_px=tolerance_px * _mean_in_tolerances(summary), farthest_px=mesh.certified_px
            )

        self._variant = "mean"
        self._weigh(rings)
        mesh = budget.smallest(tolerance_px, mesh_at, _certified_px, budget.MEAN, budget.FIRST_MEAN)
        self._hiding = hiding
        return mesh if _certified_px(mesh) <= tolerance_px else None

    def _weigh(self, rings: list[Ring]) -> None:
        """Compute the squared error of every square: it does not depend on the price."""
        blocks = self._begin(rings)
        self._squares_px2 = gl.at_least(self.ctx, self._squares_px2, 4 * SQUARES * layout.SIZES * blocks)
        self._run("weigh", _work("seen"))

    def _at_price(self, rings: list[Ring], price: float) -> tuple[Selection, np.void]:
        """The mesh for a price of a triangle, and its record `layout.RING_SUMMARY`."""

        mesh, summary = self._made(rings, lambda: self._run("spend", _work("seen"), price=price))
        return replace(mesh, price=price if price > 2.0**budget.PRICE.lowest else 0.0), summary

    def _made(self, rings: list[Ring], decide: Callable[[], None]) -> tuple[Selection, np.void]:
        """The mesh of the squares that `decide` chooses, and its record; made again if the buffers were too small."""
        needed = 0, 0
        while True:
            self._begin(rings)
            decide()
            buffers = patch_buffers(self._patches.own(needed[0]), self._commands.own(needed[1]))
            summary = self._finish(buffers)
            mesh = self.selection_of(summary, buffers, self._settings)
            mesh = replace(mesh, hidden=int(summary["hidden"]), hiding=self._hiding)
            needed = layout.PATCH.itemsize * (mesh.patches + mesh.hidden), gl.COMMAND_STRIDE * mesh.draws
            fits = needed[0] <= buffers.patches.size and needed[1] <= buffers.commands.size
            if self._has_room(int(summary["blocks"])) and fits:
                return mesh, summary

    def horizon_of(self, mesh: Selection) -> np.ndarray:
        """Slopes of the horizon by which a mesh hides land, (sectors, shells) float32. The view must be the mesh's."""
        self._find_horizon(mesh.hiding)
        return slopes_of(self._horizon)[:, : mesh.hiding.uniforms["shells"]]

    def release(self) -> None:
        """Release GPU resources."""
        self._horizon.release()
        own: tuple[Any, ...] = self._rings, self._squares_px2, self._patches, self._commands
        for resource in (*own, *self._buffers.values(), *self._kernels.values()):
            resource.release()

    def _rings_of(self, camera: Camera, across: int, left_out: int = 0) -> list[Ring]:
        heightmap = self.terrain.heightmap
        east, north = heightmap.spacing_m
        last = heightmap.cols - 1, heightmap.rows - 1
        x, y = camera.eye[:2]
        if camera.is_orthographic:
            x, y = _ground_ahead(camera, heightmap.extent_m, heightmap.range_m)
        post = x / east, last[1] - y / north
        nearest = [min(max(at, 0.0), float(end)) for at, end in zip(post, last, strict=True)]
        ground_m = float(self.terrain.filled[round(nearest[1]), round(nearest[0])])
        beside_m = math.hypot((post[0] - nearest[0]) * east, (post[1] - nearest[1]) * north)
        away_m = max(beside_m, abs(camera.eye[2] - ground_m))
        if camera.lens and camera.is_orthographic:  # the finest ring is about as wide as the picture
            away_m = camera.lens.half[1]
        return rings_around(post, away_m, last, (east, north), self.terrain.coarsest_ring, across, left_out)

    def _begin(self, rings: list[Ring]) -> int:
        """Upload the rings, and list their blocks that are in the picture; returns the number of all blocks."""
        blocks = 0
        records = []
        for level, origin, across in rings:
            records.append((origin, across, level, blocks, (0, 0)))
            blocks += across[0] * across[1]
        self._has_room(blocks)
        block = np.zeros((), layout.RINGS)
        work = _NO_WORK.copy()
        block["ring"][: len(rings)] = records
        block["rings"] = len(rings)
        block["most_blocks"] = self._most_blocks
        block["first_stamp"] = self._last_stamp + 1
        work["round"]["groups"][0] = work["all"]["count"] = blocks
        self._rings.write(block)
        self._buffers["blocks"].write(work)
        self._run("cull", groups=-(-blocks // self._threads))
        return blocks

    def _find_horizon(self, hiding: Hiding) -> None:
        if hiding.sectors:
            self._run("horizon", groups=-(-hiding.sectors // self._threads), **hiding.uniforms)

    def _finish(self, mesh: MeshBuffers) -> np.void:
        """Let neighbours agree on their edges, and turn leaves into patches in the buffers of the mesh.

        Returns a record `layout.RING_SUMMARY`. Reading it is the only time that a frame waits for the GPU.
        """
        self._find_horizon(self._hiding)
        drawn = {"Patches": mesh.patches, "Draws": mesh.commands}
        most_draws = mesh.commands.size // gl.COMMAND_STRIDE
        most_patches = mesh.patches.size // layout.PATCH.itemsize
        agreed = 0
        has_agreed = False
        while True:
            if not has_agreed:
                agreed = self._agree(agreed)
            self._buffers["summary"].write(self._nothing)
            self._run("count", _work("leaves"), agreed=agreed, **self._hiding.uniforms)
            self._run("place", into=drawn, agreed=agreed, most_draws=most_draws)
            self._run("emit", _work("all"), into=drawn, agreed=agreed, most_patches=most_patches)
            data = self._buffers["summary"].read(layout.RING_SUMMARY.itemsize)
            summary = np.frombuffer(data, layout.RING_SUMMARY)[0]
            has_agreed = not summary["unagreed"]
            if float(summary["worst_px"]) > self._hiding.farthest_px > 0:
                self._hiding = NO_HIDING  # the horizon is only right for smaller errors: run again without it
            elif has_agreed:
                self._last_stamp = self._last_stamp + agreed
                return summary

    def _agree(self, agreed: int) -> int:
        """Run further rounds of `agree` after the first `agreed`; returns how many are done."""
        if agreed:
            for r in range(agreed - AGREEING, agreed):  # later rounds use the queues of past rounds again
                self._buffers["blocks"].write(_EMPTY, offset=_work("queue", r % layout.RING_QUEUES))
        for r in range(agreed, agreed + AGREEING):
            self._run("agree", _work("queue", r % layout.RING_QUEUES), agreed=r, priced=self._variant in PRICED)
        return agreed + AGREEING

    @property
    def of_passes(self) -> Resources:
        """Everything that the passes read and write, by its name in glsl/lod/rings/."""
        own = {name.capitalize(): buffer for name, buffer in self._buffers.items()}
        horizon = {"u_horizon": self._horizon, "u_out": self._horizon}
        return {
            **self.resources,
            **self.tables.resources,
            **own,
            **horizon,
            "Rings": self._rings,
            "SquaresPx2": self._squares_px2,
        }

    def _kernel(self, name: str) -> ComputePass:
        """The pass `name`, compiled at its first use. Passes that read errors have one for each metric."""
        variant = self._variant if self._variant in _VARIANTS.get(name, {}) else ""
        key = name, variant, self.terrain.heightmap.voids > 0
        if key not in self._kernels:
            defines = self._defines | _VARIANTS.get(name, {}).get(variant, {}) | ({} if key[2] else {"NO_VOIDS": 1})
            self._kernels[key] = ComputePass(self.ctx, f"lod/rings/{name}.comp", {**self.terrain.defines, **defines})
        return self._kernels[key]

    def _run(
        self, name: str, indirect: int | None = None, groups: int = 1, into: Resources = NOTHING_MORE, **uniforms: Any
    ) -> None:
        kernel = self._kernel(name)
        offered = {**self.of_passes, **into}
        resources = {each: offered[each] for each in kernel.uses if each in offered}
        if indirect is None:
            kernel.run((groups, 1, 1), resources, uniforms)
        else:
            kernel.run_indirect(self._buffers["blocks"], resources, uniforms, indirect)
        self.ctx.memory_barrier(BARRIER)

    def _has_room(self, blocks: int) -> bool:
        """Whether so many blocks fit into the buffers; if not, make the buffers larger."""
        if blocks <= self._most_blocks:
            return True
        self._reserve(blocks + blocks // 2)
        return False

    def _reserve(self, blocks: int) -> None:
        sizes = {
            "blocks": layout.RING_WORK.itemsize + layout.RING_BLOCK.itemsize * blocks,
            "units": 2 * 4 * _UNITS * blocks,
            "lists": layout.LISTED.itemsize * _UNITS * blocks,
            "shapes": 8 * _UNITS * blocks,
            "summary": layout.RING_SUMMARY.itemsize + 4 * layout.SIZES * blocks,
        }
        for name, size in sizes.items():
            if name in self._buffers:
                self._buffers[name].release()
            self._buffers[name] = self.ctx.buffer(reserve=size)
        self._buffers["lists"].write(bytes(sizes["lists"]))  # no stamps yet
        self._nothing = bytes(sizes["summary"])
        self._most_blocks = blocks


def _ground_ahead(camera: Camera, extent_m: tuple[float, float], range_m: tuple[float, float]) -> tuple[float, float]:
    """Roughly the place in the middle of the picture; the map's middle if the view is about level."""
    x, y, down = camera.axes[2]
    if abs(down) < 0.01:
        return 0.5 * extent_m[0], 0.5 * extent_m[1]
    away_m = (0.5 * sum(range_m) - camera.eye[2]) / down
    return camera.eye[0] + away_m * x, camera.eye[1] + away_m * y


def _certified_px(mesh: Selection) -> float:
    return math.inf if mesh.certified_px is None else mesh.certified_px


def _mean_in_tolerances(summary: np.void) -> float:
    """The bound of the root mean square over the drawn land, in tolerances: `reference.rings.mean_px`."""
    squares, land = int(summary["squares"]) / 64, int(summary["land"])
    return math.sqrt(squares / land) if land else math.inf


_NO_WORK = np.zeros((), layout.RING_WORK)
for _name in ("round", "seen", "all", "leaves", "queue"):
    _NO_WORK[_name]["one"] = 1
_EMPTY = _NO_WORK["all"].tobytes()


@cache
def _work(name: str, i: int = 0) -> int:
    """Byte offset of a dispatch's command in the buffer of blocks."""
    fields = layout.RING_WORK.fields
    assert fields
    return int(fields[name][1]) + i * layout.WORK.itemsize
