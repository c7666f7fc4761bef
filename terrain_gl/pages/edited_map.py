"""An edited store: new heights over those on disk, in this process. The store itself is never written.

    heights    for each level: the edited posts of its lattice; NaN elsewhere, also where an edit was undone
    records    of nodes: wide at once, exact when they are computed anew (edited_records.py)

Each page has a version, which grows with every change. The version shows whether a thread read a page before an edit.
One thread edits; any thread may read.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy, deepcopy
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Area, span_of
from ..gpu.layout import VOID, WET
from ..heightmap import MAX_HEIGHT_M
from ..terrain import quantisation_range, units_hold
from .edited_records import EditedRecords
from .map import Page, PagedHeights, PagedMap, PageKey
from .sheet import Sheet
from .widening import Scale, moves, touched


class Square(NamedTuple):
    """A node whose record is computed anew, together with the records of all nodes inside it."""

    level: int
    row: int
    col: int


class EditedMap(PagedMap):
    """A paged map with edits. The map `base` does not change.

    Attributes
    ----------
    edits, changes
        The number of edits; the number of changes: edits, and records that were computed anew.
    saved_as
        The file that holds all edits; "" if there is none.
    wide
        The squares whose records are still wide, and the number of the last edit that touched each.
    """

    def __init__(self, base: PagedMap) -> None:
        self.__dict__.update(base.__dict__)
        self.base = base
        self._last = base.rows - 1, base.cols - 1
        self.heights = PagedHeights(self, (base.rows, base.cols))  # type: ignore[assignment]
        self._heights = [Sheet(base.tile, np.nan) for _ in range(base.top + 1)]
        self._records = EditedRecords(base.tile, base.top, self._last, _scale(base))
        self._roots: dict[PageKey, Page] = {}
        self._versions: dict[PageKey, int] = {}
        self.edits = self.changes = 0
        self.saved_as = ""
        self.wide: dict[Square, int] = {}

    def copy(self, heights: np.ndarray | None = None) -> EditedMap:
        """A copy with its own edits."""
        assert heights is None
        own = copy(self)
        own.heights = PagedHeights(own, (self.rows, self.cols))  # type: ignore[assignment]
        for name in ("_heights", "_records", "_versions", "wide"):
            setattr(own, name, deepcopy(getattr(self, name)))
        own._roots = dict(self._roots)
        return own

    @property
    def identity(self) -> str:
        """The hash of the map without edits."""
        return self.base.identity

    @property
    def scale(self) -> Scale:
        """The quantisation range of the map's records."""
        return _scale(self)

    @property
    def bytes(self) -> int:
        """Memory of the edits."""
        return self._records.bytes + sum(sheet.bytes for sheet in self._heights)

    # --- Editing ------------------------------------------------------------------------------------------------------

    def write(self, x: int, y: int, heights: Any) -> tuple[slice, slice] | None:
        """Write heights as `Heightmap.write` does, but NaN leaves a post as it is. Records of the nodes become wide.

        Raises
        ------
        TerrainError
            Heights beyond `MAX_HEIGHT_M` or for voids, no memory for more edits, or a tile that cannot be read. The map
            is then unchanged.
        """
        area = slice(y, y + heights.shape[0]), slice(x, x + heights.shape[1])
        stored = self.base.lattice_heights(0, *area)
        old = self._patched(stored, 0, area)
        new = np.where(np.isnan(heights), old, heights).astype(np.float32)
        changed = old.view(np.uint32) != new.view(np.uint32)
        if not changed.any():
            return None
        marks = self.base.lattice_marks(0, *area)
        if marks is not None and (marks[changed] & VOID).any():
            raise TerrainError(f"{self.name}: gives heights to voids, which a store keeps: build it again")
        rows, cols = (span_of(changed.any(axis)) for axis in (1, 0))
        stored, old, new = (each[rows, cols] for each in (stored, old, new))
        where = slice(y + rows.start, y + rows.stop), slice(x + cols.start, x + cols.stop)
        range_m = self._check(new, where)
        self._keep_roots()
        self.range_m = range_m
        self.edits = self.edits + 1
        self.changes = self.changes + 1
        self.saved_as = ""
        edits = np.where(stored.view(np.uint32) == new.view(np.uint32), np.float32(np.nan), new)
        for level in range(self.top + 1):
            self._write_level(level, where, old, new, edits)
        for level in sorted({min(self.tile.bit_length() - 1, self.top), self.top} - {0}):
            nodes = self._nodes_at(where, level)
            for row, col in np.ndindex(*(s.stop - s.start for s in nodes)):
                self.wide[Square(level, nodes[0].start + row, nodes[1].start + col)] = self.edits
        return where

    def _check(self, new: np.ndarray, where: Area) -> tuple[float, float]:
        """The map's lowest and highest height with new heights of some posts, if they are allowed."""
        low, high = float(new.min()), float(new.max())
        if max(-low, high) > MAX_HEIGHT_M:
            raise TerrainError(f"{self.name}: heights run from {low:.9g} to {high:.9g} m, beyond ±{MAX_HEIGHT_M:g}")
        range_m = min(self.range_m[0], low), max(self.range_m[1], high)
        if not units_hold(self.quantised_m, range_m):
            raise TerrainError(
                f"{self.name}: heights from {low:.9g} to {high:.9g} m are too far from those of the store, "
                f"{self.base.range_m[0]:.9g} to {self.base.range_m[1]:.9g} m: build it again from the edited map"
            )
        levels = range(self.top + 1)
        more = sum(self._heights[level].bytes_for(self._lattice(where, level)) for level in levels)
        more += sum(self._records.bytes_for(level, self._nodes_at(where, level)) for level in levels[1:])
        if self.bytes + more > self.memory_bytes:
            raise TerrainError(
                f"{self.name}: its edits need more than {self.memory_bytes >> 20} MiB: save them, and build the store "
                "again, or give more --memory"
            )
        return range_m

    def _write_level(self, level: int, where: Area, old: np.ndarray, new: np.ndarray, edits: np.ndarray) -> None:
        posts = self._lattice(where, level)
        places = zip(posts, where, self._last, strict=True)
        within = [np.minimum(np.arange(s.start, s.stop) << level, n) - w.start for s, w, n in places]
        if all(map(len, within)):
            self._heights[level].put(posts, edits[np.ix_(*within)])
            self._heights[level].forget_empty(posts)
        if level:
            at = where[0].start, where[1].start
            self._records.move(level, self._nodes_at(where, level), moves(old, new, at, level, self._last))
        for key in self.pages_over(where, level):
            self._versions[key] = self.changes

    def _keep_roots(self) -> None:
        """Read the coarsest pages before the first edit. They give a bound everywhere, even if the disk fails later."""
        rows, cols = self.pages(self.top)
        for key in ((self.top, row, col) for row in range(rows) for col in range(cols)):
            if key not in self._roots:
                self._roots[key] = self.base.page(key)

    # --- What was edited ----------------------------------------------------------------------------------------------

    def _lattice(self, where: Area, level: int) -> Area:
        """The posts of a level's lattice inside an edit; the map's last posts are on every lattice."""
        last = [-(-n >> level) if s.stop > n else (s.stop - 1) >> level for s, n in zip(where, self._last, strict=True)]
        rows, cols = (slice(-(-s.start >> level), end + 1) for s, end in zip(where, last, strict=True))
        return rows, cols

    def _nodes_at(self, posts: Area, level: int) -> Area:
        """The nodes of a level that a rectangle of posts touches."""
        rows, cols = (slice(*touched(s.start, s.stop, level, last)) for s, last in zip(posts, self._last, strict=True))
        return rows, cols

    def pages_over(self, posts: Area, level: int) -> list[PageKey]:
        """The pages of a level that a rectangle of posts changes."""
        return self._pages_of(self._nodes_at(posts, level), level)

    def version(self, key: PageKey) -> int:
        """The number of the last change of a page."""
        return self._versions.get(key, 0)

    def is_wide(self, key: PageKey) -> bool:
        """Whether bounds of a page are wide: they will be smaller when its records are computed anew."""
        level, row, col = key
        area = slice(row * self.tile, (row + 1) * self.tile), slice(col * self.tile, (col + 1) * self.tile)
        return level > 0 and self._records.is_wide(level, area)

    @property
    def is_edited(self) -> bool:
        """Whether a post differs from the store's."""
        return bool(self._heights[0].tiles)

    def edited(self) -> dict[tuple[int, int], np.ndarray]:
        """The edited posts: tiles of `tile` posts a side, by their row and column; NaN for posts without an edit."""
        return {at: tile.copy() for at, tile in self._heights[0].tiles.items()}

    # --- Records that were computed anew ------------------------------------------------------------------------------

    def take(self, square: Square, levels: Iterable[tuple[np.ndarray, np.ndarray]]) -> list[PageKey]:
        """Store new records and ranges of all nodes inside a square; returns the pages that change.

        `levels` has one pair (records, ranges) for each level from 1 on, computed from the present heights.
        """
        keys: list[PageKey] = []
        self.changes += 1
        for level, (errors, ranges) in enumerate(levels, 1):
            area = self._inside(square, level)
            rows, cols = (s.stop - s.start for s in area)
            if nodes := self._records.note_exact(level, area, errors[:rows, :cols], ranges[:, :rows, :cols]):
                keys += self._pages_of(nodes, level)
        self._versions.update(dict.fromkeys(keys, self.changes))
        for other in [each for each in self.wide if each.level <= square.level]:
            more = square.level - other.level
            if (other.row >> more, other.col >> more) == (square.row, square.col):
                del self.wide[other]
        return keys

    def _inside(self, square: Square, level: int) -> Area:
        """The nodes of a level inside a square, and on the map."""
        more = square.level - level
        places = zip((square.row, square.col), self.nodes(level), strict=True)
        rows, cols = (slice(k << more, min((k + 1) << more, n)) for k, n in places)
        return rows, cols

    def _pages_of(self, nodes: Area, level: int) -> list[PageKey]:
        rows, cols = (range(s.start // self.tile, (s.stop - 1) // self.tile + 1) for s in nodes)
        return [(level, row, col) for row in rows for col in cols]

    # --- Reading ------------------------------------------------------------------------------------------------------

    def page(self, key: PageKey) -> Page:
        """Read a page with its edits."""
        level = key[0]
        page = self._roots[key] if key in self._roots else self.base.page(key)
        places = zip(key[1:], page.heights.shape, strict=True)
        rows, cols = (slice(k * self.tile, k * self.tile + n - 1) for k, n in places)
        posts = slice(rows.start, rows.stop + 1), slice(cols.start, cols.stop + 1)
        heights = self._patched(page.heights, level, posts)
        marks = None if page.marks is None else self._dried(page.marks, level, posts)
        if level == 0:
            return page._replace(heights=heights, marks=marks)
        errors, ranges = self._records.of(page, level, (rows, cols), self.range_m[1] - self.range_m[0])
        return Page(heights, errors, ranges, marks)

    def lattice_heights(self, level: int, rows: slice, cols: slice) -> np.ndarray:
        """Heights of posts of a level's lattice, with edits."""
        return self._patched(self.base.lattice_heights(level, rows, cols), level, (rows, cols))

    def lattice_marks(self, level: int, rows: slice, cols: slice) -> np.ndarray | None:
        """Marks of posts of a level's lattice, with edits."""
        marks = self.base.lattice_marks(level, rows, cols)
        return None if marks is None else self._dried(marks, level, (rows, cols))

    def _dried(self, marks: np.ndarray, level: int, posts: Area) -> np.ndarray:
        """Marks, without water at posts that an edit has moved. Voids stay."""
        patch = self._heights[level].get(posts)
        return marks if patch is None else np.where(np.isnan(patch), marks, marks & ~np.uint8(WET))

    def _patched(self, heights: np.ndarray, level: int, posts: Area) -> np.ndarray:
        patch = self._heights[level].get(posts)
        return heights if patch is None else np.where(np.isnan(patch), heights, patch)


def _scale(heightmap: PagedMap) -> Scale:
    _, low_m, span_m = quantisation_range(*heightmap.quantised_m)
    return Scale(low_m, span_m)
