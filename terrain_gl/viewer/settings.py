"""What is drawn and what is shown beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..drawing import CHOICES, EVERY_POST, Drawing

STEP = 2**0.5  # of the tolerance
TOLERANCES_PX = (2.0**-5, 2.0**8)
BUDGETS = (100, 10_000_000)  # triangles


@dataclass
class Settings:
    """How a frame is drawn, and which panels stand over it.

    Attributes
    ----------
    sides
        How the picture is drawn; two where it is split, left and right.
    active
        The side that keys change.
    divider
        Where the picture is split, from 0, its left edge, to 1.
    lens
        How many times larger things are under the magnifying glass; 0 without one.
    sums, box
        Whether the summed-area table is shown, and posts along a side of the box that is read from it.
    figures, keys
        Whether figures are shown; which page of the keys, 0 for none.
    """

    sides: list[Drawing] = field(default_factory=lambda: [Drawing()])
    active: int = 0
    divider: float = 0.5
    lens: float = 0.0
    sums: bool = False
    box: int = 64
    figures: bool = True
    keys: int = 0

    @property
    def drawing(self) -> Drawing:
        """Of the active side."""
        return self.sides[self.active]

    def draw(self, **changes: Any) -> None:
        """Draw the active side otherwise; a tolerance takes the place of a number of triangles, and the other way."""
        self.sides[self.active] = self.drawing.otherwise(**changes)

    def draw_both(self, **changes: Any) -> None:
        """Draw all sides otherwise."""
        self.sides = [side.otherwise(**changes) for side in self.sides]

    @property
    def split(self) -> bool:
        """Whether there are two sides."""
        return len(self.sides) > 1

    def cycle(self, option: str, step: int = 1) -> str:
        """Take the next choice of an option of `Drawing`; returns it."""
        choices = [choice for choice in CHOICES[option] if choice not in EVERY_POST or not self.drawing.triangles]
        chosen = choices[(choices.index(getattr(self.drawing, option)) + step) % len(choices)]
        self.draw(**{option: chosen})
        return chosen

    def loosen(self, steps: float) -> None:
        """Raise the tolerance by steps of ×√2, or lower it; with a budget, the triangles the other way."""
        least, most = TOLERANCES_PX
        if self.drawing.max_error_px:
            now_px = self.drawing.max_error_px
            looser = now_px * STEP**steps if steps > 0 else now_px / STEP**-steps  # back and forth comes out the same
            self.draw(max_error_px=min(max(looser, least), most))
        elif self.drawing.triangles:
            least, most = BUDGETS
            self.draw(triangles=round(min(max(self.drawing.triangles / STEP**steps, least), most)))
