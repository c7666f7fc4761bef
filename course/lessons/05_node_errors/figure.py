"""Figure of lesson 5: a node as quad and as fan, and how often a node's error is below its child's."""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from terrain_gl import reference

truth = load(Path(__file__).parent / "check.py")


def bundled(name):
    """1025 x 1025 posts of a bundled map, metres."""
    folder = Path(__file__).parents[3] / "heightmaps"
    known = json.loads((folder / "maps.json").read_text())[name]
    return plt.imread(folder / known["file"])[:1025, :1025] * 65535.0 * known["z_scale"]


def shares(heights, levels):
    """For each level, the share of nodes that have a smaller error than one of their children."""
    fine, found = np.abs(reference.twists(heights)) / 4, []
    for level in levels:
        coarse = np.zeros(tuple((n - 1) >> level for n in heights.shape))
        for row in range(len(coarse)):  # row by row: a node's posts are held in memory
            band = heights[row << level : ((row + 1) << level) + 1]
            coarse[row] = truth.true_quads(band, level)
        found.append(float((coarse < reference.max_children(fine, coarse.shape)).mean()))
        fine = coarse
    return found


def main(path):
    """Draw the quad, the fan and the shares."""
    figure, axes = plt.subplots(1, 4, figsize=(13, 3.4), constrained_layout=True, width_ratios=[1, 1, 1, 1.6])
    square = ([0, 4, 4, 0, 0], [0, 0, 4, 4, 0])
    shown = {
        "quad, falling diagonal": [([0, 4], [4, 0])],
        "quad, rising diagonal": [([0, 4], [0, 4])],
        "fan: four wedges": [([0, 4], [4, 0]), ([0, 4], [0, 4])],
    }
    y, x = np.indices((5, 5))
    for ax, (title, lines) in zip(axes, shown.items()):
        for line in [square, *lines]:
            ax.plot(*line, "k", linewidth=1)
        ax.plot(x, y, "C0o", markersize=4)
        ax.set(title=title, aspect="equal", xticks=[], yticks=[])
    levels = (1, 2, 3, 4, 5)
    for name in ("alpine-30m", "canyon-15m"):
        axes[3].plot(levels, 100 * np.array(shares(bundled(name), levels)), "o-", label=name)
    axes[3].set(
        title="nodes with less error than a child", xlabel="level", ylabel="per cent", ylim=(0, None), xticks=levels
    )
    axes[3].legend()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
