"""Figure of lesson 11: horizons along a line with the hull, and the shadows of a map from one sweep."""

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
    return plt.imread(folder / "alpine-30m.png")[300:700, 300:900] * 65535.0 * known["z_scale"], known["spacing_m"]


def hull_from(heights, start):
    """Posts of the upper hull of what lies ahead of a post."""
    hull = []
    for i in range(len(heights) - 1, start, -1):
        while len(hull) > 1 and (heights[hull[-1]] - heights[i]) * (hull[-2] - i) <= (
            heights[hull[-2]] - heights[i]
        ) * (hull[-1] - i):
            hull.pop()
        hull.append(i)
    return hull[::-1]


def main(path):
    """Draw a line with its hull, and a map in a low western sun."""
    heights, spacing_m = alpine()
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 3.8), constrained_layout=True, width_ratios=[1.2, 1])
    profile, at = heights[150, :120], 4
    hull = hull_from(profile, at)
    left.fill_between(np.arange(120), profile, profile.min() - 20, color="0.85")
    left.plot(hull, profile[hull], "C0o-", markersize=4, linewidth=1, label="upper hull of what lies ahead")
    seen = (
        at
        + int(
            np.argmax(truth.pairs(profile[at:], 1.0)[0] == (profile[at + 1 :] - profile[at]) / np.arange(1, 120 - at))
        )
        + 1
    )
    left.plot([at, seen], profile[[at, seen]], "r-", label="horizon of the post")
    left.plot(at, profile[at], "ro")
    left.legend()
    left.set(xlabel="post", ylabel="metres", ylim=(profile.min() - 20, None))
    west = np.array([truth.pairs(row[::-1], spacing_m)[::-1] for row in heights])
    light = np.array([-1, 0, 0.4]) / np.hypot(1, 0.4)
    lit = np.maximum(reference.normals_of(heights, (spacing_m, spacing_m)) @ light, 0) * (west < 0.4)[:-1, :-1]
    right.imshow(lit + 0.12, cmap="gray", vmin=0, vmax=1)
    right.set(title="sun in the west, slope 0.4: cast shadows from one sweep", xticks=[], yticks=[])
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
