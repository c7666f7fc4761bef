"""Orientation: north, the scale in the middle of the picture, and the place under the cursor."""

import math

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.words import metres
from ..heightmap import Heightmap
from ..readers.place import degrees
from .controller import Controller
from .widgets import Widgets
from .window_state import Size

LONGEST_EM = 8.0  # longest scale bar, in heights of the typeface


def scale_bar(controller: Controller, size: Size, longest_px: float) -> tuple[float, float] | None:
    """A round length on the ground in the middle of the picture: metres and pixels; None for the sky."""
    place = controller.ground_at(0.0, 0.0)
    if place is None:
        return None
    depth_m = float(np.linalg.norm(place - controller.eye))
    px_per_m = 0.5 * size[1] / math.tan(math.radians(0.5 * controller.fov_deg)) / depth_m
    power = 10.0 ** math.floor(math.log10(longest_px / px_per_m))
    length_m = max(digit * power for digit in (1, 2, 5) if digit * power * px_per_m <= longest_px)
    return length_m, length_m * px_per_m


def place_lines(heightmap: Heightmap, place: np.ndarray) -> list[str]:
    """A place as text: height, degrees, and coordinates of the map's file; or metres from the south-west corner."""
    x, y, z = (float(v) for v in place)
    height = f"height {z:,.0f} m" if heightmap.range_m[1] >= 100 else f"height {z:.2f} m"
    if heightmap.place is None:
        return [height, f"{x:,.0f} m east, {y:,.0f} m north of the corner"]
    east, north = heightmap.place.to_map(x, y)
    try:
        lonlat = [degrees(*heightmap.place.to_lonlat(x, y))]
    except TerrainError:  # without a coordinate system, or without pyproj
        lonlat = []
    in_degrees = abs(east) <= 360 and abs(north) <= 90
    return [height, *lonlat, *([] if lonlat and in_degrees else [f"{east:.1f} E, {north:.1f} N"])]


def arrow(azimuth_deg: float) -> np.ndarray:
    """(3, 2) corners, right and down, of an arrow to the north, for a camera of this azimuth: tip, base."""
    a = math.radians(-azimuth_deg)
    tip = np.array([math.sin(a), -math.cos(a)])
    side = np.array([math.cos(a), math.sin(a)])
    return np.stack([0.9 * tip, -0.6 * tip + 0.5 * side, -0.6 * tip - 0.5 * side])


def show(ui: Widgets, azimuth_deg: float, bar: tuple[float, float] | None) -> None:
    """Build the arrow to the north, and the scale bar beside it."""
    imgui = ui.imgui
    em = ui.em
    colour = imgui.color_convert_float4_to_u32(imgui.get_style_color_vec4(imgui.Col_.text))
    draw = imgui.get_window_draw_list()
    left, top = imgui.get_cursor_screen_pos()
    corners = np.array([left + em, top + em]) + em * arrow(azimuth_deg)
    draw.add_triangle_filled(*(tuple(corner.tolist()) for corner in corners), colour)
    imgui.dummy((2 * em, 2 * em))
    imgui.same_line()
    imgui.begin_group()
    if bar:
        length_m, length_px = bar
        imgui.text(f"N   {metres(length_m)}")
        x, y = imgui.get_cursor_screen_pos()
        draw.add_rect_filled((x, y), (x + length_px, y + 0.2 * em), colour)
        imgui.dummy((length_px, 0.3 * em))
    else:
        imgui.text("N")
    imgui.end_group()
