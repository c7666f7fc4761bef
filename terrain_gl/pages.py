"""A map of which only some tiles are on the GPU: pages in a fixed pool of slots, and the error tables of each page.

A page is a tile of nodes of one level, with the posts at their corners (glsl/blocks/pages.glsl). Pages of the coarsest
levels are always loaded, so that every place has a height and a bound (glsl/error/bound_of_pages.glsl). A page is
loaded only if the page above it, of the next coarser level, is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import moderngl
import numpy as np

from .exceptions import TerrainError
from .gpu import gl, layout, shaders
from .gpu.bindings import bind
from .heightmap import Heightmap
from .terrain import block_of, quantisation_range

ROW = 1024  # words of a row of the page tables' texture
PINNED = 0.25  # part of the pool for pages that are always loaded: whole levels, from the coarsest down
FINEST_RECORD = 2  # words of an error record that bounds read: largest error, root mean square
PageKey = tuple[int, int, int]  # level, row and column of a page


class Page(NamedTuple):
    """A tile of a level.

    Attributes
    ----------
    heights
        (rows + 1, cols + 1) float32 metres at the corners of its nodes.
    errors
        (2, rows, cols) uint32: the first words of the nodes' records; empty for level 0.
    ranges
        (2, rows, cols) uint16: lowest and highest height of the nodes; empty for level 0.
    """

    heights: np.ndarray
    errors: np.ndarray
    ranges: np.ndarray


class PagedMap(Heightmap):
    """A map that is read page by page.

    Attributes
    ----------
    tile
        Nodes a side of a page, a power of two.
    top
        The coarsest level.
    gpu_bytes
        GPU memory for pages, at most.
    """

    tile: int
    top: int
    gpu_bytes: int = 512 << 20

    def page(self, key: PageKey) -> Page:
        """Read a page.

        Raises
        ------
        TerrainError
            It is missing or damaged; the message says which one, and why.
        """
        raise NotImplementedError

    def nodes(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's nodes."""
        return -(-(self.rows - 1) >> level), -(-(self.cols - 1) >> level)

    def pages(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's pages."""
        rows, cols = self.nodes(level)
        return -(-rows // self.tile), -(-cols // self.tile)


@dataclass(frozen=True)
class Ground:
    """Heights at single posts; for a post that cannot be read, the map's highest."""

    heightmap: PagedMap

    def __getitem__(self, post: Any) -> float:
        try:
            return float(self.heightmap.heights[post])
        except TerrainError:
            return self.heightmap.range_m[1]


class PagedTerrain:
    """The pool, its page tables, and the `Terrain` block. It takes the place of `Terrain` for a paged map.

    Attributes
    ----------
    slots
        Pages that the pool has room for.
    slot_of
        The slot of each loaded page.
    missing
        Pages that cannot be read, and why.
    """

    is_marked, has_water, sea_m, edits = False, False, None, 0

    def __init__(self, ctx: moderngl.Context, heightmap: PagedMap) -> None:
        self.ctx, self.heightmap = ctx, heightmap
        self.base_m, self._low_m, self.span_m = quantisation_range(*heightmap.quantised_m)
        self.top_level = heightmap.top
        side = heightmap.tile
        self.words = layout.CLASS_WORDS * (side // layout.COUNT_TILE) ** 2  # of counters in a slot
        self.slot_bytes = 4 * (side + 1) ** 2 + 4 * self.words + self.words // 2 + 4 * side**2
        across = min(math.isqrt(heightmap.gpu_bytes // self.slot_bytes), gl.limits(ctx)["texture_size"] // (side + 1))
        self.slots = min(across**2, (gl.limits(ctx)["storage_block_bytes"] // (4 * self.words)))
        self._across = across
        most = sum(rows * cols for rows, cols in map(heightmap.pages, range(heightmap.top + 1)))
        if self.slots < most and self.slots < 4 * math.prod(heightmap.pages(heightmap.top)):
            raise TerrainError(
                f"{heightmap.name}: needs more GPU memory for its coarsest tiles: give more --gpu-memory"
            )
        if self.slots > most:
            self._across = across = math.isqrt(most - 1) + 1
            self.slots = min(self.slots, across**2)
        shaders.define(ctx, PAGED=1, PAGE_LOG2=side.bit_length() - 1, SLOTS_ACROSS=across)
        self.heights = gl.texel_texture(self.ctx, (across * (side + 1), across * (side + 1)), "f4")
        self.marks = gl.texel_texture(self.ctx, (1, 1), "u1")
        self.slot_of: dict[PageKey, int] = {}
        self._free = list(range(self.slots))[::-1]
        self.missing: dict[PageKey, str] = {}
        self._tables, self._finest, self._first = self._empty_tables()
        self.table = gl.texel_texture(self.ctx, (ROW, -(-len(self._words()) // ROW)), "u4")
        self.block = ctx.buffer(self._describe().tobytes())

    @property
    def filled(self) -> Ground:
        """Heights at single posts, from which the rings get their place."""
        return Ground(self.heightmap)

    @property
    def coarsest_ring(self) -> int:
        """The coarsest ring of the clipmap that the map needs."""
        return min(layout.MAX_LEVELS - 1, (max(self.heightmap.rows, self.heightmap.cols) - 2).bit_length())

    @property
    def bytes(self) -> int:
        """GPU memory of heights and page tables."""
        return 4 * (self.heights.width * self.heights.height + self.table.width * self.table.height)

    def pinned(self) -> list[PageKey]:
        """Pages that are always loaded: whole levels from the coarsest down, as many as fit into a part of the pool."""
        found: list[PageKey] = []
        for level in range(self.top_level, -1, -1):
            rows, cols = self.heightmap.pages(level)
            if level < self.top_level and len(found) + rows * cols > PINNED * self.slots:
                break
            found += [(level, row, col) for row in range(rows) for col in range(cols)]
        return found

    def place(self, key: PageKey, heights: np.ndarray) -> int | None:
        """Put a page's heights into a free slot; None if there is none. `send` makes the page visible."""
        if not self._free:
            return None
        slot = self.slot_of[key] = self._free.pop()
        level, row, col = key
        side, whole = self.heightmap.tile + 1, np.empty((self.heightmap.tile + 1,) * 2, np.float32)
        whole[...] = np.pad(heights, [(0, side - n) for n in heights.shape], mode="edge")
        whole -= np.float32(self.base_m)
        corner = slot % self._across * side, slot // self._across * side
        self.heights.write(whole, viewport=(*corner, side, side))
        self._tables[level][row, col] = slot + 1
        part = self._finest[row << level : row + 1 << level, col << level : col + 1 << level]
        part[part >> 24 >= level] = slot | level << 24
        return slot

    def keep(self, keys: Iterable[PageKey]) -> int:
        """Keep these pages, those above them, and the pinned ones; free all other slots, and return their number."""
        kept = set(self.pinned())
        for level, row, col in keys:
            while (level, row, col) not in kept and level <= self.top_level:
                kept.add((level, row, col))
                level, row, col = level + 1, row // 2, col // 2
        gone = [key for key in self.slot_of if key not in kept]
        for key in sorted(gone):  # finest first: the finest page left over a place is the one above
            self._free.append(self.slot_of.pop(key))
            level, row, col = key
            self._tables[level][row, col] = 0
            above = self.slot_of[level + 1, row // 2, col // 2] | level + 1 << 24
            self._finest[row << level : row + 1 << level, col << level : col + 1 << level] = above
        return len(gone)

    def send(self) -> None:
        """Upload the page tables: shaders then see all pages that were placed."""
        words = np.zeros(self.table.width * self.table.height, np.uint32)
        known = self._words()
        words[: len(known)] = known
        self.table.write(words)

    def resident_level(self, low: tuple[int, int], end: tuple[int, int], level: int) -> int:
        """The finest level, from `level` up, whose pages over a closed box of (column, row) posts are all loaded."""
        while level < self.top_level and not self._is_there(low, end, level):
            level += 1
        return level

    def over(self, low: tuple[int, int], end: tuple[int, int], level: int) -> list[PageKey]:
        """All pages of a level over a closed box."""
        shift, most = level + self.heightmap.tile.bit_length() - 1, self.heightmap.pages(level)
        x0, x1 = (min(max(at[0], 0) >> shift, most[1] - 1) for at in (low, end))
        y0, y1 = (min(max(at[1], 0) >> shift, most[0] - 1) for at in (low, end))
        return [(level, y, x) for y in range(y0, y1 + 1) for x in range(x0, x1 + 1)]

    def _is_there(self, low: tuple[int, int], end: tuple[int, int], level: int) -> bool:
        return all(key in self.slot_of for key in self.over(low, end, level))

    def bind(self) -> None:
        """Bind the map for all shaders."""
        bind("blocks/terrain.glsl", Terrain=self.block, u_heights=self.heights, u_marks=self.marks)
        bind("blocks/pages.glsl", u_pages=self.table)

    def release(self) -> None:
        """Release GPU resources."""
        shaders.undefine(self.ctx, "PAGED", "PAGE_LOG2", "SLOTS_ACROSS")
        for resource in (self.heights, self.marks, self.table, self.block):
            resource.release()

    def _empty_tables(self) -> tuple[list[np.ndarray], np.ndarray, list[int]]:
        tables = [np.zeros(self.heightmap.pages(level), np.uint32) for level in range(self.top_level + 1)]
        first = np.cumsum([0, *(table.size for table in tables)]).tolist()
        return tables, np.full(tables[0].shape, 0xFF000000, np.uint32), first

    def _words(self) -> np.ndarray:
        return np.concatenate([*(table.ravel() for table in self._tables), self._finest.ravel()])

    def _describe(self) -> np.ndarray:
        block = block_of(self.heightmap, self.top_level, self._low_m - self.base_m, self.span_m)
        for level in range(self.top_level + 1):
            block["level"][level]["size"] = self.heightmap.nodes(level)[::-1]
            block["level"][level]["first_word"] = self._first[level]
        block["level"][0]["first_node"] = self._first[-1]
        return block


class PagedTables:
    """Summed-area tables of each loaded page. They take the place of `ErrorTables` for a paged map."""

    def __init__(self, terrain: PagedTerrain) -> None:
        self.ctx, self.terrain = terrain.ctx, terrain
        slots, side = terrain.slots, terrain.heightmap.tile
        self.counters = gl.reserve(self.ctx, 4 * terrain.words * slots, "a table of counters")
        self.squares = gl.reserve(self.ctx, terrain.words // 2 * slots, "a table of squared errors")
        self.ranges = gl.reserve(self.ctx, 4 * side**2 * slots, "a table of height ranges")
        self.nodes = self.ctx.buffer(bytes(16))  # nothing reads records
        self.load(terrain.pinned(), must=True)

    @property
    def bytes(self) -> int:
        """GPU memory of all tables."""
        return sum(buffer.size for buffer in (self.counters, self.squares, self.ranges))

    def bind(self) -> None:
        """Bind the tables for shaders that read bounds."""
        tables = {"Nodes": self.nodes, "Counters": self.counters, "Squares": self.squares, "Ranges": self.ranges}
        bind("lod/promise.glsl", **tables)

    def load(self, keys: list[PageKey], must: bool = False) -> int:
        """Load pages, each after the one above it; returns how many were loaded.

        Raises
        ------
        TerrainError
            With `must`, if a page is missing.
        """
        came = sum(self._load(key, must) for key in keys)
        if came:
            self.terrain.send()
        return came

    def release(self) -> None:
        """Release GPU resources."""
        for buffer in (self.counters, self.squares, self.ranges, self.nodes):
            buffer.release()

    def _load(self, key: PageKey, must: bool) -> int:
        terrain, (level, row, col) = self.terrain, key
        if key in terrain.slot_of or key in terrain.missing:
            return 0
        came = 0
        if level < terrain.top_level:
            above = (level + 1, row // 2, col // 2)
            came = self._load(above, must)
            if above not in terrain.slot_of:
                return came
        if len(terrain.slot_of) >= terrain.slots:
            return came
        try:
            page = terrain.heightmap.page(key)
        except TerrainError as error:
            if must:
                raise
            terrain.missing[key] = str(error)
            return came
        slot = terrain.place(key, page.heights)
        assert slot is not None
        counters, squares = sums_of(page, key, terrain)
        self.counters.write(counters, offset=4 * terrain.words * slot)
        self.squares.write(squares, offset=terrain.words // 2 * slot)
        if level:
            side = terrain.heightmap.tile
            words = np.zeros((side, side), np.uint32)
            rows, cols = page.ranges.shape[1:]
            words[:rows, :cols] = page.ranges[0] | page.ranges[1].astype(np.uint32) << 16
            self.ranges.write(words, offset=4 * side**2 * slot)
        return came + 1


def sums_of(page: Page, key: PageKey, terrain: PagedTerrain) -> tuple[np.ndarray, np.ndarray]:
    """Summed-area tables of a page's class counters and squared errors, as glsl/error/count.comp counts them."""
    level, span, side = key[0], np.float32(terrain.span_m), terrain.heightmap.tile
    tile = layout.COUNT_TILE * (1 if level else 2)
    n = side // tile
    worst, square = _of_cells(page, terrain) if level == 0 else _of_records(page, key, terrain)
    per_tile = _padded(worst, side).reshape(n, tile, n, tile).max((1, 3))
    c = np.arange(layout.CLASSES, dtype=np.float32)
    limits = span * np.exp2(np.float32(-0.25) * c - np.float32(0.25))
    above = (per_tile > limits[:, None, None]).astype(np.uint8)
    sums = above.cumsum(1, dtype=np.uint8).cumsum(2, dtype=np.uint8)
    counters = np.ascontiguousarray(sums.reshape(layout.CLASS_WORDS, 4, n, n).transpose(0, 2, 3, 1))
    squares = _padded(_square_up(square), side).reshape(n, tile, n, tile).sum((1, 3), dtype=np.uint64)
    return counters, squares.cumsum(0, dtype=np.uint64).cumsum(1, dtype=np.uint64)


def _of_cells(page: Page, terrain: PagedTerrain) -> tuple[np.ndarray, np.ndarray]:
    """Largest error in metres, and squared error in units of span², of cells of the map: by their twist."""
    h = page.heights - np.float32(terrain.base_m)
    twist = (h[:-1, :-1] - h[:-1, 1:]) - (h[1:, :-1] - h[1:, 1:])
    t = twist / np.float32(terrain.span_m)
    return np.float32(0.25) * np.abs(twist) * np.float32(1 + 2.0**-20), t * t / np.float32(64)


def _of_records(page: Page, key: PageKey, terrain: PagedTerrain) -> tuple[np.ndarray, np.ndarray]:
    """The same for nodes drawn as quads, from their records."""
    level, row, col = key
    unit, span = np.float32(terrain.span_m) * np.float32(2.0**-14), np.float32(terrain.span_m)
    most, rms = ((words & 0x7FFF).astype(np.uint16).view(np.float16).astype(np.float32) * unit for words in page.errors)
    posts = []
    for first, n, last in (
        (row, most.shape[0], terrain.heightmap.rows - 1),
        (col, most.shape[1], terrain.heightmap.cols - 1),
    ):
        low = (first * terrain.heightmap.tile + np.arange(n)) << level
        high = np.minimum(low + (1 << level), last)
        posts.append((high - low + (high == last)).astype(np.float32))
    share = rms / span
    return most, share * share * (posts[0][:, None] * posts[1])


def _square_up(share: np.ndarray) -> np.ndarray:
    """Units of span² in 64-bit fixed point, rounded up: glsl/error/nodes.glsl."""
    s = share * np.float32(8) * np.float32(1 + 2.0**-18)
    high = np.floor(s)
    fixed = ((s - high) * np.float32(2.0**32)).astype(np.uint64) + (high.astype(np.uint64) << np.uint64(32))
    return np.where(share == 0, np.uint64(0), fixed + np.uint64(1))


def _padded(values: np.ndarray, side: int) -> np.ndarray:
    return np.pad(values, [(0, side - n) for n in values.shape])
