"""The graphs at the top of the panel: frame times by stage, triangles, the bound and the achieved error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..basics.words import metres
from .controller import Controller
from .frame_stats import FRAMES, STAGES, FrameStats, Record, bound_words, clock, drawing_ms, seconds
from .painter import Painter
from .theme import ACCENT
from .widgets import Widgets

COLOURS = {"lod": (0.40, 0.70, 1.0, 1.0), "draw": ACCENT, "shade": (0.55, 0.85, 0.55, 1.0)}
SOFT = (1.0, 1.0, 1.0, 0.35)
UNKNOWN = "not known yet"
PAPER = (1.0, 1.0, 1.0, 0.04)


def show(ui: Widgets, painter: Painter, controller: Controller) -> None:
    """Build the graphs."""
    frame = painter.frame
    records = list(painter.history.records)
    if not frame.stats:
        return
    timer, sentence = clock(frame.stats)
    _title(ui, "Frame", UNKNOWN if frame.is_sketch else _frame_words(frame, timer))
    _bars(ui, records)
    ui.hint("frame", f"Milliseconds of the last frames, {sentence}: blue chooses levels, orange draws, green shades.")
    counted = f"{frame.stats['triangles']:,} in {frame.stats['patches']:,} patches"
    _title(ui, "Triangles", UNKNOWN if frame.is_sketch else counted)
    _line(ui, [record.triangles for record in records], SOFT)
    ui.hint("triangles", "Triangles of the last frames.")
    _title(ui, "Error", error_words(frame))
    _errors(ui, records)
    ui.hint("error", _error_hint(painter.history.largest_jump_px))
    above = controller.height_above_ground_m
    height = f"{metres(above)} above ground" if above == above else "no ground below"
    _title(ui, controller.mode.capitalize(), f"{height}, {metres(controller.speed_m_s)}/s")


def _frame_words(frame: FrameStats, timer: str) -> str:
    rate = "at rest" if frame.fps is None else f"{frame.fps:.{1 if frame.fps < 10 else 0}f} frames/s"
    words = [rate, frame.way.words(frame.stats["requested_max_error_px"] is not None)]
    return f"{seconds(drawing_ms(frame.stats))} {timer}, {', '.join(filter(None, words))}"


def error_words(frame: FrameStats) -> str:
    """The achieved error and the bound, as far as they are known."""
    if frame.is_preview or frame.is_sketch:
        return "preview: nothing certified"
    bound = bound_words(frame.stats, ".3f")
    if "complete" in frame.stats:  # of a store: its truth is on a disk, so no error is measured
        missing = len(frame.stats["tiles_missing"])
        return f"{bound}, " + (f"missing tiles: {missing:,}" if missing else "complete")
    achieved = "…" if frame.achieved_px is None else f"{frame.achieved_px:.3f} px"
    return f"achieved {achieved}, {bound}"


def _error_hint(jump_px: float | None) -> str:
    hint = "Line: the certified bound in pixels. Dots: the achieved error, measured at rest."
    jumps = "" if jump_px is None else f" From one frame to the next, no point jumps by more than {jump_px:.3g} px."
    return hint + jumps


def _title(ui: Widgets, name: str, value: str) -> None:
    ui.imgui.text_disabled(name)
    ui.imgui.same_line(4.5 * ui.em)
    ui.imgui.text(value)


def _paper(ui: Widgets) -> tuple[Any, float, float, float, float]:
    """A place for a graph: the draw list, left, top, width, height."""
    imgui = ui.imgui
    width, height = imgui.get_content_region_avail()[0], 1.6 * ui.em  # low, so that all sections fit into 720 rows
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button(f"graph {top:.0f}", (width, height))
    paper = imgui.get_window_draw_list()
    paper.add_rect_filled((left, top), (left + width, top + height), _colour(ui, PAPER), 3 * ui.scale)
    return paper, left, top, width, height


def _bars(ui: Widgets, records: list[Record]) -> None:
    paper, left, top, width, height = _paper(ui)
    most = max((sum(record.ms.values()) for record in records), default=1.0) or 1.0
    step = width / FRAMES
    for i, record in _right_aligned(records):
        x, y = left + i * step, top + height
        for stage in STAGES:
            tall = height * record.ms[stage] / most
            paper.add_rect_filled((x, y - tall), (x + max(step - 1, 1), y), _colour(ui, COLOURS[stage]))
            y -= tall


def _line(ui: Widgets, values: list[int], colour: tuple[float, ...]) -> None:
    paper, left, top, width, height = _paper(ui)
    most = max(values, default=1) or 1
    points = [(left + i * width / FRAMES, top + height * (1 - 0.9 * v / most)) for i, v in _right_aligned(values)]
    if len(points) > 1:
        paper.add_polyline(_points(ui, points), _colour(ui, colour), 1.5 * ui.scale, 0)


def _errors(ui: Widgets, records: list[Record]) -> None:
    paper, left, top, width, height = _paper(ui)
    most = max((record.bound_px or record.measured_px or 0.0 for record in records), default=1.0) or 1.0
    step = width / FRAMES

    def place(i: int, px: float) -> tuple[float, float]:
        return left + (i + 0.5) * step, top + height * (1 - 0.9 * min(px / most, 1.1))

    line = [place(i, record.bound_px) for i, record in _right_aligned(records) if record.bound_px is not None]
    if len(line) > 1:
        paper.add_polyline(_points(ui, line), _colour(ui, SOFT), 1.5 * ui.scale, 0)
    for i, record in _right_aligned(records):
        if record.measured_px is not None:
            paper.add_circle_filled(place(i, record.measured_px), 2.5 * ui.scale, _colour(ui, ACCENT))


def _right_aligned(values: list[Any]) -> Iterator[tuple[int, Any]]:
    """Values with their columns: the last value is at the right edge."""
    return enumerate(values, FRAMES - len(values))


def _colour(ui: Widgets, rgba: tuple[float, ...]) -> int:
    return ui.imgui.color_convert_float4_to_u32(rgba)


def _points(ui: Widgets, places: list[tuple[float, float]]) -> list[Any]:
    return [ui.imgui.ImVec2(*place) for place in places]
