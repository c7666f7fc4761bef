"""The graphs at the top of the panel: frame times by stage, triangles, the bound and the achieved error."""

import math
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any

from ..basics.words import metres
from .controller import Controller
from .frame_stats import FRAMES, STAGES, FrameStats, Record, bound_words, clock, drawing_ms, error_name, seconds
from .painter import Painter
from .theme import ACCENT
from .widgets import Widgets

COLOURS = {"lod": (0.40, 0.70, 1.0, 1.0), "draw": ACCENT, "shade": (0.55, 0.85, 0.55, 1.0)}
SOFT = (1.0, 1.0, 1.0, 0.35)
UNKNOWN = "not known yet"
PAPER = (1.0, 1.0, 1.0, 0.04)


def show(ui: Widgets, painter: Painter, controller: Controller, at_rest: bool) -> None:
    """Build the graphs; `at_rest`: the picture is finished. Before the first picture they are empty."""
    frame = painter.frame
    records = list(painter.history.records)
    is_known = bool(frame.stats) and not frame.is_sketch
    ui.line("Frame", _frame_words(frame, at_rest) if is_known else UNKNOWN)
    _bars(ui, records)
    by_clock = f", {clock(frame.stats)}" if frame.stats else ""
    ui.hint("frame", f"Milliseconds of the last frames{by_clock}: blue: levels, orange: draw, green: shade.")
    ui.line("Triangles", f"{frame.stats['triangles']:,} in {frame.stats['patches']:,} patches" if is_known else UNKNOWN)
    _line(ui, [record.triangles for record in records])
    ui.hint("triangles", "Triangles of the last frames.")
    ui.line("Error", error_words(frame))
    _line(ui, [record.bound_px for record in records], [record.measured_px for record in records])
    jump_px = painter.history.largest_jump_px
    jumps = "" if jump_px is None else f" From one frame to the next, no point jumps by more than {jump_px:.3g} px."
    dots = "Dots: the achieved error (so far: where bounds are largest)."
    ui.hint("error", f"Line: the certified bound, px. {dots}{jumps}")
    above_m = controller.height_above_ground_m
    height = "no ground below" if math.isnan(above_m) else f"{metres(above_m)} above ground"
    ui.line(controller.mode.capitalize(), f"{height}, {metres(controller.speed_m_s)}/s")


def _frame_words(frame: FrameStats, at_rest: bool) -> str:
    """Rate or time, and how the picture differs from one at rest: together they must fit into the panel."""
    if at_rest and frame.fps is None:
        return f"{seconds(drawing_ms(frame.stats))}, at rest"
    way = frame.way.words(frame.stats["requested_max_error_px"])
    rate = f"{frame.fps:.{1 if frame.fps < 10 else 0}f} frames/s" if frame.fps else seconds(drawing_ms(frame.stats))
    return ", ".join(filter(None, (rate, way)))


def error_words(frame: FrameStats) -> str:
    """The achieved error and the bound, as far as they are known."""
    if frame.is_preview or frame.is_sketch:
        return "preview: nothing certified"
    if not frame.stats:
        return UNKNOWN
    bound = bound_words(frame.stats, ".3f")
    if "complete" in frame.stats:  # of a store: its truth is on a disk, so no error is measured
        missing = len(frame.stats["tiles_missing"])
        return f"{bound}, " + (f"missing tiles: {missing:,}" if missing else "all tiles loaded")
    achieved = "…" if frame.achieved_px is None else f"{frame.achieved_px:.3f} px"
    return f"{error_name(frame.measured_px)} {achieved}, {bound}"


def _paper(ui: Widgets) -> tuple[Any, float, float, float, float]:
    """A place for a graph: the draw list, left, top, width, height."""
    imgui = ui.imgui
    width, height = imgui.get_content_region_avail()[0], 1.6 * ui.em  # low, so that all sections fit into 720 rows
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button(f"graph {top:.0f}", (width, height))
    paper = imgui.get_window_draw_list()
    paper.add_rect_filled((left, top), (left + width, top + height), ui.colour(PAPER), 3 * ui.scale)
    return paper, left, top, width, height


def _bars(ui: Widgets, records: list[Record]) -> None:
    paper, left, top, width, height = _paper(ui)
    most = max((sum(record.ms.values()) for record in records), default=1.0) or 1.0
    step = width / FRAMES
    for i, record in _right_aligned(records):
        x, y = left + i * step, top + height
        for stage in STAGES:
            tall = height * record.ms[stage] / most
            paper.add_rect_filled((x, y - tall), (x + max(step - 1, 1), y), ui.colour(COLOURS[stage]))
            y -= tall


def _line(ui: Widgets, values: Sequence[float | None], dots: Sequence[float | None] = ()) -> None:
    """A line through values, and dots; None for no value."""
    paper, left, top, width, height = _paper(ui)
    most = max((v or dot or 0.0 for v, dot in zip_longest(values, dots)), default=1.0) or 1.0

    def places(values: Sequence[float | None]) -> list[Any]:
        known = [((i + 0.5) * width / FRAMES, min(v / most, 1.1)) for i, v in _right_aligned(values) if v is not None]
        return [ui.imgui.ImVec2(left + x, top + height * (1 - 0.9 * share)) for x, share in known]

    paper.add_polyline(places(values), ui.colour(SOFT), 1.5 * ui.scale, 0)
    for place in places(dots):
        paper.add_circle_filled(place, 2.5 * ui.scale, ui.colour(ACCENT))


def _right_aligned(values: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    """Values with their columns: the last value is at the right edge."""
    return enumerate(values, FRAMES - len(values))
