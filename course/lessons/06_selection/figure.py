"""Figure of lesson 6: a clipmap, a balanced quadtree and right triangles for the same land."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land, spike
from terrain_gl import reference

truth = load(Path(__file__).parent / "check.py")


def squares(boxes):
    """Outlines of squares x, y, side."""
    return [[(x, y), (x + s, y), (x + s, y + s), (x, y + s), (x, y)] for x, y, s in boxes]


def rings(eye, cells, levels, size):
    """Squares of a clipmap, x, y, side."""
    found = []
    hole = (0, 0, 0, 0)
    for level in range(levels):
        side, step = 1 << level, 2 << level
        x0, y0 = (step * int(np.floor((at - 0.5 * cells * side) / step + 0.5)) for at in eye)
        for y in range(y0, y0 + cells * side, side):
            for x in range(x0, x0 + cells * side, side):
                if not (hole[0] <= x < hole[2] and hole[1] <= y < hole[3]):
                    found.append((x, y, side))
        hole = (x0, y0, x0 + cells * side, y0 + cells * side)
    return found


def tree(errors, tolerance):
    """Leaves of the balanced quadtree, x, y, side."""
    splits = reference.unsplit((65, 65), 6)
    reference.grow(splits, [level > tolerance for level in errors])
    reference.balance(splits)
    found = []
    for j, exists in enumerate(reference.existing(splits)):
        rows, cols = np.nonzero(exists & ~splits[j])
        found += [(x << j, y << j, 1 << j) for x, y in zip(cols.tolist(), rows.tolist())]
    return found


def triangles(errors, tolerance):
    """Outlines of the right triangles."""
    found, last = [], len(errors) - 1

    def visit(a, b, c):
        m = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        if m[0] % 1 == 0 and m[1] % 1 == 0 and errors[int(m[1]), int(m[0])] > tolerance:
            visit(c, a, m)
            visit(b, c, m)
        else:
            found.append([a, b, c, a])

    visit((0, 0), (last, last), (last, 0))
    visit((last, last), (0, 0), (0, last))
    return found


def main(path):
    """Draw the three."""
    rng = np.random.default_rng(8)
    heights = spike(land(rng, 65, 65), rng)
    tolerance = 30.0
    right = triangles(truth.true_rtin(heights), tolerance)
    leaves, ring = tree(truth.node_errors(heights), tolerance), rings((30.3, 27.9), 12, 4, 65)
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.6), constrained_layout=True)
    shown = (
        (f"clipmap: rings around the eye, {len(ring)} squares", squares(ring)),
        (f"quadtree, balanced: {len(leaves)} leaves", squares(leaves)),
        (f"right triangles (RTIN): {len(right)} triangles", right),
    )
    for ax, (title, lines) in zip(axes, shown, strict=True):
        ax.imshow(heights, cmap="gist_earth", extent=(0, 64, 64, 0), alpha=0.75)
        ax.add_collection(LineCollection(lines, colors="k", linewidths=0.5))
        ax.set(title=title, xlim=(0, 64), ylim=(64, 0), xticks=[], yticks=[])
    axes[0].plot(30.3, 27.9, "r+", markersize=12)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
