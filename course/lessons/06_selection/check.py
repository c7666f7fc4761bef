"""Check of lesson 6: the parts cover the map once, and nothing is finer than it must be."""

import numpy as np

from course.checking import areas, compare, holds, task
from course.land import land, spike
from course.truths import private
from terrain_gl import reference

TITLE = "Selection by trees"


@private
def node_errors(heights):
    """Errors of the nodes of all levels as quads, nested."""
    found = [np.zeros(tuple(n - 1 for n in heights.shape))]
    for level in range(1, int(np.log2(len(heights) - 1)) + 1):
        own = np.maximum(*(np.abs(e).max((1, 3)) for e in reference.quad_errors(heights, level)))
        found.append(np.maximum(own, reference.max_children(found[-1], own.shape)))
    return found


def quadtree(rng):
    """Errors of a quadtree's nodes, and tolerances that split much and little."""
    errors = node_errors(spike(land(rng, 65, 65), rng))
    return errors, [float(np.quantile(errors[2], share)) for share in (0.05, 0.5, 0.9)]


def as_lists(splits):
    """The splits of all levels as one array."""
    return np.concatenate([np.asarray(s, bool).ravel() for s in splits]).astype(int)


@private
def true_splits(errors, tolerance):
    """The nodes that are split, from the root down."""
    want = reference.unsplit((65, 65), 6)
    reference.grow(want, [level > tolerance for level in errors])
    return want


@private
def balanced(splits):
    """The fewest splits besides, so that neighbours are within one level."""
    want = [s.copy() for s in splits]
    reference.balance(want)
    return want


def leaf_levels(splits):
    """The level of the leaf over each cell."""
    leaf, exists = np.zeros((64, 64), int), np.ones((1, 1), bool)
    for j in range(len(splits) - 1, -1, -1):
        split = np.asarray(splits[j], bool)
        leaf += (exists & ~split).repeat(1 << j, 0).repeat(1 << j, 1) * (j + 1)
        exists = (exists & split).repeat(2, 0).repeat(2, 1)
    return leaf


@task("6.1 refine", points=2)
def refine(student, rng):
    """Only nodes that exist may be split."""
    errors, tolerances = quadtree(rng)
    loose = [e * rng.uniform(0.2, 1, e.shape) for e in errors]  # not nested: a child can be worse than its parent
    whole = [*loose[:-1], np.zeros((1, 1))]  # the root is good, its children are not: nothing is split
    names = "nested errors", "errors that are not nested", "a root within tolerance"
    for name, each in zip(names, (errors, loose, whole), strict=True):
        for tolerance in (*tolerances, float(errors[3].flat[5]), 1e9):  # one is a node's error itself
            want = true_splits(each, tolerance)
            yield compare(
                f"{name}, {tolerance:.3g} m", as_lists(student.refine(each, tolerance)), as_lists(want), axes=("node",)
            )


@task("6.2 balance", points=3)
def balance(student, rng):
    """Neighbours must be within one level, and no node may be split without need."""
    errors, tolerances = quadtree(rng)
    at = rng.integers(28, 36, 2)
    spot = [np.zeros(e.shape) for e in errors]  # one node is bad, deep in the tree, near its middle
    for j, level in enumerate(spot):
        level[at[0] >> j, at[1] >> j] = 1.0
    cases = {f"{tolerance:.3g} m": (errors, tolerance) for tolerance in tolerances}
    for name, (each, tolerance) in {**cases, "one bad node": (spot, 0.5)}.items():
        splits = true_splits(each, tolerance)
        want = balanced(splits)
        got = student.balance(splits)
        leaf = leaf_levels(got)
        steps = max(np.abs(np.diff(leaf, axis=axis)).max() for axis in (0, 1))
        yield holds(f"{name}: neighbours", steps <= 1, f"some neighbours are {steps} levels apart")
        yield compare(f"{name}: the splits", as_lists(got), as_lists(want), axes=("node",))


