"""The time that one frame may take: long work is done in steps, and slow pictures are drawn smaller in motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

HURRIED = 0.2  # share of the time that work gets while the picture moves
COARSEST = 4  # most window pixels across one pixel of a picture in motion
POWER = 4 / 3  # a picture of 1/s of the width and height takes about s^-POWER of the time: benchmarks/motion.py
CALM = 0.8  # a larger picture has to fit this part of the time, so that sizes do not alternate


@dataclass
class FrameBudget:
    """Keeps the window responsive.

    Attributes
    ----------
    clock
        Measures the work, in seconds. It is not the time at which frames are shown.
    work_s
        Seconds of a frame that go to long work, such as building tables.
    motion_ms
        Milliseconds that a picture in motion may take. It is drawn in the largest size that fits.
    full_ms
        Milliseconds that a full picture takes, as the last picture suggests. It is infinite at first, so that the first
        picture comes quickly.
    shrink
        Window pixels across one pixel of the next picture in motion: 1 to COARSEST.
    """

    clock: Callable[[], float] = time.perf_counter
    work_s: float = 0.03
    motion_ms: float = 150.0
    full_ms: float = float("inf")
    shrink: int = COARSEST

    def __post_init__(self) -> None:
        """Begin small, if time is limited."""
        self.forget()

    def note(self, drawn_ms: float, shrink: int) -> None:
        """Learn from the time of a picture of 1/shrink of the width and height; choose the size of the next one."""
        self.full_ms = drawn_ms * shrink**POWER
        sizes = range(1, COARSEST + 1)
        self.shrink = next((s for s in sizes if self._fits(s, CALM if s < self.shrink else 1.0)), COARSEST)

    def forget(self) -> None:
        """Know nothing about the next picture: it comes in the smallest size."""
        self.note(float("inf"), 1)

    def _fits(self, shrink: int, share: float) -> bool:
        return self.full_ms / shrink**POWER <= share * self.motion_ms

    def run(
        self, work: Iterator[float], tell: Callable[[float], None] = lambda share: None, hurried: bool = False
    ) -> bool:
        """Do steps of some work until the time is up, but at least one.

        Parameters
        ----------
        work
            Yields its progress, from 0 to 1, after each step.
        tell
            Called with that progress.
        hurried
            Take only a fraction of the time, because a frame in motion waits.

        Returns
        -------
        bool
            Whether the work is done.
        """
        end = self.clock() + self.work_s * (HURRIED if hurried else 1.0)
        for share in work:
            tell(share)
            if self.clock() > end:
                return False
        return True
