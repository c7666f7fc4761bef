"""How much is done between two looks at the window's events, and how coarsely a picture is drawn while it moves."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

HURRIED = 0.2  # of a portion's time


@dataclass
class Pace:
    """What keeps the window from waiting: long work in portions, and smaller pictures where full ones take long.

    Attributes
    ----------
    clock
        Seconds, by which work is timed; not the time that frames are shown at.
    portion_s
        Spent on work that may wait, in each frame.
    smooth_ms, coarse_ms
        Full pictures that take longer than these are drawn at half, at a quarter of their size in motion.
    full_ms
        What a full picture took last; nobody knows at first, and the first one is to come quickly.
    """

    clock: Callable[[], float] = time.perf_counter
    portion_s: float = 0.03
    smooth_ms: float = 50.0
    coarse_ms: float = 200.0
    full_ms: float = float("inf")

    @property
    def shrink(self) -> int:
        """Window pixels across one of the picture in motion."""
        return 1 + (self.full_ms > self.smooth_ms) + 2 * (self.full_ms > self.coarse_ms)

    def go_on(
        self, work: Iterator[float], tell: Callable[[float], None] = lambda share: None, hurried: bool = False
    ) -> bool:
        """Go through portions of work for a while, at least one, and tell the share that is done; whether all is.

        `hurried`: for a fraction of the time, for it is a frame in motion that waits.
        """
        end = self.clock() + self.portion_s * (HURRIED if hurried else 1.0)
        for share in work:
            tell(share)
            if self.clock() > end:
                return False
        return True
