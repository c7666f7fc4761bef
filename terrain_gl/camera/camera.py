"""The camera: where the eye is, where it looks, and how metres become pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pyrr

from ..basics.exceptions import UsageError

if TYPE_CHECKING:
    from ..heightmap import Heightmap

Vector = tuple[float, float, float]
UP = (0.0, 0.0, 1.0)
NORTH = (0.0, 1.0, 0.0)
NEAREST_M = 1e-9  # limits of distances and coordinates, so that squares of them are normal floats
FARTHEST_M = 1e12


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in world metres (x east, y north, z up).

    Parameters
    ----------
    eye, target
        The position of the camera, and the point in the middle of its picture.
    fov_deg
        Vertical field of view in degrees.
    up
        The direction that points up in the picture; by default z, and north when the camera looks straight down or up.
    bend_per_m
        Curvature of the ground: at the distance r it is drawn ``bend_per_m · r²`` lower. `Renderer` sets this value
        from the options `curvature` and `refraction`.

    Raises
    ------
    UsageError
        Eye and target coincide, `up` is parallel to the view, the field of view is not from 0.1 to 170 degrees, or a
        coordinate is not finite or larger than `FARTHEST_M`.
    """

    eye: Vector
    target: Vector
    fov_deg: float = 50.0
    up: Vector | None = None
    bend_per_m: float = 0.0

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _vector(name, value))
        if not 0.1 <= self.fov_deg <= 170:
            raise UsageError(f"field of view must lie between 0.1 and 170 degrees, got {self.fov_deg:g}")
        if math.dist(self.eye, self.target) < NEAREST_M:
            raise UsageError(f"eye and target are the same point {_text(self.eye)}: move one of them")
        if self.up is not None and _parallel(self.up, self.forward):
            raise UsageError(f"up {_text(self.up)} is parallel to the view: give another direction")

    @classmethod
    def default(cls, terrain: Heightmap, fov_deg: float = 45.0) -> Camera:
        """A view over the middle of the map, from the south, or from the west if the map is long from south to north.

        The picture shows about half of each side of the map, around its middle. It shows nearly all of a narrow map.
        """
        east, north = terrain.extent_m
        low, high = terrain.range_m
        yaw_deg = 105.0 if north > 1.5 * east else 15.0
        share = 0.45 if max(east, north) < 3 * min(east, north) else 0.9
        middle = (0.5 * east, 0.5 * north, 0.5 * (low + high))
        return cls.over(middle, (share * east, share * north, high - low), fov_deg, yaw_deg)

    @classmethod
    def over(cls, middle: Vector, size_m: Vector, fov_deg: float = 45.0, yaw_deg: float = 15.0) -> Camera:
        """A view from above in which a box fills a picture of 16:9.

        Parameters
        ----------
        middle, size_m
            Middle and size of the box, in world metres.
        yaw_deg
            The direction of the view, clockwise from north.
        """
        yaw, pitch = math.radians(yaw_deg), math.radians(17.0)
        forward = (math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch))
        view = cls((0.0, 0.0, 0.0), forward, fov_deg)
        corners = (np.indices((2, 2, 2)).reshape(3, 8) - 0.5) * np.asarray(size_m)[:, None]
        x, y, z = view.axes @ corners
        tan_x, tan_y = view.half_extent((16, 9))
        away = float(np.max([np.abs(x) / tan_x - z, np.abs(y) / tan_y - z]))
        eye = (middle[0] - away * forward[0], middle[1] - away * forward[1], middle[2] - away * forward[2])
        return cls(eye, middle, fov_deg)

    @cached_property
    def forward(self) -> np.ndarray:
        """(3,) unit vector of the view."""
        towards = np.subtract(self.target, self.eye)
        return towards / np.linalg.norm(towards)

    @cached_property
    def axes(self) -> np.ndarray:
        """(3, 3) float64: the world directions right, up and forward of the picture, one a row."""
        up = self.up or (NORTH if _parallel(UP, self.forward) else UP)
        look = pyrr.matrix44.create_look_at(np.zeros(3), self.forward, np.asarray(up), dtype="f8")
        return look[:3, :3].T * [[1.0], [1.0], [-1.0]]

    def focal_px(self, height: int) -> float:
        """Pixels per unit of ``x/z`` in a picture `height` pixels high: the focal length K."""
        return 0.5 * height / math.tan(0.5 * math.radians(self.fov_deg))

    def half_extent(self, size: tuple[int, int]) -> tuple[float, float]:
        """Largest ``|x/z|`` and ``|y/z|`` in a picture of size (width, height)."""
        tan_y = math.tan(0.5 * math.radians(self.fov_deg))
        return tan_y * size[0] / size[1], tan_y

    def over_exaggerated(self, factor: float) -> Camera:
        """The camera that gives, for a map of `Heightmap.exaggerated`, the picture of this camera with higher relief.

        All heights, also those of the eye and of the target, are stretched with the relief.
        """
        eye, target = ((x / factor, y / factor, z) for x, y, z in (self.eye, self.target))
        return replace(self, eye=eye, target=target, bend_per_m=factor * self.bend_per_m)

    def drop_m(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """How much lower posts at these world places are drawn, because the Earth is round."""
        return self.bend_per_m * (np.square(x - self.eye[0]) + np.square(y - self.eye[1]))

    def lowered(self, points: np.ndarray) -> np.ndarray:
        """World points (n, 3) as they are drawn: lower by their drop."""
        return points - np.stack([0 * points[:, 0], 0 * points[:, 1], self.drop_m(points[:, 0], points[:, 1])], -1)


def clip_from_eye(camera: Camera, size: tuple[int, int], near_m: float) -> np.ndarray:
    """(4, 4) float64 projection of column vectors, world metres relative to the eye, to clip space.

    Depth is near/z: 1 at the near plane, 0 at infinity. In floating point this reversed depth has the same relative
    precision at any distance (Reed 2015, "Depth precision visualized").
    """
    right, up, forward = camera.axes
    tan_x, tan_y = camera.half_extent(size)
    matrix = np.zeros((4, 4))
    matrix[0, :3] = right / tan_x
    matrix[1, :3] = up / tan_y
    matrix[2, 3] = near_m
    matrix[3, :3] = forward
    return matrix


def _vector(name: str, value: Vector) -> Vector:
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError):
        raise UsageError(f"{name}: expected three numbers X,Y,Z in metres, got {value!r}") from None
    if not all(abs(v) <= FARTHEST_M for v in (x, y, z)):
        raise UsageError(f"{name}: expected metres up to {FARTHEST_M:g}, got {_text((x, y, z))}")
    return x, y, z


