"""The projection of points and boxes: the GPU's, the package's and the reference's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, cameras
from test_quadtree import ASK, INFINITE_PX, projection, random_boxes, random_posts, random_view

from terrain_gl import reference
from terrain_gl.camera import screen_shift_px
from terrain_gl.comparison.pruned import view_of

__all__ = ["projection"]  # a fixture


def boxes_of(asked, grid):
    """World corners (3, n) of the given boxes of posts."""
    (east, north), (x0, y0, x1, y1) = grid.spacing_m, asked["posts"].T
    low, high = asked["range_m"].astype("f8").T
    return np.stack([x0 * east, (grid.rows - 1 - y1) * north, low]), np.stack(
        [x1 * east, (grid.rows - 1 - y0) * north, high]
    )


def bounds_of(asked, grid, camera, size, near_m):
    """The reference's projections and bounds in pixels."""
    view, error_m = view_of(camera, size, near_m), asked["error_m"].astype("f8")
    p = reference.project_boxes(view, *boxes_of(asked, grid))
    return p, reference.error_px(view, p, error_m, error_m)


@settings(max_examples=100)
@given(st.integers(0, 10**6))
def test_bound_of_the_reference_holds_for_every_point_and_the_gpus_is_no_lower(ctx, projection, seed):
    rng = np.random.default_rng(seed)
    grid, camera, size, near_m = random_view(rng)
    asked = random_boxes(rng, grid, camera)
    p, bound_px = bounds_of(asked, grid, camera, size, near_m)
    points = random_posts(rng, grid, asked)
    rise = asked["error_m"].astype("f8")[:, None] * rng.choice([-1, 1], points.shape[:2])
    px, seen = screen_shift_px(camera, size, points.reshape(-1, 3), rise.ravel(), near_m)
    worst = np.where(seen, px, 0.0).reshape(rise.shape).max(1)
    assert (worst <= bound_px * (1 + 1e-9)).all()
    assert not (p.outside & seen.reshape(rise.shape).any(1)).any()
    gpu_px, outside, inside = projection(asked, grid, camera, size, near_m)
    assert not (outside & ~p.outside).any() and not (inside & ~p.inside).any()
    finite = gpu_px < np.float32(INFINITE_PX)
    assert (bound_px[finite & ~p.outside] <= gpu_px[finite & ~p.outside]).all()


@pytest.mark.parametrize("view", ["default", "grazing", "down", "wide", "pit", "outside", "corner"])
def test_bound_of_the_gpu_is_little_above_the_references(ctx, projection, view):
    """Within float32's slack: 0.05 % of the bound, and a millionth of the coordinates."""
    grid = MAPS["odd"]()
    camera, size, near_m = cameras(grid)[view], (640, 360), 0.1 * min(grid.spacing_m)
    level, rng = np.arange(7).repeat(40), np.random.default_rng(5)
    asked = np.zeros(len(level), ASK)
    at = rng.integers(0, [grid.cols - 1, grid.rows - 1], (len(level), 2)) >> level[:, None] << level[:, None]
    asked["posts"][:, :2], asked["posts"][:, 2:] = (
        at,
        np.minimum(at + (1 << level[:, None]), [grid.cols - 1, grid.rows - 1]),
    )
    asked["range_m"], asked["error_m"] = grid.range_m, 0.01
    p, bound_px = bounds_of(asked, grid, camera, size, near_m)
    gpu_px, outside, inside = projection(asked, grid, camera, size, near_m)
    assert (outside == p.outside).all() and (inside == p.inside).all()
    clear = ~p.outside & np.isfinite(bound_px) & (p.nearest_m > 2 * near_m)
    assert clear.any() and (gpu_px[clear] <= bound_px[clear] * 1.002).all()


def test_shift_of_a_point_is_the_cameras(ctx):
    grid = MAPS["odd"]()
    rng = np.random.default_rng(1)
    for camera in cameras(grid).values():
        points = rng.uniform(0, 1, (500, 3)) * [*grid.extent_m, grid.range_m[1]]
        rise = rng.normal(size=500)
        px, seen = screen_shift_px(camera, (320, 180), points, rise, 0.5)
        scale = reference.screen_scale(view_of(camera, (320, 180), 0.5), points.T)
        assert (scale.seen == seen).all()
        assert reference.shift_px(scale, rise)[seen] == pytest.approx(px[seen], rel=1e-12)
