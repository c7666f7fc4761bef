"""Compute the records of edited nodes anew, in a thread with an OpenGL context of its own.

A *square* is a node: its record, and those of all nodes inside it, are computed together from its posts (crop.py).
Small squares come first, so that most bounds are exact soon; then squares of the coarsest level. If a square is edited
while it is computed, the result is dropped, and it is computed again.
"""

import threading
import time
from typing import NamedTuple

from ..basics.exceptions import TerrainError
from ..gpu.layout import VOID
from .crop import APRON, Records, record_steps, release_context
from .edited_map import EditedMap, Square
from .map import PageKey


class Rebuild(NamedTuple):
    """A square, the map that it is in, and the last edit that touched it."""

    heightmap: EditedMap
    square: Square
    edit: int


class Rebuilder:
    """A thread that computes records of edited nodes.

    Attributes
    ----------
    failed
        Why the last square could not be computed; "" if it could.
    """

    def __init__(self) -> None:
        self.failed = ""
        self._job: Rebuild | None = None
        self._found: tuple[Rebuild, list[Records], tuple[float, float]] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="rebuilding records", daemon=True)
        self._thread.start()

    @property
    def is_busy(self) -> bool:
        """Whether a square is being computed, or its records wait for `take`."""
        with self._changed:
            return self._job is not None

    @property
    def has_ready(self) -> bool:
        """Whether records are ready."""
        with self._changed:
            return self._found is not None

    def want(self, heightmap: EditedMap) -> None:
        """Begin the next wide square of a map, unless the thread is busy."""
        with self._changed:
            if self._job is None and heightmap.wide:
                square = min(heightmap.wide)
                self._job = Rebuild(heightmap, square, heightmap.wide[square])
                self.failed = ""
                self._changed.notify_all()

    def wait(self, seconds: float) -> None:
        """Wait until records are ready, at most for some seconds."""
        with self._changed:
            if self._job is not None and self._found is None:
                self._changed.wait(seconds)

    def take(self, heightmap: EditedMap) -> list[PageKey]:
        """Store ready records in the map, unless their square was edited meanwhile; returns the pages that change."""
        with self._changed:
            found = self._found
            self._found = None
            if found is None:
                return []
            self._job = None
        (of, square, edit), levels, range_m = found
        if of is not heightmap or heightmap.wide.get(square) != edit or heightmap.quantised_m != range_m:
            return []
        return heightmap.take(square, levels)

    def release(self) -> None:
        """End the thread after its present step."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def _work(self) -> None:
        try:
            while (job := self._next()) is not None:
                try:
                    found = self._computed(job)
                    with self._changed:
                        self._found = None if found is None else (job, *found)
                        self._changed.notify_all()
                except Exception as error:  # a thread must report every error
                    words = " ".join(str(error).split())
                    reason = words if isinstance(error, TerrainError) else f"{type(error).__name__}: {words}"
                    with self._changed:
                        self.failed = reason
                        self._job = None
                        self._changed.notify_all()
        finally:
            release_context()

    def _computed(self, job: Rebuild) -> tuple[list[Records], tuple[float, float]] | None:
        """The records of a square, and the quantisation range they are in; None if the thread must end."""
        heightmap = job.heightmap
        range_m = job.heightmap.quantised_m
        level, row, col = job.square
        sides = ((k << level, n) for k, n in zip((row, col), (heightmap.rows, heightmap.cols), strict=True))
        rows, cols = (slice(first, min(first + (1 << level) + APRON, n)) for first, n in sides)
        heights = heightmap.lattice_heights(0, rows, cols)
        marks = heightmap.lattice_marks(0, rows, cols)
        void = None if marks is None else (marks & VOID) > 0
        steps = record_steps(heights, heightmap.ground_spacing_m, range_m, level, void)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return end.value, range_m
            if self._closed:
                steps.close()
                return None
            time.sleep(0)  # other threads go first

    def _next(self) -> Rebuild | None:
        with self._changed:
            while not self._closed and (self._job is None or self._found is not None):
                self._changed.wait()
            return None if self._closed else self._job
