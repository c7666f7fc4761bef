"""A patch of 4 × 4 or 8 × 8 segments over a node is a star: diagonals point to its middle; cuts keep its bound."""

from itertools import pairwise

import numpy as np
import pytest
from maps import rough

from terrain_gl import reference
from terrain_gl.verify.holes import bilinear

SHAPES = [(17, 17), (33, 33), (19, 26)]
SHARES = (0.0, 0.3, 1.0)
START = np.arange(4)
CORNER = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [3, 3, 2, 2], [3, 3, 2, 2]])  # north-west, north-east, and so on
OUTER = np.pad(np.zeros((2, 2), bool), 1, constant_values=True)


def star(low, side, share, rng, turned=True, n=4):
    """Corners (row, column) of the triangles of a patch, (n, 3, 2).

    A share of the posts of the patch's edges are vertices. With `turned` false, all diagonals fall.
    """
    found, step = [], side // n
    for i, j in np.ndindex(n, n):
        nw, ne, sw, se = low + step * np.array([(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)])
        falls = not turned or (i < n // 2) == (j < n // 2)
        for a, b, c in [(nw, ne, se), (nw, sw, se)] if falls else [(ne, nw, sw), (ne, se, sw)]:  # the right angle is b
            if on_rim(a, b, low, side):
                found += [(c, *edge) for edge in pairwise(cut(a, b, share, rng))]
            elif on_rim(b, c, low, side):
                found += [(a, *edge) for edge in pairwise(cut(b, c, share, rng))]
            else:
                found.append((a, b, c))
    return np.array(found)


def on_rim(a, b, low, side):
    return ((a == b) & ((a == low) | (a == low + side))).any()


def cut(a, b, share, rng):
    """Some of the posts from a to b, with both ends."""
    steps = np.abs(b - a).max()
    posts = a + np.arange(steps + 1)[:, None] * (b - a) // steps
    kept = rng.random(steps + 1) < share
    kept[[0, -1]] = True
    return posts[kept]


def drawn(heights, low, side, triangles):
    """Drawn heights on a grid of 8 × 8 places a cell; NaN where no triangle is."""
    found = np.full((8 * side + 1, 8 * side + 1), np.nan)
    for corners in triangles:
        first, last = 8 * (corners.min(0) - low), 8 * (corners.max(0) - low)
        box = tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
        y, x = np.mgrid[box] / 8
        places = np.stack([y + low[0], x + low[1], np.ones_like(x)]).reshape(3, -1)
        weights = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), places)
        inside = (weights > -1e-9).all(0).reshape(x.shape)
        height = (heights[tuple(corners.T)] @ weights).reshape(x.shape)
        found[box] = np.where(inside, height, found[box])
    return found


def distances(heights, low, side, triangles, truth=None):
    """Distance of the drawing from the map at each place of the grid."""
    y, x = np.mgrid[0 : 8 * side + 1, 0 : 8 * side + 1] / 8
    true = bilinear(heights if truth is None else truth, x + low[1], y + low[0])
    return np.abs(drawn(heights, low, side, triangles) - true)


def some_map(shape, seed):
    """Odd seeds give mostly noise."""
    noise = np.random.default_rng(seed).normal(size=shape)
    return rough(*shape, seed=seed).astype(float) + (30 if seed % 2 else 1) * noise


