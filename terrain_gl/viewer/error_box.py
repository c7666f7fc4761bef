"""The look-up that decides the level of a patch, as picture and text: its box in the table, and the four fetches."""

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
_ABOVE, _LOW, _HIGH = np.array([[0.93, 0.30, 0.25], [0.05, 0.08, 0.16], [0.55, 0.68, 0.85]])
_ADDS = (0.45, 0.95, 0.55, 1.0)


@dataclass(frozen=True)
class ErrorBox:
    """A part of the table around a look-up."""

    lookup: Lookup  # for the drawn level
    first: tuple[int, int]  # column and row of the first tile that is shown
    counts: np.ndarray  # the table's entries at the corners of the shown tiles, modulo 256

    @property
    def is_above(self) -> np.ndarray:
        """Which tiles have an error above the limit. Each tile is a box of its own, which takes four fetches."""
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
    coarser, name = (patch.choices[at - 1], "Coarser") if at else (patch.joined, "Coarser, four patches as one")
    if coarser:
        is_too_coarse = coarser.lookup and coarser.lookup.above
        verdict = "is too coarse" if is_too_coarse else "suffices, but rings or neighbours ask for more"
        said.append(f"{name}: {_answer(coarser, verdict)}")
    if at + 1 < len(patch.choices):
        said.append("Finer: " + _answer(patch.choices[at + 1], "has more triangles than needed"))
    return said


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

    def corner(x: int, y: int) -> tuple[float, float]:
        return left + (x - box.first[0]) * step, top + (y - box.first[1]) * step

    for row, col in np.ndindex(rows, cols):
        shade = _ABOVE if box.is_above[row, col] else _LOW + (_HIGH - _LOW) * (box.counts[row + 1, col + 1] / 255)
        x, y = left + col * step, top + row * step
        paper.add_rect_filled((x, y), (x + step - 1, y + step - 1), ui.colour((*shade.tolist(), 1.0)))
    x0, y0, x1, y1 = box.lookup.tiles
    paper.add_rect(corner(x0, y0), corner(x1, y1), ui.colour(ACCENT), 0.0, 2 * ui.scale)
    for colour, places in ((_ADDS, [(x0, y0), (x1, y1)]), (WARNING, [(x1, y0), (x0, y1)])):
        for x, y in places:
            paper.add_circle_filled(corner(x, y), 4 * ui.scale, ui.colour(colour))
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
