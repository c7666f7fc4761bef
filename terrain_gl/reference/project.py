"""lod: from metres of height to pixels on the screen, at a point and bounded over a box.

In the camera's axes (right, up, forward) a point has the coordinates (x, y, z), z its depth, and the vertical direction
is v = (v_x, v_y, v_z). K is the focal length in pixels.
"""

import itertools
from typing import NamedTuple

import numpy as np

from .heightmap import world_m


class Pinhole(NamedTuple):
    """A pinhole camera and its picture."""

    eye: np.ndarray  # (3,) world metres
    axes: np.ndarray  # (3, 3) world directions right, up, forward, one a row
    focal_px: float  # K
    half_extent: tuple[float, float]  # largest |x/z| and |y/z| in the picture
    near_m: float  # smallest depth in the picture
    bend_per_m: float = 0.0  # 1 / 2R: see `curvature`


class ScreenScale(NamedTuple):
    """The factors by which a view converts vertical shifts to pixels, at each of many points."""

    px_m: np.ndarray  # K |(v_x − x/z v_z, v_y − y/z v_z)|
    depth_m: np.ndarray  # z
    forward: float  # v_z
    seen: np.ndarray  # whether the point is in the picture


def to_camera(view: Pinhole, points: np.ndarray) -> np.ndarray:
    """World metres (3, ...) to the camera's axes: right, up, depth."""
    return np.tensordot(view.axes, points - view.eye.reshape(3, *[1] * (points.ndim - 1)), 1)


# A point moved by δ along the vertical moves on the screen by exactly
#   K |δ| |(v_x − x/z v_z,  v_y − y/z v_z)| / z',   z' = z + δ v_z


def screen_scale(view: Pinhole, points: np.ndarray) -> ScreenScale:
    """Factors of the screen shift at world points (3, ...)."""
    x, y, z = to_camera(view, points)
    tan_x, tan_y = view.half_extent
    seen = (z >= view.near_m) & (np.abs(x) <= tan_x * z) & (np.abs(y) <= tan_y * z)
    right, up, forward = view.axes[:, 2]
    z = np.where(seen, z, 1.0)
    return ScreenScale(view.focal_px * np.hypot(right - x / z * forward, up - y / z * forward), z, forward, seen)


def shift_px(scale: ScreenScale, rise_m: np.ndarray) -> np.ndarray:
    """Screen shift in pixels of points that rise by `rise_m` metres; infinite for a point that moves behind the eye."""
    moved = scale.depth_m + rise_m * scale.forward
    return np.where(moved > 0, scale.px_m * np.abs(rise_m) / np.where(moved > 0, moved, 1.0), np.inf)


# The weight of a post at the depth z is   n = max(1, K √(s_x s_y) / z),   with the spacings s_x east and s_y north.


def post_weights(heights: np.ndarray, spacing_m: tuple[float, float], view: Pinhole) -> np.ndarray:
    """Weight of each post in a budget of triangles, (rows, cols).

    It is the width of a cell in pixels, seen from above, and at least 1.
    """
    depth_m = screen_scale(view, world_m(heights, spacing_m)).depth_m
    return np.maximum(1.0, view.focal_px / depth_m * np.sqrt(spacing_m[0] * spacing_m[1]))


class BoxProjection(NamedTuple):
    """Bounds for each of many boxes, over its points in the picture."""

    outside: np.ndarray  # no part of the box is in the picture
    inside: np.ndarray  # the whole box is in the picture
    nearest_m: np.ndarray  # smallest depth
    stretch: np.ndarray  # largest |(v_x − x/z v_z, v_y − y/z v_z)|
    middle_m: np.ndarray  # depth of the box's middle, at least `nearest_m`


# |(v_x − x/z v_z, v_y − y/z v_z)| is convex in (x/z, y/z): over the rectangle of the picture that holds the box it is
# largest at a corner. Depth is smallest at a corner of the box. Both are clipped at the picture's edges and near plane.


def project_boxes(view: Pinhole, low: np.ndarray, high: np.ndarray) -> BoxProjection:
    """Project the boxes between the world points low and high, (3, ...)."""
    ends = itertools.product(*zip(low, high, strict=True))
    x, y, z = to_camera(view, np.stack([np.stack(np.broadcast_arrays(*corner)) for corner in ends], 1))
    tan_x, tan_y = view.half_extent
    beyond = np.stack([x > tan_x * z, -x > tan_x * z, y > tan_y * z, -y > tan_y * z])  # (4 sides, 8 corners, ...)
    near = z < view.near_m
    cut = near.any(0)
    vertical = view.axes[:, 2]
    factor = [
        _largest_factor(a / np.where(near, 1.0, z), cut, tan, v, vertical[2])
        for a, tan, v in ((x, tan_x, vertical[0]), (y, tan_y, vertical[1]))
    ]
    nearest_m = np.maximum(z.min(0), view.near_m)
    middle_m = np.maximum(nearest_m, to_camera(view, 0.5 * (low + high))[2])
    outside = near.all(0) | beyond.all(1).any(0)
    return BoxProjection(outside, ~cut & ~beyond.any((0, 1)), nearest_m, np.hypot(*factor), middle_m)


def _largest_factor(ratio: np.ndarray, cut: np.ndarray, tan: float, v: float, v_z: float) -> np.ndarray:
    """Largest |v − ratio · v_z| over the box's ratios x/z (8, ...); over the whole picture for cut boxes."""
    low = np.where(cut, -tan, ratio.min(0).clip(-tan, tan))
    high = np.where(cut, tan, ratio.max(0).clip(-tan, tan))
    return np.maximum(np.abs(v - low * v_z), np.abs(v - high * v_z))


# An error δ ≤ M of any point in the box makes at most   K |δ| stretch / (nearest − M |v_z|)   pixels


def error_px(view: Pinhole, p: BoxProjection, size_m: np.ndarray, max_m: np.ndarray) -> np.ndarray:
    """Bound in pixels of errors of `size_m` metres, at most `max_m` anywhere; infinite if they reach the eye."""
    depth_m = p.nearest_m - max_m * abs(view.axes[2, 2])
    bound = view.focal_px * size_m * p.stretch / np.where(depth_m > 0, depth_m, 1.0)
    return np.where(size_m == 0, 0.0, np.where(depth_m > 0, bound, np.inf))
