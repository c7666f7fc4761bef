"""Figure of lesson 13: plain rings, the clipmap that the tables steer, and a balanced quadtree, at equal tolerance."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import PolyCollection

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land
from terrain_gl import reference
from terrain_gl.reference import rings

truth = load(Path(__file__).parent / "check.py")
LAST, EYE, BLOCKS, RINGS, TOP = 256, (118.0, 131.0), 2, 5, 6
METRES_AWAY = 0.4  # of error for each post of distance: the tolerance of one pixel of some camera


def tolerance_m(low, side):
    """The tolerance at the place of a square that is nearest to the eye."""
    away = [max(at - e, e - at - side, 0.0) for at, e in zip(low, EYE, strict=True)]
    return METRES_AWAY * max(np.hypot(*away), 4.0)


def cell_errors(heights):
    """C of the cells of each level, at the posts; level 0 has all posts, and no error."""
    return [np.zeros((LAST, LAST))] + [truth.true_cut_errors(heights, level) for level in range(1, TOP + 1)]


def largest(errors, low, side, step):
    """The largest error of the cells of a spacing that meet a square."""
    x, y = (max(at, 0) >> max(step, 0) for at in low)
    x1, y1 = (-(-min(at + side, LAST) >> max(step, 0)) for at in low)
    return errors[max(step, 0)][y:y1, x:x1].max()


def drawn(level):
    """The place of a ring, and its units that are drawn and on the map."""
    n = 8 * BLOCKS
    origin = rings.ring_origin(EYE, (BLOCKS, BLOCKS), level)
    x, y = (np.arange(n) * (1 << level) + at for at in origin)
    found = ((y > -(1 << level)) & (y < LAST))[:, None] & ((x > -(1 << level)) & (x < LAST))
    if level:
        hole = (np.array(rings.ring_origin(EYE, (BLOCKS, BLOCKS), level - 1)) - origin) >> level
        found[hole[1] : hole[1] + n // 2, hole[0] : hole[0] + n // 2] = False
    return origin, found


def plain():
    """Every unit of every ring as 2 × 2 segments, and by its posts in the finest: x, y, log2 of side and of spacing."""
    found = []
    for level in range(RINGS):
        (x0, y0), units = drawn(level)
        found += [
            (x0 + (x << level), y0 + (y << level), level, max(level - 1, 0)) for y, x in np.argwhere(units).tolist()
        ]
    return found


def steered(errors):
    """The same rings, cut into squares that keep the tolerance."""
    found = []
    for level in range(RINGS):
        (x0, y0), units = drawn(level)
        for row, col in np.ndindex(BLOCKS, BLOCKS):
            own = units[row * 8 : row * 8 + 8, col * 8 : col * 8 + 8]
            corner, steps = (x0 + (8 * col << level), y0 + (8 * row << level)), {}
            for depth in range(4):
                n = 8 >> depth
                for y, x in np.ndindex(1 << depth, 1 << depth):
                    part = own[y * n : y * n + n, x * n : x * n + n]
                    if not part.any():
                        continue
                    low, log2 = (corner[0] + (n * x << level), corner[1] + (n * y << level)), level + 3 - depth
                    allowed = tolerance_m(low, 1 << log2)
                    holds = lambda step: largest(errors, low, 1 << log2, step) <= allowed  # noqa: E731, B023
                    coarsest, finest = rings.coarsest_step(low, log2, TOP), rings.finest_step(log2, level)
                    steps[depth, x, y] = rings.next_step(coarsest, finest, holds) if part.all() or depth == 3 else None
            leaves = rings.cut_block(steps, level, can_refine=False)
            for y, x in np.ndindex(8, 8):
                size, step = leaves[y, x].tolist()
                if size >= 0 and x % (1 << size) == y % (1 << size) == 0:
                    found.append((corner[0] + (x << level), corner[1] + (y << level), level + size, step))
    return found


def quadtree(errors):
    """The leaves of a balanced quadtree, each as 2 × 2 segments."""
    splits = reference.unsplit((LAST + 1, LAST + 1), 8)
    over = [np.zeros((LAST, LAST), bool)]
    for j in range(1, 9):
        side = 1 << j
        over.append(np.zeros((LAST >> j, LAST >> j), bool))
        for y, x in np.ndindex(over[j].shape):
            low = (x << j, y << j)
            over[j][y, x] = j > TOP + 1 or largest(errors, low, side, j - 1) > tolerance_m(low, side)
    reference.grow(splits, over)
    reference.balance(splits)
    found = []
    for j, exists in enumerate(reference.existing(splits)):
        rows, cols = np.nonzero(exists & ~splits[j])
        found += [(x << j, y << j, j, j - 1) for x, y in zip(cols.tolist(), rows.tolist(), strict=True)]
    return found


def worst(squares, errors):
    """Squares over tolerance, and the largest error in tolerances."""
    ratios = np.array([largest(errors, s[:2], 1 << s[2], s[3]) / tolerance_m(s[:2], 1 << s[2]) for s in squares])
    return int((ratios > 1).sum()), float(ratios.max())


def triangles(squares):
    """The triangles of patches of T × T segments."""
    return sum(2 * 4 ** (side - step) for _, _, side, step in squares)


def main(path):
    """Draw the three methods."""
    heights = land(np.random.default_rng(8), LAST + 1, LAST + 1)
    errors = cell_errors(heights)
    methods = {"plain rings": plain(), "the tables steer": steered(errors), "balanced quadtree": quadtree(errors)}
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.9), constrained_layout={"h_pad": 0.12})
    for ax, (name, squares) in zip(axes, methods.items(), strict=True):
        over, ratio = worst(squares, errors)
        told = f"{triangles(squares)} triangles, {over} squares over, worst {ratio:.1f} ×"
        boxes = [[(x, y), (x + (1 << s), y), (x + (1 << s), y + (1 << s)), (x, y + (1 << s))] for x, y, s, _ in squares]
        ax.add_collection(
            PolyCollection(
                boxes,
                array=[step for *_, step in squares],
                cmap="viridis_r",
                clim=(-2, 5),
                edgecolors="k",
                linewidths=0.3,
            )
        )
        ax.set(title=f"{name}: {len(squares)} squares\n{told}")
        ax.set(xlim=(0, LAST), ylim=(LAST, 0), xticks=[], yticks=[], aspect="equal")
        ax.plot(*EYE, "r+", markersize=12)
        print(f"{name}: {len(squares)} squares, {triangles(squares)} triangles, {over} over, worst {ratio:.2f}")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
