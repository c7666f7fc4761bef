"""Edits: new heights for a rectangle of posts. All tables become what a rebuild would make them, bit for bit.

    heights → error tables → baselines → sums of heights → light

The tables store heights and errors as integers within a quantisation range (`Terrain.quantisation_range_m`). Edits that
stay within it cost what the rectangle costs. The first edit beyond it widens the range, and everything is built anew.
`Editor.headroom_steps` widens it ahead, beside the tables that are in use.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .exceptions import TerrainError, UsageError
from .gpu.session import in_session, steps_in_session
from .gpu_resources import GpuResources
from .heightmap import real_heights
from .steps import Steps, drain
from .terrain import Rect, hull


class Editor:
    """Gives posts new heights, and has everything follow that is computed from them.

    Parameters
    ----------
    resources
        The map on the GPU.
    forget
        Called when the last frame no longer shows the map.
    """

    def __init__(self, resources: GpuResources, forget: Callable[[], None]) -> None:
        self.session, self.resources = resources.session, resources
        self._forget = forget
        self._unlit: Rect | None = None  # what was edited since the light followed last

    @in_session
    def edit(self, rows: slice | int, cols: slice | int, heights: Any, settle: bool = True) -> None:
        """Give a rectangle of posts new heights, NaN for voids; all tables become what a rebuild would make them.

        Time grows with the rectangle. But the tables' sums change everywhere south-east of it, and everything is built
        anew when heights leave the quantisation range: see `make_headroom`.

        Parameters
        ----------
        rows, cols
            Which posts, as slices or numbers, counted from the end where negative.
        heights
            Metres, of a shape that fits; NaN, ±Inf and masked values are voids.
        settle
            Have the light follow, too. Light depends on far parts of the map: while one sculpts, it can wait for
            `settle`.

        Raises
        ------
        UsageError
            Heights of another shape, or not real numbers; posts beyond the map.
        TerrainError
            Heights out of range, or voids alone; the map is then unchanged.
        """
        new = real_heights(heights, "edit")
        shape = self.resources.terrain.heightmap.heights.shape
        y, x = _chosen(shape[0], rows, "rows"), _chosen(shape[1], cols, "cols")
        if not (len(y) and len(x)):
            return
        patch = self._patch(y, x, new)
        self._forget()
        with self.resources.timer.stage("edit"):
            if rect := self.resources.terrain.edit(int(x.min()), int(y.min()), patch):
                self.resources.tables.update(rect)
                self.resources.selectors.update(rect)
                self.resources.picture.update(rect)
                self._unlit = hull(self._unlit or rect, rect)
        if settle:
            self.settle()

    @in_session
    def settle(self) -> None:
        """Have the light follow all edits that were made with `settle=False`."""
        if self._unlit:
            self.resources.picture.settle(self._unlit)
            self._unlit = None

    @property
    def is_settled(self) -> bool:
        """Whether the light follows all edits."""
        return self._unlit is None

    @property
    def headroom_m(self) -> tuple[float, float]:
        """How far edits may dig below the lowest post, and raise the highest, before everything is built anew."""
        return self.resources.terrain.headroom_m

    def make_headroom(self, up_m: float, down_m: float = 0.0) -> None:
        """Get ready for edits that raise the highest post by `up_m` and dig `down_m` below the lowest.

        Edits are as correct without it. But the first edit copies the map, and one that leaves the quantisation range
        builds all tables anew.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        """
        drain(self.headroom_steps(up_m, down_m))

    @steps_in_session
    def headroom_steps(self, up_m: float, down_m: float = 0.0) -> Steps[None]:
        """Incremental `make_headroom`; yields progress from 0 to 1, or nothing where there is enough headroom.

        New tables are built beside those in use. One may draw meanwhile; an edit ends it.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        TerrainError
            The map was edited since the last step. The map is as the edit left it.
        """
        mine = self.resources.terrain
        terrain, tables, edits = mine.with_headroom(up_m, down_m), None, mine.edits
        if terrain is None:
            return
        try:
            yield 0.0
            tables = self.resources.tables.beside(terrain)
            yield 0.0
            for share in tables.build_steps():
                self._check_unedited(edits)
                self.session.ctx.finish()  # a step is done when the GPU has done it
                yield 0.9 * share
            self._check_unedited(edits)
            moved = terrain.base_m != mine.base_m
            mine.take(terrain)
            self.resources.tables.take(tables)
        finally:  # they hold what was in use before, or what was not finished
            terrain.release()
            if tables:
                tables.release_tables()
        self._follow_new_range(moved)
        yield 1.0

    def _follow_new_range(self, moved: bool) -> None:
        """Follow another quantisation range; `moved`: heights count from another base."""
        self._forget()
        everything, picture = self.resources.terrain.all_posts, self.resources.picture
        if moved:
            self.resources.selectors.update(everything)
        picture.update(everything)
        picture.settle(everything, moved=moved)

    def _patch(self, y: np.ndarray, x: np.ndarray, new: np.ndarray) -> np.ndarray:
        """The heights of the smallest rectangle that holds rows y and columns x, with the new ones in place."""
        patch = self.resources.terrain.heightmap.heights[y.min() : y.max() + 1, x.min() : x.max() + 1]
        patch = patch.astype(np.result_type(patch, new))
        try:
            patch[np.ix_(y - y.min(), x - x.min())] = new
        except ValueError as error:
            raise UsageError(f"edit: {error}") from None
        return patch

    def _check_unedited(self, edits: int) -> None:
        if self.resources.terrain.edits != edits:  # half of the new tables would be of other heights
            raise TerrainError("the map was edited while headroom was made for edits: begin again")


def _chosen(n: int, which: Any, name: str) -> np.ndarray:
    """Indices of the posts that a slice or a number selects among n."""
    try:
        chosen = np.atleast_1d(np.arange(n)[which])
    except (IndexError, TypeError, ValueError):
        chosen = None
    if chosen is None or chosen.ndim > 1:
        raise UsageError(f"edit: {name} must be a slice, or numbers from {-n} to {n - 1}, got {which!r}")
    return chosen
