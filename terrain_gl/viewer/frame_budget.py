"""Limit the time of a frame: long work is done in steps, and in motion slow pictures are drawn coarser."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

HURRIED = 0.2  # share of `work_s` that long work gets while the picture moves
CALM = 0.8  # a better picture has to fit this part of the time, so that pictures do not alternate


class Way(NamedTuple):
    """A way to draw a picture in motion."""

    shrink: int  # window pixels across one pixel of the picture
    looser: int  # factor of the tolerance, in pixels of the picture
    share: float  # processor time, relative to the full picture

    @property
    def is_full(self) -> bool:
        """Whether this is the picture that is drawn at rest."""
        return self.shrink == self.looser == 1

    def words(self, tolerance_px: float | None) -> str:
        """This way as text for panels; "" for the full picture. Baselines have no tolerance."""
        size = [f"1/{self.shrink} size"] if self.shrink > 1 else []
        loose = [f"tolerance {tolerance_px:.3g} px"] if tolerance_px and not self.is_full else []
        return ", ".join(size + loose)


# Colours come from the map and not from the mesh, so a coarser mesh harms the picture less than fewer pixels do.
# Shares are means over the bundled maps: benchmarks/motion.py
WAYS = (
    Way(1, 1, 1.0),
    Way(1, 2, 0.77),
    Way(1, 4, 0.66),
    Way(2, 2, 0.33),
    Way(2, 4, 0.27),
    Way(3, 2, 0.21),
    Way(4, 2, 0.175),
)
FULL = WAYS[0]
COARSEST = WAYS[-1]


@dataclass
class FrameBudget:
    """Keeps the window responsive. A picture in motion is drawn in the best way that fits `motion_ms`."""

    clock: Callable[[], float] = time.perf_counter  # measures the work; frames are shown by another clock
    work_s: float = 0.03  # seconds of a frame that go to long work, such as building tables
    motion_ms: float = 150.0  # milliseconds that a picture in motion may take
    full_ms: float = float("inf")  # milliseconds of a full picture, as the last picture suggests
    way: Way = COARSEST  # how the next picture in motion is drawn

    def __post_init__(self) -> None:
        self.forget()

    def note(self, drawn_ms: float, way: Way) -> None:
        """Learn from the time of a picture; choose how the next one is drawn."""
        self.full_ms = drawn_ms / way.share
        self.way = next((each for each in WAYS if self._fits(each)), COARSEST)

    def forget(self) -> None:
        """Forget the times of pictures. The next picture is drawn in the coarsest way."""
        self.note(float("inf"), FULL)

    def _fits(self, way: Way) -> bool:
        is_better = way.share > self.way.share
        return self.full_ms * way.share <= self.motion_ms * (CALM if is_better else 1.0)

    def run(
        self, work: Iterator[float], tell: Callable[[float], None] = lambda share: None, hurried: bool = False
    ) -> bool:
        """Do steps of some work until the time is up, but at least one; returns whether the work is done.

        Each step yields its progress, from 0 to 1, and `tell` is called with it. Hurried work takes only a part of the
        time, because a frame in motion waits.
        """
        end = self.clock() + self.work_s * (HURRIED if hurried else 1.0)
        for share in work:
            tell(share)
            if self.clock() > end:
                return False
        return True
