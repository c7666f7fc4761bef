"""Contour lines: where they are, how dense they are, and that they change nothing else."""

import numpy as np
import pytest
from asking import ask
from commands import parse

from terrain_gl import cli, reference
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import linear_from_srgb
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.shade.contours import MOST, interval_m

SIZE = (240, 120)
PLANE = Heightmap(np.broadcast_to(310.0 + 2.0 * np.arange(241.0), (121, 241)).astype("f4"), 10.0, "plane")


def shown(heightmap, camera, **options):
    with Renderer(heightmap, SIZE) as renderer:
        return renderer.render(camera, style="lambert", **options).image[..., :3].astype(int)


def from_above(heightmap, up_m=4000.0):
    x, y = (0.5 * side for side in heightmap.extent_m)
    return Camera((x, y, up_m), (x, y, 0.0), 20.0, up=(0, 1, 0))


def columns_of_lines(picture):
    """Middles of the dark columns of a picture's middle row, and how dark each is."""
    row = picture[SIZE[1] // 2].sum(-1)
    dark = np.concatenate([[0], (row < row.max() - 30).astype(int), [0]])
    starts, ends = np.flatnonzero(np.diff(dark) == 1), np.flatnonzero(np.diff(dark) == -1)
    lines = [(np.arange(a, b) + 0.5, row.max() - row[a:b]) for a, b in zip(starts, ends, strict=True)]
    return np.array([np.average(at, weights=ink) for at, ink in lines]), np.array([ink.sum() for _, ink in lines])


def test_lines_stand_where_the_plane_has_their_height_and_each_fifth_is_heavy():
    camera = from_above(PLANE)
    found, weight = columns_of_lines(shown(PLANE, camera, contour_m=20.0))
    tan = np.tan(np.radians(10.0)) / (SIZE[1] / 2)
    heights = np.arange(320.0, 800.0, 20.0)
    expected = SIZE[0] / 2 + ((heights - 310.0) / 2.0 * 10.0 - camera.eye[0]) / (camera.eye[2] - heights) / tan
    seen = (expected > 2) & (expected < SIZE[0] - 2)
    assert seen.sum() > 10 and np.allclose(found, expected[seen], atol=0.3)
    heavy = heights[seen] % 100 == 0
    assert weight[heavy].min() > 1.5 * weight[~heavy].max()


def ink_across(plain, lined, column):
    """Pixels of ink of each line that a column of the picture crosses, as shares of the land's linear light."""
    before, after = linear_from_srgb(plain[:, column, 0]), linear_from_srgb(lined[:, column, 0])
    ink = 1 - after / before
    rims = np.flatnonzero(np.diff(np.concatenate([[0], (ink > 0.02).astype(int), [0]])))
    return np.array([ink[a:b].sum() for a, b in rims.reshape(-1, 2)])


THIN, INDEX = 0.6 * 1.2, 0.8 * 2.2  # opacity and width in pixels, of glsl/shade/contours.glsl


def test_a_line_has_one_width_on_a_cliff_and_at_a_grazing_angle():
    x, y = np.mgrid[0:121, 0:241][::-1]
    cliff = np.where(x < 120 + y % 2, 0.0, 400.0) + 0.05 * x  # 400 m up between two posts, and not straight
    land, (east, north) = Heightmap(cliff.astype("f4"), 10.0), (1195.0, 600.0)
    in_front = Camera((east - 900.0, north, 210.0), (east, north, 210.0), 40.0)
    plain, lined = shown(land, in_front), shown(land, in_front, contour_m=50.0)
    for column in range(40, 200, 20):
        found = ink_across(plain, lined, column)[1:-1]  # at the rims, half of the pixel is other land
        heavy = found > (THIN + INDEX) / 2
        assert len(found) >= 5 and heavy.sum() == 1
        assert np.allclose(found[heavy], INDEX, rtol=0.2) and np.allclose(found[~heavy], THIN, rtol=0.2)
    slope = Heightmap(np.broadcast_to(0.2 * np.arange(241.0), (121, 241)).astype("f4"), 10.0)
    along = Camera((0.0, 600.0, 60.0), (2000.0, 600.0, 45.0), 20.0)
    found = ink_across(shown(slope, along), shown(slope, along, contour_m=2.0), SIZE[0] // 2)
    assert len(found) > 5 and found.max() < 1.2 * INDEX


def test_labels_give_the_height_of_the_land_where_they_are():
    y, x = np.mgrid[0:121, 0:241]
    hill = Heightmap((600 * np.exp(-((x - 120) ** 2 + (y - 60) ** 2) / 900)).astype("f4"), 10.0)
    size, camera = (640, 360), Camera((1200.0, -700.0, 900.0), (1200.0, 600.0, 200.0), 45.0)
    with Renderer(hill, size) as renderer, renderer.session:
        assert renderer.contour_labels(10.0) == []
        renderer.render(camera, style="lambert", contour_m=10.0)
        labels = renderer.contour_labels(10.0)
        places = renderer.picture.places()[0]
        wet = renderer.contour_labels(10.0, 300.0)
        assert renderer.contour_labels(None) == []
    assert len(labels) > 4 and len(set(labels)) == len(labels)
    for label in labels:
        col, row = places[int(label.y), int(label.x)]
        height_m = float(label.name.removesuffix(" m"))
        assert height_m % 50 == 0 and abs(post_m(hill, col, row) - height_m) < 12, label
    assert {float(label.name[:-2]) for label in wet} == {
        h for h in {float(each.name[:-2]) for each in labels} if h >= 300
    }


def post_m(heightmap, col, row):
    return float(heightmap.heights[round(float(row)), round(float(col))])


def test_without_the_option_nothing_changes_and_lines_are_lines_alone():
    camera = from_above(PLANE)
    plain, lined = shown(PLANE, camera), shown(PLANE, camera, contour_m=0.0)
    same = (plain == lined).all(-1)
    assert 0.6 < same.mean() < 0.97 and (lined <= plain).all()


def test_a_plain_at_the_height_of_a_line_is_no_line():
    flat = np.zeros((121, 241), "f4")
    flat[:, 200:] = 70.0
    picture = shown(Heightmap(flat, 10.0), from_above(Heightmap(flat, 10.0)), contour_m=10.0)
    assert (picture[20:100, 40:160].reshape(-1, 3) == picture[60, 100]).all()


def test_lines_that_would_be_a_grey_fade_away():
    camera = from_above(PLANE)
    plain = shown(PLANE, camera)
    assert np.array_equal(shown(PLANE, camera, contour_m=0.4), plain)
    assert np.abs(shown(PLANE, camera, contour_m=20.0) - plain).max() > 50


def test_there_are_none_under_water():
    camera = from_above(PLANE)
    dry, wet = (shown(PLANE, camera, contour_m=20.0, water_m=water_m) for water_m in (None, 540.0))
    plain = shown(PLANE, camera)
    assert np.array_equal(wet[:, :100], plain[:, :100]) and np.array_equal(wet[:, 140:], dry[:, 140:])
    assert not np.array_equal(wet[:, 140:], plain[:, 140:])


@pytest.mark.parametrize("relief_m", [0.03, 1.0, 39.9, 40.0, 41.0, 812.0, 8848.0])
def test_the_interval_is_round_and_suits_the_relief(relief_m):
    chosen = interval_m(100.0, 100.0 + relief_m)
    digit = chosen / 10 ** np.floor(np.log10(chosen * 1.001))
    assert round(digit, 6) in (1, 2, 5)
    assert MOST / 2.6 < relief_m / chosen <= MOST * 1.0001


def test_cover_is_the_twins(ctx):
    random = np.random.default_rng(1)
    asked = np.stack([random.uniform(-3, 3, 300), 10 ** random.uniform(-4, 0, 300), random.uniform(0.5, 3, 300)], -1)
    asked = np.concatenate([asked, np.zeros((300, 1))], -1).astype("f4")
    statement = "return vec4(contour_cover(a.x, a.y, a.z));"
    unused = {name: ctx.buffer(reserve=8192) for name in ("HeightSums", "Listed", "Terrain", "View")}  # of its includes
    answers = ask(ctx, "shade/contours.glsl", statement, asked, defines={"LISTED": 1}, resources=unused)[:, 0]
    expected = [reference.contour_cover(*map(float, each[:3])) for each in asked]
    # half a step of float32 at level 3, in pixels
    assert np.abs(answers - expected).max() <= 4e-7 / asked[:, 1].min()


@pytest.mark.parametrize("contour_m", [-1.0, float("nan"), float("inf")])
def test_what_is_no_interval_is_refused(contour_m):
    with pytest.raises(UsageError, match="contours"):
        FrameOptions(contour_m=contour_m)


def test_the_command_line_takes_metres_or_auto(capsys):
    words = ["shot", "alpine", "-o", "p.png", "--contours"]
    assert [parse(*words, text).frame.contour_m for text in ("auto", "25")] == [0.0, 25.0]
    assert cli.main([*words, "-5"]) == 2 and "auto" in capsys.readouterr().err
