"""The time that one frame may take: long work is done in steps, and slow pictures are drawn smaller in motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

HURRIED = 0.2  # share of the time that work gets while the picture moves


@dataclass
class FrameBudget:
    """Keeps the window responsive.

    Attributes
    ----------
    clock
        Measures the work, in seconds. It is not the time at which frames are shown.
    work_s
        Seconds of a frame that go to long work, such as building tables.
    smooth_ms, coarse_ms
        In motion, a picture is drawn at half its size if the full one takes longer than `smooth_ms`, and at a quarter
        if it takes longer than `coarse_ms`.
    full_ms
        Milliseconds of the last full picture. It is infinite at first, so that the first picture comes quickly.
    """

    clock: Callable[[], float] = time.perf_counter
    work_s: float = 0.03
    smooth_ms: float = 50.0
    coarse_ms: float = 200.0
    full_ms: float = float("inf")

    @property
    def shrink(self) -> int:
        """Window pixels across one pixel of the picture in motion."""
        return 1 + (self.full_ms > self.smooth_ms) + 2 * (self.full_ms > self.coarse_ms)

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
