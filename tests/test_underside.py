"""The land from below: it is drawn only where a pixel may show it, because its triangles cost time."""

import numpy as np
import pytest

import terrain_gl as tg
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer.methods import METHODS
from terrain_gl.shade.picture import Picture

SIZE = (64, 64)
SPACING_M = 10.0


def cliff(high_rows=1, hole=None):
    """60 × 40 posts; the southern rows are 100 m higher than the others."""
    heights = np.zeros((60, 40), "f4")
    heights[-high_rows:] = 100.0
    if hole:
        heights[hole] = np.nan
    return Heightmap(heights, SPACING_M)


def middle_row(renderer, camera, **options):
    """The brightness of the middle column in the style "depth", from top to bottom; 0 is the sky."""
    image = renderer.render(camera, style="depth", **options).image
    return image[:, SIZE[0] // 2, 0].astype(int)


def samples_of(renderer, camera):
    """The picture in the style "depth", and how many samples the mesh wrote."""
    image = renderer.render(camera, style="depth").image
    with renderer.session:
        written = renderer.ctx.query(samples=True)
        with written:
            renderer.picture.see(renderer.inspector.frame.selection)
        return image, written.samples


def test_slopes_that_face_away_are_not_drawn(monkeypatch):
    """The picture is the same without them, and they are hidden, because the eye is above the ground."""
    y, x = np.mgrid[:60, :40]
    hills = 40 * np.sin(0.9 * x) * np.sin(0.8 * y).astype("f4")
    camera = Camera((200.0, 10.0, 90.0), (200.0, 300.0, 0.0))
    with tg.Renderer(Heightmap(hills.astype("f4"), SPACING_M), SIZE) as renderer:
        image, written = samples_of(renderer, camera)
        monkeypatch.setattr(Picture, "_may_show_underside", lambda *_: True)
        both_sides, more_written = samples_of(renderer, camera)
    np.testing.assert_array_equal(image, both_sides)
    assert written < 0.95 * more_written


def test_an_eye_beside_the_map_sees_the_underside():
    """It looks below the southern rim, at the inner side of a cliff."""
    with tg.Renderer(cliff(), SIZE) as renderer:
        seen = middle_row(renderer, Camera((200.0, -50.0, 130.0), (200.0, 0.0, 60.0), 20.0))
    assert (seen > 145).all()  # the cliff is 60 m away, the land behind it more than 150 m


def test_a_near_plane_in_the_ground_shows_the_underside():
    """It cuts a ridge, whose far slope is then seen from inside."""
    heights = np.zeros((60, 40), "f4")
    heights[29:40] = 400.0
    camera = Camera((200.0, 100.0, 250.0), (200.0, 300.0, 250.0), 30.0)
    with tg.Renderer(Heightmap(heights, SPACING_M), SIZE) as renderer:
        assert (middle_row(renderer, camera, near_m=150.0) > 0).all()
        assert renderer.measure()["holes"] == 0


def test_a_mesh_above_the_eye_shows_its_underside():
    """The eye is in a pit, above its ground. Two triangles lie across the pit, above the eye."""
    heights = np.full((65, 65), 100.0, "f4")
    heights[16:49, 16:49] = 0.0
    camera = Camera((320.0, 320.0, 20.0), (320.0, 420.0, 80.0), 30.0)
    with tg.Renderer(Heightmap(heights, SPACING_M), SIZE) as renderer:
        assert (middle_row(renderer, camera, triangles=2) > 0).all()
        assert renderer.inspector.frame.selection.certified_px > 64


@pytest.mark.parametrize("method", METHODS)
def test_an_eye_under_the_ground_sees_the_underside(method):
    heights = np.full((60, 40), 50.0, "f4")
    with tg.Renderer(Heightmap(heights, SPACING_M), SIZE) as renderer:
        above = middle_row(renderer, Camera((200.0, 300.0, 90.0), (200.0, 310.0, 50.0)), method=method)
        below = middle_row(renderer, Camera((200.0, 300.0, 10.0), (200.0, 310.0, 50.0)), method=method)
    assert (above > 0).all() and (below > 0).all()


def test_a_hole_shows_the_underside():
    heightmap = cliff(high_rows=30, hole=np.s_[34:38, 15:25])
    camera = Camera((200.0, 60.0, 160.0), (200.0, 230.0, 95.0), 10.0)  # through the hole, at the cliff north of it
    with tg.Renderer(heightmap, SIZE) as renderer:
        filled = middle_row(renderer, camera, voids="fill")
        holed = middle_row(renderer, camera, voids="hole")
    inside = np.flatnonzero(filled != holed)[2:-2]  # without the hole's edges
    # the cliff is 260 m away, the land behind it more than 350 m
    assert len(inside) > 20 and (holed[inside] > 95).all()
