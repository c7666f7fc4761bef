"""The land from below: it is drawn only where a pixel may show it, because its triangles cost time."""

import numpy as np
import pytest

import terrain_gl as tg
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.methods import METHODS

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


def test_an_eye_above_the_ground_looks_through_the_underside():
    eye = (200.0, -50.0, 130.0)  # south of the rim; looks below it, at the cliff's inner side
    with tg.Renderer(cliff(), SIZE) as renderer:
        seen = middle_row(renderer, Camera(eye, (200.0, 0.0, 60.0), 20.0))
        near = middle_row(renderer, Camera(eye, (200.0, 0.0, 60.0), 20.0), near_m=90.0)
    np.testing.assert_allclose(seen, near, atol=1)  # as if the underside of the cliff were cut off


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
