"""What is drawn and what is shown beside it, and the keys that change that."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..drawing import METHODS, Drawing
from ..lod import METRICS
from ..shade import STYLES

STEP = 2**0.5  # of the tolerance
TOLERANCES_PX = (2.0**-5, 2.0**8)

KEYS = (
    ("W A S D", "fly ahead, left, back, right"),
    ("E Q", "up, down"),
    ("Shift", "five times as fast"),
    ("wheel", "speed"),
    ("right drag", "look around"),
    ("C", "look around without a button"),
    ("left drag", "orbit what is under the cursor"),
    ("Home", "back to the first view"),
    ("G", "stay above ground, or not"),
    ("1 … 6  Tab", "style: " + ", ".join(STYLES[:3]) + ","),
    ("", ", ".join(STYLES[3:])),
    ("+ -", "tolerance, in steps of ×√2"),
    ("M", "metric: max or rms"),
    ("F", "every post, or as few as will do"),
    ("P", "save the picture as PNG"),
    ("I", "show the figures, or not"),
    ("H  F1", "show the keys, or not"),
    ("Esc", "quit"),
)


@dataclass
class Settings:
    """How a frame is drawn, and which panels stand over it."""

    drawing: Drawing = field(default_factory=Drawing)
    figures: bool = True
    keys: bool = False

    def press(self, key: str) -> None:
        """Do what a key says, if it says anything."""
        if key in "123456" and len(key) == 1:
            self._draw(style=STYLES[int(key) - 1])
        elif key == "tab":
            self._draw(style=_next(STYLES, self.drawing.style))
        elif key in ("+", "=", "-"):
            self._change_tolerance(STEP if key != "-" else 1 / STEP)
        elif key == "m":
            self._draw(metric=_next(METRICS, self.drawing.metric))
        elif key == "f":
            self._draw(method=_next(METHODS, self.drawing.method))
        elif key == "i":
            self.figures = not self.figures
        elif key in ("h", "f1"):
            self.keys = not self.keys

    def _change_tolerance(self, factor: float) -> None:
        least, most = TOLERANCES_PX
        self._draw(max_error_px=min(max(self.drawing.max_error_px * factor, least), most))

    def _draw(self, **options: Any) -> None:
        self.drawing = replace(self.drawing, **options)


def _next(choices: tuple[str, ...], now: str) -> str:
    return choices[(choices.index(now) + 1) % len(choices)]
