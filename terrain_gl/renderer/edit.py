"""Edits: new heights for a rectangle of posts. All tables become the same, bit for bit, as after a rebuild.

    heights → error tables → baselines → sums of heights → light

The tables store heights and errors in units that are chosen from the heights of the opened map (`heightmap.units_for`).
They also hold heights beyond these. So the cost of an edit grows with its rectangle. A map in memory whose heights
double or halve their range gets new units and new tables (`terrain.units_suit`).
"""

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..basics.exceptions import UsageError
from ..basics.rect import Rect, hull
from ..basics.steps import Steps
from ..files.edits import read_edits
from ..gpu.session import in_session, steps_in_session
from ..heightmap import real_heights
from ..pages.edited_map import EditedMap
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
    def edit(self, rows: slice | int, cols: slice | int, heights: ArrayLike, settle: bool = True) -> None:
        """Give a rectangle of posts new heights, NaN for voids; all tables become the same as after a rebuild.

        The voids of a store do not change, and its bounds are wide until `rebuild_steps` (docs/stores.md).

        The time grows with the rectangle, and with the part of the map south-east of it, where sums change.

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
            Heights beyond `heightmap.MAX_HEIGHT_M`, or beyond what the tables of a store can hold, or no post of the
            map would have a height. The map is then unchanged.
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


def _span(n: int, which: slice | int, name: str) -> slice:
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
