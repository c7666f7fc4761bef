"""Check of lesson 9: against the best of all trees with as many leaves, found by brute force."""

import heapq

import numpy as np

from course.checking import at_most, compare, holds, task
from course.land import land, spike
from course.truths import private, referee
from terrain_gl import reference

TITLE = "Budgets"


@private
def tree_of(heights):
    """Squared errors of the quads of all levels; cells of the map have none."""
    found = [np.zeros(tuple(n - 1 for n in heights.shape))]
    for level in range(1, int(np.log2(len(heights) - 1)) + 1):
        own = [axis.own for axis in reference.node_axes(heights.shape, level)]
        errors = np.maximum(*map(np.abs, reference.quad_errors(heights, level)))
        found.append(np.square(errors * own[0][:, :, None, None] * own[1]).sum((1, 3)))
    return found


def trees(rng):
    """Land, a spike in a plain, land with a spike, and numbers without land."""
    plain = spike(np.full((17, 17), 100.0) + rng.normal(0, 0.1, (17, 17)), rng)
    return {
        "land": tree_of(land(rng, 33, 33)),
        "a spike in a plain": tree_of(plain),
        "both": tree_of(spike(land(rng, 33, 33), rng)),
        "a good root over bad children": [
            np.zeros((8, 8)),
            *(rng.exponential(300, (n, n)) for n in (4, 2)),
            np.ones((1, 1)),
        ],
    }


def both(a, b):
    """Least errors of two subtrees together, for each number of leaves, from the least errors of each."""
    found = np.full(len(a) + len(b) - 1, np.inf)
    for n in np.flatnonzero(np.isfinite(a)):
        found[n : n + len(b)] = np.minimum(found[n : n + len(b)], a[n] + b)
    return found


@private
def least_errors(squares):
    """The least squared error of all trees with n leaves, for every n; infinite if there is no such tree."""
    best = [[np.array([np.inf, e]) for e in row] for row in squares[0]]
    for square in squares[1:]:
        upper = []
        for y, row in enumerate(square):
            upper.append([])
            for x, own in enumerate(row):
                four = [best[2 * y + k // 2][2 * x + k % 2] for k in range(4)]
                joined = both(both(four[0], four[1]), both(four[2], four[3]))
                joined[1] = own
                upper[-1].append(joined)
        best = upper
    return best[0][0]


def hull(best):
    """Numbers of leaves on the lower convex hull: the trees that a price can choose."""
    points = [(n, e) for n, e in enumerate(best) if np.isfinite(e)]
    found = []
    for n, e in points:
        while len(found) > 1 and (found[-1][1] - found[-2][1]) * (n - found[-2][0]) >= (e - found[-2][1]) * (
            found[-1][0] - found[-2][0]
        ):
            found.pop()
        found.append((n, e))
    lowest = min(range(len(found)), key=lambda i: found[i][1])
    return found[: lowest + 1]


@private
def true_totals(squares, splits):
    """Triangles and squared error of a tree."""
    exists, triangles, error = np.ones((1, 1), bool), 0, 0.0
    for square, split in zip(squares[::-1], splits[::-1], strict=True):
        triangles += 2 * int((exists & ~split).sum())
        error += float(square[exists & ~split].sum())
        exists = split.repeat(2, 0).repeat(2, 1)
    return triangles, error


@referee("totals")
def totals_of(student, squares, splits):
    """Triangles and squared error of a student's tree."""
    return true_totals(squares, splits)


def costs(student, squares, splits):
    """Triangles and squared error of a student's tree, or None if it is no tree."""
    splits = [np.asarray(s, bool) for s in splits]
    if [s.shape for s in splits] != [s.shape for s in squares] or splits[0].any():
        return None
    if any((fine & ~coarse.repeat(2, 0).repeat(2, 1)).any() for fine, coarse in zip(splits, splits[1:], strict=False)):
        return None
    return totals_of(student, squares, splits)


NO_TREE = "these splits are no tree: a shape differs, a cell is split, or a node whose parent is not"


@task("9.1 triangles and error of a tree", points=2)
def totals(student, rng):
    """Tested on random trees."""
    for name, squares in trees(rng).items():
        splits, exists = [], np.ones((1, 1), bool)
        for j in range(len(squares) - 1, -1, -1):
            splits.insert(0, exists & (rng.random(exists.shape) < 0.7) & (j > 0))
            exists = splits[0].repeat(2, 0).repeat(2, 1)
        want = true_totals(squares, splits)
        triangles, error = student.totals(squares, splits)
        yield compare(f"{name}: triangles", triangles, want[0])
        yield compare(f"{name}: squared error", error, want[1])
        nothing = [np.zeros(s.shape, bool) for s in squares]
        want = true_totals(squares, nothing)
        yield compare(f"{name}: the root alone", student.totals(squares, nothing), want)


@private
def true_greedy(squares, triangles):
    """The splits of the greedy method."""
    splits = [np.zeros(s.shape, bool) for s in squares]
    leaves, count = [(0.0, 1 - len(squares), 0, 0)], 2
    while leaves and count + 6 <= triangles:
        _, minus, y, x = heapq.heappop(leaves)
        splits[-minus][y, x], count, j = True, count + 6, -minus - 1
        for v, u in ((2 * y + k // 2, 2 * x + k % 2) for k in range(4 if j else 0)):
            gain = squares[j][v, u] - squares[j - 1][2 * v : 2 * v + 2, 2 * u : 2 * u + 2].sum()
            heapq.heappush(leaves, (-gain, -j, v, u))
    return splits


@task("9.2 greedy, from the root down", points=2)
def greedy(student, rng):
    """The leaf with the largest gain must be split, not the leaf with the largest error."""
    for name, squares in trees(rng).items():
        for triangles in (2, 62, 301):  # a tree can have 62 triangles, but not 301
            want = true_greedy(squares, triangles)
            got = student.greedy(squares, triangles)
            found = costs(student, squares, got)
            yield holds(f"{name}, {triangles} triangles", found is not None, NO_TREE)
            if found is not None:
                flat = [np.concatenate([np.asarray(s, bool).ravel() for s in each]).astype(int) for each in (got, want)]
                yield compare(f"{name}, {triangles} triangles: splits", *flat, axes=("node",))


@task("9.3 the best tree at a price", points=3)
def prune(student, rng):
    """The tree's cost must be the least of all trees."""
    for name, squares in trees(rng).items():
        best = least_errors(squares)
        for price in np.exp(rng.uniform(-3, 11, 6)):
            found = costs(student, squares, student.prune(squares, float(price)))
            title = f"{name}, price {price:.3g}"
            yield holds(title, found is not None, NO_TREE)
            if found is not None:
                least = (best + 2 * price * np.arange(len(best)))[1:].min()
                yield compare(f"{title}: squared error + price x triangles", found[1] + price * found[0], least)


@task("9.4 so many triangles", points=3)
def budget(student, rng):
    """The tree must keep to the budget, and have no more error than the best tree that a price can choose."""
    for name, squares in trees(rng).items():
        best = least_errors(squares)
        chosen = hull(best)
        exactly = 2 * chosen[len(chosen) // 2][0]  # a number of triangles that a price can give
        for triangles in (2, 30, 100, 333, 1000, exactly):
            found = costs(student, squares, student.budget(squares, triangles))
            title = f"{name}, {triangles} triangles"
            yield holds(title, found is not None, NO_TREE)
            if found is not None:
                yield at_most(f"{title}: their number", found[0], triangles)
                want = min(e for n, e in chosen if 2 * n <= triangles)
                yield at_most(f"{title}: squared error", found[1], want + 1e-9 * best[1])
