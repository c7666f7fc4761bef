"""Place and direction of the camera, and where a line of sight meets the ground."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from ..basics.exceptions import UsageError
from ..camera import Camera, Vector
from ..heightmap import Heightmap, ground_m

STEEPEST_DEG = 89.9


@dataclass(frozen=True)
class Pose:
    """Place and direction of the camera: metres; degrees, azimuth clockwise from the north of the grid."""

    eye: Vector
    azimuth_deg: float
    elevation_deg: float
    fov_deg: float

    @classmethod
    def of(cls, camera: Camera) -> Pose:
        """The pose of a camera that is not rolled."""
        if camera.lens:
            raise UsageError("the window has no lenses: give Camera(eye, target, fov_deg)")
        east, north, up = camera.forward
        _, top, _ = camera.axes
        steep = math.hypot(east, north) < 1e-6  # straight down: the top of the picture gives the azimuth
        azimuth = math.degrees(math.atan2(*(top[:2] if steep else (east, north))))
        return cls(camera.eye, azimuth, not_too_steep(math.degrees(math.asin(up))), camera.fov_deg)

    @classmethod
    def read(cls, numbers: dict[str, Any]) -> Pose:
        """The pose that `dataclasses.asdict` has turned into numbers."""
        x, y, z = (float(v) for v in numbers["eye"])
        return cls((x, y, z), *(float(numbers[name]) for name in ("azimuth_deg", "elevation_deg", "fov_deg")))

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): world directions right, up and forward, one a row."""
        a, e = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        right = np.array([math.cos(a), -math.sin(a), 0.0])
        forward = np.array([math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), math.sin(e)])
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def camera(self) -> Camera:
        x, y, z = np.asarray(self.eye) + self.axes[2]
        return Camera(self.eye, (x, y, z), self.fov_deg)

    def beside(self, px: float, height: int) -> Pose:
        """The pose turned to the left, so that the place in the picture's middle moves `px` to the right on its row.

        `height` is the picture's height in pixels. A view that is almost straight down does not change.
        """
        right = px * math.tan(math.radians(0.5 * self.fov_deg)) / (0.5 * max(1, height))
        up = math.sin(math.radians(self.elevation_deg)) * math.hypot(1.0, right)
        if abs(up) > math.sin(math.radians(STEEPEST_DEG)):
            return self
        turn = math.atan2(right, math.sqrt(1 - up * up))
        azimuth_deg = (self.azimuth_deg - math.degrees(turn)) % 360
        return replace(self, azimuth_deg=azimuth_deg, elevation_deg=math.degrees(math.asin(up)))

    def towards(self, other: Pose, share: float) -> Pose:
        """A pose on the way to another, `share` 0 to 1; the camera turns the short way."""
        before, after = np.array([*self.eye, *astuple(self)[1:]]), np.array([*other.eye, *astuple(other)[1:]])
        turn = after - before
        turn[3] = (turn[3] + 180) % 360 - 180
        x, y, z, azimuth, elevation, fov = (float(v) for v in before + share * turn)
        return Pose((x, y, z), azimuth % 360, elevation, fov)


def raised(place: Vector, factor: float) -> Vector:
    """A place in world metres with its height multiplied."""
    return place[0], place[1], factor * place[2]


def vector(place: np.ndarray) -> Vector:
    """Three plain numbers."""
    x, y, z = (float(v) for v in place)
    return x, y, z


def not_too_steep(elevation_deg: float) -> float:
    """The elevation, kept away from straight up and down, where no azimuth is defined."""
    return min(max(elevation_deg, -STEEPEST_DEG), STEEPEST_DEG)


def hit_ground(
    heightmap: Heightmap, eye: np.ndarray, ray: np.ndarray, bend_per_m: float = 0.0, exaggeration: float = 1.0
) -> np.ndarray | None:
    """The first place where a ray meets the ground, or None: ray marching with growing steps, then bisection.

    The place is on the ray. The relief is drawn `exaggeration` times as high. Land far away is drawn lower by its drop
    (`Camera.bend_per_m`); `on_map` adds the drop.
    """

    def is_below(points: np.ndarray) -> np.ndarray:
        return on_map(points, eye, bend_per_m)[:, 2] < exaggeration * ground_m(heightmap, points[:, :2])

    near, far = 0.1 * min(heightmap.spacing_m), 4 * np.hypot(*heightmap.extent_m) + 2 * np.linalg.norm(eye)
    t = np.geomspace(near, max(far, 2 * near), 4000) / np.linalg.norm(ray)
    points = eye + t[:, None] * ray
    below = np.flatnonzero(is_below(points))
    if not len(below):
        return None
    first, last = t[max(below[0] - 1, 0)], t[below[0]]
    for _ in range(30):
        middle = 0.5 * (first + last)
        under = is_below((eye + middle * ray)[None])[0]
        first, last = (first, middle) if under else (middle, last)
    return eye + last * ray


def on_map(places: np.ndarray, eye: np.ndarray, bend_per_m: float) -> np.ndarray:
    """The places of the map that are drawn at these places (..., 3): higher by their drop."""
    drop_m = bend_per_m * np.square(places[..., :2] - eye[:2]).sum(-1)
    return places + np.stack([0 * drop_m, 0 * drop_m, drop_m], -1)
