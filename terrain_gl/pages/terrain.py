"""A map of which only some tiles are on the GPU: pages, their edits, and the error tables of each page."""

from collections.abc import Iterable
from typing import cast

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..gpu import gl, layout
from ..gpu.passes import Resources
from .edited_map import EditedMap
from .map import PagedMap, PageKey, above
from .pool import PagePool
from .resident import ResidentHeights
from .sums import Sums, counter_words, sums_of


class PagedTerrain(PagePool):
    """A paged map on the GPU, and its edits. It takes the place of `Terrain`."""

    streams = True

    def __init__(self, ctx: moderngl.Context, heightmap: PagedMap) -> None:
        super().__init__(ctx, heightmap)
        self.edits = 0  # the number of edits that have changed the map
        self._own: EditedMap | None = None

    @property
    def all_posts(self) -> Rect:
        """The rectangle of all posts."""
        return 0, 0, self.heightmap.cols - 1, self.heightmap.rows - 1

    @property
    def has_water(self) -> bool:
        """Whether the map has lakes or a sea."""
        return self.heightmap.has_water

    @property
    def sea_m(self) -> float | None:
        """Height of the sea that continues beyond the map; None if the map has no sea."""
        return self.heightmap.sea_m

    @property
    def own(self) -> EditedMap:
        """The map with the edits of this terrain. From the first edit on, it replaces the caller's map."""
        if self._own is None:
            heightmap = self.heightmap
            self._own = heightmap.copy() if isinstance(heightmap, EditedMap) else EditedMap(heightmap)
            if isinstance(heightmap.heights, ResidentHeights):  # the window reads the loaded pages alone
                self._own.heights = heightmap.heights
        return self._own

    def edit(self, x: int, y: int, heights: np.ndarray) -> Rect | None:
        """Give the posts from column x and row y on new heights, (rows, cols); NaN leaves a post as it is.

        The loaded pages have the new heights after `PagedTables.update`.

        Returns
        -------
        Rect, optional
            The columns and rows (x0, y0, x1, y1) whose pages change; None if no post changed.
        """
        own = self.own
        changed = own.write(x, y, heights)
        if changed is None:
            return None
        self.heightmap = own
        self.edits = self.edits + 1
        self.block.write(self._describe().tobytes())
        rows, cols = changed
        return cols.start, rows.start, cols.stop - 1, rows.stop - 1

    def exaggerate(self, factor: float) -> None:
        """Draw the relief `factor` times as high: see `Heightmap.exaggerated`."""
        if self._own is None:
            self.heightmap = cast(PagedMap, self.heightmap.exaggerated(factor))
        else:
            self._own.exaggerate(factor)
        self.block.write(self._describe().tobytes())

    def has_voids_around(self, col: int, row: int) -> bool:
        """Whether one of the four cells around a post has no data, or may have none, as its page is not loaded."""
        rows, cols = np.array([[row - 1], [row]]), np.array([[col - 1, col]])
        return self.heightmap.voids > 0 and bool(self.known.may_be_holes(rows, cols).any())

    def forget_hidden(self, key: PageKey) -> None:
        """Free the slot of a hidden page."""
        if key in self._hidden:
            self._free.append(self._hidden.pop(key))

    def renew(self, key: PageKey, sums: Sums) -> int:
        """Give a loaded page new heights; returns its slot. Its light stays."""
        slot = self.slot_of[key]
        self._write(slot, sums)
        return slot

    def drop(self, key: PageKey) -> None:
        """Remove a loaded page that is not a root, and all finer pages under it."""
        level, row, col = key
        for other in sorted(self.slot_of):  # finest first
            more = level - other[0]
            if more >= 0 and (other[1] >> more, other[2] >> more) == (row, col):
                self._remove(other)


class PagedTables:
    """Summed-area tables of each loaded page. They take the place of `ErrorTables` for a paged map."""

    def __init__(self, terrain: PagedTerrain) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        slots = terrain.slots
        side = terrain.heightmap.tile
        self._words = counter_words(side)
        self.counters = gl.reserve(self.ctx, 4 * self._words * slots, "a table of counters")
        self.squares = gl.reserve(self.ctx, self._words // 2 * slots, "a table of squared errors")
        self.ranges = gl.reserve(self.ctx, layout.NODE_RANGE.itemsize * side**2 * slots, "a table of height ranges")
        for key in terrain.roots:
            self.put(key, sums_of(terrain.heightmap, key))
        terrain.send()

    @property
    def bytes(self) -> int:
        """GPU memory of all tables."""
        return sum(buffer.size for buffer in (self.counters, self.squares, self.ranges))

    @property
    def resources(self) -> Resources:
        """What shaders read of the tables."""
        return {"Counters": self.counters, "Squares": self.squares, "Ranges": self.ranges}

    def put(self, key: PageKey, sums: Sums) -> None:
        """Put a page into a free slot. The page above it must be loaded. Shaders see it after `PagedTerrain.send`."""
        self._write(self.terrain.place(key, sums), sums)

    def update(self, rect: Rect) -> None:
        """Follow a change of posts or of the records of their nodes: replace the loaded pages over a rectangle."""
        x0, y0, x1, y1 = rect
        posts = slice(y0, y1 + 1), slice(x0, x1 + 1)
        pages_over = self.terrain.own.pages_over
        self.renew(key for level in range(self.terrain.top_level, -1, -1) for key in pages_over(posts, level))

    def renew(self, keys: Iterable[PageKey]) -> None:
        """Read loaded pages again, and remove those that can no longer be read."""
        terrain = self.terrain
        for key in keys:
            terrain.forget_hidden(key)
            if key not in terrain.slot_of:
                continue
            try:
                sums = sums_of(terrain.heightmap, key)
            except Exception:  # a disk may fail in any way; an edited map has its coarsest pages in memory
                terrain.drop(key)
                continue
            self._write(terrain.renew(key, sums), sums)
        terrain.send()

    def _write(self, slot: int, sums: Sums) -> None:
        self.counters.write(sums.counters, offset=4 * self._words * slot)
        self.squares.write(sums.squares, offset=self._words // 2 * slot)
        if sums.ranges is not None:
            self.ranges.write(sums.ranges, offset=sums.ranges.nbytes * slot)

    def load(self, keys: Iterable[PageKey]) -> None:
        """Read pages in this thread, and first the pages above them. Shaders see these pages at once."""
        for key in keys:
            missing = []
            while key not in self.terrain.slot_of:
                missing.append(key)
                key = above(key)
            for each in missing[::-1][: self.terrain.free]:
                self.put(each, sums_of(self.terrain.heightmap, each))
        self.terrain.send()

    def release(self) -> None:
        """Release GPU resources."""
        for buffer in (self.counters, self.squares, self.ranges):
            buffer.release()
