"""The camera: what keys and mouse do to it."""

import math

import numpy as np
import pytest
from viewers import hills

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap, ground_m
from terrain_gl.viewer.controller import CLEARANCE, FAST, TRAVEL_S, WHEEL, Controller, Pose, hit_ground
from terrain_gl.viewer.pose import on_map


@pytest.fixture
def controller():
    return Controller(hills(), Camera((640, -200, 400), (640, 640, 100)))


def test_starts_with_the_camera_given(controller):
    assert controller.camera.eye == (640, -200, 400)
    assert controller.camera == controller.start != Pose.of(controller.start).camera  # to the last digit
    assert not controller.moving


def test_straight_down_keeps_north_up():
    start = Camera((600, 600, 900), (600, 600, 0))
    controller = Controller(hills(), start)
    assert np.allclose(controller.camera.axes, start.axes, atol=3e-3)  # a tenth of a degree from the vertical


@pytest.mark.parametrize(("key", "axis", "sign"), [("w", 2, 1), ("s", 2, -1), ("d", 0, 1), ("a", 0, -1)])
def test_keys_move_along_the_view(controller, key, axis, sign):
    before, direction = controller.eye.copy(), sign * controller.axes[axis]
    controller.press(key)
    controller.step(0.5)
    moved = controller.eye - before
    assert np.allclose(moved / np.linalg.norm(moved), direction)


@pytest.mark.parametrize(("key", "sign"), [("e", 1), ("q", -1)])
def test_keys_move_up_and_down_in_the_world(controller, key, sign):
    before = controller.eye.copy()
    controller.press(key)
    controller.step(0.2)
    assert np.allclose((controller.eye - before)[:2], 0) and (controller.eye - before)[2] * sign > 0


def test_opposite_keys_hold_still(controller):
    controller.press("w")
    controller.press("s")
    assert not controller.moving


@pytest.mark.parametrize("frames", [1, 7, 100])
def test_motion_does_not_depend_on_the_frame_rate(controller, frames):
    expected = Controller(controller.heightmap, controller.start)
    for flown, steps in ((controller, frames), (expected, 3)):
        flown.press("d")
        for _ in range(steps):
            flown.step(1.0 / steps)
        flown.let_go("d")
        for _ in range(steps):
            flown.step(0.2 / steps)
    assert np.allclose(controller.eye, expected.eye, atol=1e-9)


def test_reaches_its_speed_and_comes_to_rest(controller):
    controller.press("d")
    controller.step(10.0)
    before = controller.eye.copy()
    controller.step(1.0)
    assert np.linalg.norm(controller.eye - before) == pytest.approx(controller.speed_m_s)
    controller.press("shift")
    controller.step(10.0)
    before = controller.eye.copy()
    controller.step(1.0)
    assert np.linalg.norm(controller.eye - before) == pytest.approx(FAST * controller.speed_m_s)
    controller.let_go_all()
    for _ in range(100):
        controller.step(0.02)
    assert not controller.moving


def test_wheel_changes_speed_within_limits(controller):
    before = controller.speed_m_s
    controller.wheel(2)
    assert controller.speed_m_s == pytest.approx(before * WHEEL**2)
    controller.wheel(-1000)
    assert 0 < controller.speed_m_s < before
    controller.wheel(1000)
    assert math.isfinite(controller.speed_m_s)


def seen_at(controller, place):
    """Tangents right and up of the point of the picture where a place is seen."""
    right, up, forward = controller.axes @ (place - controller.eye)
    return right / forward, up / forward


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.25, -0.1), (-0.3, 0.05)])
def test_the_wheel_comes_nearer_to_what_is_under_the_cursor(controller, at):
    place = hit_ground(controller.heightmap, controller.eye, np.array([*at, 1.0]) @ controller.axes)
    away = np.linalg.norm(place - controller.eye)
    controller.approach(*at, 2)
    assert np.linalg.norm(place - controller.eye) == pytest.approx(away / WHEEL**2, rel=1e-6)
    assert seen_at(controller, place) == pytest.approx(at, abs=1e-6)
    controller.approach(*at, -2)
    assert controller.eye == pytest.approx(controller.start.eye, abs=0.1)
    controller.approach(*at, 60)
    assert controller.height_above_ground_m >= CLEARANCE * 10 - 1e-6


def test_the_wheel_in_the_sky_goes_on(controller):
    controller.look(0, -1000)
    before = controller.eye.copy()
    controller.approach(0.0, 0.0, 1)
    assert (controller.eye - before) @ controller.axes[2] > 0 and controller.pivot is None


@pytest.mark.parametrize("to", [(0.3, -0.2), (-0.1, 0.05), (0.0, -0.35)])
def test_a_middle_drag_takes_the_land_along(controller, to):
    """The eye keeps its height, and the place that was grabbed stays under the cursor."""
    controller.grab(0.05, -0.1)
    place, height = controller.pivot, controller.eye[2]
    controller.pan(*to)
    assert seen_at(controller, place) == pytest.approx(to, abs=1e-9) and controller.eye[2] == height
    controller.pan(0.0, 5.0)  # the sky: no further than a few times the distance
    assert np.linalg.norm(controller.eye - place) < 6 * np.linalg.norm(np.subtract(controller.start.eye, place))


