"""Each station of the lecture shows its claim in pixels, at 1280 × 720; without it, the measure fails."""

import pytest

pytest.importorskip("zarr")  # the last station shows a store
from stations import measured
from viewers import later, seen, wait_for_threads

from terrain_gl.files.maps import open_map
from terrain_gl.renderer import Renderer
from terrain_gl.viewer.loading import Opened


@pytest.fixture(scope="module")
def land():
    heightmap, known = open_map("alpine-30m")
    return Opened(heightmap, known.camera, known.sun, known.name)


def draw(app):
    """Do frames until the picture is complete; only a station on jumps waits for measurements."""
    viewer = app.viewer
    viewer.window.refresh()
    for _ in range(20_000):
        wait_for_threads(viewer)
        later(app)
        waits = viewer.lecture.station.before and not viewer.lecture.jumps.sides
        if viewer.settled and not viewer.scene.controller.moving and not waits:
            return
    raise AssertionError("the picture does not become complete")


@pytest.mark.slow
def test_each_station_shows_what_must_be_seen(make_app, land):
    app = make_app((1280, 720), with_map=False)
    viewer = app.viewer
    viewer.show(Renderer(land.heightmap, (1280, 720), ctx=viewer.ctx), land)
    viewer.give_lecture()
    for number, station in enumerate(viewer.lecture.stations, 1):
        viewer.lecture.go_to(number - 1)
        draw(app)
        shown, is_seen = measured(number, app)
        assert is_seen, (number, station.name, shown)
        # the same measure does not hold without what the station shows
        if number == 1:
            viewer.settings.change(wires=False)
            draw(app)
            assert not measured(1, app)[1]
        elif number in (3, 6, 8, 10, 11):
            left, right = viewer.settings.sides
            viewer.explainer.take_sides([left, left])
            draw(app)
            assert not measured(number, app)[1], (number, station.name)
        elif number in (2, 7):
            viewer.settings.change(max_error_px=64.0)
            draw(app)
            assert not measured(7, app)[1] and measured(7, app)[0] != shown
        elif number == 13:
            assert viewer.scene.is_paged
            viewer.settings.change(max_error_px=0.25)
            draw(app)
            assert not measured(13, app)[1]
        elif number in (5, 9):
            app.press("escape")
            draw(app)
            assert (abs(seen(app) - (255, 120, 90)).max(-1) <= 40).sum() < 10
