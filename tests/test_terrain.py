"""The heightmap on the GPU: exact heights, filled voids, quantisation ranges that small edits do not move."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import MAPS, holes, rough

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.terrain import Terrain, quantisation_range
from terrain_gl.terrain.filling import fill_voids


def uploaded(terrain):
    return np.frombuffer(terrain.heights.read(), "f4").reshape(terrain.heightmap.heights.shape)


@pytest.mark.parametrize("name", MAPS)
def test_heights_arrive_exactly(ctx, name):
    heightmap = MAPS[name]()
    terrain = Terrain(ctx, heightmap)
    solid = ~np.isnan(heightmap.heights)
    back = uploaded(terrain).astype("f8") + terrain.base_m
    assert (back[solid] == heightmap.heights[solid].astype("f8")).all()
    assert np.isfinite(back).all()


@pytest.mark.parametrize("offset", [8848.0, -10994.0, 1e6, -3e6])
def test_base_keeps_centimetres_far_from_zero(ctx, offset):
    heights = (offset + rough(50, 60, 1, 0.3).astype("f8")).astype("f4")
    terrain = Terrain(ctx, Heightmap(heights))
    assert (uploaded(terrain).astype("f8") + terrain.base_m == heights.astype("f8")).all()
    assert np.abs(uploaded(terrain)).max() <= 2 * terrain.span_m


@given(st.floats(-1e7, 1e7, width=32, allow_subnormal=False), st.floats(0, 1e7, width=32, allow_subnormal=False))
def test_span_holds_the_map(low, relief):
    low, high = float(np.float32(low)), float(np.float32(min(low + relief, 1e7)))
    base, bottom, span = quantisation_range(low, max(low, high))
    assert bottom <= low and max(low, high) <= bottom + span
    assert span > 0
    assert span <= max(3 * (high - low), 4e-6 * max(abs(low), 1.0))
    assert np.float32(base) == base and np.float32(bottom) == bottom and np.float32(span) == span
    for h in np.linspace(low, high, 7).astype("f4"):
        assert float(h - np.float32(base)) == float(h) - base


def test_block_says_what_the_map_is(ctx):
    heightmap = Heightmap(holes(), (3.0, 4.0))
    terrain = Terrain(ctx, heightmap)
    block = np.frombuffer(terrain.block.read(), layout.TERRAIN)[0]
    assert tuple(block["last_post"]) == (heightmap.cols - 1, heightmap.rows - 1)
    assert tuple(block["spacing_m"]) == (3.0, 4.0)
    assert block["has_voids"] == 1
    assert block["top_level"] == terrain.top_level
    voids = np.frombuffer(terrain.marks.read(alignment=1), "u1").reshape(heightmap.heights.shape)
    assert (voids == np.isnan(heightmap.heights)).all()


@given(st.integers(1, 40), st.integers(1, 40), st.floats(0, 0.99), st.integers(0, 99))
def test_filled_voids_stay_between_the_heights_around(rows, cols, share, seed):
    heights = rough(rows + 1, cols + 1, seed)
    void = np.random.default_rng(seed).random(heights.shape) < share
    void[0, 0] = False
    known = heights[~void]
    filled = fill_voids(np.where(void, np.nan, heights).astype("f4"))
    assert (filled[~void] == known).all()
    assert known.min() <= filled.min() and filled.max() <= known.max()


def test_edit_finds_what_changed_and_no_more(ctx):
    heights = rough(60, 70)
    terrain = Terrain(ctx, Heightmap(heights))
    after = heights.copy()
    after[20:25, 31:40] += 0.5
    assert terrain.edit(0, 0, after) == (31, 20, 39, 24)
    assert (uploaded(terrain) == after).all()
    assert terrain.edit(0, 0, after) is None


def test_map_beyond_the_texture_limit_is_refused(ctx, monkeypatch):
    monkeypatch.setattr("terrain_gl.gpu.gl.limits", lambda _: {"texture_size": 64})
    with pytest.raises(TerrainError, match="70x60 posts, but this GPU's textures end at 64"):
        Terrain(ctx, Heightmap(rough(60, 70)))
