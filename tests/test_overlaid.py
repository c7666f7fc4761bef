"""Overlays in pictures and films: at the right pixels, over every style, whole over pieces; wrong ones in one line."""

import json

import numpy as np
import pytest
from commands import refused
from maps import rough
from rasters import write_raster

import terrain_gl as tg
from terrain_gl.camera.pieces import cut
from terrain_gl.cli import shot
from terrain_gl.files.views import standard_view
from terrain_gl.image import read_image, write_image
from terrain_gl.renderer import renderer
from terrain_gl.renderer.overlay import Overlay, read_overlay

SIZE = (150, 84)
SHOT = ("shot", "map.npy", "--size", "150x84", "--spacing", "1")
RED = np.array([255, 70, 50])
NO_POINTS = np.zeros((0, 2))


@pytest.fixture(autouse=True)
def folder(folder):
    """A map, and a way over it in metres from its south-western post."""
    np.save("map.npy", rough(97, 130, 3))
    way = {"type": "LineString", "coordinates": [[20, 40], [70, 50], [110, 45]]}
    (folder / "way.json").write_text(json.dumps(way | {"crs": None}))
    return folder


@pytest.fixture
def placed(folder):
    """A map that says where it lies; a way over it in degrees; a picture of its ground, red."""
    pytest.importorskip("pyproj", reason="the [geo] extra is not installed")
    write_raster("map.tif", rough(97, 130, 3) * 10)
    write_raster("red.tif", np.broadcast_to(np.array([240, 20, 20], "u1")[:, None, None], (3, 97, 130)))
    place = tg.Heightmap.open("map.tif").place
    way = [place.to_lonlat(x, y) for x, y in ((200, 400), (700, 500), (1100, 450))]
    (folder / "way.json").write_text(json.dumps({"type": "LineString", "coordinates": way}))
    return folder


def reddish(image):
    """Rows and columns of the line's pixels."""
    return np.argwhere(np.abs(image[..., :3].astype(int) - RED).max(-1) < 70)


@pytest.mark.parametrize("style", ["lambert", "lod"])
def test_a_line_is_where_the_camera_sees_it(ctx, style):
    heightmap = tg.Heightmap(np.zeros((97, 130), "f4"), 1.0)
    camera = tg.Camera((65, 48, 300), (65, 48, 0), 30.0)
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as r:
        bare = r.render(camera, style=style).image
        r.overlays = (Overlay((np.array([[20.0, 48.0], [110.0, 48.0]]),), np.array([[40.0, 20.0]])),)
        over = r.render(camera, style=style).image
        r.overlays = ()
        assert np.array_equal(r.render(camera, style=style).image, bare)
    assert (over[..., 3] == 255).all()
    changed = np.argwhere((over != bare).any(-1))
    on_line = changed[np.abs(changed[:, 0] - 42) <= 3]
    focal = camera.focal_px(SIZE[1])
    width = focal * 90 / 300  # seen from above
    assert on_line[:, 1].min() == pytest.approx(75 - width / 2, abs=3) and np.ptp(on_line[:, 1]) > 0.9 * width
    others = changed[np.abs(changed[:, 0] - 42) > 3]  # the ring of the point
    middle = 42 - focal * 28 / 300, 75 - focal * 25 / 300
    assert len(others) and np.abs(others - middle).max() < 6


def test_a_line_follows_an_edit(ctx):
    heightmap = tg.Heightmap(np.zeros((65, 65), "f4"), 1.0)
    camera = tg.Camera((32, -60, 40), (32, 32, 10), 45.0)
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as r:
        r.overlays = (Overlay((np.array([[2.0, 30.0], [62.0, 30.0]]),), NO_POINTS),)
        before = reddish(r.render(camera, style="lambert").image)
        r.edit(slice(0, 65), slice(0, 65), 15.0)
        after = reddish(r.render(camera, style="lambert").image)
    assert len(before) > 20 and after[:, 0].mean() < before[:, 0].mean() - 5


def test_shot_draws_what_the_api_does_and_pieces_have_no_seams(placed, monkeypatch, run):
    monkeypatch.setattr(renderer, "cut", lambda size, fine: cut(size, fine, 64))
    monkeypatch.setattr(shot, "LARGEST", 64)
    words = "shot", "map.tif", "--overlay", "way.json", "--size", "150x84", "--style", "lambert", "-o"
    assert run(*words, "a.png")[0] == 0
    heightmap = tg.Heightmap.open("map.tif")
    with tg.Renderer(heightmap, SIZE) as r:
        r.overlays = (read_overlay("way.json", heightmap),)
        whole = r.render(standard_view(heightmap), style="lambert").image
    shown = read_image("a.png")
    assert len(reddish(shown)) > 40
    assert (np.abs(shown.astype(int) - whole).max(-1) > 8).mean() < 0.004


def test_a_picture_among_overlays_is_the_ground(placed, run):
    words = "shot", "map.tif", "--size", "64x36", "-o"
    assert run(*words, "a.png", "--overlay", "red.tif", "--overlay", "way.json")[0] == 0
    assert run(*words, "b.png", "--material", "red.tif", "--overlay", "way.json")[0] == 0
    one, other = read_image("a.png"), read_image("b.png")
    assert np.array_equal(one, other) and (one[..., 0] > one[..., 1].astype(int) + 40).mean() > 0.1


def test_a_film_has_overlays(placed, run):
    words = "fly", "map.tif", "--size", "64x36", "--seconds", "0.4", "--fps", "5", "--style", "lambert", "-o"
    assert run(*words, "bare/")[0] == 0 and run(*words, "over/", "--overlay", "way.json")[0] == 0
    for name in ("frame-00001.png", "frame-00002.png"):
        assert len(reddish(read_image(f"over/{name}"))) > len(reddish(read_image(f"bare/{name}"))) + 5


def test_wrong_overlays_end_in_one_line(folder, run):
    (folder / "degrees.json").write_text(json.dumps({"type": "Point", "coordinates": [7, 46]}))
    write_image("ground.png", np.full((8, 8, 3), 99, np.uint8))
    for words in (
        ("-o", "a.png", "--overlay", "gone.json"),
        ("-o", "a.png", "--overlay", "map.npy"),
        ("-o", "a.png", "--overlay", "degrees.json"),  # and the map does not say where it lies
    ):
        refused(run(*SHOT, *words), 1, words[-1])
    for words in (
        ("-o", "a.png", "--overlay", "ground.png", "--overlay", "ground.png"),
        ("-o", "a.png", "--overlay", "ground.png", "--material", "ground.png"),
        ("-o", "ground.png", "--overlay", "ground.png"),
        ("-o", "a.png", "--json", "way.json", "--overlay", "way.json"),
    ):
        refused(run(*SHOT, *words), 2)
    assert sorted(path.name for path in folder.iterdir()) == ["degrees.json", "ground.png", "map.npy", "way.json"]
