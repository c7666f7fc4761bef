"""Count the pixels where the sky shows through the surface."""

from __future__ import annotations

import numpy as np

from .camera import Camera
from .heightmap import Heightmap

_PAIRS = (((0, 1), (0, -1)), ((1, 0), (-1, 0)), ((1, 1), (-1, -1)), ((1, -1), (-1, 1)))


def count_holes(
    covered: np.ndarray, heightmap: Heightmap, camera: Camera, size: tuple[int, int], tolerance_px: float
) -> int:
    """Pixels that no triangle covers although the truth does, by more than the tolerance.

    A crack is thin: its pixels have covered ones on two opposite sides. Such a pixel is a hole unless the sky, or a void,
    is within `tolerance_px` + 1 of it in the true picture, by marching its rays through the full-resolution heights.

    Parameters
    ----------
    covered
        (height, width) bool, first row on top.
    """
    rows, cols = np.nonzero(_candidates(covered))
    for rays in (3, 17):  # a few tell for most pixels; voids far away are small
        offsets = np.linspace(-tolerance_px - 1.0, tolerance_px + 1.0, rays)
        hits = np.ones(len(rows), bool)
        for dx in offsets:
            for dy in offsets:
                at = np.flatnonzero(hits)
                hits[at] = _meets_ground(heightmap, camera, size, cols[at] + 0.5 + dx, rows[at] + 0.5 + dy)
        rows, cols = rows[hits], cols[hits]
    return len(rows)


def _candidates(covered: np.ndarray) -> np.ndarray:
    padded = np.pad(covered, 1)
    height, width = covered.shape

    def shifted(step: tuple[int, int]) -> np.ndarray:
        return padded[1 + step[0] : 1 + step[0] + height, 1 + step[1] : 1 + step[1] + width]

    between = np.zeros_like(covered)
    for one, other in _PAIRS:
        between |= shifted(one) & shifted(other)
    return between & ~covered


def _meets_ground(
    heightmap: Heightmap, camera: Camera, size: tuple[int, int], x_px: np.ndarray, y_px: np.ndarray
) -> np.ndarray:
    """Whether the rays through points of the picture (x right, y down, pixels) meet solid ground, (n,) bool."""
    focal = camera.focal_px(size[1])
    picture = np.stack([(x_px - 0.5 * size[0]) / focal, (0.5 * size[1] - y_px) / focal, np.ones(len(x_px))], -1)
    rays = picture @ camera.axes
    return np.array([_ray_meets_ground(heightmap, np.asarray(camera.eye), ray) for ray in rays], bool)


def _ray_meets_ground(heightmap: Heightmap, eye: np.ndarray, ray: np.ndarray) -> bool:
    """March a ray in half-post steps over the map until it crosses the surface; through a void it goes on below."""
    to_posts = np.array([1.0, -1.0]) / heightmap.spacing_m
    start = np.array([0.0, heightmap.rows - 1.0]) + eye[:2] * to_posts
    step = ray[:2] * to_posts
    first, last = _clip(start, step, (heightmap.cols - 1, heightmap.rows - 1))
    if first >= last:
        return False
    pace = 0.5 / max(np.hypot(*step), 1e-12)
    t = np.arange(first, min(last, first + 1e6 * pace), pace)

    def crossings(t: np.ndarray) -> np.ndarray:
        heights = bilinear(heightmap.heights, start[0] + t * step[0], start[1] + t * step[1])
        above = np.sign(eye[2] + t * ray[2] - heights)  # NaN over a void, which compares false
        return t[:-1][above[1:] * above[:-1] < 0]

    # looked at closely, a crossing may turn out to lie in the corner of a void
    return any(len(crossings(np.linspace(at, at + pace, 65))) for at in crossings(t))


def _clip(start: np.ndarray, step: np.ndarray, last_post: tuple[int, int]) -> tuple[float, float]:
    first, last = 0.0, np.inf
    for s, d, end in zip(start, step, last_post, strict=True):
        if abs(d) < 1e-12:
            if not 0 <= s <= end:
                return 1.0, 0.0
            continue
        a, b = sorted((-s / d, (end - s) / d))
        first, last = max(first, a), min(last, b)
    return first, last


def bilinear(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights at fractional columns x and rows y, in float64; NaN in cells with a void corner and outside the map."""
    rows, cols = heights.shape
    outside = ~((x >= 0) & (x <= cols - 1) & (y >= 0) & (y <= rows - 1))
    col = np.clip(np.floor(np.where(outside, 0, x)), 0, cols - 2).astype(int)
    row = np.clip(np.floor(np.where(outside, 0, y)), 0, rows - 2).astype(int)
    u, v = x - col, y - row
    top = heights[row, col] * (1 - u) + heights[row, col + 1] * u
    bottom = heights[row + 1, col] * (1 - u) + heights[row + 1, col + 1] * u
    return np.where(outside, np.nan, top * (1 - v) + bottom * v)
