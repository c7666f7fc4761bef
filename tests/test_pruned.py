"""Pruned quadtrees: by hand, and against all quadtrees of a small map."""

import functools
import itertools

import numpy as np
import pytest
from maps import MAPS, cameras

from terrain_gl import reference
from terrain_gl.camera import Camera, screen_shift_px
from terrain_gl.comparison import pruned


def test_neighbours_in_a_restricted_tree_differ_by_at_most_one_level():
    """A spike on a post that is odd in both directions: one node of each level contains it and is too coarse."""
    coarse = [np.zeros((64 >> level, 64 >> level), bool) for level in range(7)]
    for level in range(1, 7):
        coarse[level][29 >> level, 29 >> level] = True
    tree = pruned._restricted(coarse)
    assert [int(level.sum()) for level in tree][:2] == [0, 1] and sum(level.sum() for level in tree) > 6
    for fine, parents in zip(tree[1:], tree[2:], strict=False):
        around = fine | np.logical_or.reduce(reference.tree.neighbours(fine))
        assert parents.repeat(2, 0).repeat(2, 1)[around].all()


def trees(level, row, col):
    """All quadtrees under a node, as lists of their leaves."""
    yield [(level, row, col)]
    if level:
        children = [list(trees(level - 1, 2 * row + y, 2 * col + x)) for y in (0, 1) for x in (0, 1)]
        yield from (sum(parts, []) for parts in itertools.product(*children))


def leaf_square(heights, camera, size, level, row, col):
    """Squared screen error of a leaf's posts, for the better diagonal.

    The posts of its last row and column belong to the leaves beside it, unless the map ends there.
    """
    rows, cols = heights.shape
    side, last = 1 << level, np.array(heights.shape) - 1
    sums = [0.0, 0.0]
    for diagonal, errors in enumerate(reference.quad_errors(heights, level) if level else ()):
        for y in range(side + (row * side + side == last[0])):
            for x in range(side + (col * side + side == last[1])):
                r, c = row * side + y, col * side + x
                point = np.array([[c, rows - 1 - r, heights[r, c]]])
                (px,), (seen,) = screen_shift_px(camera, size, point, np.array([errors[row, y, col, x]]), 0.1)
                sums[diagonal] += px * px * seen
    return min(sums)


@pytest.mark.parametrize("seed", range(3))
def test_reference_allocation_is_the_best_of_all_quadtrees(seed):
    rng = np.random.default_rng(seed)
    heights = rng.normal(size=(5, 5)) * rng.uniform(0, 2, (5, 5))
    camera, size = Camera((rng.uniform(0, 4), -3, 5), (2, 2.5, 0), 60.0), (64, 48)
    square = functools.cache(lambda *leaf: leaf_square(heights, camera, size, *leaf))
    every = [(2 * len(leaves), sum(square(*leaf) for leaf in leaves)) for leaves in trees(2, 0, 0)]
    assert len(every) == 17
    budgets = [2, 8, 14, 20, 26, 32]
    _, plain = pruned.pruned_quads(heights, (1.0, 1.0), camera, size, 0.1, budgets)
    seen = reference.screen_scale(pruned.view_of(camera, size, 0.1), reference.world_m(heights, (1.0, 1.0))).seen.sum()
    for budget, n, rms_px in zip(budgets, *plain, strict=True):
        assert n <= budget
        assert rms_px == pytest.approx(np.sqrt(min(e for m, e in every if m <= n) / seen), rel=1e-9, abs=1e-12)
    assert plain.rms_px[-1] == 0


def test_reference_allocation_restricted_is_never_better_than_plain():
    heightmap = MAPS["odd"]()
    heights, void = heightmap.heights.astype("f8"), np.zeros(heightmap.heights.shape, bool)
    void[5:9, 3:30] = True
    budgets = [2, 100, 400, 1600, 10**9]
    for camera in cameras(heightmap).values():
        restricted, plain = pruned.pruned_quads(heights, heightmap.spacing_m, camera, (320, 180), 0.1, budgets, void)
        assert (plain.triangles <= budgets).all()
        assert (np.diff(plain.rms_px) <= 1e-12).all() and (np.diff(restricted.rms_px) <= 1e-12).all()
        assert (restricted.rms_px >= plain.rms_px * (1 - 1e-9)).all()
        assert plain.rms_px[-1] == restricted.rms_px[-1] == 0


def test_bands_of_a_map_are_its_whole_node_rows(monkeypatch):
    """Large maps are read in bands: the errors are the same, and every post is counted once."""
    heightmap = MAPS["odd"]()
    heights, camera = heightmap.heights.astype("f8"), cameras(heightmap)["default"]
    ask = (heightmap.spacing_m, camera, (320, 180), 0.1)
    whole = pruned.pruned_quads(heights, *ask, [50, 500])
    whole_bands = pruned.bands
    monkeypatch.setattr(pruned, "bands", lambda heights, level: whole_bands(heights, level, 1))
    assert len(pruned.bands(heights, 3)) == -(-(len(heights) - 1) // 8)
    for one, other in zip(whole, pruned.pruned_quads(heights, *ask, [50, 500]), strict=True):
        assert (one.triangles == other.triangles).all()
        assert one.rms_px == pytest.approx(other.rms_px, rel=1e-12)
