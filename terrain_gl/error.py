"""Error tables: the error of every node against the truth, in metres. The tables do not depend on the view.

The record of a node has its largest error and its root mean square error as a cell of a patch, whatever edges are cut
(glsl/error/node_errors.glsl). Summed-area tables of class counters and of squared errors bound the error of any
rectangle of nodes in four fetches (glsl/error/bound.glsl). Specification: `reference.cut_errors`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from copy import copy
from typing import Any, TypeAlias

import moderngl
import numpy as np

from .basics.rect import Rect
from .gpu import gl, layout
from .gpu.layout import FINE_LEVELS, Level
from .gpu.passes import ComputePass, Resources
from .sat import SummedAreaTables, Table
from .terrain import Terrain

PORTION = 2**18  # posts that one step of `ErrorTables.build_steps` visits
GATHERED_BYTES = 16  # of a record `Gathered` in glsl/error/coarse.glsl
CUT_BYTES = 8  # of each edge, in the buffer `cuts`
Nodes: TypeAlias = tuple[int, int, int, int]  # a rectangle of nodes or tiles: first column, first row, columns, rows
_BUFFERS = ("nodes", "ranges", "counters", "squares", "contributions", "cuts")
_BARRIER = moderngl.SHADER_STORAGE_BARRIER_BIT


def sizes(levels: Sequence[Level]) -> dict[str, int]:
    """Bytes of each buffer of `ErrorTables`, by its name."""
    last = levels[-1]
    coarse = levels[FINE_LEVELS + 1 :]
    nodes = last.first_node + last.nodes
    tiles = last.first_count // layout.CLASS_WORDS + 1
    return {
        "nodes": nodes * layout.NODE.itemsize,
        "ranges": nodes * layout.NODE_RANGE.itemsize,
        "counters": tiles * layout.CLASS_WORDS * 4,
        "squares": tiles * 8,
        "contributions": levels[FINE_LEVELS].nodes * len(coarse) * GATHERED_BYTES if coarse else GATHERED_BYTES,
        "cuts": 4 * CUT_BYTES * max(1, sum(level.nodes for level in coarse)),
    }


class ErrorTables:
    """The tables of one terrain, in GPU buffers.

    Attributes
    ----------
    nodes
        Records `layout.NODE` of all levels from 1 on.
    ranges
        Records `layout.NODE_RANGE` of these nodes: lowest and highest height; exchanged if the node has voids.
    counters, squares
        Summed-area tables of the class counters (8 bits, four classes a word) and of squared errors (64 bits): one
        table for each level, over tiles of nodes (`layout.Level.count_tile`).
    contributions
        What each node of the last fine level contributes to the node over it, for each coarse level
        (glsl/error/coarse.glsl). An edit recomputes only those that it touches.
    cuts
        How far each coarse node's edges may move when they are cut (glsl/error/coarse.comp). Edits compare old and new
        values.
    """

    nodes: moderngl.Buffer
    ranges: moderngl.Buffer
    counters: moderngl.Buffer
    squares: moderngl.Buffer
    contributions: moderngl.Buffer
    cuts: moderngl.Buffer

    def __init__(self, terrain: Terrain, build: bool = True) -> None:
        ctx = self.ctx = terrain.ctx
        self.terrain = terrain
        self._kernels: dict[tuple[str, int, bool], ComputePass] = {}  # by name, level (at most 2), existence of voids
        self._sat8 = SummedAreaTables(ctx, 8)
        self._sat64 = SummedAreaTables(ctx, 64)
        self._reserve()
        if build:
            self.build()

    def _reserve(self) -> None:
        with ExitStack() as made:  # if memory does not suffice for all buffers, release the ones that were made
            for name, size in sizes(self.terrain.levels).items():
                buffer = gl.reserve(self.ctx, size, f"a table of {name}")
                made.callback(buffer.release)
                setattr(self, name, buffer)
            made.pop_all()

    @property
    def bytes(self) -> int:
        """GPU memory of all tables."""
        return sum(buffer.size for buffer in self._buffers)

    def build(self) -> None:
        """Compute everything from the terrain's heights."""
        self.update(self.terrain.all_posts)

    def node_steps(self, last: int) -> Iterator[float]:
        """Compute the records and ranges of levels 1 to `last` alone; yields progress from 0 to 1."""
        for j in range(1, last + 1):
            columns, rows = self.terrain.levels[j].size
            height = max(1, (PORTION >> 2 * j) // columns)
            for y in range(0, rows, height):
                self._update_nodes(j, (0, y, columns, min(height, rows - y)), self.terrain.all_posts)
                yield (j - 1 + y / rows) / last

    def build_steps(self) -> Iterator[float]:
        """Incremental `build`; yields progress from 0 to 1."""
        last = len(self.terrain.levels) - 1
        for share in self.node_steps(last):
            yield 0.9 * share
        for j in range(last + 1):
            self._update_tables(j, self.terrain.all_posts)
            yield 0.9 + 0.1 * j / last

    def update(self, posts: Rect) -> None:
        """Follow an edit: recompute what depends on posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        for j in range(1, len(self.terrain.levels)):
            self._update_nodes(j, _touched(self.terrain.levels[j], posts, j), posts)
        for j in range(len(self.terrain.levels)):
            self._update_tables(j, posts)

    def empty_for(self, terrain: Terrain) -> ErrorTables:
        """Empty tables for another terrain, with the shaders of these tables."""
        other = copy(self)
        other.terrain = terrain
        other._reserve()
        return other

    def read_nodes(self, level: int) -> np.ndarray:
        """Records `layout.NODE` of one level, (rows, cols); half floats are in units of span · 2^-8."""
        return self._read(self.nodes, layout.NODE, level)

    def read_ranges(self, level: int) -> np.ndarray:
        """Records `layout.NODE_RANGE` of one level, (rows, cols): heights in 1/65535 of the quantisation range."""
        ranges = self._read(self.ranges, layout.NODE_RANGE, level)
        return np.sort(ranges["heights"]).view(layout.NODE_RANGE)[..., 0]  # they are exchanged where voids are

    def _read(self, buffer: moderngl.Buffer, dtype: np.dtype[Any], level: int) -> np.ndarray:
        sizes = self.terrain.levels[level]
        data = buffer.read(dtype.itemsize * sizes.nodes, offset=dtype.itemsize * sizes.first_node)
        return np.frombuffer(data, dtype).reshape(sizes.size[::-1])

    def read_counts(self, level: int, error_class: int, tiles: Rect) -> np.ndarray:
        """The table of one class at the corners of a rectangle of tiles, borders included, modulo 256.

        `tiles` is (x0, y0, x1, y1): the first column and row, then the column and row after the last. The result is
        (y1 − y0 + 1, x1 − x0 + 1) uint8.
        """
        columns, rows = self.terrain.levels[level].counts
        x0, y0, x1, y1 = tiles
        first = self.terrain.levels[level].first_count + (error_class // 4 * rows + max(y0 - 1, 0)) * columns
        lines = y1 - max(y0 - 1, 0)
        words = np.frombuffer(self.counters.read(4 * columns * lines, offset=4 * first), "u4").reshape(lines, columns)
        counts = (words >> 8 * (error_class % 4)).astype(np.uint8)
        whole = np.pad(counts, ((int(y0 == 0), 0), (1, 0)))
        return whole[:, x0 : x1 + 1]

    @property
    def resources(self) -> Resources:
        """What glsl/error/bound.glsl and certified.glsl read."""
        return {"Counters": self.counters, "Squares": self.squares, "Ranges": self.ranges}

    def release_tables(self) -> None:
        """Release the tables but not the shaders, which other tables use."""
        for buffer in self._buffers:
            buffer.release()

    def release(self) -> None:
        """Release GPU resources."""
        self.release_tables()
        for sat in (self._sat8, self._sat64):
            sat.release()
        for kernel in self._kernels.values():
            kernel.release()

    @property
    def _buffers(self) -> tuple[moderngl.Buffer, ...]:
        return tuple(getattr(self, name) for name in _BUFFERS)

    def _update_nodes(self, j: int, nodes: Nodes, posts: Rect) -> None:
        """Recompute a rectangle of nodes of level j after a change of `posts`."""
        x, y, width, height = nodes
        records = {"Nodes": self.nodes, "Ranges": self.ranges}
        if j <= FINE_LEVELS:
            # the map's rim may cut off the last column and the last row of nodes
            last_x, last_y = self.terrain.all_posts[2:] if j == 1 else (0, 0)
            whole = np.clip(((last_x >> j) - x, (last_y >> j) - y), 0, (width, height)).tolist()
            self._run("small", j, (x, y, *whole), whole, records)
            self._run("fine", j, (x + whole[0], y, width - whole[0], height), (width - whole[0], height), records)
            self._run("fine", j, (x, y + whole[1], whole[0], height - whole[1]), (whole[0], height - whole[1]), records)
            return
        gathering = self.ctx.buffer(bytes(width * height * GATHERED_BYTES))
        changed = self.ctx.buffer(bytes(width * height * 4))
        kept = {"Contributions": self.contributions, "Cuts": self.cuts}
        coarse = {**kept, "Changed": changed, "Gathering": gathering, **records}
        fine = width << j - FINE_LEVELS, height << j - FINE_LEVELS
        for step, threads in enumerate(((4 * width, height), fine, (width, height))):
            self._run("coarse", j, nodes, threads, coarse, posts=posts, step=step)
        gathering.release()
        changed.release()

    def _update_tables(self, j: int, posts: Rect) -> None:
        """Recount a level's tiles that changed, and update the sums."""
        level = self.terrain.levels[j]
        x, y, width, height = _touched(level, posts, j)
        tile = level.count_tile
        x0, y0 = x // tile, y // tile
        at = (-(-(x + width) // tile) - x0, -(-(y + height) // tile) - y0)
        counts = Table(*level.counts, layers=layout.CLASS_WORDS, first=level.first_count)
        sums = Table(*level.counts, first=level.first_count // layout.CLASS_WORDS)
        if at == level.counts:
            self._count(j, 0, 0, self.counters, counts, self.squares, sums)
            self._sat8.build(self.counters, counts)
            self._sat64.build(self.squares, sums)
            return
        new_counts = Table(*at, layers=layout.CLASS_WORDS)
        new_sums = Table(*at)
        counters = self.ctx.buffer(reserve=4 * new_counts.words)
        squares = self.ctx.buffer(reserve=8 * new_sums.words)
        self._count(j, x0, y0, counters, new_counts, squares, new_sums)
        self._sat8.edit(self.counters, counts, counters, new_counts, x0, y0)
        self._sat64.edit(self.squares, sums, squares, new_sums, x0, y0)
        counters.release()
        squares.release()

    def _count(
        self, j: int, x: int, y: int, counters: moderngl.Buffer, counts: Table, squares: moderngl.Buffer, sums: Table
    ) -> None:
        """Write the values that the two tables sum, for tiles from (x, y) on."""
        tables = {"Nodes": self.nodes, "Counters": counters, "Squares": squares}
        tiles = x, y, counts.width, counts.height
        self._run("count", j, tiles, counts[:2], tables, first_counter=counts.first, first_square=sums.first)

    def _run(self, name: str, j: int, nodes: Nodes, threads: Sequence[int], tables: Resources, **uniforms: Any) -> None:
        """Run a kernel over a rectangle of nodes of level j."""
        if 0 in threads:
            return
        place = {"which_level": j, "first": nodes[:2], "count": nodes[2:]}
        self._kernel(name, j).run(_groups(threads), {**self.terrain.resources, **tables}, place | uniforms)
        self.ctx.memory_barrier(_BARRIER)

    def _kernel(self, name: str, j: int) -> ComputePass:
        """The shader of a pass; that of fine nodes is compiled for level 1, and for all others."""
        level = min(j, 2) if name in ("small", "fine") else 2
        key = name, level, self.terrain.heightmap.voids > 0
        if key not in self._kernels:
            defines = {"LEVEL": level} | ({} if key[2] else {"NO_VOIDS": 1})
            self._kernels[key] = ComputePass(self.ctx, f"error/{name}.comp", defines)
        return self._kernels[key]


def _groups(threads: Sequence[int]) -> list[int]:
    """Work groups of 8 × 8 threads for so many threads."""
    return [*(-(-n // 8) for n in threads), 1]


def _touched(level: Level, posts: Rect, j: int) -> Nodes:
    """Nodes of level j that a rectangle of posts touches, borders included."""
    x0, y0 = max(0, posts[0] - 1) >> j, max(0, posts[1] - 1) >> j
    x1, y1 = min(posts[2] >> j, level.size[0] - 1), min(posts[3] >> j, level.size[1] - 1)
    return x0, y0, x1 - x0 + 1, y1 - y0 + 1
