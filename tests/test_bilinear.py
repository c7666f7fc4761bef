"""The truth as a mesh: every post, bilinear in between; from above it equals the full resolution."""

import numpy as np
import pytest
from maps import MAPS, cameras, rough

import terrain_gl as tg
from terrain_gl.comparison.bilinear import FINER, _commands
from terrain_gl.heightmap import bilinear
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
    r.release()


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
    commands = list(_commands(counts))
    assert sum(command[0] for command in commands) == sum(counts)
    first = 0
    for patches, _, begin, *_ in commands:
        assert begin == first
        size = int(np.searchsorted(np.cumsum(counts), begin, side="right"))
        assert patches * (FINER * 2**size + 1) ** 2 <= 65535
        first += patches


def test_a_rough_map_has_no_holes_in_it(ctx):
    heightmap = tg.Heightmap(rough(90, 70, 3), 10.0)
    r = tg.Renderer(heightmap, (320, 180), ctx=ctx)
    for name, camera in cameras(heightmap, (320, 180)).items():
        r.draw(camera, method="truth", style=UNLIT)
        assert r.measure()["holes"] == 0, name
    r.release()
