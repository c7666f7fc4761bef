"""A bound of how far float32 moves the drawn mesh on the screen; derived in docs/precision.md."""

import math

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap

ROUNDING = 2.0**-24  # relative error of one float32 operation
CLIP_ROUNDINGS = 9  # roundings of a clip coordinate: 3 of a position, 5 of a matrix product, 1 for their products
SCREEN_ROUNDINGS = 4  # roundings of the division by depth and of the viewport transform
_AT_ONCE = 1 << 16  # triangles that are projected together


def rounding_px(
    camera: Camera, size: tuple[int, int], spacing_m: tuple[float, float], away_m: np.ndarray, depth_m: np.ndarray
) -> np.ndarray:
    """Bound the distance between a point's position in float32 and its exact position in the picture, in pixels.

    The rasteriser's grid adds up to half a step of 1/256 pixel along each axis, on all GPUs seen so far.

    Parameters
    ----------
    away_m
        (n,) distances from the eye to the point, or to the farthest corner of the triangle that contains it.
    depth_m
        (n,) view depths of the point.
    """
    half, centre = np.array(camera.half_extent(size)), np.abs(camera.centre)
    focal_px = camera.focal_px(size[1]) * np.array([camera.aspect(size), 1.0])
    away_m = away_m + math.hypot(*spacing_m)
    # the errors of x and y, and in perspective that of depth at the picture's rim
    lean = 1.0 if camera.is_orthographic else 1.0 + centre + half
    shift_m = float(np.hypot(*centre)) if camera.is_orthographic else 0.0
    spread_px = float(np.linalg.norm(focal_px * lean))
    of_clip = CLIP_ROUNDINGS * spread_px * (away_m + shift_m) / camera.w_at(depth_m)
    bound: np.ndarray = ROUNDING * (of_clip + SCREEN_ROUNDINGS * math.hypot(*size))
    return bound


def mesh_rounding_px(
    triangles: tuple[np.ndarray, np.ndarray],
    heightmap: Heightmap,
    base_m: float,
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
) -> float:
    """The largest `rounding_px` of a point of a mesh in the picture; 0 if none of it is.

    `triangles` are those of `mesh.captured_triangles`, with heights above `base_m`.
    """
    posts, heights_m = triangles
    return max(
        (
            _largest_px(posts[first:end], heights_m[first:end] + base_m, heightmap, camera, size, near_m)
            for first in range(0, len(posts), _AT_ONCE)
            for end in [first + _AT_ONCE]
        ),
        default=0.0,
    )


def _largest_px(
    posts: np.ndarray,
    heights_m: np.ndarray,
    heightmap: Heightmap,
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
) -> float:
    cols, rows = np.moveaxis(posts.astype(np.float64), -1, 0)
    east, north = heightmap.spacing_m
    up = heights_m - camera.drop_between_m(heightmap, cols, rows)
    corners = np.stack([cols * east, (heightmap.rows - 1 - rows) * north, up], -1) - camera.eye  # (n, 3, 3)
    x, y, depth = np.moveaxis(corners @ camera.axes.T, -1, 0)
    seen = (depth >= near_m).any(1)
    for aside, middle, half in zip((x, y), camera.centre, camera.half_extent(size), strict=True):
        w = camera.w_at(depth)
        seen &= (aside <= (middle + half) * w).any(1) & (aside >= (middle - half) * w).any(1)
    if not seen.any():
        return 0.0
    corners = corners[seen]
    away = np.linalg.norm(corners, axis=-1).max(1)
    # no point of the picture is nearer than its distance over the longest ray
    longest = np.hypot(1.0, np.hypot(*(np.abs(camera.centre) + camera.half_extent(size))))
    apart = np.linalg.norm(np.clip(0.0, corners.min(1), corners.max(1)), axis=-1)
    nearest = np.maximum(np.maximum(depth[seen].min(1), near_m), apart / longest)
    return float(rounding_px(camera, size, (east, north), away, nearest).max())
