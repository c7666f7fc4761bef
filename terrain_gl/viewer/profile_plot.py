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
FLATTEST = 0.02  # smallest range of heights that fills the graph, as a part of the length
_HINT = "Click on the land: each click adds a leg, a double click ends the line. Esc puts the ruler away."


def show(ui: Widgets, measured: Profile | None) -> None:
    """Build the ruler's part."""
    imgui = ui.imgui
    imgui.text_disabled("Ruler")
    imgui.same_line(4.5 * ui.em)
    if measured is None:
        with ui.wrapped():
            imgui.text(_HINT)
        return
    imgui.text(f"{metres(measured.length_m)} on the map")
    climb = f"{metres(round(measured.climb_m, 2))} up, {metres(round(measured.descent_m, 2))} down"
    for name, value in (("Ground", f"{metres(measured.ground_m)} along the ground"), ("Climb", climb)):
        imgui.text_disabled(name)
        imgui.same_line(4.5 * ui.em)
        imgui.text(value)
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
    heights = ticks(low, high)
    ways = ticks(0.0, measured.length_m)
    words = [f"{round(height, 6):,g} m" for height in heights]
    margin = max(imgui.calc_text_size(word)[0] for word in [*words, "0"]) + 0.4 * em
    across = imgui.get_content_region_avail()[0]
    tall = 5.0 * em
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button("profile", (across, tall + 1.2 * em))
    ui.hint("profile", "Height over the way on the map, of the line that you clicked.")
    x0 = left + margin
    y0 = top + 0.5 * em
    width = max(across - margin - 0.5 * em, 1.0)
    height_px = tall - em
    draw = imgui.get_window_draw_list()
    line, land, grid = (imgui.color_convert_float4_to_u32(colour) for colour in (LINE, LAND, GRID))
    text = imgui.color_convert_float4_to_u32(imgui.get_style_color_vec4(imgui.Col_.text_disabled))

    def at(along_m: float, height_m: float) -> tuple[float, float]:
        share = (height_m - low) / (high - low)
        return x0 + width * along_m / measured.length_m, y0 + height_px * (1 - share)

    for height_m, word in zip(heights, words, strict=True):
        _, y = at(0.0, height_m)
        draw.add_line((x0, y), (x0 + width, y), grid)
        draw.add_text((x0 - 0.3 * em - imgui.calc_text_size(word)[0], y - 0.5 * em), text, word)
    for along_m in ways:
        x, _ = at(along_m, low)
        draw.add_line((x, y0), (x, y0 + height_px), grid)
        word = metres(along_m) if along_m else "0"
        half = 0.5 * imgui.calc_text_size(word)[0]
        place = min(max(x - half, x0 - 0.3 * em), left + across - 2 * half), y0 + height_px + 0.2 * em
        draw.add_text(place, text, word)
    foot = y0 + height_px
    ways_m = np.linspace(0.0, measured.length_m, max(2, round(width)))
    shown = np.interp(ways_m, measured.along_m[known], measured.height_m[known])
    there = np.interp(ways_m, measured.along_m, known.astype(float)) > 0.5
    points = [at(float(way), float(height)) for way, height in zip(ways_m, shown, strict=True)]
    for i in np.flatnonzero(there[:-1] & there[1:]):
        ax, ay = points[i]
        bx, by = points[i + 1]
        draw.add_rect_filled((ax, ay), (bx, foot), land)
        draw.add_line((ax, ay), (bx, by), line, 1.5 * ui.scale)
