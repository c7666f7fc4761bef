"""Edits: new heights for a rectangle of posts. All tables become the same, bit for bit, as after a rebuild.

    heights → error tables → baselines → sums of heights → light

The tables store heights and errors as fractions of a quantisation range (`terrain.quantisation_range`). The cost of an
edit inside the range grows with its rectangle. An edit outside the range widens it and rebuilds everything.
`Editor.headroom_steps` widens the range in advance, while the old tables stay in use.
"""

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.rect import Rect, hull
from ..basics.steps import Steps, drain
from ..files.edits import read_edits
from ..gpu.session import in_session, steps_in_session
from ..heightmap import real_heights
from ..pages.edited_map import EditedMap
from ..terrain import Terrain
from .gpu_resources import GpuResources

MOST_POSTS = 1 << 24  # most posts of a store that one edit may change


class Editor:
    """Gives posts new heights, and updates everything that is computed from them.

    `forget` is called when the last frame no longer shows the present map.
    """

    def __init__(self, resources: GpuResources, forget: Callable[[], None]) -> None:
        self.session = resources.session
        self.resources = resources
        self._forget = forget
        self._unlit: Rect | None = None  # posts edited since the last update of the light

    @in_session
    def edit(self, rows: slice | int, cols: slice | int, heights: Any, settle: bool = True) -> None:
        """Give a rectangle of posts new heights, NaN for voids; all tables become the same as after a rebuild.

        The voids of a store do not change, and its bounds are wide until `rebuild_steps` (docs/stores.md).

        The time grows with the rectangle, and with the part of the map south-east of it, where sums change. If heights
        leave the quantisation range, everything is rebuilt: see `make_headroom`.

        Parameters
        ----------
        rows, cols
            The posts, as slices or numbers; negative numbers count from the end.
        heights
            Metres, in a shape that fits; NaN, ±Inf and masked values are voids.
        settle
            Update the light, too. That takes longer, because an edit changes shadows far away. During a brush stroke
            the light can wait: call `settle` at its end.

        Raises
        ------
        UsageError
            Heights of another shape, or not real numbers; posts beyond the map.
        TerrainError
            Heights beyond `heightmap.MAX_HEIGHT_M`, or no post of the map would have a height. The map is then
            unchanged.
        """
        new = real_heights(heights, "edit")
        heightmap = self.resources.terrain.heightmap
        y, x = _span(heightmap.rows, rows, "rows"), _span(heightmap.cols, cols, "cols")
        if y.start == y.stop or x.start == x.stop:
            return
        try:
            new = np.broadcast_to(new, (y.stop - y.start, x.stop - x.start))
        except ValueError as error:
            raise UsageError(f"edit: {error}") from None
        if self.resources.streaming and not np.isfinite(new).all():
            raise UsageError("edit: the voids of a store do not change: give every post a height")
        if self.resources.streaming and new.size > MOST_POSTS:
            most = f"at most {MOST_POSTS:,} posts of a store at once, got {new.size:,}"
            raise UsageError(f"edit: {most}: edit it in parts")
        self.write(x.start, y.start, new, settle)

    @in_session
    def write(self, x: int, y: int, heights: np.ndarray, settle: bool = True) -> None:
        """As `edit`, for the posts from column x and row y on. In a store, NaN leaves a post as it is."""
        self._forget()
        resources = self.resources
        with resources.timer.stage("edit"):
            if rect := resources.terrain.edit(x, y, heights):
                resources.tables.update(rect)
                resources.selectors.update(rect)
                resources.picture.update(rect)
                self._unlit = hull(self._unlit or rect, rect)
        if resources.streaming:
            resources.streaming.follow(more_follow=not settle)
        if settle:
            self.settle()

    @in_session
    def load(self, path: str | os.PathLike[str]) -> None:
        """Apply the edits of a file to a store. Exceptions are those of `read_edits` and `write`."""
        before = self.resources.terrain.heightmap
        for x, y, heights in read_edits(path, before):
            self.write(x, y, heights, settle=False)
        self.settle()
        after = self.resources.terrain.heightmap
        if isinstance(after, EditedMap) and not isinstance(before, EditedMap):
            after.saved_as = os.path.abspath(path)

    @in_session
    def settle(self) -> None:
        """Update the light after edits with `settle=False`."""
        if self.resources.streaming:
            self.resources.streaming.follow()
        if self._unlit:
            self.resources.picture.settle(self._unlit)
            self._unlit = None

    @steps_in_session
    def rebuild_steps(self) -> Steps[None]:
        """Compute the records of edited nodes of a store anew, in a thread; yields progress from 0 to 1.

        After a TerrainError (a tile cannot be read, the thread has no OpenGL) bounds stay wide, but they still hold.
        """
        if self.resources.streaming:
            self._forget()
            yield from self.resources.streaming.rebuild_steps()

    @property
    def headroom_m(self) -> tuple[float, float]:
        """How far edits may go below the lowest post and above the highest before everything is rebuilt, in metres."""
        return self.resources.terrain.headroom_m

    def make_headroom(self, up_m: float, down_m: float = 0.0) -> None:
        """Prepare for edits up to `up_m` above the highest post and `down_m` below the lowest.

        Edits are correct without this, but slower: the first edit copies the map, and an edit that leaves the
        quantisation range rebuilds all tables. Exceptions are those of `headroom_steps`.
        """
        with self.session.turn():
            drain(self.headroom_steps(up_m, down_m))

    @steps_in_session
    def headroom_steps(self, up_m: float, down_m: float = 0.0) -> Steps[None]:
        """Incremental `make_headroom`; yields progress from 0 to 1, or nothing if there is enough headroom.

        New tables are built while the old ones stay in use. Drawing between steps is allowed; an edit ends the work.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        TerrainError
            The map was edited since the last step. The map is as the edit left it.
        """
        if not self.resources.streaming:  # a store needs no headroom in advance
            yield from self._take_steps(self.resources.terrain.with_headroom(up_m, down_m))

    @steps_in_session
    def range_steps(self, quantised_m: tuple[float, float]) -> Steps[None]:
        """Remove headroom in steps, as `headroom_steps` adds it; `quantised_m`: earlier `Heightmap.quantised_m`."""
        if not self.resources.streaming:
            yield from self._take_steps(self.resources.terrain.with_range(quantised_m))

    def _take_steps(self, terrain: Terrain | None) -> Steps[None]:
        """Build tables for the same map with another quantisation range, then use both."""
        if terrain is None:
            return
        mine = self.resources.terrain
        edits = mine.edits
        tables = None
        try:
            yield 0.0
            tables = self.resources.tables.empty_for(terrain)
            yield 0.0
            for share in tables.build_steps():
                self._check_unedited(edits)
                self.session.ctx.finish()  # a step ends when the GPU has finished it
                yield 0.9 * share
            self._check_unedited(edits)
            moved = terrain.base_m != mine.base_m  # heights are relative to this base
            mine.swap(terrain)
            self.resources.tables.swap(tables)
        finally:  # after `swap`, these objects hold the old tables; after a failure, the unfinished ones
            terrain.release()
            if tables:
                tables.release_tables()
        self._forget()
        if moved:
            self.resources.selectors.update(mine.all_posts)
        self.resources.picture.update(mine.all_posts)
        self.resources.picture.settle(mine.all_posts, moved=moved)
        yield 1.0

    def _check_unedited(self, edits: int) -> None:
        if self.resources.terrain.edits != edits:  # else parts of the new tables would have the old heights
            raise TerrainError("the map was edited while headroom was made for edits: begin again")


def _span(n: int, which: Any, name: str) -> slice:
    """The posts from `start` to `stop` that a slice or a number selects among n."""
    try:
        posts = range(n)[which]
    except (IndexError, TypeError, ValueError):
        posts = None
    if isinstance(posts, int):
        posts = range(posts, posts + 1)
    if posts is None or posts.step != 1 or isinstance(which, bool):
        one = f"a number from {-n} to {n - 1}"
        raise UsageError(f"edit: {name} must be a slice without a step, or {one}, got {which!r}")
    return slice(posts.start, max(posts.start, posts.stop))
