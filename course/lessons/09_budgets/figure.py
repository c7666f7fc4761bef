"""Figure of lesson 9: the error against the number of triangles, for greedy trees, price trees and the best trees.

It also prints how far both greedy ways are from the best.

Run: python course/lessons/09_budgets/figure.py figure.png
"""

import heapq
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land, spike

truth = load(Path(__file__).parent / "check.py")


def nested(squares):
    """For each node, the largest error of itself and of all nodes below it."""
    found = [squares[0]]
    for square in squares[1:]:
        low = found[-1]
        found.append(np.maximum.reduce([square, low[::2, ::2], low[1::2, ::2], low[::2, 1::2], low[1::2, 1::2]]))
    return found


def nested_greedy(squares, triangles):
    """The splits of a greedy way that splits the leaf with the largest nested error."""
    errors, splits = nested(squares), [np.zeros(square.shape, bool) for square in squares]
    leaves, count = [(0.0, len(squares) - 1, 0, 0)], 2
    while leaves and count + 6 <= triangles:
        _, j, y, x = heapq.heappop(leaves)
        splits[j][y, x], count = True, count + 6
        for v, u in ((2 * y + k // 2, 2 * x + k % 2) for k in range(4 if j > 1 else 0)):
            heapq.heappush(leaves, (-errors[j - 1][v, u], j - 1, v, u))
    return splits


def away(squares, best, way):
    """How many times as large as the best root mean square error a way's is, for each number of triangles."""
    numbers = np.flatnonzero(np.isfinite(best))
    numbers = numbers[1 : np.argmin(best[numbers])]
    errors = np.array([truth.true_totals(squares, way(squares, 2 * n))[1] for n in numbers])
    return np.sqrt(errors / best[numbers])


def curve(squares, best, axis, title):
    """One panel: root mean square error over the number of triangles."""
    posts = (len(squares[0]) + 1) ** 2
    numbers = np.flatnonzero(np.isfinite(best))
    numbers = numbers[: np.argmin(best[numbers]) + 1]
    axis.plot(2 * numbers, np.sqrt(best[numbers] / posts), color="0.6", linewidth=4, label="best of all trees")
    chosen = np.array(truth.hull(best))
    axis.plot(2 * chosen[:, 0], np.sqrt(chosen[:, 1] / posts), "o", markersize=4, label="a price chooses these")
    counts = np.unique(np.geomspace(2, 2 * numbers[-1], 60).astype(int))
    for way, label in ((truth.true_greedy, "greedy by the gain"), (nested_greedy, "greedy by nested errors")):
        spent = [truth.true_totals(squares, way(squares, n)) for n in counts]
        axis.step(counts, [np.sqrt(e / posts) for _, e in spent], where="post", label=label)
        times = away(squares, best, way)
        print(f"{title}, {label}: {np.median(times):.2f} times the best error, {times.max():.3g} at most")
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
