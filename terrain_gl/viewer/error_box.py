"""The look-up that decides the level of a patch, as picture and text: its box in the table, and the four fetches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..basics.words import metres
from ..renderer import Renderer
from ..verify.explain import Choice, Explanation, Lookup
from .theme import ACCENT, WARNING
from .widgets import Widgets

AROUND = 0.5  # tiles that are shown beyond each side of the box, relative to this side
LEAST = 8  # fewest tiles that are shown along a side
SIDE_EM = 8.0  # side of the picture, in heights of the typeface
_ABOVE = (0.93, 0.30, 0.25)
_LOW, _HIGH = np.array([0.05, 0.08, 0.16]), np.array([0.55, 0.68, 0.85])
_ADDS = (0.45, 0.95, 0.55, 1.0)


@dataclass(frozen=True)
class ErrorBox:
    """A part of the table around a look-up.

    Attributes
    ----------
    lookup
        The look-up for the drawn level.
    first
        Column and row of the first tile that is shown.
    counts
        The table's entries at the corners of the shown tiles, modulo 256.
    """

    lookup: Lookup
    first: tuple[int, int]
    counts: np.ndarray

    @property
    def is_above(self) -> np.ndarray:
        """Which tiles have an error above the limit. Each is a box of one tile, so it takes four fetches."""
        s = self.counts
        return (s[1:, 1:] - s[1:, :-1]) - (s[:-1, 1:] - s[:-1, :-1]) > 0


def read(renderer: Renderer, patch: Explanation) -> ErrorBox | None:
    """The table around the box of a patch; None if no table decided."""
    lookup = patch.chosen.lookup
    if lookup is None or patch.metric != "max":
        return None
    x0, y0, x1, y1 = lookup.tiles
    around = [max(round(AROUND * side), (LEAST - side + 1) // 2, 1) for side in (x1 - x0, y1 - y0)]
    columns, rows = renderer.resources.terrain.levels[lookup.level].counts
    left, top = max(x0 - around[0], 0), max(y0 - around[1], 0)
    shown = left, top, min(x1 + around[0], columns), min(y1 + around[1], rows)
    return ErrorBox(lookup, (left, top), renderer.inspector.error_counts(lookup, shown))


def lines(patch: Explanation) -> list[str]:
    """The look-up as text, for the drawn level, the next coarser one and the next finer one."""
    at = patch.choices.index(patch.chosen)
    said = [_answer(patch.chosen, f"({patch.chosen.segments} segments a side) suffices")]
    if at > 0:
        said.append("Coarser: " + _answer(patch.choices[at - 1], _verdict(patch.choices[at - 1])))
    elif patch.joined:
        said.append("Coarser, four patches as one: " + _answer(patch.joined, _verdict(patch.joined)))
    if at + 1 < len(patch.choices):
        said.append("Finer: " + _answer(patch.choices[at + 1], "has more triangles than needed"))
    return [line for line in said if line]


def _verdict(coarser: Choice) -> str:
    if coarser.lookup and coarser.lookup.above:
        return "is too coarse"
    return "suffices, but rings or neighbours ask for more"


def _answer(choice: Choice, verdict: str) -> str:
    if (lookup := choice.lookup) is None:
        return f"T = {choice.segments} {verdict}: read from the cells themselves."
    tiles = f"{lookup.above} of {lookup.count} tile{'s' * (lookup.count > 1)}"
    return f"{tiles} above {metres(lookup.limit_m)}: T = {choice.segments} {verdict}."


def show(ui: Widgets, box: ErrorBox) -> None:
    """Build a picture of the table around the box, with the four fetches beside it."""
    imgui = ui.imgui
    rows, cols = box.is_above.shape
    step = SIDE_EM * ui.em / max(rows, cols)
    left, top = imgui.get_cursor_screen_pos()
    imgui.dummy((cols * step, rows * step))
    paper = imgui.get_window_draw_list()

    def colour(rgb: tuple[float, ...] | np.ndarray) -> int:
        return int(imgui.color_convert_float4_to_u32((*(float(v) for v in rgb[:3]), 1.0)))

    for row, col in np.ndindex(rows, cols):
        shade = _LOW + (_HIGH - _LOW) * (box.counts[row + 1, col + 1] / 255)
        corner = left + col * step, top + row * step
        filled = colour(_ABOVE if box.is_above[row, col] else shade)
        paper.add_rect_filled(corner, (corner[0] + step - 1, corner[1] + step - 1), filled)
    x0, y0, x1, y1 = (v - box.first[i % 2] for i, v in enumerate(box.lookup.tiles))
    ends = (left + x0 * step, top + y0 * step), (left + x1 * step, top + y1 * step)
    paper.add_rect(*ends, colour(ACCENT), 0.0, 2 * ui.scale)
    for i in range(4):
        at = ends[i & 1][0], ends[i >> 1][1]
        paper.add_circle_filled(at, 4 * ui.scale, colour(_ADDS if i in (0, 3) else WARNING))
    imgui.same_line()
    imgui.begin_group()
    a, b, c, d = box.lookup.corners
    imgui.text_disabled("Table of error counts, this patch in orange")
    imgui.text(f"north-west {a}   north-east {b}")
    imgui.text(f"south-west {c}   south-east {d}")
    imgui.text(f"({d} - {c}) - ({b} - {a}) = {box.lookup.above} tiles above the limit, modulo 256")
    imgui.text_disabled(f"Red: tiles with an error above {metres(box.lookup.limit_m)}.")
    imgui.text_disabled("A tile is 2 × 2 quads." if box.lookup.level else "A tile is 4 × 4 cells.")
    imgui.end_group()
