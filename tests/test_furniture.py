"""Furniture: the north is where the camera sees it, the bar is as long as it says, and numbers stand at the ramp."""

import math
from dataclasses import replace

import numpy as np
import pytest
from commands import parse, small_map

from terrain_gl import Camera, Heightmap
from terrain_gl.cli.scene import open_scene
from terrain_gl.files.furniture import furniture, land_ahead_m, length_of, north_of, stamp
from terrain_gl.image import read_image
from terrain_gl.light.ramps import Ramp
from terrain_gl.pages.map import PagedMap
from terrain_gl.store.build import build

SIZE = (320, 180)
SOUTH = Camera((0, -100, 100), (0, 0, 0))


def drawn(stamps, size=SIZE):
    picture = np.full((size[1], size[0], 4), 128, np.uint8)
    stamp(picture, 0, stamps)
    return picture


@pytest.mark.parametrize(
    ("eye", "expected"),
    [((0, -100, 100), (0, 1)), ((0, 100, 100), (0, -1)), ((-100, 0, 100), (-1, 0)), ((100, 0, 100), (1, 0))],
)
def test_the_arrow_points_to_the_north(eye, expected):
    camera = Camera(eye, (0, 0, 0))
    assert north_of(camera) == pytest.approx(expected, abs=1e-6)
    arrow = furniture(SIZE, camera, 100.0, "")[0].pixels
    ink = np.argwhere(arrow[: arrow.shape[0] * 2 // 3, :, 0] * arrow[: arrow.shape[0] * 2 // 3, :, 3] > 200)
    row, col = ink.mean(0) - (np.array(ink.max(0)) + ink.min(0)) / 2
    assert np.dot((col, -row), expected) > 0, "the head is broader than the shaft, so the ink's mean is on its side"


def test_along_the_view_there_is_no_arrow():
    assert north_of(Camera((0, 0, 0), (0, 100, 0))) == (0.0, 0.0)


@pytest.mark.parametrize("away", [3.0, 170.0, 9e5])
def test_the_bar_is_as_long_as_it_says(away):
    camera = Camera((0, 0, away), (0, 0, 0), 40.0)
    metres, px = length_of(SIZE, camera, away)
    high_m = 2 * away * math.tan(math.radians(20))
    assert px / SIZE[1] == pytest.approx(metres / high_m) and SIZE[0] / 15 < px <= SIZE[0] / 5
    digit = metres / 10 ** math.floor(math.log10(metres) + 1e-9)
    assert min(abs(digit - each) for each in (1, 2, 5)) < 1e-6


def test_the_bar_is_right_where_the_view_meets_the_land():
    """A flight's cameras have targets one metre away."""
    hill = np.zeros((65, 65), "f4")
    hill[:, 40:] = 100.0
    land = Heightmap(hill, 10.0)
    for eye, ahead, away in [
        ((5, 320, 50), (1, 0, 0), 390),
        ((5, 320, 50), (1, 0, -0.5), 112),
        ((5, 320, 50), (0, 0, 1), None),
    ]:
        found = land_ahead_m(land, Camera(eye, tuple(np.add(eye, ahead)), up=(0, 1, 0)))
        assert math.isnan(found) if away is None else found == pytest.approx(away, rel=5e-3)


def test_furniture_is_at_the_corners_and_in_any_rows_the_same():
    stamps = furniture((640, 360), SOUTH, 100.0, "Hill", Ramp("diverging", -12.0, 12.0))
    whole = drawn(stamps, (640, 360))
    changed = (whole != 128).any(-1)
    quarters = [
        changed[rows, cols] for rows in (slice(0, 90), slice(270, 360)) for cols in (slice(0, 160), slice(480, 640))
    ]
    assert all(part.any() for part in quarters) and not changed[120:240, 200:440].any()
    assert (whole[..., 3] >= 128).all() and (whole[~changed][:, 3] == 128).all(), "it is seen over a clear sky, too"
    opaque = np.full_like(whole, 255)
    stamp(opaque, 0, stamps)
    assert (opaque[..., 3] == 255).all(), "opacity stays"
    parts = np.full_like(whole, 128)
    for first in range(0, 360, 50):
        stamp(parts[first : first + 50], first, stamps)
    assert np.array_equal(parts, whole)


def test_a_legend_has_the_colours_of_its_ramp():
    ramp = Ramp("diverging", -12.0, 12.0)
    legend = furniture(SIZE, SOUTH, 100.0, "", ramp)[-1].pixels
    opaque = legend[..., 3] > 0.99
    row = np.flatnonzero(opaque.sum(1) == opaque.sum(1).max())[0]
    colours = legend[row, opaque[row], :3]
    assert colours[0] == pytest.approx(ramp.srgb[0], abs=2) and colours[-1] == pytest.approx(ramp.srgb[-1], abs=2)
    assert len(furniture(SIZE, SOUTH, 100.0, "")) == 2, "no title, no ramp: the arrow and the bar are left"
    assert len(furniture(SIZE, SOUTH, math.nan, "")) == 1, "no scale in the sky"


def test_the_commands_draw_it(folder, run):
    shot = "shot", small_map(), "--spacing", "10", "--size", "320x180", "--style", "lambert", "-o"
    assert run(*shot, "a.png")[0] == run(*shot, "b.png", "--furniture", "--title", "Hill")[0] == 0
    changed = (read_image("a.png") != read_image("b.png")).any(-1)
    assert changed[:60, :80].any() and changed[:60, 240:].any() and changed[120:, :80].any()
    fly = "fly", "dem.npy", "--spacing", "10", "--size", "320x180", "--style", "lambert", "--seconds", "0.1"
    assert run(*fly, "--fps", "10", "--furniture", "-o", "film/")[0] == 0
    assert (read_image("film/frame-00001.png")[:60, 240:, :3] > 240).any()


def test_a_flight_over_a_store_reads_its_coarse_level_once(tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    monkeypatch.chdir(tmp_path)
    build(small_map(), "s.zarr", 10.0, tile=32, shard=32)
    reads = []
    coarse = PagedMap.coarse
    monkeypatch.setattr(PagedMap, "coarse", lambda self: reads.append(self) or coarse(self))
    asked = parse("fly", "s.zarr", "-o", "a.gif", "--furniture")
    scene = open_scene(asked)
    first, second = (replace(scene, camera=SOUTH).stamps(asked.laid, SIZE) for _ in range(2))
    assert len(first) == 3 and len(reads) == 1
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.pixels, other.pixels)
