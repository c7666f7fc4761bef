"""A bound of how far float32 moves the drawn mesh on the screen; derived in docs/precision.md."""

import math

import numpy as np

from ..heightmap import Heightmap
from .camera import Camera

ROUNDING = 2.0**-24  # relative error of one float32 operation
CLIP_ROUNDINGS = 9  # roundings of a clip coordinate: 3 of a position, 5 of a matrix product, 1 for their products
SCREEN_ROUNDINGS = 4  # roundings of the division by depth and of the viewport transform
LEFT_OUT_PX = 1 / 64  # if float32 adds no more to land far from the eye, the certificate leaves it out
GRID_PX = math.sqrt(2) / 512  # vertex shaders round to 1/256 pixel along each axis
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
    of_clip_px, of_screen_px = _rounding_px(camera, size)
    shift_m = math.hypot(*camera.centre) if camera.is_orthographic else 0.0
    bound: np.ndarray = of_clip_px * (away_m + math.hypot(*spacing_m) + shift_m) / camera.w_at(depth_m) + of_screen_px
    return bound


def _rounding_px(camera: Camera, size: tuple[int, int]) -> tuple[float, float]:
    """Bounds of what the rounding of clip coordinates adds, for a distance as large as w; and of what the rest adds."""
    half, centre = np.array(camera.half_extent(size)), np.abs(camera.centre)
    focal_px = camera.focal_px(size[1]) * np.array([camera.aspect(size), 1.0])
    # the errors of x and y, and in perspective that of depth at the picture's rim
    lean = 1.0 if camera.is_orthographic else 1.0 + centre + half
    of_clip = CLIP_ROUNDINGS * float(np.linalg.norm(focal_px * lean))
    return ROUNDING * of_clip, ROUNDING * SCREEN_ROUNDINGS * math.hypot(*size)


def certified_rounding_px(camera: Camera, heightmap: Heightmap, size: tuple[int, int]) -> tuple[float, ...]:
    """What the certificate includes: a, b, 0 and 0 of glsl/lod/project.glsl. In most views all are 0.

    Edges of triangles in a box, and the spacing, are at most its diagonal each: so a counts twice. b is the bound far
    from the eye, with the rounding of vertices to `GRID_PX`. If it is at most `LEFT_OUT_PX`, nothing is included. A
    distance is at most w times the longest ray, or that of the farthest land for an orthographic camera.
    """
    of_clip_px, of_screen_px = _rounding_px(camera, size)
    if camera.is_orthographic:
        (east, north), (low_m, high_m) = heightmap.extent_m, heightmap.range_m
        corners = np.array([[0.0, 0.0, low_m], [east, north, high_m]])
        over_w = math.hypot(*np.abs(corners - camera.eye).max(0)) + math.hypot(*camera.centre)
    else:
        over_w = math.hypot(1.0, *(np.abs(camera.centre) + camera.half_extent(size)))
    far_px = of_clip_px * over_w + of_screen_px + GRID_PX
    return (2.0 * of_clip_px, far_px, 0.0, 0.0) if far_px > LEFT_OUT_PX else (0.0,) * 4


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
