"""The ruler's part of the panel: lengths, climb, and the profile with its axes."""

import math

import numpy as np

from ..basics.words import metres
from ..shade.contours import interval_m
from .ruler import Profile
from .widgets import Widgets

LINE = (1.0, 0.80, 0.47, 1.0)
LAND = (1.0, 0.80, 0.47, 0.18)
GRID = (1.0, 1.0, 1.0, 0.14)
FLATTEST = 0.02  # smallest range of heights that fills the graph, as a fraction of the length
_HINT = "Click on the land: each click adds a leg, a double click ends the line. Esc puts the ruler away."


def show(ui: Widgets, measured: Profile | None) -> None:
    """Build the ruler's part."""
    if measured is None:
        with ui.wrapped():
            ui.line("Ruler", _HINT)
        return
    ui.line("Ruler", f"{metres(measured.length_m)} on the map")
    ui.line("Ground", f"{metres(measured.ground_m)} along the ground")
    ui.line("Climb", f"{metres(round(measured.climb_m, 2))} up, {metres(round(measured.descent_m, 2))} down")
    _plot(ui, measured)


def ticks(low: float, high: float) -> list[float]:
    """A few round numbers from `low` to `high`."""
    step = interval_m(low, low + (high - low) * 10)  # at most 4 parts, a tenth of `contours.MOST`
    first = math.ceil(low / step - 1e-9)
    return [i * step for i in range(first, math.floor(high / step + 1e-9) + 1)]


def _plot(ui: Widgets, measured: Profile) -> None:
    imgui = ui.imgui
    em = ui.em
    known = np.isfinite(measured.height_m)
    if not known.any():
        return
    low, high = float(measured.height_m[known].min()), float(measured.height_m[known].max())
    high = max(high, low + FLATTEST * measured.length_m)
    heights = {height_m: f"{round(height_m, 6):,g} m" for height_m in ticks(low, high)}
    margin = max(imgui.calc_text_size(word)[0] for word in [*heights.values(), "0"]) + 0.4 * em
    across = imgui.get_content_region_avail()[0]
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button("profile", (across, 6.2 * em))
    ui.hint("profile", "Height over the way on the map, of the line that you clicked.")
    x0, y0 = left + margin, top + 0.5 * em
    width = max(across - margin - 0.5 * em, 1.0)
    foot = y0 + 4.0 * em
    draw = imgui.get_window_draw_list()
    line, land, grid = map(ui.colour, (LINE, LAND, GRID))
    text = ui.colour(imgui.get_style_color_vec4(imgui.Col_.text_disabled))

    def at(along_m: float, height_m: float) -> tuple[float, float]:
        share = (height_m - low) / (high - low)
        return x0 + width * along_m / measured.length_m, y0 + (foot - y0) * (1 - share)

    for height_m, word in heights.items():
        _, y = at(0.0, height_m)
        draw.add_line((x0, y), (x0 + width, y), grid)
        draw.add_text((x0 - 0.3 * em - imgui.calc_text_size(word)[0], y - 0.5 * em), text, word)
    for along_m in ticks(0.0, measured.length_m):
        x, _ = at(along_m, low)
        draw.add_line((x, y0), (x, foot), grid)
        word = metres(along_m) if along_m else "0"
        half = 0.5 * imgui.calc_text_size(word)[0]
        draw.add_text((min(max(x - half, x0 - 0.3 * em), left + across - 2 * half), foot + 0.2 * em), text, word)
    ways_m = np.linspace(0.0, measured.length_m, max(2, round(width)))
    shown_m = np.interp(ways_m, measured.along_m[known], measured.height_m[known])
    is_there = np.interp(ways_m, measured.along_m, known.astype(float)) > 0.5
    points = list(map(at, ways_m.tolist(), shown_m.tolist()))
    for i in np.flatnonzero(is_there[:-1] & is_there[1:]):
        draw.add_rect_filled(points[i], (points[i + 1][0], foot), land)
        draw.add_line(points[i], points[i + 1], line, 1.5 * ui.scale)
