"""A small map of a store in the panel: it shows how fine the loaded tiles are, and where the camera is."""

import math
from collections.abc import Iterator
from itertools import groupby

import numpy as np

from ..basics.boxes import over_blocks
from ..pages.terrain import PagedTerrain
from .controller import Controller
from .legend import VIRIDIS, Colour, Legend
from .widgets import Widgets

MOST = 64  # squares along the longer side
TALLEST_EM = 4.0  # largest height of this map, in heights of the typeface
LEGEND = Legend(VIRIDIS, "every post", "coarsest tiles", "Tiles that are loaded. Dot: the camera.")
_CAMERA = (1.0, 1.0, 1.0, 1.0)


def finest_levels(levels: np.ndarray, most: int = MOST) -> np.ndarray:
    """The same levels (rows, columns) with at most `most` rows and columns: the finest level of each square."""
    side = -(-max(levels.shape) // most)
    return over_blocks(np.minimum, levels, side)


def runs(levels: np.ndarray) -> Iterator[tuple[int, int, int, int]]:
    """Runs of neighbouring squares of one level in a row: row, first column, column after the last, level."""
    for row, values in enumerate(levels.tolist()):
        first = 0
        for level, same in groupby(values):
            end = first + len(list(same))
            yield row, first, end, level
            first = end


def colour_of(level: int, top: int) -> Colour:
    """Colour of a level: along the ramp of the legend."""
    places = np.linspace(0, 1, len(VIRIDIS))
    red, green, blue = (float(np.interp(level / max(top, 1), places, ramp)) for ramp in np.transpose(VIRIDIS))
    return red, green, blue


def show(ui: Widgets, terrain: PagedTerrain, controller: Controller) -> None:
    """Build the map, and its legend."""
    imgui = ui.imgui
    east, north = controller.heightmap.extent_m
    levels = finest_levels(terrain.levels)
    scale = min(imgui.get_content_region_avail()[0] / east, TALLEST_EM * ui.em / north)
    width, height = east * scale, north * scale
    left, top = imgui.get_cursor_screen_pos()
    imgui.invisible_button("tiles", (width, height))
    ui.hint("tiles", "How fine the tiles of the store are that are loaded, from above, north up.")
    paper = imgui.get_window_draw_list()
    rows, cols = levels.shape
    for row, first, end, level in runs(levels):
        corner = round(left + width * first / cols), round(top + height * row / rows)  # whole pixels: no gaps
        other = round(left + width * end / cols), round(top + height * (row + 1) / rows)
        colour = (*colour_of(level, terrain.top_level), 1.0)
        paper.add_rect_filled(corner, other, imgui.color_convert_float4_to_u32(colour))
    _camera(ui, (left, top), scale, north, controller)
    ui.legend(LEGEND)


def _camera(ui: Widgets, corner: tuple[float, float], scale: float, north_m: float, controller: Controller) -> None:
    """Build a dot at the camera, and a line in its direction; nothing if it is outside the map."""
    x, y = (float(v) for v in controller.eye[:2])
    if not (0 <= x <= controller.heightmap.extent_m[0] and 0 <= y <= north_m):
        return
    at = corner[0] + scale * x, corner[1] + scale * (north_m - y)
    azimuth = math.radians(controller.azimuth_deg)
    paper = ui.imgui.get_window_draw_list()
    colour = ui.imgui.color_convert_float4_to_u32(_CAMERA)
    end = at[0] + 0.7 * ui.em * math.sin(azimuth), at[1] - 0.7 * ui.em * math.cos(azimuth)
    paper.add_line(at, end, colour, 1.5 * ui.scale)
    paper.add_circle_filled(at, 2.5 * ui.scale, colour)