def square_nodes(shape, level):
    """Indices and first posts of the nodes that the map's rim does not cut off."""
    side = 1 << level
    return [(at, side * np.array(at)) for at in np.ndindex(*((n - 1) // side for n in shape))]


def ratios(heights, level, shares, turned=True):
    """Largest distance of each patch, and of each cell of it, as shares of their bounds: (n,), (n, 4, 4)."""
    rng, of_patches, of_cells, places = np.random.default_rng(level), [], [], 2 << level
    bound, of_corners = reference.star_errors(heights, level, 2), reference.turned_errors(heights, level - 2)
    for at, low in square_nodes(heights.shape, level):
        own = of_corners[tuple(4 * np.array(at)[:, None, None] + np.indices((4, 4)))]
        for share in shares:
            off = distances(heights, low, 1 << level, star(low, 1 << level, share, rng, turned))
            cells = [
                [off[i : i + places + 1, j : j + places + 1].max() for j in START * places] for i in START * places
            ]
            of_patches.append(off.max() / bound[at])
            of_cells.append(np.array(cells) / own[*np.indices((4, 4)), CORNER])
    return np.array(of_patches), np.array(of_cells)


@pytest.mark.parametrize(
    ("shape", "level"), [(shape, level) for shape in SHAPES for level in (3, 4, 5) if square_nodes(shape, level)]
)
def test_no_cuts_of_a_star_break_its_bound(shape, level):
    """Nor do they break the bound of any of its cells."""
    found = [ratios(some_map(shape, seed), level, SHARES) for seed in range(6)]
    patches, cells = (np.concatenate(each) for each in zip(*found, strict=True))
    assert max(patches.max(), cells.max()) <= 1 + 1e-9
    assert patches.max() > 0.85
    assert cells.max(0).min() > 0.8  # in each of the 16 cells


@pytest.mark.parametrize("level", [4, 5])
def test_no_cuts_of_a_star_of_8_segments_break_its_bound(level):
    low, side, rng, found = np.zeros(2, int), 1 << level, np.random.default_rng(8), []
    for seed, share in [(seed, share) for seed in range(4) for share in SHARES]:
        heights = some_map((side + 1, side + 1), seed)
        off = distances(heights, low, side, star(low, side, share, rng, n=8))
        found.append(off.max() / reference.star_errors(heights, level, 3)[0, 0])
    assert 0.85 < max(found) <= 1 + 1e-9


@pytest.mark.parametrize("level", [3, 4, 5])
def test_without_the_moves_of_cuts_the_bound_breaks(level, monkeypatch):
    """The map is flat at the corners of cells, and 1 m above or below everywhere else."""
    heights = np.random.default_rng(level).choice([-1.0, 1.0], (33, 33))
    step = 1 << level - 2
    heights[::step, ::step] = 0
    assert ratios(heights, level, SHARES)[0].max() <= 1 + 1e-9
    moves = reference.cut_moves
    monkeypatch.setattr(reference.error, "cut_moves", lambda *of: np.zeros_like(moves(*of)))
    assert ratios(heights, level, (0.0,))[0] == pytest.approx(1)  # without cuts it is exact
    patches, cells = ratios(heights, level, (0.3, 0.5))
    assert patches.max() > 1.4
    assert (cells[:, ~OUTER] <= 1 + 1e-9).all()


@pytest.mark.parametrize("level", [3, 4, 5])
def test_diagonals_that_all_fall_break_the_bound(level):
    """The posts of the map lie on a star."""
    low, side = np.zeros(2, int), 1 << level
    rng = np.random.default_rng(level)
    heights = drawn(rng.normal(size=(side + 1, side + 1)), low, side, star(low, side, 0.0, rng))[::8, ::8]
    assert ratios(heights, level, SHARES)[0].max() <= 1 + 1e-9
    patches, cells = ratios(heights, level, (0.0,), turned=False)
    assert patches.max() > 1.5
    falls = CORNER % 2 == 0
    assert (cells[:, falls] <= 1 + 1e-9).all()
    assert (cells[:, ~falls] > 1.5).all()


def test_places_beside_voids_do_not_count():
    """A spike that is a void is drawn, and its cells are not measured."""
    heights, rng = some_map((17, 17), 0), np.random.default_rng(3)
    heights[5, 5] += 500
    void = np.zeros(heights.shape, bool)
    void[5, 5] = True
    bound = reference.star_errors(heights, 4, 2, void)[0, 0]
    low, truth = np.zeros(2, int), np.where(void, np.nan, heights)
    off = [np.nanmax(distances(heights, low, 16, star(low, 16, share, rng), truth)) for share in SHARES]
    assert 0.95 * bound < max(off) <= bound + 1e-9
    assert bound < reference.star_errors(heights, 4, 2)[0, 0] / 4


def test_nodes_that_the_rim_cuts_off_have_no_bound():
    for level in (3, 4, 5):
        bound = reference.star_errors(some_map((19, 26), 0), level, 2)
        square = np.zeros(bound.shape, bool)
        for at, _ in square_nodes((19, 26), level):
            square[at] = True
        assert (np.isfinite(bound) == square).all()
