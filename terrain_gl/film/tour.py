"""A flight for any map: one loop around the middle, at a safe height above the ground."""

import math

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap, ground_m
from .path import CameraPath, Keyframe

KEYFRAMES = 16
RADIUS = 0.3  # radii of the loop, as a part of the map's width and height
NEARBY = 0.06  # radius of the ground that a keyframe must stay above, as a part of the map's smaller side
LOW = 0.02  # least height of a keyframe above that ground, as a part of the map's smaller side
HIGH = 0.1  # largest such height
AHEAD = 0.6 * math.pi  # the eye looks at the point of the loop that is this angle ahead
CLEARANCE = 0.01  # smallest height above the surface, as a part of the map's smaller side
FOV_DEG = 55.0


def tour(heightmap: Heightmap, fov_deg: float = FOV_DEG) -> CameraPath:
    """A loop around a map, at least `clearance_m` above it; the eye looks ahead, and goes down and up twice."""
    loop = CameraPath([_keyframe(heightmap, 2 * math.pi * i / KEYFRAMES, fov_deg) for i in range(KEYFRAMES)], True)
    lift = clearance_m(heightmap) - float(np.min(above_surface_m(heightmap, loop.eyes)))
    if lift <= 0:
        return loop
    # the curve is affine in its keyframes: lifting all of them lifts the curve by the same amount
    return CameraPath([_lifted(keyframe, 1.001 * lift) for keyframe in loop.keyframes], True)


def clearance_m(heightmap: Heightmap) -> float:
    """The smallest height of a tour above the surface: a part of the map's smaller side, at least two spacings."""
    return max(CLEARANCE * min(heightmap.extent_m), 2 * max(heightmap.spacing_m))


def above_surface_m(heightmap: Heightmap, way: np.ndarray) -> np.ndarray:
    """A lower bound of the height above the surface for each piece of a path (n, 3): (n - 1,) metres.

    The surface is never above the highest of the posts around. The result is infinite over voids and outside the map.
    """
    steps = np.abs(np.diff(way[:, :2], axis=0)) / heightmap.spacing_m
    fine = max(1, math.ceil(float(steps.max(initial=0.0))))
    number = np.arange(fine * (len(way) - 1) + 1) / fine  # steps of at most one post
    x, y, z = (np.interp(number, np.arange(len(way)), axis) for axis in way.T)
    heights = z - _highest_m(heightmap, x, y)
    return np.minimum.reduceat(np.minimum(heights[1:], heights[:-1]), np.arange(0, len(heights) - 1, fine))


def _highest_m(heightmap: Heightmap, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height of the highest of the 4 × 4 posts around each place (n,): its cell and the cells next to it."""
    col = np.floor(x / heightmap.spacing_m[0]).astype(np.int64)
    row = np.floor(heightmap.rows - 1 - y / heightmap.spacing_m[1]).astype(np.int64)
    highest = np.full(len(x), -np.inf)
    for down in range(-1, 3):
        for right in range(-1, 3):
            r = row + down
            c = col + right
            inside = (r >= 0) & (r < heightmap.rows) & (c >= 0) & (c < heightmap.cols)
            post = heightmap.heights[np.where(inside, r, 0), np.where(inside, c, 0)]
            highest = np.fmax(highest, np.where(inside, post, -np.inf))
    return highest


def _keyframe(heightmap: Heightmap, angle: float, fov_deg: float) -> Keyframe:
    side = min(heightmap.extent_m)
    x, y = _on_loop(heightmap, angle)
    ahead_x, ahead_y = _on_loop(heightmap, angle + AHEAD)
    share = 0.5 - 0.5 * math.cos(2 * angle)
    z = _nearby_m(heightmap, x, y).max() + side * (LOW + (HIGH - LOW) * share)
    return Keyframe(
        Camera((x, y, float(z)), (ahead_x, ahead_y, float(_nearby_m(heightmap, ahead_x, ahead_y).mean())), fov_deg)
    )


def _on_loop(heightmap: Heightmap, angle: float) -> tuple[float, float]:
    east, north = heightmap.extent_m
    return (0.5 + RADIUS * math.cos(angle)) * east, (0.5 + RADIUS * math.sin(angle)) * north


def _nearby_m(heightmap: Heightmap, x: float, y: float) -> np.ndarray:
    """Heights of the ground at points around a place, on a sunflower spiral; the map's mid-range if all is void."""
    n = np.arange(400)
    radius = NEARBY * min(heightmap.extent_m) * np.sqrt(n / len(n))
    angle = n * math.pi * (3 - math.sqrt(5))
    places = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], -1)
    heights = ground_m(heightmap, places)
    heights = heights[np.isfinite(heights)]
    return heights if len(heights) else np.array([0.5 * sum(heightmap.range_m)])


def _lifted(keyframe: Keyframe, metres: float) -> Keyframe:
    """The keyframe, moved up, with the same direction of view."""
    camera = keyframe.camera
    x, y, z = camera.eye
    u, v, w = camera.target
    return Keyframe(Camera((x, y, z + metres), (u, v, w + metres), camera.fov_deg))
