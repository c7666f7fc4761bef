"""Figure of lesson 9: the error against the number of triangles, for greedy trees, price trees and the best trees."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land, spike

truth = load(Path(__file__).parent / "check.py")


def curve(squares, best, axis, title):
    """One panel: root mean square error over the number of triangles."""
    posts = (len(squares[0]) + 1) ** 2
    numbers = np.flatnonzero(np.isfinite(best))
    numbers = numbers[: np.argmin(best[numbers]) + 1]
    axis.plot(2 * numbers, np.sqrt(best[numbers] / posts), color="0.6", linewidth=4, label="best of all trees")
    chosen = np.array(truth.hull(best))
    axis.plot(2 * chosen[:, 0], np.sqrt(chosen[:, 1] / posts), "o", markersize=4, label="a price chooses these")
    counts = np.unique(np.geomspace(2, 2 * numbers[-1], 60).astype(int))
    spent = [truth.true_totals(squares, truth.true_greedy(squares, n)) for n in counts]
    axis.step(counts, [np.sqrt(e / posts) for _, e in spent], where="post", label="greedy, from the root")
    axis.set(title=title, xlabel="triangles", ylabel="rms error, metres", xscale="log")
    axis.legend()


def main(path):
    """Draw both panels."""
    rng = np.random.default_rng(4)
    plain = spike(np.full((33, 33), 100.0) + rng.normal(0, 0.1, (33, 33)), rng)
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.2), constrained_layout=True)
    maps = {"land with a cliff and a spike": spike(land(rng, 33, 33), rng), "a spike in a plain": plain}
    for axis, (title, heights) in zip(axes, maps.items(), strict=True):
        squares = truth.tree_of(heights)
        curve(squares, truth.least_errors(squares), axis, title)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