@private
def true_rtin(h):
    """Nested errors from the smallest squares up: middles of sides, then centres of squares."""
    last, e = len(h) - 1, np.zeros(h.shape)
    s = 2
    while s <= last:
        half = s // 2
        for t, k in ((h, e), (h.T, e.T)):  # middles of sides along x, then along y: views
            k[::s, half::s] = np.abs(t[::s, half::s] - 0.5 * (t[::s, :-1:s] + t[::s, s::s]))
            if half > 1:
                q = half // 2
                for dx in (-q, q):
                    inner = k[q::half, half + dx :: s]  # centres of the squares of half the size, above and below
                    k[s::s, half::s] = np.maximum(k[s::s, half::s], inner[1::2])
                    k[:-1:s, half::s] = np.maximum(k[:-1:s, half::s], inner[::2])
                    if s < last:
                        k[s:-1:s, half::s] = np.maximum(k[s:-1:s, half::s], inner[2::2])
        corner = {
            (i, j): h[i * s : last + i * s - s + 1 : s, j * s : last + j * s - s + 1 : s]
            for i in (0, 1)
            for j in (0, 1)
        }
        row, col = np.indices((last // s, last // s))
        falling = (row + col) % 2 == 0  # the diagonal runs through the parent's centre
        own = np.where(falling, corner[0, 0] + corner[1, 1], corner[0, 1] + corner[1, 0]) / 2
        sides = [e[half::s, :-1:s], e[half::s, s::s], e[:-1:s, half::s], e[s::s, half::s]]
        e[half::s, half::s] = np.maximum.reduce([np.abs(h[half::s, half::s] - own), *sides])
        s *= 2
    return e


def rtin_map(rng):
    """A square map of 33 posts with a spike."""
    return spike(land(rng, 33, 33), rng)


@task("6.3 the errors of right triangles", points=3)
def rtin_errors(student, rng):
    """Compared with `true_rtin`."""
    for heights in (rtin_map(rng), rng.normal(0, 10, (9, 9))):
        want = true_rtin(heights)
        yield compare(f"{len(heights)} posts a side", student.rtin_errors(heights), want, axes=("row", "column"))


@task("6.4 the mesh of right triangles", points=3)
def rtin_mesh(student, rng):
    """Triangles must cover the map once, without vertices inside edges, and be as few as possible."""
    heights = rtin_map(rng)
    errors = true_rtin(heights)
    inner = errors[1:-1, 1:-1]
    rim = np.concatenate([errors[0, 1:-1], errors[-1, 1:-1], errors[1:-1, 0], errors[1:-1, -1]])
    for tolerance_m in (float(np.quantile(inner, 0.2)), float(np.quantile(inner, 0.8)), 1e9):
        found = np.asarray(student.rtin_mesh(errors, tolerance_m))
        name = f"{tolerance_m:.3g} m"
        if found.ndim != 3 or found.shape[1:] != (3, 2):
            yield holds(name, False, f"expected the shape (n, 3, 2), got {found.shape}")
            continue
        area = np.abs(areas(found)).sum()
        yield compare(f"{name}: the area in cells", area, 32.0**2)
        edges = np.stack([found, np.roll(found, -1, 1)], 2).reshape(-1, 2, 2)
        ordered = np.sort(edges[..., 0] * 64 + edges[..., 1], 1)
        unique, uses = np.unique(ordered, axis=0, return_counts=True)
        ends = np.stack([unique // 64, unique % 64], -1)
        outer = ((ends[:, 0] == ends[:, 1]) & np.isin(ends[:, 0], (0, 32))).any(1)
        lonely = int((uses != np.where(outer, 1, 2)).sum())
        yield holds(f"{name}: edges", lonely == 0, f"{lonely} edges are not shared by two triangles: T-junctions")
        want = 2 + 2 * int((inner > tolerance_m).sum()) + int((rim > tolerance_m).sum())
        yield compare(f"{name}: triangles", len(found), want)
