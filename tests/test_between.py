"""The error tables against samples between the posts: errors of quads and fans are never above the tables."""

import itertools

import numpy as np
import pytest
from maps import cliff, holes, rough

from terrain_gl import reference
from terrain_gl.error import ErrorTables
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.terrain import Terrain

FINER_LOG2 = 3  # samples a side of a cell: 8


def smooth(rows, cols):
    y, x = np.indices((rows, cols))
    return 40 * np.sin(0.21 * x + 0.1 * y) * np.cos(0.17 * y)


def bilinear(heights):
    """The truth on a lattice 2^FINER_LOG2 times as fine, float64."""
    n, h = 1 << FINER_LOG2, heights.astype("f8")
    for axis in (0, 1):
        h = np.moveaxis(h, axis, 0)
        t = (np.arange(n) / n).reshape(1, n, *[1] * (h.ndim - 1))
        between = (h[:-1, None] * (1 - t) + h[1:, None] * t).reshape(-1, *h.shape[1:])
        h = np.moveaxis(np.concatenate([between, h[-1:]]), 0, axis)
    return h


def measured(void):
    """Which samples are compared: posts with a height, and all places in cells without a void corner."""
    n = 1 << FINER_LOG2
    solid = ~(void[1:, 1:] | void[1:, :-1] | void[:-1, 1:] | void[:-1, :-1])
    seen = np.zeros([n * (size - 1) + 1 for size in void.shape], bool)
    for y, x in itertools.product(range(n + 1), repeat=2):
        seen[y : y + n * solid.shape[0] : n, x : x + n * solid.shape[1] : n] |= solid
    seen[::n, ::n] |= ~void
    return seen


def of_nodes(shape, seen, fine):
    """Samples that count in a node: on its own land, or at its own posts. Other land at its rim is a neighbour's."""
    land = np.pad(reference.cells_with_data(shape, fine, ~seen), [(0, 0), (1, 1), (0, 0), (1, 1)])
    posts = np.zeros(shape, bool)
    posts[:: 1 << FINER_LOG2, :: 1 << FINER_LOG2] = True
    return np.logical_or.reduce(reference.of_corners(land)) | reference.own_posts(shape, fine, ~(seen & posts))


def sampled(truth, seen, level):
    """Largest errors of a level's nodes at the samples, with whole edges.

    The nodes of the fine lattice that are FINER_LOG2 levels higher have the same corners and the same centres.
    """
    fine = level + FINER_LOG2
    seen = of_nodes(truth.shape, seen, fine)
    return np.max([np.abs(errors * seen).max((1, 3)) for errors in reference.quad_errors(truth, fine)], 0)


MAPS = {
    "2x2": rough(2, 2),
    "2x6": rough(2, 6, 1),
    "6x2": rough(6, 2, 2),
    "12x19": rough(12, 19, 3),
    "49x2": rough(49, 2, 4),
    "3x100": rough(3, 100, 5),
    "33x33": rough(33, 33, 6),
    "100x300": rough(100, 300, 7),
    "smooth": smooth(70, 50),
    "cliff": cliff(67),
    "holes": holes(150),
    "high": rough(40, 45, 9, 1e-3).astype("f8") + np.where(np.arange(45) < 2, 0, 4000),
}


@pytest.mark.parametrize("name", MAPS)
def test_tables_bound_the_surface_between_the_posts(ctx, name):
    terrain = Terrain(ctx, Heightmap(MAPS[name], 10.0))
    tables = ErrorTables(terrain)
    truth, seen = bilinear(terrain.filled), measured(np.isnan(terrain.heightmap.heights))
    for level in range(1, len(terrain.levels)):
        max_m, _ = layout.unpack_nodes(tables.read_nodes(level), terrain.span_m)
        assert (sampled(truth, seen, level) <= max_m).all(), level


@pytest.mark.parametrize("name", ["12x19", "smooth", "cliff"])
def test_errors_at_the_posts_alone_do_not_bound_the_surface(name):
    """The part for crossed cells is needed: without it some node's error between posts is above the table's."""
    heights = MAPS[name].astype("f8")
    truth, seen = bilinear(heights), measured(np.zeros(heights.shape, bool))
    for level in (1, 2):
        at_posts = np.max([np.abs(errors).max((1, 3)) for errors in reference.quad_errors(heights, level)], 0)
        assert (sampled(truth, seen, level) > at_posts * (1 + 1e-9)).any()


@pytest.mark.parametrize("name", ["33x33", "smooth", "cliff"])
def test_errors_of_quads_are_reached(name):
    """At some sample, the error is nearly the table's: along a diagonal, the largest error may lie between two samples.

    Nodes at the rim are left out.
    """
    heights = MAPS[name].astype("f8")
    truth, seen = bilinear(heights), measured(np.zeros(heights.shape, bool))
    step = np.abs(reference.twists(heights)).max() / 4 * 4.0**-FINER_LOG2
    for level in range(1, 5):
        rows, cols = (n - 1 >> level for n in heights.shape)
        most = reference.largest_errors(heights, level)[:rows, :cols]
        assert (most <= sampled(truth, seen, level)[:rows, :cols] + step).all()


def test_bends_of_nodes_at_the_rim_are_needed(monkeypatch):
    """A ridge at 10 m between two void corners, over flat land: it runs between posts, in cells without a twist."""
    heights, void = np.zeros((4, 6)), np.zeros((4, 6), bool)
    heights[0, 0] = heights[3, 5] = 10.0
    void[0, 0] = void[3, 5] = True
    quad = sampled(bilinear(heights), measured(void), 3).item()
    assert quad == pytest.approx(10)
    assert quad <= reference.largest_errors(heights, 3, void).item()
    monkeypatch.setattr(reference.error, "bend_bounds", lambda heights, level: np.zeros((1, 1)))
    assert quad > reference.largest_errors(heights, 3, void).item() * 1.05


def test_errors_of_the_steepest_maps_stay_finite(ctx):
    """Half floats reach four times the span: a node of one cell at the rim can have a twist of twice the span."""
    for heights in ([[0, 9], [9, 0]], np.indices((4, 6)).sum(0) % 2 * 9.0, np.indices((6, 2)).sum(0) % 2 * 9.0):
        terrain = Terrain(ctx, Heightmap(heights, 1.0))
        tables = ErrorTables(terrain)
        for level in range(1, len(terrain.levels)):
            nodes = tables.read_nodes(level)
            assert np.isfinite(nodes["max_m"]).all() and np.isfinite(nodes["rms_m"]).all()
        tables.release()
        terrain.release()
