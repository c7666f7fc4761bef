"""Live graphs at the top of the panel: frame times by stage, triangles, the error promised against that measured."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .hud import achieved_px, clock, drawing_ms, metres, seconds

if TYPE_CHECKING:
    from .flight import Flight
    from .gui import Gui

STAGES = ("lod", "draw", "shade")
COLOURS = {"lod": (0.40, 0.70, 1.0, 1.0), "draw": (1.0, 0.80, 0.47, 1.0), "shade": (0.55, 0.85, 0.55, 1.0)}
SOFT, ACCENT, LINE = (1.0, 1.0, 1.0, 0.35), (1.0, 0.80, 0.47, 1.0), (1.0, 1.0, 1.0, 0.15)
FRAMES = 120


@dataclass
class Record:
    """What the graphs show of a frame."""

    ms: dict[str, float]
    triangles: int
    promised_px: float | None
    measured_px: float | None = None
    refined: bool = False


@dataclass
class History:
    """The last frames."""

    records: deque[Record] = field(default_factory=lambda: deque(maxlen=FRAMES))

    def add(self, stats: dict[str, Any]) -> None:
        """Note a frame."""
        ms = {stage: stats["ms"].get(stage, 0.0) for stage in STAGES}
        promised_px = stats["certified_max_error_px"]
        drawable = promised_px is not None and math.isfinite(promised_px)  # a budget may promise nothing
        self.records.append(Record(ms, stats["triangles"], promised_px if drawable else 0.0))

    def measured(self, px: float) -> None:
        """Note what the last frame achieved."""
        if self.records:
            self.records[-1].measured_px = px


def show(gui: Gui, flight: Flight) -> None:
    """Lay the graphs out in the panel that is being built."""
    figures, stats = flight.figures, flight.figures.stats
    if not stats:
        return
    ms = drawing_ms(stats)
    pace = "at rest" if figures.fps is None else f"{figures.fps:.{1 if figures.fps < 10 else 0}f} frames/s"
    coarse = f", {figures.shrunk} × coarser" if figures.shrunk > 1 else ""
    whose, told = clock(stats)
    _title(gui, "Frame", f"{seconds(ms)} {whose}, {pace}{coarse}")
    _bars(gui, list(flight.painter.history.records))
    text = f"Milliseconds of the last frames, {told}: blue chooses levels, orange draws the mesh, green shades."
    gui.hint("frame", text)
    _title(gui, "Triangles", f"{stats['triangles']:,} in {stats['patches']:,} patches")
    _line(gui, [record.triangles for record in flight.painter.history.records], SOFT)
    gui.hint("triangles", "Triangles of the last frames.")
    promised = "no" if (px := stats["certified_max_error_px"]) is None else f"{px:.3f}"
    measured = "…" if (px := achieved_px(figures.measured_px, stats)) is None else f"{px:.3f}"
    _title(gui, "Error", f"measured {measured}, promised {promised} px")
    _errors(gui, list(flight.painter.history.records))
    gui.hint("error", "Line: pixels promised before drawing. Dots: measured on that very mesh, when nothing moves.")
    above = figures.height_m
    height = f"{metres(above)} above ground" if above == above else "no ground below"
    _title(gui, flight.controller.mode.capitalize(), f"{height}, {metres(figures.speed_m_s)}/s")


def _title(gui: Gui, name: str, value: str) -> None:
    gui.imgui.text_disabled(name)
    gui.imgui.same_line(4.5 * gui.em)
    gui.imgui.text(value)


def _canvas(gui: Gui) -> tuple[Any, float, float, float, float]:
    """A place for a graph: the draw list, left, top, width, height."""
    imgui = gui.imgui
    width, height = imgui.get_content_region_avail()[0], 1.6 * gui.em  # all sections fit a window of 720 rows
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button(f"graph {top:.0f}", (width, height))
    paper = imgui.get_window_draw_list()
    paper.add_rect_filled((left, top), (left + width, top + height), _colour(gui, (1, 1, 1, 0.04)), 3 * gui.scale)
    return paper, left, top, width, height


def _bars(gui: Gui, records: list[Record]) -> None:
    paper, left, top, width, height = _canvas(gui)
    most = max((sum(record.ms.values()) for record in records), default=1.0) or 1.0
    step = width / FRAMES
    for i, record in _late(records):
        x, y = left + i * step, top + height
        for stage in STAGES:
            tall = height * record.ms[stage] / most
            paper.add_rect_filled((x, y - tall), (x + max(step - 1, 1), y), _colour(gui, COLOURS[stage]))
            y -= tall


def _line(gui: Gui, values: list[int], colour: tuple[float, ...]) -> None:
    paper, left, top, width, height = _canvas(gui)
    most = max(values, default=1) or 1
    points = [(left + i * width / FRAMES, top + height * (1 - 0.9 * v / most)) for i, v in _late(values)]
    if len(points) > 1:
        paper.add_polyline(_points(gui, points), _colour(gui, colour), 1.5 * gui.scale, 0)


def _errors(gui: Gui, records: list[Record]) -> None:
    paper, left, top, width, height = _canvas(gui)
    most = max((record.promised_px or record.measured_px or 0.0 for record in records), default=1.0) or 1.0
    step = width / FRAMES

    def place(i: int, px: float) -> tuple[float, float]:
        return left + (i + 0.5) * step, top + height * (1 - 0.9 * min(px / most, 1.1))

    line = [place(i, record.promised_px) for i, record in _late(records) if record.promised_px is not None]
    if len(line) > 1:
        paper.add_polyline(_points(gui, line), _colour(gui, SOFT), 1.5 * gui.scale, 0)
    for i, record in _late(records):
        if record.measured_px is not None:
            paper.add_circle_filled(place(i, record.measured_px), 2.5 * gui.scale, _colour(gui, ACCENT))


def _late(values: list[Any]) -> Iterator[tuple[int, Any]]:
    """Numbered so that the last one stands at the right edge."""
    return enumerate(values, FRAMES - len(values))


def _colour(gui: Gui, rgba: tuple[float, ...]) -> int:
    return gui.imgui.color_convert_float4_to_u32(rgba)


def _points(gui: Gui, places: list[tuple[float, float]]) -> list[Any]:
    return [gui.imgui.ImVec2(*place) for place in places]