def _text(vector: Vector) -> str:
    return ",".join(f"{v:g}" for v in vector)


def _parallel(a: Any, b: Any) -> bool:
    return math.hypot(*_cross(a, b)) <= 1e-6 * math.hypot(*a) * math.hypot(*b)


def _cross(a: Any, b: Any) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def screen_shift_px(
    camera: Camera, size: tuple[int, int], points: np.ndarray, rise_m: np.ndarray, near_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Distance in pixels by which points move on the screen when they are moved up; exact formula in float64.

    Parameters
    ----------
    points
        (n, 3) world metres.
    rise_m
        (n,) metres, upward.

    Returns
    -------
    px
        (n,) pixels; infinite if the point moves behind the eye.
    seen
        (n,) bool, whether the point is in the picture.
    """
    at = camera.axes @ (camera.lowered(points) - np.asarray(camera.eye)).T
    seen = in_picture(camera, size, [*at], near_m)
    return shift_px(camera, size, [*np.where(seen, at, np.array([[0.0], [0.0], [1.0]]))], rise_m), seen


def in_picture(camera: Camera, size: tuple[int, int], at: Sequence[np.ndarray], near_m: float) -> np.ndarray:
    """Whether points are in the picture; `at` holds their coordinates along the camera's axes, in metres."""
    x, y, z = at
    tan_x, tan_y = camera.half_extent(size)
    return (z >= near_m) & (np.abs(x) <= tan_x * z) & (np.abs(y) <= tan_y * z)


def shift_px(camera: Camera, size: tuple[int, int], at: Sequence[np.ndarray], rise_m: np.ndarray) -> np.ndarray:
    """Distance in pixels by which points in the picture move when they are moved up: see `screen_shift_px`."""
    x, y, z = at
    right, up, forward = camera.axes[:, 2]
    moved = z + rise_m * forward
    shift = np.hypot(right - x / z * forward, up - y / z * forward) * np.abs(rise_m)
    return np.where(moved > 0, camera.focal_px(size[1]) * shift / np.where(moved > 0, moved, 1.0), np.inf)


def boxes_in_picture(
    camera: Camera, size: tuple[int, int], near_m: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Whether boxes may be in the picture: (n,) bool, False if a box lies outside one of the view's planes.

    Parameters
    ----------
    low, high
        (n, 3) world metres, smallest and largest corners.
    """
    eye = np.asarray(camera.eye)
    low, high = low - eye, high - eye
    if camera.bend_per_m:
        farthest = np.where(-low > high, low, high)
        nearest = np.clip(0.0, low, high)
        low[:, 2] -= camera.bend_per_m * np.square(farthest[:, :2]).sum(1)
        high[:, 2] -= camera.bend_per_m * np.square(nearest[:, :2]).sum(1)
    right, up, forward = camera.axes
    tan_x, tan_y = camera.half_extent(size)
    sides = [side * axis - tan * forward for axis, tan in ((right, tan_x), (up, tan_y)) for side in (1, -1)]
    normals = np.array([*sides, -forward])[:, None]  # outward normals of the view's planes
    slack = 1e-6 * np.array([1 + tan_x + tan_y] * 4 + [1.0])[:, None, None]  # the GPU places vertices in float32
    least = np.minimum(*(normals * side - slack * np.abs(side) for side in (low, high))).sum(-1)  # of all corners
    return ~(least > [[0.0]] * 4 + [[-near_m]]).any(0)
