"""A small map in the panel: the land from above, the camera, and the outline of what it sees. A click goes there."""

import numpy as np

from ..heightmap import Heightmap
from ..renderer.lines import on_land
from .controller import Controller
from .widgets import Rgba, Widgets
from .window_state import Size

_SIDE = 40  # squares along the longer side
TALLEST_EM = 8.0  # largest height, in heights of the typeface
_LIGHT = np.array([-0.6, 0.5])  # of slopes, from the north-west
_LINE: Rgba = (1.0, 0.8, 0.47, 1.0)


class Overview:
    """The map. Its shades are computed anew for another map, and after each stroke."""

    def __init__(self) -> None:
        self._of: object = None
        self._shades = np.zeros((2, 2), int)

    def show(
        self, ui: Widgets, controller: Controller, heightmap: Heightmap, size: Size, version: object
    ) -> np.ndarray | None:
        """Build the map; returns the place on the land that was clicked, (3,) in world metres.

        The shades are those of a `version` of the land; None: they stay.
        """
        imgui = ui.imgui
        east, north = heightmap.extent_m
        scale = min(imgui.get_content_region_avail()[0] / east, TALLEST_EM * ui.em / north)
        width, height = east * scale, north * scale
        left, top = imgui.get_cursor_screen_pos()
        imgui.invisible_button("overview", (max(width, 1.0), max(height, 1.0)))
        clicked = imgui.is_item_clicked()
        ui.hint("overview", "The whole map, north up, and what the camera sees. Click to travel there.")
        if version is not None and self._of != version:
            self._of, self._shades = version, _shades(ui, heightmap)
        paper = imgui.get_window_draw_list()
        rows, cols = (n - 1 for n in self._shades.shape)
        xs = np.rint(left + width * np.arange(cols + 1) / cols).tolist()
        ys = np.rint(top + height * np.arange(rows + 1) / rows).tolist()
        shades = self._shades.tolist()
        for row in range(rows):
            for col in range(cols):
                a, b, c, d = (*shades[row][col : col + 2], *shades[row + 1][col : col + 2])
                corners = (xs[col], ys[row]), (xs[col + 1], ys[row + 1])
                paper.add_rect_filled_multi_color(*corners, a, b, d, c)
        colour = ui.colour(_LINE)

        def at(place: np.ndarray) -> tuple[float, float]:
            x, y = np.clip(place[:2], 0, (east, north))
            return float(left + scale * x), float(top + scale * (north - y))

        seen = outline(controller, size)
        for one, other in zip(seen, [*seen[1:], seen[0]], strict=True):
            paper.add_line(at(one), at(other), colour, 1.5 * ui.scale)
        paper.add_circle_filled(at(controller.eye), 2.5 * ui.scale, colour)
        if not clicked:
            return None
        x, y = imgui.get_mouse_pos()
        return on_land(heightmap, np.array([[(x - left) / scale, north - (y - top) / scale]]))[0]


def outline(controller: Controller, size: Size) -> list[np.ndarray]:
    """The land at the corners of the picture; towards the sky, places far away. The first two are the nearest."""
    up = np.tan(np.radians(0.5 * controller.fov_deg))
    right = up * size[0] / max(1, size[1])
    far_m = 2 * max(controller.heightmap.extent_m)
    places = []
    for x, y in ((-right, -up), (right, -up), (right, up), (-right, up)):
        place = controller.ground_at(float(x), float(y))
        if place is None:
            ray = np.array([x, y, 1.0]) @ controller.axes
            place = controller.eye + far_m * ray / max(float(np.linalg.norm(ray[:2])), 1e-9)
        places.append(place)
    return places


def _shades(ui: Widgets, heightmap: Heightmap) -> np.ndarray:
    """Colours of the corners of squares: slopes lit from the north-west, and heights."""
    coarse = heightmap.coarse()
    n = max(coarse.rows, coarse.cols)
    rows, cols = (
        np.linspace(0, posts - 1, max(2, round(_SIDE * posts / n)) + 1).round().astype(int)
        for posts in (coarse.rows, coarse.cols)
    )
    heights = np.asarray(coarse.heights, float)[np.ix_(rows, cols)]
    low, high = heightmap.range_m
    shares = np.nan_to_num((heights - low) / max(high - low, 1e-9))
    down, right = np.gradient(shares)
    lit = np.clip(0.35 + 0.3 * shares + 2.5 * (_LIGHT[0] * right - _LIGHT[1] * -down), 0.05, 1.0)
    return np.array([[ui.colour((0.9 * v, v, 0.85 * v, 1.0)) for v in row] for row in lit.tolist()])
