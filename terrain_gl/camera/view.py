"""The view: the camera in one uniform block, which every shader reads (glsl/blocks/view.glsl)."""

import math
from typing import Any

import moderngl
import numpy as np

from ..gpu import gl, layout
from ..gpu.passes import Resources
from ..terrain import Terrain
from .camera import Camera, clip_from_eye, depth_span_m
from .pieces import Piece
from .rounding import certified_rounding_px

_FIELDS = layout.VIEW.names or ()
_SETTINGS: dict[str, Any] = {"tolerance_px": 0.0, "metric": 0, "cull": False}


class ViewBlock:
    """The `View` block of glsl/blocks/view.glsl, in a buffer.

    Attributes
    ----------
    reach_m
        Metres from the eye to the corners of the near plane; infinite for an orthographic camera.
    viewport
        OpenGL's viewport for the mesh of the current piece: left, bottom, width, height in drawn pixels. It has a
        margin around the piece (`margin_px`), because Mesa's software renderer cuts triangles at the viewport's rim.
        The corners that this makes are not multiples of 1/256 of a pixel, so a sample between two slivers may be
        lost. A cut in the margin is far from the picture.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.block = ctx.buffer(reserve=layout.VIEW.itemsize)
        self._values: dict[str, Any] = {}  # the block's fields, by name
        self._clip_from_eye: list[list[float]] = []  # projection of the whole picture, row by row
        self._piece: Piece | None = None  # the piece whose view the buffer holds
        self._near_m = 0.0
        self._asked: tuple[Any, ...] = ()  # all that the values were computed from
        self._largest_px = gl.limits(ctx)["viewport_size"]
        self.viewport = (0, 0, 0, 0)

    def write(self, terrain: Terrain, camera: Camera, size: tuple[int, int], near_m: float, **settings: object) -> None:
        """Write a camera to the block; `settings` are the fields tolerance_px, metric and cull."""
        land = terrain.heightmap
        asked = camera, size, near_m, settings, land.spacing_m, land.cols, land.rows, land.range_m, terrain.base_m
        if asked != self._asked:
            self._compute(terrain, camera, size, near_m, settings)
            self._piece = None
            self._asked = asked
        self.crop(Piece.whole(size))

    def _compute(
        self, terrain: Terrain, camera: Camera, size: tuple[int, int], near_m: float, settings: dict[str, Any]
    ) -> None:
        x, y, z = camera.eye
        east, north = terrain.heightmap.spacing_m
        bend_per_m = camera.bend_per_m
        row_zero_north = (terrain.heightmap.rows - 1) * north
        eye_z_m = z - terrain.base_m
        col, row = _post(x / east), _post((row_zero_north - y) / north)
        right, up, forward = camera.axes.tolist()
        span_m = depth_span_m(camera, terrain.heightmap)
        values = {
            "right": (*right, 0.0),
            "up": (*up, 0.0),
            "forward": (*forward, 0.0),
            "eye_post": (col, row),
            "eye_offset_m": (x - col * east, y + row * north - row_zero_north),
            "half_extent": camera.half_extent(size),
            "eye_z_m": eye_z_m,
            "eye_z_rest_m": eye_z_m - float(np.float32(eye_z_m)),
            "focal_px": camera.focal_px(size[1]),
            "bend_per_m": bend_per_m,
            "sag_m": bend_per_m * (east**2 + north**2) / 4 * (1 + 1e-6),
            "bulge_m": (bend_per_m * east**2, bend_per_m * north**2),
            "centre": camera.centre,
            "aspect": camera.aspect(size),
            "depth_span_m": span_m,
            "rounding_px": certified_rounding_px(camera, terrain.heightmap, size),
        }
        self._values = _SETTINGS | settings | values
        corner = (half + abs(middle) for half, middle in zip(camera.half_extent(size), camera.centre, strict=True))
        self.reach_m = math.inf if camera.is_orthographic else near_m * math.hypot(1.0, *corner)
        self._clip_from_eye = clip_from_eye(camera, size, near_m, span_m).tolist()
        self._near_m = near_m

    @property
    def eye(self) -> tuple[tuple[int, int], tuple[float, float], float]:
        """Column and row of a post near the eye; metres from there to the eye, east, north; metres above the base."""
        return self._values["eye_post"], self._values["eye_offset_m"], self._values["eye_z_m"]

    @property
    def is_orthographic(self) -> bool:
        """Whether the rays are parallel."""
        return bool(self._values["depth_span_m"])

    @property
    def focal_px(self) -> float:
        """Pixels per unit of y/w."""
        return float(self._values["focal_px"])

    def depths_m(self, depths: np.ndarray) -> np.ndarray:
        """View depths of values of the depth buffer, in float64; infinite for 0, the sky."""
        wide = depths.astype(np.float64)
        near_m, span_m = self._near_m, float(self._values["depth_span_m"])
        away = (1 - wide) * span_m if span_m else near_m / np.where(wide > 0, wide, 1.0)
        return np.where(wide > 0, away, np.inf)

    def crop(self, piece: Piece) -> None:
        """Select the piece of the picture to draw next, with the mesh of the whole picture."""
        if piece == self._piece:
            return
        x, y, z, w = self._clip_from_eye
        values = self._values
        fine = piece.fine
        (wide, right), (high, up) = piece.window
        columns = zip(x, y, z, w, strict=True)
        values["clip_from_eye"] = [v for a, b, c, d in columns for v in (wide * a + right * d, high * b + up * d, c, d)]
        values["size_px"] = piece.picture[0] * fine, piece.picture[1] * fine
        width, height = piece.drawn_size
        left, bottom = margin_px(width, self._largest_px), margin_px(height, self._largest_px)
        self.viewport = -left, -bottom, width + 2 * left, height + 2 * bottom
        values["piece_px"] = (width, height, *self.viewport[2:])
        values["first_px"] = piece.corner[0] * fine, piece.corner[1] * fine
        self.block.write(np.array(tuple(values[name] for name in _FIELDS), layout.VIEW))
        self._piece = piece

    @property
    def resources(self) -> Resources:
        """What shaders read of the view: glsl/blocks/view.glsl."""
        return {"View": self.block}

    def release(self) -> None:
        """Release GPU resources."""
        self.block.release()


def margin_px(side: int, largest_px: int) -> int:
    """Margin of a viewport on either side of a piece: as wide as the piece, if the driver's largest viewport allows."""
    return min(side, (largest_px - side) // 2)


def _post(at: float) -> int:
    """Column or row of the nearest post. For an eye far beyond the map, it is clamped to 32-bit numbers."""
    return min(max(round(at), -(2**30)), 2**30)
