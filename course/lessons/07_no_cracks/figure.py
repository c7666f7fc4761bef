"""Figure of lesson 7: a mesh with T-junctions from above, the crack from the side, and the mesh repaired."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load

truth = load(Path(__file__).parent / "check.py")


def repaired(places, triangles):
    """Triangles cut at the vertices on their edges."""
    found, todo = [], triangles.tolist()
    while todo:
        t = todo.pop()
        for k in range(3):
            p, q, r = t[k], t[(k + 1) % 3], t[(k + 2) % 3]
            along, to = places[q] - places[p], places - places[p]
            share = to @ along / (along @ along)
            inside = np.flatnonzero((to[:, 0] * along[1] == to[:, 1] * along[0]) & (share > 0) & (share < 1))
            if len(inside):
                todo += [[p, inside[0], r], [inside[0], q, r]]
                break
        else:
            found.append(t)
    return np.array(found)


def main(path):
    """Draw the three panels."""
    vertices, triangles, places = truth.broken(np.random.default_rng(12))
    loose = np.array(truth.true_open(triangles))
    inner = loose[~truth.rim(loose, places)]
    figure, (before, side, after) = plt.subplots(1, 3, figsize=(13, 4.2), constrained_layout=True)
    for ax, mesh, title in (
        (before, triangles, "red: edges inside that one triangle uses"),
        (after, repaired(places, triangles), "repaired"),
    ):
        ax.triplot(places[:, 0], places[:, 1], mesh, color="k", linewidth=0.7)
        ax.set(title=title, aspect="equal", xticks=[], yticks=[], ylim=(16.3, -0.3))
    for a, b in inner:
        before.plot(*places[[a, b]].T, "r", linewidth=1.5)
    x = np.array([0.0, 1, 2])
    h = np.array([1.0, 2.2, 1.6])
    side.plot(x[[0, 2]], h[[0, 2]], "C0", label="the coarse triangle's edge")
    side.plot(x, h, "C1", label="the two fine triangles' edges")
    side.fill(x, h, color="r", alpha=0.25)
    side.text(0.95, 1.65, "crack", color="r")
    side.plot(x, h, "ko")
    side.set(title="a T-junction from the side", xticks=[], yticks=[], ylim=(0.6, 2.6))
    side.legend(loc="lower right")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
