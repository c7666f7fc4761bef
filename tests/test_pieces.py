"""Pieces: they tile the picture, show the same as the whole picture, and are drawn with its mesh."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import rough

import terrain_gl as tg
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import clip_from_eye
from terrain_gl.camera.pieces import Piece, cut
from terrain_gl.image import linear_from_srgb, reduced
from terrain_gl.renderer import renderer
from terrain_gl.shade.picture import STYLES

SIZE = (150, 83)
# Vertices are snapped to 1/256 of a pixel. Places computed through another matrix differ by a few 1e-4 pixels: one in
# about fourteen snaps to another place. An edge that moves by 1/256 passes a sample in 1 of 64 pixels, with four
# samples each. A pixel here has two edges, so four ends: 1/14 * 1/64 * 4 of the pixels have a sample of a neighbour.
OUTLIERS = 0.0045


@pytest.fixture
def heightmap():
    return tg.Heightmap(rough(97, 130, 3), (20.0, 30.0), "rough")


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(renderer, "cut", lambda size, fine: cut(size, fine, 64))


@given(st.integers(1, 5000), st.integers(1, 5000), st.integers(1, 8), st.sampled_from([512, 750, 2048]))
def test_pieces_tile_the_picture(width, height, fine, largest):
    pieces = cut((width, height), fine, largest)
    assert all(max(piece.drawn_size) <= largest and min(piece.size) >= 1 for piece in pieces)
    assert all(x % 2 == y % 2 == 0 for x, y in (piece.corner for piece in pieces))
    count = len({(piece.rows.start, piece.cols.start) for piece in pieces})
    area = sum(piece.size[0] * piece.size[1] for piece in pieces)
    assert count == len(pieces) and area == width * height
    assert [piece.rows.start for piece in pieces] == sorted(piece.rows.start for piece in pieces)


def clip_from_picture(piece):
    """From clip coordinates of the whole picture to those of the piece."""
    matrix = np.eye(4)
    for axis in (0, 1):
        matrix[axis, axis], matrix[axis, 3] = piece.window[axis]
    return matrix


def test_every_pixel_is_in_one_piece():
    hit = np.zeros((83, 150), int)
    for piece in cut((150, 83), 3, 64):
        hit[piece.rows, piece.cols] += 1
    assert (hit == 1).all()


@given(st.integers(0, 3), st.integers(-99, 99).map(lambda n: n / 100), st.integers(-99, 99).map(lambda n: n / 100))
def test_a_piece_sees_its_window_of_the_picture(i, x, y):
    size = (640, 360)
    camera = tg.Camera((0, 0, 0), (3, 10, -1))
    piece = cut(size, largest=320)[i]
    place = (
        camera.forward
        + x * camera.half_extent(size)[0] * camera.axes[0]
        + y * camera.half_extent(size)[1] * camera.axes[1]
    )
    whole = clip_from_eye(camera, size, 0.1) @ [*place, 1.0]
    part = clip_from_picture(piece) @ whole
    px = (whole[:2] / whole[3] + 1) / 2 * size
    assert (part[:2] / part[3] + 1) / 2 * piece.size + piece.corner == pytest.approx(px, abs=1e-9)
    assert (part[2:] == whole[2:]).all()


def test_a_picture_in_pieces_is_the_picture_in_one(heightmap, small_pieces):
    ways = [{"style": style, "max_error_px": 2.0} for style in STYLES]
    ways += [{"method": method} for method in ("clipmap", "tessellated", "full")]
    with tg.Renderer(heightmap, SIZE) as r:
        for way in ways:
            whole = r.render(tg.Camera.default(heightmap), **way)
            parts = r.render(tg.Camera.default(heightmap), size=SIZE, **way)
            assert (np.abs(whole.image.astype(int) - parts.image).max(-1) > 1).mean() <= OUTLIERS, way
            assert parts.stats["triangles"] == whole.stats["triangles"], way


def test_a_size_beyond_the_renderers_own(heightmap, small_pieces):
    camera = tg.Camera.default(heightmap)
    done = []
    with tg.Renderer(heightmap, (40, 30)) as small, tg.Renderer(heightmap, SIZE) as large:
        expected = large.render(camera, 1.0)
        before = small.render(camera, 1.0)
        frame = small.render(camera, 1.0, size=SIZE, progress=done.append)
        assert frame.stats["triangles"] == expected.stats["triangles"] > before.stats["triangles"]
        assert (frame.stats["width"], frame.stats["height"]) == SIZE
        assert (np.abs(frame.image.astype(int) - expected.image).max(-1) > 1).mean() <= OUTLIERS
        assert done == sorted(done) and done[-1] == 1.0 and len(done) > 6
        assert (small.render(camera, 1.0).image == before.image).all()


def test_fine_pixels_are_the_mean_light_of_a_larger_picture(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, (60, 40)) as r:
        fine = r.render(camera, 1.0, size=(60, 40), fine=3, method="full").image
    with tg.Renderer(heightmap, (180, 120)) as r:
        light = linear_from_srgb(r.render(camera, 1.0, method="full").image[..., :3])
    mean = light.reshape(40, 3, 60, 3, 3).mean((1, 3))
    # half a step of rounding; where the curve is steepest, that is 12.92 times as much light
    assert np.abs(linear_from_srgb(fine[..., :3]) - mean).max() < 1 / 255


def test_fine_pixels_keep_the_mesh_of_the_picture_asked_for(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, (60, 40)) as r:
        triangles = r.render(camera, 2.0).stats["triangles"]
        assert r.render(camera, 2.0, size=(60, 40), fine=4).stats["triangles"] == triangles


def test_there_is_nothing_to_measure_after_pieces(heightmap):
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as r:
        r.render(camera)
        r.render(camera, size=SIZE)
        with pytest.raises(tg.TerrainError, match="render a frame first"):
            r.measure()
        r.render(camera)
        assert r.measure()["holes"] == 0


@pytest.mark.parametrize("size, fine", [((0, 5), 1), ((5, -1), 1), ((5, 5), 0), ((5, 5), 2000)])
def test_no_pixels_are_refused(size, fine):
    with pytest.raises(UsageError, match="at least 1x1|pixels drawn"):
        cut(size, fine)


def test_reduced_is_a_mean_of_light():
    black_and_white = np.zeros((2, 4, 4), np.uint8)
    black_and_white[:, ::2] = 255
    clear = reduced(black_and_white, 2)
    assert (clear[..., :3] == 255).all() and (clear[..., 3] == 128).all()  # what is clear has no colour
    black_and_white[..., 3] = 255
    assert (reduced(black_and_white, 2)[..., :3] == 188).all()  # half the light of white, in sRGB
    assert (reduced(black_and_white, 2)[..., 3] == 255).all()
    assert reduced(black_and_white, 1) is black_and_white
    with pytest.raises(ValueError, match="multiples of 3"):
        reduced(black_and_white, 3)


def test_the_whole_is_a_piece_that_changes_nothing():
    assert (clip_from_picture(Piece.whole((7, 5))) == np.eye(4)).all()
