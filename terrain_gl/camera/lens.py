"""Lenses: what the picture of a camera shows, if that is no symmetric field of view.

A point has the coordinates (x, y, z) along the camera's axes: right, up, forward. Its place in the picture is
(x/w, y/w). In perspective w = z, and an orthographic camera has w = 1 m. The picture is a rectangle of these numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..basics.exceptions import UsageError

Pair = tuple[float, float]
Axis = tuple[float, float, float]
_OFF = 1e-6  # how far a matrix may be from a rotation: written with seven digits, it is one


@dataclass(frozen=True)
class Lens:
    """A part of the plane before the eye.

    Attributes
    ----------
    low, high
        ``(x/w, y/w)`` at the lower left and the upper right corner of the picture. If both ``x/w`` are 0, the width
        follows from the height: pixels are square.
    axes
        The world directions right, up and forward, instead of those that follow from eye, target and up.
    is_orthographic
        Whether the rays are parallel.
    size
        The picture that the lens was calibrated for.
    """

    low: Pair
    high: Pair
    axes: tuple[Axis, Axis, Axis] | None = None
    is_orthographic: bool = False
    size: tuple[int, int] | None = None

    @property
    def half(self) -> Pair:
        """Half the picture, across and up."""
        return 0.5 * (self.high[0] - self.low[0]), 0.5 * (self.high[1] - self.low[1])

    def half_of(self, size: tuple[int, int]) -> Pair:
        """Half a picture of `size`, across and up."""
        across, above = self.half
        return (across or above * size[0] / size[1]), above

    @property
    def centre(self) -> Pair:
        """The middle of the picture."""
        return 0.5 * (self.low[0] + self.high[0]), 0.5 * (self.low[1] + self.high[1])

    @property
    def fov_deg(self) -> float:
        """The angle between the lower and the upper edge, in degrees."""
        return math.degrees(math.atan(self.high[1]) - math.atan(self.low[1]))

    def shrunk(self, factor: float) -> Lens:
        """The lens for a world that is `factor` times smaller."""
        if not self.is_orthographic:
            return self
        low, high = ((x / factor, y / factor) for x, y in (self.low, self.high))
        return replace(self, low=low, high=high)

    def check_picture(self, size: tuple[int, int]) -> None:
        """Raise `UsageError` if a picture has another shape than the calibrated one."""
        if self.size and size[0] * self.size[1] != size[1] * self.size[0]:
            wide, high = self.size
            raise UsageError(
                f"the camera is calibrated for pictures of {wide} x {high} pixels, and {size[0]} x {size[1]} have"
                " another shape: draw that size, or a multiple"
            )


def rigid(name: str, matrix: ArrayLike) -> np.ndarray:
    """A rotation, (3, 3) float64: the nearest one to a matrix that is one up to rounding."""
    given = np.asarray(matrix, np.float64)
    if given.shape != (3, 3) or not np.isfinite(given).all():
        raise UsageError(f"{name}: expected a rotation, a matrix of 3 x 3 finite numbers, got shape {given.shape}")
    left, scales, right = np.linalg.svd(given)
    if np.abs(scales - 1).max() > _OFF or np.linalg.det(given) < 0:
        raise UsageError(f"{name}: is no rotation: it scales by {scales.min():g} to {scales.max():g}, or mirrors")
    return np.asarray(left @ right)


def lens_of_intrinsics(intrinsics: ArrayLike, size: tuple[int, int], axes: np.ndarray) -> Lens:
    """The lens of OpenCV's intrinsic matrix: pixel centres are whole numbers, v points down."""
    k = np.asarray(intrinsics, np.float64)
    if k.shape != (3, 3) or not np.isfinite(k).all():
        raise UsageError(f"K: expected a matrix of 3 x 3 finite numbers, got shape {k.shape}")
    fx, fy = k[0, 0], k[1, 1]
    if not (fx > 0 and fy > 0) or k[1, 0] != 0 or (k[2] != [0, 0, 1]).any():
        raise UsageError("K: expected fx, 0, cx; 0, fy, cy; 0, 0, 1, with fx and fy above 0")
    if abs(k[0, 1]) > 1e-9 * fx:
        raise UsageError(f"K: has a skew of {k[0, 1]:g}: resample the pictures without it")
    wide, high = size
    if min(wide, high) < 1:
        raise UsageError(f"picture size must be at least 1x1, got {wide}x{high}")
    fx, fy, cx, cy = (float(each) for each in (fx, fy, k[0, 2], k[1, 2]))
    left, right = (-0.5 - cx) / fx, (wide - 0.5 - cx) / fx
    top, bottom = (0.5 + cy) / fy, (0.5 + cy - high) / fy
    return Lens((left, bottom), (right, top), _rows(axes), size=(wide, high))


def lens_of_projection(projection: ArrayLike, axes: np.ndarray) -> Lens:
    """The lens of OpenGL's projection, where the camera looks along -z: the borders are clip x, y = ±w."""
    p = np.asarray(projection, np.float64)
    if p.shape != (4, 4) or not np.isfinite(p).all():
        raise UsageError(f"projection: expected a matrix of 4 x 4 finite numbers, got shape {p.shape}")
    across, above, last = p[0], p[1], p[3]
    is_perspective = last[0] == last[1] == last[3] == 0 and last[2] < 0
    is_orthographic = last[0] == last[1] == last[2] == 0 and last[3] > 0
    if not (is_perspective or is_orthographic) or across[1] != 0 or above[0] != 0 or min(across[0], above[1]) <= 0:
        raise UsageError("projection: is neither a perspective (also off-axis) nor an orthographic matrix of OpenGL")
    aside = across[3], above[3]
    if is_perspective and any(aside) or is_orthographic and (across[2] or above[2]):
        raise UsageError("projection: shears the view: only off-axis perspective and parallel projection are supported")
    if is_perspective:  # clip x = a x + b z, clip w = -c z: x / -z = (±c + b) / a
        middles, scale = (across[2], above[2]), -last[2]
    else:  # clip x = a x + b, clip w = c: x = (±c - b) / a
        middles, scale = (-aside[0], -aside[1]), last[3]
    low, high = (
        (float((side * scale + middles[0]) / across[0]), float((side * scale + middles[1]) / above[1]))
        for side in (-1, 1)
    )
    return Lens(low, high, _rows(axes), is_orthographic=bool(is_orthographic))


def clip_of_depth(projection: ArrayLike, metres: float = 1.0) -> tuple[float, float, float, float]:
    """a, b, c, d: a place at the view depth z has clip z = a z + b and clip w = c z + d; `metres` in a unit of z."""
    p = np.asarray(projection, np.float64)
    return float(-p[2, 2] * metres), float(p[2, 3]), float(-p[3, 2] * metres), float(p[3, 3])


def _rows(axes: np.ndarray) -> tuple[Axis, Axis, Axis]:
    right, up, forward = ((float(x), float(y), float(z)) for x, y, z in axes)
    return right, up, forward
