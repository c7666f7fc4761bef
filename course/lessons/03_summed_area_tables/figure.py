"""Figures of lesson 3: the four corners of a box, and how wrong float32 is over a map."""

import sys

import numpy as np
from matplotlib import pyplot as plt


def heights(n):
    """16-bit heights of a slope with noise, n × n, whole numbers."""
    rng = np.random.default_rng(1)
    y, x = np.indices((n, n))
    return np.round(20000 + 0.5 * 40000 * (x + y) / n + rng.normal(0, 200, (n, n))).clip(0, 65535)


def errors(n, box=9, samples=40000):
    """Difference of box means by float32 sums and by exact sums, in steps of the heights."""
    h = heights(n)
    rng = np.random.default_rng(2)
    x, y = rng.integers(0, n - box, (2, samples))
    means = []
    for dtype in (np.float32, np.float64):
        table = np.pad(h.astype(dtype).cumsum(0, dtype=dtype).cumsum(1, dtype=dtype), ((1, 0), (1, 0)))
        sums = table[y + box, x + box] - table[y, x + box] - table[y + box, x] + table[y, x]
        means.append(sums / box**2)
    return x, y, means[0].astype(float) - means[1]


def main(path):
    """Draw a box with its four corners, and the errors of float32 over the map."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.3), constrained_layout=True)
    left.set(xlim=(0, 10), ylim=(8, 0), xlabel="column", ylabel="row", title="box = S(b) - S(top) - S(left) + S(a)")
    for x, y, colour in ((8, 6, "C0"), (8, 2, "C1"), (3, 6, "C2"), (3, 2, "C3")):
        left.add_patch(plt.Rectangle((0, 0), x, y, facecolor=colour, alpha=0.18))
    left.add_patch(plt.Rectangle((3, 2), 5, 4, fill=False, edgecolor="k", linewidth=2))
    for x, y, name in ((8, 6, "+ S(x1, y1)"), (8, 2, "- S(x1, y0)"), (3, 6, "- S(x0, y1)"), (3, 2, "+ S(x0, y0)")):
        left.plot(x, y, "ko")
        left.annotate(name, (x, y), xytext=(6, -14), textcoords="offset points")
    n = 4096
    x, y, wrong = errors(n)
    shown = right.scatter(x, y, c=np.abs(wrong), s=1, vmax=20, cmap="magma")
    figure.colorbar(shown, ax=right, label="steps of the 16-bit heights")
    right.set(
        xlim=(0, n),
        ylim=(n, 0),
        title=f"means of 9 x 9 posts in float32:\n{(np.abs(wrong) > 0.5).mean():.0%} are off by over half a step",
    )
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