def test_a_long_drag_into_the_sky_goes_no_further_than_its_first_event(controller):
    controller.grab(0.0, 0.0)
    reach_m = np.linalg.norm(controller.pivot - controller.eye)
    for up in np.linspace(0.0, 2.0, 200):
        controller.pan(0.1 * up, up)
        assert np.linalg.norm((controller.eye - controller.pivot)[:2]) <= 4.001 * reach_m


def test_the_eye_stays_near_the_map_whatever_moves_it(controller):
    farthest_m = 31 * max(controller.heightmap.extent_m)
    for _ in range(300):
        controller.approach(0.0, 2.0, -20)
    assert np.abs(controller.eye).max() < farthest_m
    controller.held |= {"w", "shift"}
    for _ in range(300):
        controller.wheel(5)
        controller.step(0.25)
    assert np.abs(controller.eye).max() < farthest_m


def test_a_camera_that_is_given_far_away_stays_there():
    far = Controller(hills(), Camera((1e6, 1e6, 1e6), (640, 640, 100)))
    far.look(5, 5)
    assert tuple(far.eye) == (1e6, 1e6, 1e6)
    far.grab(0.0, 0.0)
    far.orbit(0.0, 0.0)
    assert np.allclose(far.eye, 1e6)


def test_flying_to_a_place_ends_near_it_and_above_the_ground(controller):
    at = (0.2, -0.1)
    place = hit_ground(controller.heightmap, controller.eye, np.array([*at, 1.0]) @ controller.axes)
    away = np.linalg.norm(place - controller.eye)
    assert controller.fly_to(*at) and controller.moving
    controller.step(2 * TRAVEL_S)
    assert np.linalg.norm(place - controller.eye) < 0.4 * away and controller.height_above_ground_m > 0
    assert seen_at(controller, place) == pytest.approx((0, 0), abs=1e-6)
    controller.look(0, -1000)
    assert not controller.fly_to(0.0, 0.0)


def test_speed_follows_the_height_above_the_ground(controller):
    controller.eye = np.array([640.0, 640.0, 2000.0])
    high, height = controller.speed_m_s, controller.height_above_ground_m
    controller.eye[2] = 300.0
    assert controller.speed_m_s / high == pytest.approx(controller.height_above_ground_m / height)
    controller.wheel(3)
    assert controller.speed_m_s / high == pytest.approx(WHEEL**3 * controller.height_above_ground_m / height)
    controller.eye[2] = 0.0  # in the ground it is not zero
    assert controller.speed_m_s > 0
    controller.eye = np.array([-5000.0, 640.0, 900.0])  # off the map, above its lowest place
    assert controller.speed_m_s / high == pytest.approx(WHEEL**3 * (900 - controller.heightmap.range_m[0]) / height)


def test_look_turns_and_stops_short_of_the_vertical(controller):
    controller.look(100, 0)
    assert controller.azimuth_deg == pytest.approx(10)
    for _ in range(3):
        controller.look(0, 5000)
        assert controller.camera.forward[2] > -1
    controller.look(0, -50000)
    assert np.isfinite(controller.camera.axes).all()


def test_orbit_keeps_the_pivot_in_its_place(controller):
    x, y = 0.2, -0.1
    controller.grab(x, y)
    pivot = controller.pivot
    assert pivot[2] == pytest.approx(ground_m(controller.heightmap, pivot[:2])[0], abs=0.01)
    distance = np.linalg.norm(pivot - controller.eye)
    controller.orbit(70, 15)
    right, up, forward = controller.axes @ (pivot - controller.eye)
    assert (right / forward, up / forward) == pytest.approx((x, y))
    assert np.linalg.norm(pivot - controller.eye) == pytest.approx(distance)
    assert not np.allclose(controller.eye, controller.start.eye)


def test_in_the_sky_the_pivot_is_in_the_middle_or_far_away(controller):
    controller.grab(0, 0)
    middle = controller.pivot
    controller.grab(0, 5)
    assert np.allclose(controller.pivot, middle)
    controller.look(0, -1000)  # nothing but sky
    controller.grab(0, 0)
    assert np.isfinite(controller.pivot).all()


def test_stays_above_ground_unless_told_otherwise(controller):
    controller.eye = np.array([640.0, 640.0, 150.0])
    controller.speed_m_s = 1000.0
    controller.press("q")
    controller.step(1.0)
    assert controller.height_above_ground_m == pytest.approx(CLEARANCE * 10)
    controller.above_ground = False
    controller.step(1.0)
    assert controller.height_above_ground_m < -500


def test_no_ground_outside_the_map_nor_over_voids():
    heights = np.full((5, 5), 10.0)
    heights[2, 2] = np.nan
    controller = Controller(Heightmap(heights, 1.0), Camera((2, 2, 3), (2, 4, 3)))
    assert math.isnan(controller.height_above_ground_m)
    controller.step(0.1)
    assert controller.eye[2] == 3
    controller.eye = np.array([-50.0, 0, -7])
    controller.step(0.1)
    assert controller.eye[2] == -7


