"""Figure of lesson 6: a balanced quadtree and right triangles for the same land."""

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
    """Draw both trees."""
    rng = np.random.default_rng(8)
    heights = spike(land(rng, 65, 65), rng)
    tolerance = 30.0
    right = triangles(truth.true_rtin(heights), tolerance)
    leaves = tree(truth.node_errors(heights), tolerance)
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.8), constrained_layout=True)
    shown = (
        (f"quadtree, balanced: {len(leaves)} leaves", squares(leaves)),
        (f"right triangles (RTIN): {len(right)} triangles", right),
    )
    for ax, (title, lines) in zip(axes, shown, strict=True):
        ax.imshow(heights, cmap="gist_earth", extent=(0, 64, 64, 0), alpha=0.75)
        ax.add_collection(LineCollection(lines, colors="k", linewidths=0.5))
        ax.set(title=title, xlim=(0, 64), ylim=(64, 0), xticks=[], yticks=[])
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
