"""Count the pixels where the sky shows through the surface."""

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap, bilinear

# offsets up to a pixel from the middle, in steps of an eighth: samples are somewhere in this area
_AROUND = sorted(((i / 8, j / 8) for i in range(-8, 9) for j in range(-8, 9)), key=lambda at: np.hypot(*at))
_PAIRS = (((0, 1), (0, -1)), ((1, 0), (-1, 0)), ((1, 1), (-1, -1)), ((1, -1), (-1, 1)))


def count_holes(
    covered: np.ndarray, heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float, tolerance_px: float
) -> int:
    """Count the pixels that no triangle covers although the true surface does.

    A crack is thin: each of its pixels has covered pixels on two opposite sides. Such a pixel is a hole if all rays
    around it meet the ground, even if the surface moves up or down by `tolerance_px` plus one pixel. Rays are followed
    through the full-resolution heights.

    Parameters
    ----------
    covered
        (height, width) bool, first row on top.
    """
    rows, cols = np.nonzero(_candidates(covered))
    for dx, dy in _AROUND:
        hits = _meets_ground(heightmap, camera, size, near_m, tolerance_px + 1.0, cols + 0.5 + dx, rows + 0.5 + dy)
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
    heightmap: Heightmap,
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
    slack_px: float,
    x_px: np.ndarray,
    y_px: np.ndarray,
) -> np.ndarray:
    """Whether rays through points of the picture (x right, y down, pixels) certainly meet the ground, (n,) bool."""
    focal = camera.focal_px(size[1])
    aspect = camera.aspect(size)
    x = camera.centre[0] + (x_px - 0.5 * size[0]) / (focal * aspect)
    y = camera.centre[1] + (0.5 * size[1] - y_px) / focal
    right, up, vertical_w = camera.vertical
    stretch = np.hypot((right - x * vertical_w) * aspect, up - y * vertical_w)
    slack = slack_px / (focal * np.maximum(stretch, 1e-9))  # metres up or down, for each unit of w
    aside = np.stack([x, y, np.zeros(len(x))], -1) @ camera.axes
    along = np.broadcast_to(camera.axes[2], aside.shape)
    starts, rays = (aside, along) if camera.is_orthographic else (0 * aside, along + aside)
    seen = zip(starts + camera.eye, rays, slack, strict=True)
    return np.array([_ray_meets_ground(heightmap, camera, *ray, near_m) for ray in seen], bool)


def _ray_meets_ground(
    heightmap: Heightmap, camera: Camera, eye: np.ndarray, ray: np.ndarray, slack: float, near_m: float
) -> bool:
    """Follow a ray from cell to cell.

    The ray meets the ground if it passes from more than the slack above the ground to more than the slack below it, or
    the other way round, with no void in between. Heights are compared on cell edges, where diagonals do not matter.
    """
    to_posts = np.array([1.0, -1.0]) / heightmap.spacing_m
    start = np.array([0.0, heightmap.rows - 1.0]) + eye[:2] * to_posts
    step = ray[:2] * to_posts
    depth, x, y = _edges_crossed(start, step, heightmap, near_m)
    above_m = eye[2] + depth * ray[2] + camera.drop_between_m(heightmap, x, y) - bilinear(heightmap.heights, x, y)
    low, high = heightmap.range_m
    side = np.sign(above_m) * (np.abs(above_m) > np.minimum(slack * camera.w_at(depth), high - low))
    middle = (depth[1:] + depth[:-1]) / 2
    void = np.isnan(bilinear(heightmap.heights, start[0] + middle * step[0], start[1] + middle * step[1]))
    voids_before = np.concatenate([[0], np.cumsum(void)])
    sure = np.flatnonzero(np.abs(side) == 1)
    change = side[sure[1:]] != side[sure[:-1]]
    return bool(np.any(change & (voids_before[sure[1:]] == voids_before[sure[:-1]])))


def _edges_crossed(
    start: np.ndarray, step: np.ndarray, heightmap: Heightmap, near_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of a ray with the grid lines, on the map and beyond the near plane: depths, columns, rows."""
    last_post = np.array([heightmap.cols - 1, heightmap.rows - 1])
    crossed = []
    for axis in np.flatnonzero(np.abs(step) > 1e-12):
        lines = np.arange(last_post[axis] + 1.0)
        depth = (lines - start[axis]) / step[axis]
        at = start + depth[:, None] * step
        at[:, axis] = lines
        crossed.append(np.c_[depth, at])
    points = np.concatenate(crossed or [np.zeros((0, 3))])
    on_map = ((points[:, 1:] >= 0) & (points[:, 1:] <= last_post)).all(1) & (points[:, 0] > near_m)
    return tuple(points[on_map][np.argsort(points[on_map, 0])].T)