def test_hit_ground_finds_the_first_hill():
    heightmap = hills()
    eye = np.array([640.0, -200.0, 400.0])
    hit = hit_ground(heightmap, eye, np.array([0.0, 2.0, -0.8]))
    assert hit[2] == pytest.approx(ground_m(heightmap, hit[:2])[0], abs=1e-3)
    assert hit_ground(heightmap, eye, np.array([0.0, 0.0, 1.0])) is None


def test_hit_ground_finds_land_that_is_drawn_lower():
    """On a round Earth, with 1 / 2R = 1e-4, land 600 m away is 36 m lower."""
    heightmap, eye, bend_per_m = hills(), np.array([640.0, -200.0, 400.0]), 1e-4
    seen = hit_ground(heightmap, eye, np.array([0.0, 2.0, -0.8]), bend_per_m)
    place = on_map(seen, eye, bend_per_m)
    assert place[2] == pytest.approx(ground_m(heightmap, place[:2])[0], abs=1e-3)
    assert place[2] - seen[2] == pytest.approx(bend_per_m * (seen[1] + 200) ** 2)
    assert seen[2] - 400 == pytest.approx(-0.4 * (seen[1] + 200))


def test_home_comes_back(controller):
    controller.look(300, 100)
    controller.press("w")
    controller.step(1.0)
    controller.let_go_all()
    controller.home()
    assert controller.camera.eye == controller.start.eye and not controller.moving


def test_arrows_turn_the_head(controller):
    before = controller.pose
    controller.press("right")
    assert controller.moving
    controller.step(0.5)
    assert controller.azimuth_deg == pytest.approx(before.azimuth_deg + 20) and controller.pose.eye == before.eye
    controller.press("left")
    assert not controller.moving


def test_the_camera_travels_smoothly(controller):
    there = Pose((100.0, 700.0, 500.0), 350.0, -30.0, 40.0)
    start = controller.pose
    controller.travel_to(there)
    assert controller.moving
    controller.step(TRAVEL_S / 2)
    half = controller.pose
    assert np.allclose(half.eye, (np.array(start.eye) + there.eye) / 2)
    assert half.azimuth_deg == pytest.approx(355.0)  # from 0 to 350 the short way
    controller.step(TRAVEL_S)
    assert controller.pose == there and not controller.moving


def test_a_key_ends_the_travel(controller):
    controller.travel_to(Pose((100.0, 700.0, 500.0), 350.0, -30.0, 40.0))
    controller.press("d")
    controller.let_go("d")
    assert not controller.moving


def test_orbiting_by_keys_keeps_the_distance_and_the_middle(controller):
    controller.change_mode("orbit")
    pivot = controller.pivot
    distance = np.linalg.norm(pivot - controller.eye)
    controller.press("d")
    for _ in range(30):
        controller.step(0.1)
    assert np.linalg.norm(pivot - controller.eye) == pytest.approx(distance)
    assert np.allclose(np.cross(pivot - controller.eye, controller.axes[2]), 0, atol=1e-6)
    controller.let_go("d")
    controller.press("w")
    controller.step(2.0)
    assert np.linalg.norm(pivot - controller.eye) < 0.5 * distance


def test_a_new_pose_in_orbit_has_a_pivot_in_the_middle(controller):
    """A state, or the end of a tour, sets the pose; then the wheel comes nearer to what is in the middle."""
    controller.change_mode("orbit")
    controller.pose = Pose((100.0, 700.0, 500.0), 90.0, -30.0, 40.0)
    middle = controller.pivot
    assert np.allclose(np.cross(middle - controller.eye, controller.axes[2]), 0, atol=1e-6)
    before = np.linalg.norm(middle - controller.eye)
    controller.approach(0.3, 0.1, 3.0)
    assert np.linalg.norm(middle - controller.eye) < before
    controller.mode = "fly"
    controller.pose = controller.pose
    assert controller.pivot is None


def test_a_walker_stays_at_eye_height_and_on_the_map(controller):
    controller.change_mode("walk")
    assert controller.pose.eye == controller.start.eye  # there is no ground below
    controller.eye = np.array([640.0, 640.0, 500.0])
    controller.change_mode("walk")
    heights = []
    controller.press("w")
    for _ in range(400):
        controller.step(0.25)
        heights.append(controller.height_above_ground_m)
    assert np.allclose(heights, 1.7, atol=1e-4)
    assert controller.eye[1] > 1000 and controller.eye[1] <= 1280  # came to the map's edge and stopped there
    assert controller.near_m < 1.7 and Controller(controller.heightmap, controller.start).near_m is None


def test_zoom_changes_the_field_of_view_within_limits(controller):
    controller.zoom(3)
    assert controller.camera.fov_deg < 50
    controller.zoom(-1000)
    controller.zoom(1000)
    assert controller.camera.fov_deg == 1
