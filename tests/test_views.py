"""Standard views: on any map, the eye is above the ground and sees the map."""

from dataclasses import replace

import numpy as np
import pytest
from maps import MAPS, REAL, rough

import terrain_gl as tg
from terrain_gl import reference
from terrain_gl.camera import screen_shift_px
from terrain_gl.cli import main
from terrain_gl.files import views
from terrain_gl.files.views import VIEWS, standard_sun, standard_view
from terrain_gl.heightmap import bilinear
from terrain_gl.image import read_image
from terrain_gl.shade.picture import UNLIT

SIZE = (96, 54)


def height_under(heightmap, point):
    east, north = heightmap.spacing_m
    column, row = point[0] / east, heightmap.rows - 1 - point[1] / north
    return float(bilinear(heightmap.heights, np.array([column]), np.array([row]))[0])


def posts_seen(heightmap, camera):
    points = reference.world_m(heightmap.heights, heightmap.spacing_m).reshape(3, -1).T
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
    heights[60:62, 60:200] = 400.0  # a wall, and behind it a tower that is seen from the far side only
    heights[40, 130] = 500.0
    heightmap = tg.Heightmap(heights, 10.0)
    camera = standard_view(heightmap, "valley")
    eye = np.array(camera.eye)
    far = np.array(camera.target) - eye
    line = eye + np.linspace(0.1, 0.9, 50)[:, None] * far
    assert all(point[2] > height_under(heightmap, point) for point in line)


def test_high_sees_the_middle_and_no_sky_above_a_square_map():
    heightmap = tg.Heightmap(rough(200, 200, 2), 10.0)
    with tg.Renderer(heightmap, SIZE) as r, r.session:
        r.draw(standard_view(heightmap, "high"), style=UNLIT)
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


def island(n=160):
    """A mountain in the north-east of a plain; half of the map has no data."""
    y, x = np.mgrid[:n, :n]
    heights = np.maximum(0, 900 - 30 * np.hypot(x - 115, y - 50)) + rough(n, n, 1, 20.0)
    heights[:, :60] = np.nan
    return tg.Heightmap(heights, 30.0)


def test_the_first_view_shows_the_summit_and_land_with_data():
    heightmap = island()
    camera = standard_view(heightmap)
    row, col = np.unravel_index(np.nanargmax(heightmap.heights), heightmap.heights.shape)
    summit = np.array([[col * 30.0, (159 - row) * 30.0, np.nanmax(heightmap.heights)]])
    assert screen_shift_px(camera, SIZE, summit, np.zeros(1), 1.0)[1].all()
    assert camera.target[0] > 0.5 * heightmap.extent_m[0]  # towards the land
    assert posts_seen(heightmap, camera) > 0.2


def test_the_flatter_the_map_the_lower_the_sun():
    suns = [standard_sun(tg.Heightmap(island().heights, spacing_m)) for spacing_m in (10.0, 100.0, 1e5)]
    elevations = [elevation for _, elevation in suns]
    assert elevations[0] == 35 and 15 < elevations[1] < 35 and elevations[2] == 15
    assert standard_sun(tg.Heightmap(np.zeros((9, 9)), 1.0)) == (300, 35)


@pytest.mark.parametrize("view", ["valley", "ridge"])
def test_nobody_stands_on_a_fragment(view):
    """A peak that is surrounded by voids is never a place of the eye."""
    heights = rough(200, 200, 4, 300.0)
    heights[80:120, 80:120] = np.nan
    heights[99:102, 99:102] = 5000.0
    heightmap = tg.Heightmap(heights, 20.0)
    x, y, _ = standard_view(heightmap, view).eye
    assert np.hypot(x - 2000, y - 1990) > 300


def test_an_eye_under_the_ground_is_told(tmp_path, capsys):
    heights = rough(65, 65, 1, 100.0) - rough(65, 65, 1, 100.0).min() + 500
    np.save(tmp_path / "a.npy", heights)
    words = ["shot", str(tmp_path / "a.npy"), "--spacing", "10", "-o", str(tmp_path / "a.png"), "--size", "32x18"]
    assert main([*words, "--eye", "300,300,100", "--target", "300,600,100"]) == 0
    said = capsys.readouterr().err
    assert "under the ground" in said and said.count("\n") == 1
    assert main([*words, "--eye", "300,300,900", "--target", "300,600,100"]) == 0
    assert "under the ground" not in capsys.readouterr().err


def test_a_summit_that_stands_out_is_large_in_the_middle(monkeypatch):
    """Also near the rim of the map, where no eye would be placed. Lower, it is a hill like the others."""
    y, x = np.indices((193, 193)) * 400.0
    hills = 300 * (np.sin(x / 3600) * np.cos(y / 5200) + 1)
    cone = np.maximum(0.0, 3000 - 0.4 * np.hypot(x - 16000, y - 12000))
    summit = np.array([16000.0, 192 * 400.0 - 12000.0, 3300.0])

    def off_middle(heights):
        """Place of the summit: 0 in the middle of the picture, 1 at its rim."""
        camera = standard_view(tg.Heightmap(heights.astype("f4"), 400.0))
        right, up, depth = camera.axes @ (summit - camera.eye)
        return np.abs(np.array([right, up]) / depth / camera.half_extent(SIZE)).max()

    assert off_middle(hills + cone) < 0.5
    assert off_middle(hills + cone / 12) > 0.6
    found = [views._Blocks(tg.Heightmap((hills + cone).astype("f4"), step)).summit() for step in (400.0, 4000.0)]
    assert found[0] and not found[1]  # posts too far apart show no summit from nearby
    monkeypatch.setattr(views, "_STANDS_OUT", 1.0)
    assert off_middle(hills + cone) > 0.5
