"""Overlays on the land."""

from dataclasses import replace

import numpy as np
import pytest
from viewers import changed, hills, seen, settle, with_a_stroke

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap, ground_m
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.draped import polylines
from terrain_gl.renderer.overlay import Overlay
from terrain_gl.viewer.loading import Opened

ACROSS = Overlay((np.array([[4.0, 100.0], [124.0, 70.0]]),), np.array([[60.0, 60.0], [-500.0, 3.0]]))


def draped(overlays, heightmap):
    """Points and colour of each polyline of the overlays."""
    return [line[:2] for i, overlay in enumerate(overlays) for line in polylines(overlay, i, heightmap)]


def drawn_anew(viewer):
    """The window's picture by a renderer that has seen nothing before."""
    spec = viewer.scene.frame_spec()
    heightmap = Heightmap(viewer.scene.heightmap.heights.copy(), viewer.scene.heightmap.spacing_m)
    with Renderer(heightmap, spec.size, ctx=viewer.ctx) as renderer:
        renderer.overlays = viewer.scene.opened.overlays
        return renderer.render(spec.camera, **vars(spec.sides[0])).image[..., :3].astype(int)


def test_lines_lie_on_the_land_between_their_ends():
    heightmap = hills()
    lines = draped((ACROSS,), heightmap)
    assert len(lines) == 2  # the line, and the ring of the point that is on the map
    points = lines[0][0]
    for x, y, z in points[:: len(points) // 20]:  # between posts, too
        assert z == pytest.approx(ground_m(heightmap, np.array([[x, y]]))[0])
    assert np.ptp(points[:, 2]) > 20 and len(points) > 120


def test_a_line_is_cut_at_gaps_and_at_the_edge():
    heights = np.zeros((40, 60), "f4")
    heights[:, 20:30] = np.nan
    line = Overlay((np.array([[-20.0, 10.0], [80.0, 10.5]]),), np.zeros((0, 2)))
    runs = [points for points, _ in draped((line,), Heightmap(heights, 10.0))]
    assert len(runs) == 2 and all(np.isfinite(run).all() for run in runs)
    assert all((np.diff(run[:, 0]) <= 10.001).all() for run in runs)  # nothing crosses the gap


@pytest.mark.slow
def test_an_overlay_is_drawn_and_follows_the_land(empty):
    heightmap = hills()
    opened = Opened(heightmap, Camera.default(heightmap), key="hills")
    empty.settings.change_all(style="lambert")
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), opened)
    settle(empty)
    bare = seen(empty)
    turn = 3.0 * np.arange(121)  # across and across a circle
    long = np.stack([60 + 50 * np.cos(turn), 60 + 50 * np.sin(turn)], -1)
    both = (ACROSS, Overlay((long,), np.zeros((0, 2))))
    assert sum(len(run) for run, _ in draped(both, heightmap)) > 8000, "far more pieces than before"
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), replace(opened, overlays=both))
    settle(empty)
    assert changed(seen(empty), bare) > 0.02
    red = (np.abs(seen(empty) - [255, 70, 50]).max(-1) < 60).sum()
    assert red > 30 and empty.ctx.error == "GL_NO_ERROR"
    before, after = with_a_stroke(empty)
    assert not np.array_equal(before, after)
    empty.sculpting.brushing = False
    settle(empty)
    assert changed(seen(empty), drawn_anew(empty)) < 0.004  # lines of the old land: 0.024; two meshes within a pixel
    low = seen(empty)
    empty.exaggerate(2.0)
    settle(empty)
    assert changed(seen(empty), low) > 0.02
    assert changed(seen(empty), drawn_anew(empty)) < 0.001  # lines of the lower land: 0.52


def test_names_of_points_are_in_the_window_unless_land_hides_them(empty):
    y, x = np.mgrid[0:65, 0:65]
    hill = Heightmap((200 * np.exp(-((x - 32) ** 2 + (y - 32) ** 2) / 60)).astype("f4"), 10.0)
    named = Overlay((), np.array([[32.0, 50.0], [32.0, 14.0]]), ("in front", "behind"))
    camera = Camera((320.0, -300.0, 130.0), (320.0, 320.0, 60.0), 45.0)
    empty.settings.change_all(style="lambert")
    opened = Opened(hill, camera, key="hill", camera_given=True, overlays=(named,))
    empty.show(Renderer(hill, (320, 200), ctx=empty.ctx), opened)
    settle(empty)
    (label,) = empty.painter.labels
    assert label.name == "in front" and label.x == pytest.approx(0.5 * empty.window.size[0], abs=2)
