"""How a split picture is put together: where each side is, and which columns of its picture it shows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..renderer.names import Label


class Part(NamedTuple):
    """The columns of pixels of a side, and by how many columns its picture is moved to the right there."""

    first: int
    last: int
    shift: int


@dataclass(frozen=True)
class Split:
    """One side or two. Each side has a whole picture of its own, and shows a part of it."""

    sides: int = 1
    divider: float = 0.5  # where the sides meet, from 0 at the left edge to 1
    swapped: bool = False  # whether the first side is on the right
    centred: bool = False  # whether each side shows the middle of its picture: then both show the same land
    covered: float = 0.0  # share of the width at the left that the panel covers

    def part(self, side: int) -> tuple[float, float]:
        """Where a side begins and ends, from 0 at the left edge to 1."""
        if self.sides == 1:
            return 0.0, 1.0
        return (self.divider, 1.0) if self.is_right(side) else (0.0, self.divider)

    def is_right(self, side: int) -> bool:
        """Whether a side is right of the divider."""
        return bool(side) != self.swapped

    def side_at(self, share: float) -> int:
        """The side at a place across the picture, from 0 at the left edge to 1."""
        return int(self.sides > 1 and (share > self.divider) != self.swapped)

    def shift(self, side: int) -> float:
        """By which share of the width the picture of a side is moved to the right."""
        if self.sides == 1 or not self.centred:
            return 0.0
        begin, end = self.part(side)
        return 0.5 * (max(begin, min(self.covered, end)) + end) - 0.5

    def parts(self, width: int) -> list[Part]:
        """The columns of each side in a picture of this width."""
        ends = ((*self.part(side), self.shift(side)) for side in range(self.sides))
        return [Part(round(first * width), round(last * width), round(shift * width)) for first, last, shift in ends]

    def moved(self, labels: Sequence[Label], width: int) -> list[Label]:
        """Labels of the unmoved picture at their places on each side."""
        at = [(each._replace(x=each.x + part.shift), part) for part in self.parts(width) for each in labels]
        return [label for label, part in at if part.first <= label.x < part.last]


WHOLE = Split()
