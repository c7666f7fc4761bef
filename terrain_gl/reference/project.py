"""lod: from metres of height to pixels on the screen, at a point and bounded over a box.

In the camera's axes (right, up, forward) a point has the coordinates (x, y, z), z its depth. It is in the picture at
(x/w, y/w). In perspective w = z; an orthographic camera has w = 1. A point that rises by one metre moves by v_x, v_y
and v_w in x, y and w. K are the pixels per unit of y/w, and a K those per unit of x/w; a = 1 if pixels are square.
"""

import itertools
from typing import NamedTuple

import numpy as np

from .heightmap import world_m


class Pinhole(NamedTuple):
    """A pinhole camera, or an orthographic one, and its picture."""

    eye: np.ndarray  # (3,) world metres
    axes: np.ndarray  # (3, 3) world directions right, up, forward, one a row
    focal_px: float  # K
    half_extent: tuple[float, float]  # half the picture, in units of x/w and y/w
    near_m: float  # smallest depth in the picture
    bend_per_m: float = 0.0  # 1 / 2R: see `curvature`
    centre: tuple[float, float] = (0.0, 0.0)  # x/w and y/w in the middle of the picture
    aspect: float = 1.0  # a
    is_orthographic: bool = False

    @property
    def vertical(self) -> np.ndarray:
        """(3,) v_x, v_y, v_w."""
        right, up, forward = self.axes[:, 2]
        return np.array([right, up, 0.0 if self.is_orthographic else forward])

    def w_at(self, depth_m: np.ndarray) -> np.ndarray:
        """W at a depth."""
        return np.ones_like(depth_m) if self.is_orthographic else depth_m


class ScreenScale(NamedTuple):
    """The factors by which a view converts vertical shifts to pixels, at each of many points."""

    px_m: np.ndarray  # K |(a (v_x − x/w v_w), v_y − y/w v_w)|
    depth_m: np.ndarray  # w
    forward: float  # v_w
    seen: np.ndarray  # whether the point is in the picture


def to_camera(view: Pinhole, points: np.ndarray) -> np.ndarray:
    """World metres (3, ...) to the camera's axes: right, up, depth."""
    return np.tensordot(view.axes, points - view.eye.reshape(3, *[1] * (points.ndim - 1)), 1)


# A point moved by δ along the vertical moves on the screen by exactly
#   K |δ| |(a (v_x − x/w v_w),  v_y − y/w v_w)| / w',   w' = w + δ v_w


def screen_scale(view: Pinhole, points: np.ndarray) -> ScreenScale:
    """Factors of the screen shift at world points (3, ...)."""
    x, y, z = to_camera(view, points)
    (tan_x, tan_y), (middle_x, middle_y) = view.half_extent, view.centre
    w = view.w_at(z)
    seen = (z >= view.near_m) & (np.abs(x - middle_x * w) <= tan_x * w) & (np.abs(y - middle_y * w) <= tan_y * w)
    right, up, forward = view.vertical
    w = np.where(seen, w, 1.0)
    shift = np.hypot(view.aspect * (right - x / w * forward), up - y / w * forward)
    return ScreenScale(view.focal_px * shift, w, forward, seen)


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
    nearest_m: np.ndarray  # smallest w
    stretch: np.ndarray  # largest |(a (v_x − x/w v_w), v_y − y/w v_w)|
    middle_m: np.ndarray  # w of the box's middle, at least `nearest_m`


# |(a (v_x − x/w v_w), v_y − y/w v_w)| is convex in (x/w, y/w): over the rectangle of the picture that holds the box it
# is largest at a corner. Depth is smallest at a corner of the box. Both are clipped at the picture's edges and near
# plane.


def project_boxes(view: Pinhole, low: np.ndarray, high: np.ndarray) -> BoxProjection:
    """Project the boxes between the world points low and high, (3, ...)."""
    ends = itertools.product(*zip(low, high, strict=True))
    x, y, z = to_camera(view, np.stack([np.stack(np.broadcast_arrays(*corner)) for corner in ends], 1))
    w = view.w_at(z)
    off = [a - middle * w for a, middle in zip((x, y), view.centre, strict=True)]
    beyond = np.stack([s * a > tan * w for a, tan in zip(off, view.half_extent, strict=True) for s in (1, -1)])
    near = z < view.near_m  # (8 corners, ...); `beyond` is (4 sides, 8 corners, ...)
    cut = near.any(0)
    v_x, v_y, v_w = view.vertical
    sides = zip((x, y), (v_x, v_y), view.half_extent, view.centre, strict=True)
    factor = [
        _largest_factor(a / np.where(near, 1.0, w), cut, (middle - tan, middle + tan), v, v_w)
        for a, v, tan, middle in sides
    ]
    nearest_m = view.w_at(np.maximum(z.min(0), view.near_m))
    middle_m = np.maximum(nearest_m, view.w_at(to_camera(view, 0.5 * (low + high))[2]))
    outside = near.all(0) | beyond.all(1).any(0)
    stretch = np.hypot(view.aspect * factor[0], factor[1])
    return BoxProjection(outside, ~cut & ~beyond.any((0, 1)), nearest_m, stretch, middle_m)


def _largest_factor(ratio: np.ndarray, cut: np.ndarray, ends: tuple[float, float], v: float, v_w: float) -> np.ndarray:
    """Largest |v − ratio · v_w| over the box's ratios x/w (8, ...); over the whole picture for cut boxes."""
    low = np.where(cut, ends[0], ratio.min(0).clip(*ends))
    high = np.where(cut, ends[1], ratio.max(0).clip(*ends))
    return np.maximum(np.abs(v - low * v_w), np.abs(v - high * v_w))


# An error δ ≤ M of any point in the box makes at most   K |δ| stretch / (nearest − M |v_z|)   pixels


def error_px(view: Pinhole, p: BoxProjection, size_m: np.ndarray, max_m: np.ndarray) -> np.ndarray:
    """Bound in pixels of errors of `size_m` metres, at most `max_m` anywhere; infinite if they reach the eye."""
    depth_m = p.nearest_m - max_m * abs(view.vertical[2])
    bound = view.focal_px * size_m * p.stretch / np.where(depth_m > 0, depth_m, 1.0)
    return np.where(size_m == 0, 0.0, np.where(depth_m > 0, bound, np.inf))
