"""Figure of lesson 10: footprints of 8 × 8 cells: every normal, one renormalised normal, the mean vector."""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from terrain_gl import reference


def alpine():
    """A part of the bundled map, and its spacing."""
    folder = Path(__file__).parents[3] / "heightmaps"
    known = json.loads((folder / "maps.json").read_text())["alpine-30m"]
    return plt.imread(folder / "alpine-30m.png")[300:813, 300:941] * 65535.0 * known["z_scale"], known["spacing_m"]


def main(path):
    """Draw the three pictures and A(κ)."""
    heights, spacing_m = alpine()
    normals = reference.normals_of(heights, (spacing_m, spacing_m))
    light = np.array([-0.6, 0.5, 0.9]) / np.linalg.norm([-0.6, 0.5, 0.9])
    rows, cols = (n // 8 for n in normals.shape[:2])
    blocks = normals[: 8 * rows, : 8 * cols].reshape(rows, 8, cols, 8, 3)
    mean = blocks.mean((1, 3))
    every = np.maximum(blocks @ light, 0).mean((1, 3))
    unit = np.maximum(mean @ light, 0) / np.linalg.norm(mean, axis=-1)
    panels = {
        "every normal, then the mean": every,
        f"renormalised: {100 * (unit.mean() / every.mean() - 1):+.1f} % light": unit,
        f"mean vector: {100 * (np.maximum(mean @ light, 0).mean() / every.mean() - 1):+.1f} % light": np.maximum(
            mean @ light, 0
        ),
    }
    figure, axes = plt.subplots(1, 4, figsize=(14, 3), constrained_layout=True)
    for ax, (title, values) in zip(axes, panels.items()):
        ax.imshow(values, cmap="gray", vmin=0, vmax=1)
        ax.set(title=title, xticks=[], yticks=[])
    kappa = np.geomspace(0.05, 500, 200)
    axes[3].semilogx(kappa, 1 / np.tanh(kappa) - 1 / kappa)
    axes[3].set(title="length of the mean vector", xlabel="sharpness κ", ylabel="A(κ)")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
