"""Grain below the posts' spacing: only in the shading near the eye, prefiltered, the same each time."""

import numpy as np
import pytest
from maps import rough

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer

SIZE = (160, 90)


@pytest.fixture
def renderer(ctx):
    with Renderer(Heightmap(rough(129, 129, 2, 300.0), 30.0), SIZE, ctx=ctx) as made:
        yield made


def above(up_m):
    """Look down on the middle of the map."""
    return Camera((1900.0, 1900.0, up_m), (1900.0, 1930.0, 0.0), 50.0)


def shown(renderer, up_m, **options):
    return renderer.render(above(up_m), 1.0, **options).image[..., :3].astype(int)


def test_near_the_eye_there_is_grain_and_it_can_be_left_out(renderer):
    on, off = shown(renderer, 500.0), shown(renderer, 500.0, grain="off")
    assert np.abs(on - off).mean() > 3
    assert np.abs(on.mean((0, 1)) - off.mean((0, 1))).max() < 3  # the mean light is as it was
    assert np.array_equal(on, shown(renderer, 500.0))


def test_far_away_there_is_none(renderer):
    assert np.abs(shown(renderer, 60000.0) - shown(renderer, 60000.0, grain="off")).max() <= 1


def test_it_fades_instead_of_flickering(renderer):
    """With 16 times as many pixels, averaged, the picture differs from this one by less than the grain's strength."""
    for up_m in (500.0, 900.0, 1800.0):
        one, off = shown(renderer, up_m), shown(renderer, up_m, grain="off")
        fine, fine_off = (shown(renderer, up_m, size=SIZE, fine=4, grain=grain) for grain in ("on", "off"))
        aliased = np.abs((one - off) - (fine - fine_off)).mean()
        assert aliased < 0.6 * max(np.abs(fine - fine_off).mean(), 1.0), up_m


def test_the_mesh_and_what_is_measured_stay_as_they_are(renderer):
    told = []
    for grain in ("on", "off"):
        renderer.draw(above(500.0), 1.0, grain=grain)
        stats = renderer.measure()
        told.append([stats[key] for key in ("triangles", "max_error_px", "rms_error_px", "certified_max_error_px")])
    assert told[0] == told[1]


@pytest.mark.slow
@pytest.mark.parametrize("look", ["grey", "tint", "viridis"])
def test_diagrams_have_none(renderer, look):
    assert np.array_equal(shown(renderer, 500.0, look=look), shown(renderer, 500.0, look=look, grain="off"))
