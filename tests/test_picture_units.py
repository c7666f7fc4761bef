"""Feet in pictures: the interval of contour lines and their heights, the legend, the scale bar; labels keep apart."""

import re

import numpy as np
import pytest

from terrain_gl.camera import Camera
from terrain_gl.cli.values import interval
from terrain_gl.files.furniture import Stamp, length_of, name_stamps
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.shade.contours import interval_m

SIZE = (640, 360)


def hill():
    y, x = np.mgrid[:65, :81]
    return Heightmap((400 + 400 * np.exp(-((x - 40) ** 2 + (y - 32) ** 2) / 500)).astype("f4"), 20.0)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [("40", 40, ""), ("40ft", 40, "ft"), ("12.5 m", 12.5, "m"), ("auto", 0, ""), ("0", 0, ""), ("1e2ft", 100, "ft")],
)
def test_an_interval_may_have_a_unit(text, value, unit):
    found = interval(text)
    assert (float(found), found.unit) == (value, unit)


@pytest.mark.parametrize(("relief", "feet"), [(100.0, 10), (400.0, 50), (3000.0, 500)])
def test_the_interval_that_suits_a_map_is_round_in_feet(relief, feet):
    assert interval_m(0.0, relief, "ft") == pytest.approx(0.3048 * feet)


@pytest.mark.parametrize("asked", [("--contours", "40ft"), ("--contours", "40", "--units", "ft")])
def test_contours_in_feet(run, folder, asked, monkeypatch):
    import terrain_gl.cli.overlays as overlays

    seen = []
    monkeypatch.setattr(overlays, "name_stamps", lambda size, names, taken: seen.extend(names) or [])
    np.save("dem.npy", hill().heights)
    code, _, told = run("shot", "dem.npy", "--spacing", "20", *asked, "-o", "p.png", "--size", "640x360")
    assert code == 0, told
    assert seen and all(re.fullmatch(r"\d+ ft", name) for name, *_ in seen)
    feet = {int(name.split()[0]) for name, *_ in seen}
    assert all(each % 200 == 0 and 400 / 0.3048 <= each <= 800 / 0.3048 for each in feet)


def test_labels_in_feet_lie_where_those_of_metres_lie(ctx):
    camera = Camera((800, -900, 1700), (800, 700, 500), 45)
    with Renderer(hill(), SIZE, ctx=ctx) as renderer:
        renderer.render(camera, contour_m=12.192)
        metres, feet = renderer.contour_labels(12.192), renderer.contour_labels(12.192, units="ft")
    assert metres and [(each.x, each.y) for each in metres] == [(each.x, each.y) for each in feet]
    for one, other in zip(metres, feet, strict=True):
        assert float(one.name.removesuffix(" m")) == pytest.approx(0.3048 * float(other.name.removesuffix(" ft")))


@pytest.mark.parametrize("away_m", [3.0, 700.0, 20_000.0])
def test_the_scale_bar_is_round_in_its_unit(away_m):
    camera = Camera((0, 0, away_m), (0, 0, 0), 40)
    length_m, px = length_of(SIZE, camera, away_m)
    length_ft, px_ft = length_of(SIZE, camera, away_m, 0.3048)
    assert float(f"{length_ft:.0e}") == pytest.approx(length_ft) and f"{length_ft:e}"[0] in "125"
    assert length_ft * 0.3048 / px_ft == pytest.approx(length_m / px)


def test_names_keep_away_from_the_furniture():
    legend = Stamp(500, 300, np.ones((40, 130, 4), np.float32))
    names = [("800 ft", 560.0, 320.0, True), ("900 ft", 100.0, 100.0, True)]
    assert len(name_stamps(SIZE, names)) == 2 and len(name_stamps(SIZE, names, [legend])) == 1


def test_the_legend_and_its_line_are_in_feet(run, folder):
    np.save("dem.npy", hill().heights)
    told = run("shot", "dem.npy", "--spacing", "20", "--look", "viridis", "--units", "ft", "-o", "p.png", "--furniture")
    assert re.search(r"from 1312\.\d+ to 2624\.\d+ ft", told[2])
