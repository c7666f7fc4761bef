"""Cameras: axes, projection and the exact screen shift, compared with the projection matrix."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera, boxes_in_picture, clip_from_eye, screen_shift_px
from terrain_gl.heightmap import Heightmap

SIZE = (1280, 720)
metres = st.integers(-(10**7), 10**7).map(lambda millimetres: millimetres / 1000)
points = st.tuples(metres, metres, metres)


def pixels(camera, size, world, near_m=0.1):
    """Places of world points (n, 3) in the picture, pixels from its middle, by the clip matrix."""
    relative = np.c_[world - np.asarray(camera.eye), np.ones(len(world))]
    clip = relative @ clip_from_eye(camera, size, near_m).T
    return clip[:, :2] / clip[:, 3:] * np.asarray(size) / 2


def test_axes_of_a_camera_that_looks_north():
    camera = Camera((0, 0, 0), (0, 5, 0))
    assert np.allclose(camera.axes, [[1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-12)


def test_straight_down_north_is_up():
    assert np.allclose(Camera((3, 4, 100), (3, 4, 0)).axes, [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)


def test_east_is_right_and_high_is_up_in_the_picture():
    camera = Camera((0, 0, 0), (0, 10, 0))
    x, y = pixels(camera, SIZE, np.array([[1.0, 10.0, 0.0], [0.0, 10.0, 1.0]]))
    assert x[0] > 0 and abs(x[1]) < 1e-9
    assert y[1] > 0 and abs(y[0]) < 1e-9


@given(points, points)
def test_axes_are_orthonormal_and_right_handed(eye, target):
    if np.linalg.norm(np.subtract(eye, target)) < 1e-3:
        return
    right, up, forward = axes = Camera(eye, target).axes
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.allclose(np.cross(up, forward), -right, atol=1e-9)
    assert up[2] >= -1e-9


def test_focal_length_and_extent_agree():
    camera = Camera((0, 0, 0), (1, 0, 0), 60)
    tan_x, tan_y = camera.half_extent(SIZE)
    assert tan_y == pytest.approx(np.tan(np.radians(30)))
    assert camera.focal_px(SIZE[1]) * tan_y == pytest.approx(SIZE[1] / 2)
    assert camera.focal_px(SIZE[1]) * tan_x == pytest.approx(SIZE[0] / 2)


def test_depth_is_one_at_the_near_plane_and_falls_to_zero():
    clip = clip_from_eye(Camera((0, 0, 0), (0, 1, 0)), SIZE, 0.5)
    depth = [(clip @ [0, d, 0, 1])[2] / (clip @ [0, d, 0, 1])[3] for d in (0.5, 1, 1e9)]
    assert depth == pytest.approx([1, 0.5, 5e-10])


@given(points, points, st.floats(5, 150), points, st.integers(-1000, 1000).map(lambda n: n / 1000))
def test_screen_shift_is_the_distance_in_the_picture(eye, target, fov, point, rise):
    if np.linalg.norm(np.subtract(eye, target)) < 1:
        return
    camera = Camera(eye, target, fov)
    world = np.array([point])
    (px,), (seen,) = screen_shift_px(camera, SIZE, world, np.array([rise]), 2.0)
    depth = camera.forward @ (world[0] - eye)
    place = pixels(camera, SIZE, world)[0] if depth > 2 else np.array([np.inf, np.inf])
    assert (
        seen == (depth >= 2 and (np.abs(place) <= np.asarray(SIZE) / 2).all())
        or np.abs(np.abs(place) - np.asarray(SIZE) / 2).min() < 1e-6
    )
    if seen:
        moved = pixels(camera, SIZE, world + [0, 0, rise])[0]
        assert px == pytest.approx(np.hypot(*(moved - place)), rel=1e-6, abs=1e-7)


def test_point_moved_behind_the_eye_shifts_without_bound():
    camera = Camera((0, 0, 10), (0, 0, 0))
    px, seen = screen_shift_px(camera, SIZE, np.zeros((1, 3)), np.array([11.0]), 0.1)
    assert seen.all() and np.isinf(px).all()


@pytest.mark.parametrize("shape", [(2, 2), (3, 1000), (1000, 3), (500, 500)], ids=str)
def test_default_view_sees_the_map(shape):
    heightmap = Heightmap(np.random.default_rng(0).normal(size=shape), 10.0)
    camera = Camera.default(heightmap)
    east, north = heightmap.extent_m
    places = np.array([[x, y, 0] for x in np.linspace(0, east, 11) for y in np.linspace(0, north, 11)])
    _, seen = screen_shift_px(camera, SIZE, places, np.zeros(121), 1.0)
    assert seen[60], "the middle"
    assert seen.mean() > 0.4
    assert camera.eye[2] > heightmap.range_m[1]


@pytest.mark.parametrize(
    "arguments, message",
    [
        (((0, 0, 0), (0, 0, 0)), "same point"),
        (((0, 0, 0), (0, 0, 5), 50, (0, 0, 2)), "parallel"),
        (((0, 0, 0), (0, 1, 0), 50, (0, 0, 0)), "parallel"),
        (((0, 0, 0), (0, 0, 1e-200)), "same point"),
        (((0, 0, np.nan), (0, 1, 0)), "metres up to"),
        (((0, 0, np.inf), (0, 1, 0)), "metres up to"),
        (((0, 0, 1e300), (0, 1, 0)), "metres up to"),
        (((0, 0), (0, 1, 0)), "three numbers"),
        (("x", (0, 1, 0)), "three numbers"),
        (((0, 0, 0), (0, 1, 0), 0), "field of view"),
        (((0, 0, 0), (0, 1, 0), 180), "field of view"),
        (((0, 0, 0), (0, 1, 0), float("nan")), "field of view"),
    ],
)
def test_bad_cameras_are_refused_in_one_line(arguments, message):
    with pytest.raises(UsageError, match=message) as error:
        Camera(*arguments)
    assert "\n" not in str(error.value)


def test_boxes_outside_of_one_plane_are_not_in_the_picture():
    """All eight corners of a box, as they are drawn, are beyond one plane of the view, but for rounding."""
    rng = np.random.default_rng(3)
    low = rng.uniform(-1500, 1500, (4000, 3)) * (1, 1, 0.2)
    high = low + rng.uniform(0, 600, (4000, 3))
    for bend_per_m in (0.0, 1e-4):
        camera = Camera((10, -20, 30), (200, 300, -40), 60, bend_per_m=bend_per_m)
        nearest, farthest = np.clip(camera.eye, low, high), np.where(camera.eye - low > high - camera.eye, low, high)
        bottom, top = low[:, 2] - camera.drop_m(*farthest[:, :2].T), high[:, 2] - camera.drop_m(*nearest[:, :2].T)
        corners = [(x, y, z) for x in (low, high) for y in (low, high) for z in (bottom, top)]
        points = np.array([np.stack([x[:, 0], y[:, 1], z], -1) for x, y, z in corners]) - camera.eye
        (x, y, z), (tan_x, tan_y) = np.moveaxis(points @ camera.axes.T, -1, 0), camera.half_extent(SIZE)
        beyond = [x - tan_x * z, -x - tan_x * z, y - tan_y * z, -y - tan_y * z, 1.0 - z]
        seen, margin = boxes_in_picture(camera, SIZE, 1.0, low, high), np.max([each.min(0) for each in beyond], 0)
        assert seen[margin <= 0].all() and not seen[margin > 0.02].any() and 0.05 < seen.mean() < 0.95
