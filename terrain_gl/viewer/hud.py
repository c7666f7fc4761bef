"""The words on the window: figures, keys, messages. Panels of text from plain values; drawing is overlay.py's."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any

from .. import gl
from ..drawing import EVERY_POST, Drawing
from .commands import shown_lines
from .overlay import ACCENT, BRIGHT, SOFT, Panel, Text
from .settings import Settings

_LABEL, _VALUE = 11, 19  # columns
ROOMY = 110  # columns, for figures beside an explanation


@dataclass
class Figures:
    """What the window knows of its last frame.

    Attributes
    ----------
    posts
        Columns and rows of the map.
    fps
        Frames a second while in motion; None at rest.
    stats
        Of `Renderer.draw`.
    measured_px
        Achieved error by metric; None until known.
    height_m
        Eye above ground; NaN where there is none.
    shrunk
        Window pixels across one pixel of the picture.
    """

    name: str
    posts: tuple[int, int]
    fps: float | None = None
    stats: dict[str, Any] = field(default_factory=dict)
    measured_px: dict[str, float] | None = None
    height_m: float = math.nan
    speed_m_s: float = 0.0
    shrunk: int = 1


def drawing_ms(stats: dict[str, Any]) -> float:
    """Milliseconds that a frame took on the GPU."""
    return sum(stats["ms"].get(stage, 0.0) for stage in ("lod", "draw", "shade"))


def clock(stats: dict[str, Any]) -> tuple[str, str]:
    """Whose milliseconds they are, in a word and in a sentence."""
    if stats["ms_clock"] == "cpu":
        return "CPU", "by the CPU's clock: this driver has no timer queries"
    renderer = stats["gl_renderer"].split()[0]
    if renderer in gl.SOFTWARE:
        return renderer, f"by timer queries of {renderer}, where the CPU plays the GPU"
    return "GPU", "by the GPU's own clock (timer queries)"


def _asked(drawing: Drawing) -> tuple[str, str]:
    if drawing.triangles:
        return "budget", f"{drawing.triangles:,} triangles"
    return "tolerance", "none" if drawing.method in EVERY_POST else f"{drawing.max_error_px:.4g} px {drawing.metric}"


def achieved_px(measured_px: dict[str, float] | None, stats: dict[str, Any]) -> float | None:
    """What was measured, in the metric of the promise: what a budget promises is of the largest error."""
    of_largest = stats.get("requested_triangles") and stats["certified_max_error_px"] is not None
    return measured_px["max" if of_largest else stats["metric"]] if measured_px else None


def figures_panel(figures: Figures, settings: Settings) -> Panel:
    """Panel at the top left: what the frame cost and what is known of its error."""
    stats, drawing = figures.stats, settings.drawing
    ms = drawing_ms(stats)
    pace = "at rest" if figures.fps is None else f"{figures.fps:.0f} fps"
    size = f"{stats['width']} × {stats['height']}" + (f"  1:{figures.shrunk}" if figures.shrunk > 1 else "")
    measured = achieved_px(figures.measured_px, stats)
    rows = [
        ("frame", f"{pace}  {seconds(ms)}" + " GPU" * (clock(stats)[0] == "GPU")),
        ("picture", size),
        ("triangles", f"{stats['triangles']:,}"),
        ("patches", f"{stats['patches']:,}"),
        None,
        _asked(drawing),
        ("promised", "nothing" if (px := stats["certified_max_error_px"]) is None else f"≤ {px:.4g} px"),
        ("measured", "…" if measured is None else f"{measured:.3f} px"),
        None,
        ("method", "every post" if drawing.method in EVERY_POST else drawing.method),
        ("style", drawing.style),
        ("height", f"{metres(figures.height_m)} above ground" if figures.height_m == figures.height_m else "–"),
        ("speed", f"{metres(figures.speed_m_s)}/s"),
    ]
    posts = f"  {figures.posts[0]} × {figures.posts[1]} posts"
    title = [Text(_shorten(figures.name, _LABEL + _VALUE - len(posts)), ACCENT), Text(posts, SOFT)]
    return Panel([title, [], *(_row(*row) if row else [] for row in rows)])


def keys_pages(columns: int, rows: int) -> list[Panel]:
    """Panels in the middle, with room for so many characters a line and lines: all keys, in two columns if they fit."""
    lines: list[tuple[str, str]] = []
    across = max(len(keys) for _, keys, _ in shown_lines()) + 2
    column = across + max(len(meaning) for _, _, meaning in shown_lines()) + 3
    abreast = 2 if 2 * column - 3 <= columns else 1
    for group, keys, meaning in shown_lines():
        if (group.upper(), "") not in lines:
            lines += [("", "")] * bool(lines) + [(group.upper(), "")]
        first, *more = wrap(meaning, max(16, columns - across))
        lines += [(keys, first), *(("", words) for words in more)]
    if len(lines) > abreast * rows:
        rows -= 2  # for what is said at the foot
    height = min(max(1, rows), -(-len(lines) // abreast))
    pages = [lines[i : i + abreast * height] for i in range(0, len(lines), abreast * height)]
    foot = [[[], [Text(f"{i} of {len(pages)}   H goes on", SOFT)]] for i in range(1, len(pages) + 1)]
    shown = [_keys_page(page, height, across, column if len(page) > height else 0) for page in pages]
    return [Panel(page + (foot[i] if len(pages) > 1 else []), (0.5, 0.5)) for i, page in enumerate(shown)]


def _keys_page(lines: list[tuple[str, str]], height: int, across: int, column: int) -> list[list[Text]]:
    left: list[list[Text]] = [_keys_row(line, across, column) for line in lines[:height]]
    for i, line in enumerate(lines[height:]):
        left[i] += _keys_row(line, across, 0)
    return left


def progress_panel(text: str, part: float, can_cancel: bool) -> Panel:
    """Panel at the foot: what is being done, and how far it is."""
    bar = 30
    full = round(bar * part)
    line = [Text("■" * full, ACCENT), Text("■" * (bar - full), (255, 255, 255, 40))]
    return Panel([[Text(text + ("  (Esc cancels)" if can_cancel else ""))], line], (0.5, 0.92))


def message_panel(text: str) -> Panel:
    """Panel at the foot: one sentence."""
    return Panel([[Text(text)]], (0.5, 1.0))


def metres(value: float) -> str:
    """Three digits or so: 0.85 m, 12.4 m, 870 m, 5.2 km."""
    if abs(value) >= 10000:
        return f"{value / 1000:,.1f} km"
    return f"{value:,.0f} m" if abs(value) >= 100 else f"{value:.3g} m"


def seconds(ms: float) -> str:
    """Three digits or so, in the unit that fits."""
    return f"{ms:.3g} ms" if ms < 999 else f"{ms / 1000:.1f} s"


def _row(label: str, value: str) -> list[Text]:
    return [Text(label.ljust(_LABEL), SOFT), Text(value.ljust(_VALUE), BRIGHT)]


def _shorten(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def _keys_row(line: tuple[str, str], across: int, width: int) -> list[Text]:
    keys, meaning = line
    return [Text(keys.ljust(across), ACCENT if meaning else SOFT), Text(meaning.ljust(max(0, width - across)))]
