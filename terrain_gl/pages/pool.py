"""Pages of a map on the GPU, in a fixed pool of slots, and the page tables, which give the slot of each page.

Pages of the coarsest level are always loaded, so that every place has a height and a bound
(glsl/pages/bound.glsl). A page is put into the pool only after the page above it, of the next coarser level.
Nothing here waits for a disk.
"""

import itertools
import math
from collections.abc import Iterable

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from ..gpu import gl, layout
from ..gpu.passes import Resources
from ..terrain import block_of, quantisation_range
from .map import Boxes, PagedMap, PageKey, above
from .resident import ResidentHeights
from .sums import Sums, bytes_of_slot, counter_words
from .windows import light_bytes, scratch_bytes

ROW = 1024  # words of a row of the page tables' texture
LIT = 1 << 31  # bit in the page tables: the page has light (glsl/pages/terrain.glsl)
OF_COPIES = 0.5  # share of `memory_bytes` for copies of the heights of loaded pages


class PagePool:
    """The pool, its page tables, and the `Terrain` block."""

    def __init__(self, ctx: moderngl.Context, heightmap: PagedMap) -> None:
        self.ctx = ctx
        self.heightmap = heightmap
        self.base_m, _, self.span_m = quantisation_range(*heightmap.quantised_m)
        self.top_level = heightmap.top
        self.numbering = heightmap.numbering
        self._make_tables()
        self._is_changed = False  # whether the tables differ from those on the GPU
        self.slots, self.across = self._room()  # `across`: slots in a row of the textures
        side = heightmap.tile + 1
        self.defines = {"PAGED": 1, "PAGE_LOG2": heightmap.tile.bit_length() - 1, "SLOTS_ACROSS": self.across}
        self.heights = gl.texel_texture(ctx, (self.across * side, self.across * side), "f4")
        self.height_sums = gl.reserve(ctx, 4 * side**2 * self.slots, "a table of heights")
        self.is_marked = heightmap.is_marked
        self.marks = gl.texel_texture(ctx, self.heights.size if self.is_marked else (1, 1), "u1")
        self._mixed = np.zeros(self.slots, bool)  # whether the page in a slot has nodes with holes and land
        self.slot_of: dict[PageKey, int] = {}  # of each loaded page that is not hidden
        self._hidden: dict[PageKey, int] = {}
        self._lit = np.zeros(self.slots, bool)
        self.table = gl.texel_texture(ctx, (ROW, len(self._words)), "u4")
        self.table.write(self._words)
        self.block = ctx.buffer(self._describe().tobytes())
        self._free = list(range(self.slots))[::-1]
        self.eye_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the present view
        self.rim_focal_px = 0.0  # with `--voids hole`, where rims must be sharp to a pixel: the focal length
        self.shows_errors = False  # whether a picture needs the pages of level 0, to compare the mesh with true heights
        self.views = (
            1  # number of views that take turns, as the sides of a split picture; the pages of each stay loaded
        )
        self.waits = True  # whether a picture waits for all that it needs
        self._stamps = np.zeros(self.numbering.total, np.int64)  # of each page: when a view last used it
        self._stamp = 0  # of the present view
        # heights of the loaded pages; `known` is NaN where void
        self.filled = ResidentHeights(heightmap, self._finest, self.slots)
        self.known = self.filled.known() if heightmap.voids else self.filled

    @property
    def coarsest_ring(self) -> int:
        """The coarsest ring of the clipmap that the map needs."""
        return min(layout.MAX_LEVELS - 1, (max(self.heightmap.rows, self.heightmap.cols) - 2).bit_length())

    @property
    def bytes(self) -> int:
        """GPU memory of heights, their sums, and page tables."""
        words = sum(texture.width * texture.height for texture in (self.heights, self.table))
        return 4 * words + self.height_sums.size + self.marks.width * self.marks.height

    @property
    def roots(self) -> list[PageKey]:
        """Pages that are always loaded: the coarsest level."""
        rows, cols = self.heightmap.pages(self.top_level)
        return [(self.top_level, row, col) for row in range(rows) for col in range(cols)]

    # --- Pages come and go --------------------------------------------------------------------------------------------

    def place(self, key: PageKey, sums: Sums) -> int:
        """Put a page's heights and their sums into a free slot; returns the slot. Shaders see the page after `send`."""
        slot = self._free_slot(key)
        self._write(slot, sums)
        self._lit[slot] = False
        self._enter(key, slot)
        return slot

    def _write(self, slot: int, sums: Sums) -> None:
        side = self.heightmap.tile + 1
        corner = slot % self.across * side, slot // self.across * side
        self.heights.write(sums.heights - np.float32(self.base_m), viewport=(*corner, side, side))
        self.height_sums.write(sums.height_sums, offset=4 * side**2 * slot)
        self.filled.copies[slot] = sums.heights
        self._mixed[slot] = sums.is_mixed
        if sums.marks is not None:
            self.marks.write(sums.marks, viewport=(*corner, side, side), alignment=1)
            if self.known.marks is not None:
                self.known.marks[slot] = sums.marks

    def hide(self) -> None:
        """Treat all pages except the roots as not loaded. They keep their slots as long as there is room."""
        for key in self.slot_of.keys() - set(self.roots):
            self._hidden[key] = self.slot_of.pop(key)
            self._slots_of[self.numbering.number(key)] = 0
        for root in self.roots:
            self._fine_under(root)[...] = self.slot_of[root] | root[0] << 24
        self._is_changed = True

    def show(self, keys: Iterable[PageKey]) -> None:
        """Show hidden pages again; `keys` has coarse pages first. Remove a hidden page if the page above it is gone."""
        for key in keys:
            if key in self._hidden and above(key) in self.slot_of:
                self._enter(key, self._hidden.pop(key))
            elif key in self._hidden:
                self._free.append(self._hidden.pop(key))

    def show_all(self) -> None:
        """Show all hidden pages again."""
        self.show(sorted(self._hidden, reverse=True))

    def _free_slot(self, key: PageKey) -> int:
        """An empty slot; if there is none, the slot of the least recently used hidden page."""
        if self._free and key not in self._hidden:
            return self._free.pop()
        old = min(self._hidden, key=lambda other: (other != key, self._stamp_of(other), other))
        return self._hidden.pop(old)

    def _enter(self, key: PageKey, slot: int) -> None:
        level = key[0]
        number = self.numbering.number(key)
        self.slot_of[key] = slot
        self._slots_of[number] = slot + 1 | (LIT if self._lit[slot] else 0)
        self.hold(key)
        part = self._fine_under(key)
        part[part >> 24 >= level] = slot | level << 24
        self._is_changed = True

    @property
    def free(self) -> int:
        """Number of slots that are empty or hold a hidden page."""
        return len(self._free) + len(self._hidden)

    def begin(self) -> None:
        """Begin a view. From now on, `make_room` keeps the pages that `use` and `hold` name."""
        self._stamp += 1

    def use(self, boxes: Boxes, level: np.ndarray) -> None:
        """Note that a view needs the pages over boxes, each at its level, and all pages above them."""
        self._use(np.unique(self.numbering.over(boxes, level)[1]))

    def hold(self, key: PageKey) -> None:
        """Note that a view needs a page, and all pages above it."""
        self._use(np.array([self.numbering.number(key)]))

    def _use(self, numbers: np.ndarray) -> None:
        while len(numbers):
            self._stamps[numbers] = self._stamp
            numbers = self.numbering.above(numbers)

    def _is_used(self, key: PageKey) -> bool:
        return key[0] == self.top_level or self._stamp_of(key) > self._stamp - self.views

    def _stamp_of(self, key: PageKey) -> int:
        return int(self._stamps[self.numbering.number(key)])

    def light(self, key: PageKey) -> None:
        """Note that a loaded page has light. Shaders see it after `send`."""
        self._slots_of[self.numbering.number(key)] |= np.uint32(LIT)
        self._lit[self.slot_of[key]] = True
        self._is_changed = True

    def is_lit(self, key: PageKey) -> bool:
        """Whether a loaded page has light."""
        return bool(self._slots_of[self.numbering.number(key)] & np.uint32(LIT))

    def in_use(self) -> list[PageKey]:
        """Loaded pages that the present views use; the largest in the picture first."""
        return sorted(filter(self._is_used, self.slot_of), key=lambda key: (-self._width(key), key))

    def _width(self, key: PageKey) -> float:
        """Approximate width of a page in the picture, up to a factor."""
        level, row, col = key
        east, north = self.heightmap.spacing_m
        size = self.heightmap.tile << level
        x, y = (col + 0.5) * size * east, (self.heightmap.rows - 1 - (row + 0.5) * size) * north
        away_m = math.dist((x, y, self.base_m), self.eye_m)
        return size * east / max(away_m, 0.5 * size * east)

    def spare(self) -> list[PageKey]:
        """Pages that can be removed, the least recently used first; no roots, and no pages of the present views."""
        return sorted(itertools.filterfalse(self._is_used, self.slot_of), key=lambda key: (self._stamp_of(key), key))

    def make_room(self, pages: int) -> int:
        """Free slots until `pages` of them are free, or no page can be removed; returns the number of free slots."""
        if pages > self.free:
            for key in self.spare()[: pages - self.free]:
                self._remove(key)
        return min(pages, self.free)

    def _remove(self, key: PageKey) -> None:
        slot = self.slot_of.pop(key)
        self._free.append(slot)
        self._slots_of[self.numbering.number(key)] = 0
        part = self._fine_under(key)
        coarser = above(key)
        part[part == (slot | key[0] << 24)] = self.slot_of[coarser] | coarser[0] << 24
        self._is_changed = True

    def send(self) -> None:
        """Upload the page tables: shaders then see all pages that were placed, and none that were removed."""
        if self._is_changed:
            self.table.write(self._words)
        self._is_changed = False

    # --- Which pages are loaded ---------------------------------------------------------------------------------------

    @property
    def levels(self) -> np.ndarray:
        """The level of the finest loaded page over each page of level 0: (rows, columns)."""
        return self._finest >> 24

    def is_there(self, numbers: np.ndarray) -> np.ndarray:
        """Whether pages are in the pool, by their numbers."""
        return self._slots_of[numbers] > 0

    def is_mixed(self, numbers: np.ndarray) -> np.ndarray:
        """Whether loaded pages have nodes with holes and land, by their numbers."""
        return self._mixed[(self._slots_of[numbers] & np.uint32(LIT - 1)).astype(np.int64) - 1]

    def resident_level(self, boxes: Boxes, level: np.ndarray) -> np.ndarray:
        """The finest level, from `level` up, whose pages over a box are all loaded."""
        found = level.copy()
        open_ = np.arange(len(found))
        while len(open_):
            box, numbers = self.numbering.over(boxes.some(open_), found[open_])
            lacks = np.bincount(box, ~self.is_there(numbers), minlength=len(open_)) > 0
            open_ = open_[lacks & (found[open_] < self.top_level)]
            found[open_] += 1
        return found

    # --- On the GPU ---------------------------------------------------------------------------------------------------

    @property
    def resources(self) -> Resources:
        """What shaders read of the map: glsl/blocks/terrain.glsl and glsl/pages/terrain.glsl."""
        return {"Terrain": self.block, "u_heights": self.heights, "u_marks": self.marks, "u_pages": self.table}

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self.heights, self.height_sums, self.marks, self.table, self.block):
            resource.release()

    def _make_tables(self) -> None:
        """Make the words of the page tables: each page's slot + 1; then the finest page over each page of level 0."""
        total = self.numbering.total
        fine = int(self.numbering.first[1])
        words = np.zeros(-(-(total + fine) // ROW) * ROW, np.uint32)
        self._slots_of = words[:total]
        finest = words[total : total + fine]
        finest[:] = 0xFF000000
        self._finest = finest.reshape(self.numbering.size[0])
        self._words = words.reshape(-1, ROW)

    def _fine_under(self, key: PageKey) -> np.ndarray:
        level, row, col = key
        return self._finest[row << level : row + 1 << level, col << level : col + 1 << level]

    def _room(self) -> tuple[int, int]:
        """The number of slots within the limits, and the number of slots in a row of the texture."""
        heightmap = self.heightmap
        side = heightmap.tile
        most = heightmap.gpu_bytes - self._words.nbytes - scratch_bytes(heightmap)
        most = most // (bytes_of_slot(side, heightmap.is_marked) + light_bytes(side))
        copy = (5 if heightmap.is_marked else 4) * (side + 1) ** 2
        most = min(most, int(OF_COPIES * heightmap.memory_bytes) // copy)
        most = min(most, gl.storage_block_bytes(self.ctx) // (4 * max(counter_words(side), (side + 1) ** 2)))
        across = min(math.isqrt(max(most, 0)), gl.limits(self.ctx)["texture_size"] // (side + 1))
        slots = across**2
        if slots < self.numbering.total and slots < 4 * len(self.roots):
            raise TerrainError(f"{heightmap.name}: its coarsest tiles need more --gpu-memory and --memory")
        if slots > self.numbering.total:
            across = math.isqrt(self.numbering.total - 1) + 1
            slots = min(slots, across**2)
        return slots, across

    def _describe(self) -> np.ndarray:
        block = block_of(self.heightmap, self.top_level)
        for level in range(self.top_level + 1):
            block["level"][level]["size"] = self.heightmap.nodes(level)[::-1]
            block["level"][level]["first_page"] = self.numbering.first[level]
        block["level"][0]["first_node"] = self.numbering.total
        return block
