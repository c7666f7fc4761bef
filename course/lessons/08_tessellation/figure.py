"""Figure of lesson 8: what the driver makes of a patch, and how far float positions are from posts. It needs OpenGL."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course import solving
from course.box import shaders


def texts():
    """The shaders of the solution, and of the wrong answer that computes positions in floats."""
    found = []
    folder = Path(__file__).parent
    floats = next(wrong.text for wrong in solving.wrong_answers(folder) if wrong.name == "floats")
    for text in (solving.clean(solving.solution(folder).read_text(encoding="utf-8")), floats):
        names = {}
        exec(text, names)
        found.append(names["shaders"]())
    return found


def main(path):
    """Draw two patches and the errors."""
    right, floats = texts()
    heights = np.zeros((61, 61), np.float32)
    figure, axes = plt.subplots(1, 3, figsize=(13, 3.9), constrained_layout=True)
    for ax, edges, title in (
        (axes[0], (5, 5, 5, 5), "5 segments everywhere"),
        (axes[1], (10, 5, 5, 5), "10 segments in the north, 5 elsewhere"),
    ):
        square = np.array([[0, 0, 60, 1]], np.int32)
        mesh = shaders.mesh(
            right["control"], right["evaluation"], heights, square, np.array([edges], np.int32), np.array([5], np.int32)
        )
        for triangle in mesh:
            ax.plot(*np.append(triangle, triangle[:1], 0)[:, :2].T, "k", linewidth=0.8)
        ax.plot(*np.unique(mesh.reshape(-1, 3)[:, :2], axis=0).T, "C0o", markersize=4)
        ax.set(title=title, aspect="equal", ylim=(62, -2), xlabel="column", ylabel="row")
    segments = np.arange(2, 65)
    off = []
    for n in segments.tolist():
        square = np.array([[100 * n, 0, n, 1]], np.int32)
        wide = np.zeros((n + 1, 101 * n + 1), np.float32)
        mesh = shaders.mesh(
            None, floats["evaluation"], wide, square, np.ones((1, 4), np.int32), np.array([n], np.int32)
        )
        places = mesh[..., :2].astype(float)
        off.append(float(np.mean(places != np.rint(places))))
    axes[2].bar(segments, 100 * np.array(off), width=0.8)
    driver = shaders.renderer(shaders.TESSELLATION).split(" (")[0]
    axes[2].set(
        title=f"positions in floats: coordinates off their posts\n({driver})",
        xlabel="segments",
        ylabel="per cent",
    )
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
