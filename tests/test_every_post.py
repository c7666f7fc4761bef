"""Every post: the method "truth" is bilinear in between; from above it equals the method "full"."""

import numpy as np
import pytest
from maps import MAPS, cameras, rough

import terrain_gl as tg
from terrain_gl import reference
from terrain_gl.camera import screen_shift_px
from terrain_gl.heightmap import bilinear
from terrain_gl.lod.every_post import TRUTH
from terrain_gl.lod.patches import commands_for
from terrain_gl.shade.picture import UNLIT

AT = -0.125, -0.375  # of the first sample, from the middle of its pixel: right, up


@pytest.mark.parametrize("name", ["odd", "two", "long", "holes", "offset"])
def test_measured_and_captured_it_is_the_full_resolution(ctx, name):
    heightmap = MAPS[name]()
    camera = cameras(heightmap)["default"]
    r = tg.Renderer(heightmap, (160, 90), ctx=ctx)
    r.draw(camera, method="full", style=UNLIT)
    full = len(r.triangles())
    stats = r.draw(camera, method="truth", style=UNLIT)
    assert len(r.triangles()) == full == stats["triangles"]
    measured = r.measure()
    assert measured["max_error_posts_px"] == 0 and measured["holes"] == 0


def heights_seen(renderer, camera, method):
    """Where the rays of a camera that looks straight down meet the drawn surface: heights and places."""
    renderer.draw(camera, method=method, style=UNLIT)
    places = renderer.picture.places()
    n = renderer.size[0]
    right = np.arange(n) + 0.5 - n / 2
    from_middle_px = np.hypot(right + AT[0], right[::-1, None] + AT[1])
    land = (places[0, ..., 0] >= 0) & (from_middle_px > 20)
    col, row = places[0][land].T.astype(float)
    away_m = 100.0 * np.hypot(col - 1, row - 1)
    return camera.eye[2] - away_m * camera.focal_px(n) / from_middle_px[land], col, row


def test_heights_between_posts_are_bilinear(ctx):
    heights = np.array([[0.0, 0.0, 90.0], [0.0, 60.0, 0.0], [30.0, 0.0, 0.0]])
    camera = tg.Camera((100.0, 100.0, 400.0), (100.0, 100.0, 0.0), 40.0)
    r = tg.Renderer(tg.Heightmap(heights, 100.0), (201, 201), ctx=ctx)
    off = {}
    for method in ("truth", "full"):
        seen, col, row = heights_seen(r, camera, method)
        assert len(seen) > 10000
        off[method] = np.abs(seen - bilinear(heights, col, row)).max()
    r.release()
    # a diagonal has an error of a quarter of the twist, here at most 150 m; in a cell cut in four, a quarter of that
    assert off["truth"] <= 150 / 16 + 0.5
    assert off["full"] > 2 * off["truth"]


def test_no_draw_makes_more_vertices_than_software_can_count():
    counts = (5, 70000, 3, 0, 1234, 60001)
    vertices = [(TRUTH * 2**size + 1) ** 2 for size in range(len(counts))]
    commands = list(commands_for(counts, vertices))
    assert sum(command[0] for command in commands) == sum(counts)
    first = 0
    for patches, _, begin, *_ in commands:
        assert begin == first
        size = int(np.searchsorted(np.cumsum(counts), begin, side="right"))
        assert patches * vertices[size] <= 65535
        first += patches


def test_a_rough_map_has_no_holes_in_it(ctx):
    heightmap = tg.Heightmap(rough(90, 70, 3), 10.0)
    r = tg.Renderer(heightmap, (320, 180), ctx=ctx)
    for name, camera in cameras(heightmap, (320, 180)).items():
        r.draw(camera, method="truth", style=UNLIT)
        assert r.measure()["holes"] == 0, name


@pytest.mark.parametrize("size", [(2, 2), (3, 70), (64, 97), (118, 203)], ids=str)
def test_every_cell_of_the_map_is_in_one_square(ctx, size):
    """The squares lie on the lattice of their side, and are as large as the map allows."""
    with tg.Renderer(tg.Heightmap(rough(*size, 1), 10.0), (64, 48), ctx=ctx) as r:
        stats = r.choose(tg.Camera.default(r.heightmap), method="full", cull=False)
        selection = r.inspector.frame.selection
        squares = selection.surface.chosen(selection)
        assert stats["triangles"] == len(r.triangles()) == 2 * (size[0] - 1) * (size[1] - 1)
    times = np.zeros((size[0] - 1, size[1] - 1), int)
    for (x, y), side in zip(squares.corner, squares.size[:, 0], strict=True):
        times[y : y + side, x : x + side] += 1
        assert x % side == y % side == 0
        twice = 2 * side
        assert side == 32 or x // twice * twice + twice > size[1] - 1 or y // twice * twice + twice > size[0] - 1
    assert (times == 1).all()


def test_cells_outside_the_picture_are_left_out(ctx):
    """Every cell with a post in the picture is drawn; far fewer cells than the map has."""
    heightmap = MAPS["odd"]()
    camera, size = cameras(heightmap)["down"], (160, 90)
    with tg.Renderer(heightmap, size, ctx=ctx) as r:
        triangles = r.choose(camera, method="full")["triangles"]
        drawn = np.zeros(np.subtract(heightmap.heights.shape, 1), bool)
        col, row = np.floor(r.triangles().astype(float).mean(1)).astype(int).T
        drawn[row, col] = True
    world = reference.world_m(heightmap.heights, heightmap.spacing_m).reshape(3, -1)
    _, seen = screen_shift_px(camera, size, world.T, np.zeros(world.shape[1]), 1.0)
    row, col = np.nonzero(seen.reshape(heightmap.heights.shape))
    assert len(row) and drawn[np.minimum(row, len(drawn) - 1), np.minimum(col, drawn.shape[1] - 1)].all()
    assert triangles < 0.1 * 2 * drawn.size


def test_the_bound_of_full_is_that_of_the_cells_in_the_picture(ctx):
    """A quarter of the twist, seen from above: half the focal length times the error, over the depth."""
    heights = np.zeros((40, 40))
    heights[5, 5] = 8.0  # a twist of 8 m in four cells
    with tg.Renderer(tg.Heightmap(heights, 10.0), (200, 200), ctx=ctx) as r:
        camera = tg.Camera((50.0, -100.0, 1000.0), (50.0, 340.0, 0.0), 20.0)
        near, away = camera, tg.Camera((300.0, 100.0, 100.0), (300.0, 101.0, 0.0), 20.0)
        bounds = [r.choose(each, method="full")["certified_max_error_px"] for each in (near, away)]
        measured = r.draw(near, method="full", style=UNLIT) and r.measure()
    assert measured["max_error_px"] <= bounds[0] < 3 * measured["max_error_px"]
    assert bounds[1] < 1e-3
