"""Posts without data: filled smoothly from their rim, or holes; marked, counted, and not certified."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, cameras, holes, rough

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.terrain.filling import Filling, fill_voids

SIZE = (160, 90)


def peak(void_radius=14, n=97):
    """A mountain whose summit is missing, as in radar data."""
    y, x = np.mgrid[:n, :n]
    away = np.hypot(x - n // 2, y - n // 2)
    heights = 3000 - 40 * away + 20 * np.sin(x / 3) * np.cos(y / 5)
    return np.where(away < void_radius, np.nan, heights).astype("f4")


def test_a_fill_is_as_smooth_as_a_membrane():
    """Each post is close to the mean of its neighbours, and no post lies beyond the heights of the rim."""
    heights = peak()
    void = np.isnan(heights)
    filled = fill_voids(heights)
    around = np.pad(filled, 1, "edge")
    mean = (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
    rim = heights[~void & (np.hypot(*(np.indices(void.shape) - 48)) < 16)]
    assert np.abs(filled - mean)[void].max() < 0.03 * np.ptp(rim)
    assert filled[void].max() <= rim.max() and filled[40:57, 40:57].min() > rim.min()
    assert np.array_equal(filled[~void], heights[~void])


def test_a_fill_has_no_steps():
    """Neighbours in a fill differ at most three times as much as on the land; blocks would have larger steps."""
    y, x = np.mgrid[:128, :128].astype("f4")
    plane = 3 * x - 2 * y
    heights = plane.copy()
    heights[30:95, 20:100] = np.nan
    filled = fill_voids(heights)
    assert max(np.abs(np.diff(filled, axis=0)).max(), np.abs(np.diff(filled, axis=1)).max()) < 3 * 3
    assert np.abs(filled - plane).max() < 0.05 * np.ptp(plane)


@settings(max_examples=40)
@given(st.integers(2, 60), st.integers(2, 60), st.floats(0, 0.95), st.integers(0, 999))
def test_edits_fill_as_a_new_start_does(rows, cols, share, seed):
    """Bit by bit, whether the edits make voids or close them."""
    rng = np.random.default_rng(seed)
    heights = rough(rows, cols, seed)
    heights[rng.random(heights.shape) < share] = np.nan
    heights[0, 0] = 1.0
    filling = Filling(heights)
    for _ in range(3):
        y0, x0 = rng.integers(0, rows), rng.integers(0, cols)
        y1, x1 = min(y0 + rng.integers(1, 12), rows), min(x0 + rng.integers(1, 12), cols)
        new = rng.normal(size=(y1 - y0, x1 - x0)) * 50
        new[rng.random(new.shape) < rng.random()] = np.nan
        before = filling.filled[0].copy()
        heights[y0:y1, x0:x1] = new
        heights[0, 0] = 1.0
        rect = filling.update((int(x0), int(y0), int(x1 - 1), int(y1 - 1)))
        assert filling.filled[0].tobytes() == Filling(heights.copy()).filled[0].tobytes()
        differs = np.argwhere(filling.filled[0] != before)
        if len(differs):
            (top, left), (bottom, right) = differs.min(0), differs.max(0)
            assert rect[0] <= left and rect[1] <= top and rect[2] >= right and rect[3] >= bottom


def above(heightmap):
    """Look straight down on all of the map, and a little beyond."""
    (east, north), top = heightmap.extent_m, heightmap.range_m[1]
    return Camera((east / 2, north / 2, top + 40 * north), (east / 2, north / 2, top), 1.6)


def test_voids_are_drawn_unless_they_are_to_be_holes(ctx):
    heightmap = Heightmap(peak(), 30.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        camera = above(heightmap)
        filled = renderer.render(camera, style="shaded")
        summit = renderer.drawn_height_at(48 * 30.0, 48 * 30.0)
        assert not renderer.picture.sky_share()[45, 80]
        holed = renderer.render(camera, style="shaded", voids="hole")
        assert renderer.picture.sky_share()[45, 80] == 1
        assert np.isnan(renderer.drawn_height_at(48 * 30.0, 48 * 30.0))
        for style in ("lod", "error", "promise"):
            renderer.render(camera, style=style, voids="hole")
            assert renderer.picture.sky_share()[45, 80] == 1
            renderer.render(camera, style=style)
            assert renderer.picture.sky_share()[45, 80] == 0
    assert filled.stats["voids"] == holed.stats["voids"] == heightmap.voids == np.isnan(peak()).sum()
    assert filled.stats["triangles"] == holed.stats["triangles"]
    assert np.nanmin(peak()) < summit <= np.nanmax(peak())


def test_filled_ground_is_marked(ctx):
    """It is orange in the style of voids, one grey when lit, and grey in the style of errors."""
    heightmap = Heightmap(peak(), 30.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        shown = {
            style: renderer.render(above(heightmap), style=style).image[..., :3].astype(int)
            for style in ("voids", "shaded", "error")
        }
        land = renderer.picture.coverage()
    orange = (shown["voids"][..., 0] > shown["voids"][..., 2] + 60) & land
    assert orange.sum() / land.sum() == pytest.approx(heightmap.voids / heightmap.heights.size, rel=0.15)
    middle, aside = shown["shaded"][45, 80], shown["shaded"][70, 60]
    assert np.ptp(middle) < np.ptp(aside)
    assert np.ptp(shown["error"][45, 80]) < 10


@pytest.mark.parametrize("view", ["default", "grazing", "down", "pit"])
def test_the_bound_is_over_posts_with_data_alone(ctx, view):
    """The bound holds, and is the same number, whatever is drawn at the other posts."""
    heightmap = MAPS["holes"]()
    camera = cameras(heightmap)[view]
    with Renderer(heightmap, (320, 180), ctx=ctx) as renderer:
        told = []
        for voids in ("fill", "hole"):
            renderer.draw(camera, 1.0, voids=voids, style="depth")
            stats = renderer.measure()
            assert stats["max_error_px"] <= stats["certified_max_error_px"] <= 1.0
            assert stats["holes"] == 0 and stats["posts_measured"] <= (~np.isnan(holes())).sum()
            told.append([stats[key] for key in ("max_error_px", "rms_error_px", "posts_measured", "triangles")])
    assert told[0] == told[1]


def test_other_words_are_refused():
    with pytest.raises(UsageError, match="voids: expected one of fill, hole, got 'gap'"):
        FrameOptions(voids="gap")
