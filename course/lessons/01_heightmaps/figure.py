"""Figure of lesson 1: a map lit from the north-west, the same map mirrored, and voids filled."""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from terrain_gl import reference

truth = load(Path(__file__).parent / "check.py")


def alpine():
    """A part of the bundled map, and its spacing."""
    folder = Path(__file__).parents[3] / "heightmaps"
    known = json.loads((folder / "maps.json").read_text())["alpine-30m"]
    heights = plt.imread(folder / "alpine-30m.png")[300:540, 300:620] * 65535.0
    return heights * known["z_scale"], (known["spacing_m"], known["spacing_m"])


def shade(heights, spacing):
    """Brightness for a light in the north-west."""
    light = np.array([-1, 1, 2.5]) / np.sqrt(8.25)
    return np.maximum(reference.normals_of(heights, spacing) @ light, 0)


def main(path):
    """Draw the three pictures."""
    heights, spacing = alpine()
    void = np.zeros(heights.shape, bool)
    void[120:150, 160:210] = True
    panels = {
        "row 0 is the north edge": shade(heights, spacing),
        "row 0 taken for the south: mirrored": shade(heights[::-1], spacing),
        "a void of 30 x 50 posts, filled": shade(truth.harmonic(heights, void), spacing),
    }
    figure, axes = plt.subplots(1, 3, figsize=(13, 3.7), constrained_layout=True)
    for ax, (title, values) in zip(axes, panels.items(), strict=True):
        ax.imshow(values, cmap="gray", vmin=0, vmax=1)
        ax.set(title=title, xticks=[], yticks=[])
    axes[2].add_patch(plt.Rectangle((160, 120), 50, 30, fill=False, edgecolor="r", linewidth=0.8))
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
