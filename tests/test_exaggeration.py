"""The relief drawn higher: the picture of higher land, with true contour lines, colours and heights."""

from pathlib import Path

import numpy as np
import pytest

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_sun
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions

SIZE = (160, 100)
FACTOR = 3.0
EYE, TARGET = (900.0, -1200.0, 900.0), (900.0, 900.0, 400.0)


def hills():
    y, x = np.mgrid[:61, :61].astype("f4")
    return 400 + 150 * np.sin(x / 9) * np.cos(y / 11) + 100 * np.exp(-((x - 30) ** 2 + (y - 35) ** 2) / 90)


def raised(place):
    return place[0], place[1], FACTOR * place[2]


def of_higher_land(heights, **options):
    """The picture of a map whose heights are really FACTOR times as high."""
    with Renderer(Heightmap(FACTOR * heights, 30.0), SIZE) as renderer:
        return renderer.render(Camera(raised(EYE), raised(TARGET)), **options).image.astype(int)


@pytest.mark.parametrize("style", ["lambert", "shaded"])
def test_it_is_the_picture_of_higher_land_also_after_another_one(style):
    options = {"style": style, "look": "grey", "grain": "off", "surroundings": "none"}
    with Renderer(Heightmap(hills(), 30.0), SIZE) as renderer:
        plain = renderer.render(Camera(EYE, TARGET), **options).image.astype(int)
        high = renderer.render(Camera(EYE, TARGET), exaggeration=FACTOR, **options).image.astype(int)
        again = renderer.render(Camera(EYE, TARGET), **options).image.astype(int)
    truth = of_higher_land(hills(), **options)
    assert np.abs(plain - truth).mean() > 5
    assert np.abs(high - truth).mean() < 0.2
    assert (again == plain).all()


@pytest.mark.parametrize("factor", [0.3, 7.0])
def test_the_bound_holds_for_the_picture_as_drawn(factor):
    rough = hills() + 20 * np.random.default_rng(3).standard_normal((61, 61)).astype("f4")
    with Renderer(Heightmap(rough, 30.0), SIZE) as renderer:
        renderer.render(Camera(EYE, TARGET), 2.0, style="depth", exaggeration=factor)
        stats = renderer.measure()
    assert stats["max_error_px"] <= stats["certified_max_error_px"] <= 2.0
    assert stats["holes"] == 0 and stats["posts_measured"] > 100


def test_heights_and_places_that_are_asked_for_stay_true():
    heightmap = Heightmap(hills(), 30.0)
    with Renderer(heightmap, SIZE) as renderer:
        renderer.render(Camera(EYE, TARGET), style="depth", method="full", exaggeration=FACTOR)
        assert renderer.heightmap.spacing_m == (30.0, 30.0)
        for col, row in ((20, 30), (40, 11)):
            x, y = 30.0 * col, 30.0 * (60 - row)
            assert renderer.height_at(x, y) == heightmap.heights[row, col]
            assert renderer.drawn_height_at(x, y) == pytest.approx(heightmap.heights[row, col], abs=1e-2)
    assert heightmap.spacing_m == (30.0, 30.0) and heightmap.exaggeration == 1


def test_edits_of_exaggerated_land_are_true_heights():
    heightmap = Heightmap(hills(), 30.0)
    with Renderer(heightmap, SIZE) as renderer:
        renderer.render(Camera(EYE, TARGET), style="depth", exaggeration=FACTOR)
        renderer.edit(30, 20, [[777.0]])
        assert renderer.height_at(600.0, 900.0) == 777.0
        renderer.render(Camera(EYE, TARGET), style="depth", exaggeration=FACTOR)
        assert renderer.measure()["max_error_px"] <= 1
        assert renderer.heightmap.spacing_m == (30.0, 30.0)


def test_contour_lines_stand_at_true_heights():
    def lines(exaggeration, heights):
        plane = Heightmap(heights, 10.0)
        with Renderer(plane, SIZE) as renderer:
            camera = Camera((500.0, 500.0, 9000.0), (500.0, 500.0, 0.0), 5.0, up=(0, 1, 0))
            image = renderer.render(camera, style="lambert", contour_m=50.0, exaggeration=exaggeration).image
        column = image[:, SIZE[0] // 2, :3].astype(int).sum(-1)
        dark = np.concatenate([[0], column < np.median(column) - 20]).astype(int)
        return int((np.diff(dark) == 1).sum())

    tilted = np.broadcast_to(np.linspace(10.0, 330.0, 101, dtype="f4")[:, None], (101, 101))
    plain = lines(1.0, tilted)
    assert plain >= 4 and abs(lines(2.0, tilted) - plain) <= 1  # one line may leave the picture at its rim
    assert lines(1.0, 2 * tilted) >= plain + 3  # what --z-scale would show


def test_colours_stand_at_true_heights():
    def middle(heights, exaggeration):
        with Renderer(Heightmap(heights, 30.0), SIZE) as renderer:
            camera = Camera((900.0, 900.0, 30000.0), (900.0, 900.0, 0.0), 2.0, up=(0, 1, 0))
            frame = renderer.render(
                camera, look="viridis", ramp_range=(0.0, 3000.0), grain="off", exaggeration=exaggeration
            )
        return frame.image[40:60, 70:90, :3].astype(int).mean((0, 1))

    flat = np.full((61, 61), 700, "f4")
    flat[:3] = 650  # some relief
    assert np.abs(middle(flat, 3.0) - middle(flat, 1.0)).max() < 3
    assert np.abs(middle(3 * flat, 1.0) - middle(flat, 1.0)).max() > 20


@pytest.mark.parametrize("factor", [0.0, -1.0, 1000.0, float("nan")])
def test_factors_out_of_range_are_refused(factor):
    with pytest.raises(UsageError, match="exaggeration"):
        FrameOptions(exaggeration=factor)


def test_the_command_line_has_it_for_pictures_of_small_maps_and_stores_and_for_meshes(folder, run):
    np.save("hills.npy", hills())
    shared = "--spacing", "30", "--size", "160x100", "--style", "lambert"
    view = "--eye=900,-1200,900", "--target=900,900,400", "--fov=50"
    assert run("shot", "hills.npy", *shared, *view, "--exaggeration", "3", "-o", "high.png")[0] == 0
    shown = read_image("high.png")[..., :3].astype(int)
    assert np.abs(shown - of_higher_land(hills(), style="lambert", sun=sun_of("hills.npy"))[..., :3]).mean() < 1
    assert run("build", "hills.npy", "--spacing", "30", "-o", "s.zarr")[0] == 0
    assert run("shot", "s.zarr", *shared[2:], *view, "--exaggeration", "3", "-o", "store.png")[0] == 0
    assert np.abs(shown - read_image("store.png")[..., :3]).mean() < 0.5
    assert run("mesh", "hills.npy", "--spacing", "30", "--exaggeration", "3", "-o", "high.obj")[0] == 0
    lines = Path("high.obj").read_text(encoding="utf-8").splitlines()
    corners = [line.split()[1:] for line in lines if line.startswith("v ")]
    z = np.array(corners, float)[:, 2]
    assert z.max() == pytest.approx(3 * hills().max(), rel=0.02)
    assert z.min() == pytest.approx(3 * hills().min(), rel=0.02)


def sun_of(name):
    return standard_sun(Heightmap.open(name, 30.0))
