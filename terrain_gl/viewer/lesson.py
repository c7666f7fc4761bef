"""What the window explains in words and numbers: why a patch is drawn as it is, and what a summed-area table gives."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np

from ..drawing import EVERY_POST, Drawing
from ..explain import Choice, Explanation
from ..renderer import Renderer
from ..terrain import measure_span
from .hud import metres
from .overlay import ACCENT, BRIGHT, SOFT, Panel, Text

HEADINGS = ("drawn as", "posts apart", "off by", "on screen", "")


def title(told: Explanation) -> str:
    """What the patch is, in a line."""
    if told.chosen.segments == 0:
        return (
            f"A fan over {told.side} × {told.side} posts"
            if told.level
            else "A fan over one cell, around the mean of its posts"
        )
    t = told.chosen.segments
    quads = "one quad" if t == 1 else f"{t} × {t} quads"
    return f"A patch of {quads}, {told.chosen.step} post{'s' * (told.chosen.step > 1)} apart"


def rows(told: Explanation) -> list[tuple[str, str, str, str, str]]:
    """The choices: under `HEADINGS`."""
    return [
        (_name(choice), str(choice.step), metres(_off_m(told, choice)), f"{choice.px:.3g} px", _verdict(told, choice))
        for choice in told.choices
    ]


def reasons(told: Explanation) -> list[str]:
    """Why it is drawn so, in sentences."""
    off = metres(_off_m(told, told.chosen))
    if not told.in_picture:
        return ["It is not in the picture that the mesh was chosen for: it may be as coarse as it likes."]
    worst = "The worst post" if told.metric == "max" else "The root mean square of its posts"
    asked = f"within {told.tolerance_px:.3g} px" if np.isfinite(told.tolerance_px) else "what the budget pays for"
    if told.chosen.max_m == 0:
        return ["Every post of it is a vertex, or lies in the plane of its triangles: nothing is off."]
    return [
        f"The nearest corner of its box is {metres(told.nearest_m)} deep in the view: there a metre of height makes"
        f" at most {told.px_per_m:.3g} px.",
        f"{worst} is off by at most {off} (from the tables), so by {told.chosen.px:.3g} px: {asked}.",
    ]


def explanation_panel(told: Explanation, columns: int) -> Panel:
    """All of it as text, at the lower right; sentences have room for so many characters a line."""
    table = [HEADINGS, *rows(told)]
    widths = [max(map(len, cells)) + 2 for cells in zip(*table, strict=True)]
    lines = [[Text(title(told), ACCENT)], []]
    for row in table:
        colour = SOFT if row is HEADINGS else ACCENT if row[-1] == "drawn" else BRIGHT
        lines.append([Text("".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)), colour)])
    sentences = [
        [Text(line)] for sentence in reasons(told) for line in wrap(sentence, min(columns, max(60, sum(widths))))
    ]
    return Panel([*lines, [], *sentences], (1.0, 1.0))


def side_line(drawing: Drawing, stats: dict[str, Any]) -> str:
    """A side of a split picture in a line: what was asked for, and what it took."""
    tolerance = f"{drawing.max_error_px:.3g} px {drawing.metric}" if drawing.max_error_px else ""
    budget = f"{drawing.triangles:,} triangles" if drawing.triangles else tolerance
    asked = "every post" if drawing.method in EVERY_POST else f"{drawing.method}, {budget}"
    promised = stats.get("certified_max_error_px")
    promise = "nothing promised" if promised is None else f"at most {promised:.3g} px"
    return f"{asked}: {stats['triangles']:,} triangles, {promise}"


def _name(choice: Choice) -> str:
    return "fan" if choice.segments == 0 else f"T = {choice.segments}"


def _off_m(told: Explanation, choice: Choice) -> float:
    return choice.rms_m if told.metric == "rms" else choice.max_m


def _verdict(told: Explanation, choice: Choice) -> str:
    if choice == told.chosen:
        return "drawn"
    if choice.px > told.tolerance_px:
        return "too coarse"
    finer = told.choices.index(choice) > told.choices.index(told.chosen)
    return "finer than needed" if finer else "would do, but a neighbour is finer"


@dataclass(frozen=True)
class BoxSum:
    """A box of posts, and its four fetches.

    Attributes
    ----------
    box
        First column and row, last column and row, the last ones outside.
    corners
        S at north-west, north-east, south-west and south-east, 32 bits.
    """

    box: tuple[int, int, int, int]
    corners: tuple[int, int, int, int]
    mean_m: float

    @property
    def posts(self) -> int:
        """How many are in the box."""
        return (self.box[2] - self.box[0]) * (self.box[3] - self.box[1])

    @property
    def sum(self) -> int:
        """(D − C) − (B − A), modulo 2³²: exact, wrapped or not."""
        a, b, c, d = self.corners
        return ((d - c) - (b - a)) % 2**32

    def words(self) -> list[str]:
        """What is to be read beside the picture."""
        a, b, c, d = self.corners
        return [
            f"A  {a:,}      B  {b:,}      north",
            f"C  {c:,}      D  {d:,}      south",
            f"(D - C) - (B - A) = {self.sum:,} steps of 1/65535 of the heights' span",
            f"in {self.posts:,} posts: their mean is {metres(self.mean_m)}",
            "Four look-ups, whatever its size: green ones add, red ones take away.",
            "Sums wrap at 2^32, hence the bands; differences stay exact.",
        ]


def box_around(renderer: Renderer, col: int, row: int, side: int) -> BoxSum:
    """The box of at most `side` posts a side around a post, as the GPU's table has it."""
    heightmap, sums = renderer.heightmap, renderer.picture.sums
    x0, y0 = max(0, min(col - side // 2, heightmap.cols - 1)), max(0, min(row - side // 2, heightmap.rows - 1))
    x1, y1 = min(x0 + side, heightmap.cols), min(y0 + side, heightmap.rows)

    def fetch(x: int, y: int) -> int:
        if x == 0 or y == 0:
            return 0
        return int.from_bytes(sums.buffer.read(4, offset=4 * ((y - 1) * heightmap.cols + x - 1)), "little")

    found = BoxSum((x0, y0, x1, y1), (fetch(x0, y0), fetch(x1, y0), fetch(x0, y1), fetch(x1, y1)), 0.0)
    _, low_m, span_m = measure_span(*heightmap.reach_m)
    return BoxSum(found.box, found.corners, low_m + found.sum / found.posts * span_m / 65535)
