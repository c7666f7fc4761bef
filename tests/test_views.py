"""Standard views: on any map the eye stands above the ground and has the map before it."""

from dataclasses import replace

import numpy as np
import pytest
from maps import MAPS, REAL, rough

import terrain_gl as tg
from terrain_gl.camera import screen_shift_px
from terrain_gl.cli import main
from terrain_gl.files.views import VIEWS, standard_view
from terrain_gl.image import read_image
from terrain_gl.verify.holes import bilinear
from terrain_gl.verify.measure import posts_of

SIZE = (96, 54)


def height_under(heightmap, point):
    east, north = heightmap.spacing_m
    column, row = point[0] / east, heightmap.rows - 1 - point[1] / north
    return float(bilinear(heightmap.heights, np.array([column]), np.array([row]))[0])


def posts_seen(heightmap, camera):
    points = posts_of(heightmap, (0, 0, heightmap.cols, heightmap.rows))
    points = points[np.isfinite(points[:, 2])]
    _, seen = screen_shift_px(camera, SIZE, points, np.zeros(len(points)), 0.1 * min(heightmap.spacing_m))
    return seen.mean()


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", MAPS)
def test_the_eye_is_above_the_ground_and_sees_the_map(name, view):
    heightmap = MAPS[name]()
    camera = standard_view(heightmap, view)
    ground = height_under(heightmap, camera.eye)
    assert np.isnan(ground) or camera.eye[2] > ground
    if name != "huge":  # a needle 37 times as high as it is wide
        assert posts_seen(heightmap, camera) > 0.04


def test_valley_does_not_stand_at_the_foot_of_a_wall():
    y, x = np.indices((131, 131))
    heightmap = tg.Heightmap(np.where(3 * x + 7 * y > 694, 80.0, 0.0), 10.0)
    eye = standard_view(heightmap, "valley").eye
    assert eye[2] == 10.0


@pytest.mark.parametrize("view", ["valley", "ridge"])
def test_the_eye_stands_on_the_map_away_from_its_rim(view):
    heightmap = tg.Heightmap(rough(300, 500, 8), (10.0, 20.0))
    eye = standard_view(heightmap, view).eye
    assert (np.abs(np.divide(eye[:2], heightmap.extent_m) - 0.5) <= 0.375 + 1 / 64).all()
    assert eye[2] - height_under(heightmap, eye) >= 10.0


def test_valley_looks_up_from_below_and_ridge_down_from_above():
    y, x = np.mgrid[:201, :201]
    heights = 300.0 * np.exp(-((x - 130) ** 2 + (y - 90) ** 2) / 300)  # one hill
    heightmap = tg.Heightmap(heights, 10.0)
    summit = np.array([1300.0, 1100.0])
    valley, ridge = standard_view(heightmap, "valley"), standard_view(heightmap, "ridge")
    assert valley.eye[2] < 100 and valley.forward[2] > 0
    towards = summit - valley.eye[:2]
    assert valley.forward[:2] @ towards > 0.95 * np.hypot(*towards) * np.hypot(*valley.forward[:2])
    assert np.hypot(*(ridge.eye[:2] - summit)) < 30 and ridge.eye[2] > 300
    assert np.degrees(np.arcsin(ridge.forward[2])) == pytest.approx(-8, abs=0.01)


def test_valley_avoids_a_sight_that_is_blocked():
    heights = np.zeros((256, 256))
    heights[60:62, 60:200] = 400.0  # a wall, and behind it a tower that only the far side sees
    heights[40, 130] = 500.0
    heightmap = tg.Heightmap(heights, 10.0)
    camera = standard_view(heightmap, "valley")
    eye = np.array(camera.eye)
    far = np.array(camera.target) - eye
    line = eye + np.linspace(0.1, 0.9, 50)[:, None] * far
    assert all(point[2] > height_under(heightmap, point) for point in line)


def test_high_sees_the_middle_and_no_sky_above_a_square_map():
    heightmap = tg.Heightmap(rough(200, 200, 2), 10.0)
    with tg.Renderer(heightmap, SIZE) as r:
        r.draw(standard_view(heightmap, "high"))
        assert r.picture.coverage().mean() > 0.8


def test_views_are_the_maps_own():
    heightmap = tg.Heightmap(rough(130, 90, 4), 10.0)
    for view in VIEWS:
        again = tg.Heightmap(heightmap.heights.copy(), 10.0)
        assert standard_view(heightmap, view) == standard_view(again, view)


@pytest.mark.parametrize("name", REAL)
def test_real_maps(dem, name):
    heightmap = tg.Heightmap.open(dem / name, **REAL[name])
    for view in VIEWS:
        camera = standard_view(heightmap, view)
        ground = height_under(heightmap, camera.eye)
        assert np.isnan(ground) or camera.eye[2] > ground


def test_command_line(tmp_path):
    np.save(tmp_path / "map.npy", rough(60, 60, 5))
    heightmap = tg.Heightmap.open(tmp_path / "map.npy", 10.0)
    command = ["shot", str(tmp_path / "map.npy"), "--spacing", "10", "--size", "48x27", "--view", "ridge"]
    assert main([*command, "-o", str(tmp_path / "view.png")]) == 0
    with tg.Renderer(heightmap, (48, 27)) as r:
        expected = r.render(standard_view(heightmap, "ridge")).image
        assert (read_image(tmp_path / "view.png")[..., :3] == expected[..., :3]).all()
        turned = replace(standard_view(heightmap, "ridge"), fov_deg=90.0)
        assert main([*command, "--fov", "90", "-o", str(tmp_path / "turned.png")]) == 0
        assert (read_image(tmp_path / "turned.png")[..., :3] == r.render(turned).image[..., :3]).all()
