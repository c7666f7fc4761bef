"""Figure of lesson 12: a grid and a quadtree over the same land: fair curves, and two unfair pairs of points."""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load

budgets = load(Path(__file__).parents[1] / "09_budgets" / "check.py")


def pruned(squares, price):
    """Triangles and squared error of the best tree at a price."""
    best, count = squares[0] + 2 * price, np.full(squares[0].shape, 2)
    for square in squares[1:]:
        n = len(square)
        parts, own = best.reshape(n, 2, n, 2).sum((1, 3)), square + 2 * price
        count = np.where(parts < own, count.reshape(n, 2, n, 2).sum((1, 3)), 2)
        best = np.minimum(parts, own)
    return int(count[0, 0]), float(best[0, 0] - price * count[0, 0])


def main(path):
    """Draw both curves."""
    folder = Path(__file__).parents[3] / "heightmaps"
    known = json.loads((folder / "maps.json").read_text())["canyon-15m"]
    heights = plt.imread(folder / known["file"])[128:385, 128:385] * 65535.0 * known["z_scale"]
    squares = budgets.tree_of(heights)
    posts = heights.size
    grid = [(2 * s.size, np.sqrt(s.sum() / posts)) for s in squares[1:7]][::-1]
    tree = sorted({pruned(squares, 2.0**k) for k in np.linspace(-2, 18, 24)})
    tree = [(n, np.sqrt(e / posts)) for n, e in tree if 2 * squares[6].size <= n <= 2 * squares[1].size]
    figure, ax = plt.subplots(figsize=(7.5, 4.6), constrained_layout=True)
    for points, name in ((grid, "regular grid"), (tree, "quadtree by a price")):
        ax.loglog(*zip(*points), "o-", label=name, markersize=4)
    a, b = tree[len(tree) // 2], grid[-1]
    ax.annotate("unfair: 'as good as the grid'", a, xytext=(a[0] / 9, a[1] / 3), arrowprops={"arrowstyle": "->"})
    ax.annotate(
        "unfair: 'more triangles, less error'", b, xytext=(b[0] / 25, b[1] / 2.2), arrowprops={"arrowstyle": "->"}
    )
    ax.set(
        xlabel="triangles",
        ylabel="achieved rms error, metres",
        title="the bundled canyon, 257 x 257 posts, from no eye",
    )
    ax.legend()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
