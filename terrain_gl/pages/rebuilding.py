"""Compute the records of edited nodes anew, in a thread with an OpenGL context of its own.

A *square* is a node: its record, and those of all nodes inside it, are computed together from its posts (crop.py).
Small squares come first, so that most bounds are exact soon; then squares of the coarsest level. If a square is edited
while it is computed, the result is dropped, and it is computed again.
"""

import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple

from ..basics.exceptions import reason_of
from ..gpu.layout import VOID
from .crop import APRON, Records, record_steps, release_context
from .edited_map import EditedMap, Square
from .map import PageKey


class Rebuild(NamedTuple):
    """A square, the map that it is in, and the last edit that touched it; then its records."""

    heightmap: EditedMap
    square: Square
    edit: int
    levels: Future[list[Records]]


class Rebuilder:
    """A thread that computes records of edited nodes."""

    def __init__(self) -> None:
        self.failed = ""  # why the last square could not be computed
        self._job: Rebuild | None = None
        self._closed = threading.Event()
        self._thread = ThreadPoolExecutor(1, "rebuilding records")

    @property
    def is_busy(self) -> bool:
        """Whether a square is being computed, or its records wait for `take`."""
        return self._job is not None

    @property
    def has_ready(self) -> bool:
        """Whether records are ready."""
        return self._job is not None and self._job.levels.done()

    def want(self, heightmap: EditedMap) -> None:
        """Begin the next wide square of a map, unless the thread is busy."""
        if self._job is None and heightmap.wide:
            square = min(heightmap.wide)
            levels = self._thread.submit(self._computed, heightmap, square)
            self._job = Rebuild(heightmap, square, heightmap.wide[square], levels)
            self.failed = ""

    def wait(self, seconds: float) -> None:
        """Wait until records are ready, at most for some seconds."""
        if self._job:
            wait([self._job.levels], seconds)

    def take(self, heightmap: EditedMap) -> list[PageKey]:
        """Store ready records in the map, unless their square was edited meanwhile; returns the pages that change."""
        job = self._job
        if job is None or not job.levels.done():
            return []
        self._job = None
        if error := job.levels.exception():
            self.failed = reason_of(error)
            return []
        is_old = heightmap.wide.get(job.square) != job.edit
        return [] if job.heightmap is not heightmap or is_old else heightmap.take(job.square, job.levels.result())

    def release(self) -> None:
        """End the thread after its present step."""
        self._closed.set()
        self._thread.submit(release_context)
        self._thread.shutdown()

    def _computed(self, heightmap: EditedMap, square: Square) -> list[Records]:
        """The records of a square; none if the thread must end."""
        level, row, col = square
        sides = ((k << level, n) for k, n in zip((row, col), (heightmap.rows, heightmap.cols), strict=True))
        rows, cols = (slice(first, min(first + (1 << level) + APRON, n)) for first, n in sides)
        heights = heightmap.lattice_heights(0, rows, cols)
        marks = heightmap.lattice_marks(0, rows, cols)
        void = None if marks is None else (marks & VOID) > 0
        steps = record_steps(heights, heightmap.ground_spacing_m, heightmap.quantised_m, level, void)
        while not self._closed.is_set():
            try:
                next(steps)
            except StopIteration as end:
                found: list[Records] = end.value
                return found
            time.sleep(0)  # other threads go first
        steps.close()
        return []
