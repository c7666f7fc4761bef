"""Triangles with units of the tables from the spacing alone, divided by those with units from the map's heights.

Units from the spacing are for heights of 1,024 cells, rounded up to a power of two of metres. Three views of every map,
1280 x 720, 1 px. The units only change what the tables round, so all meshes are certified.

Run: python benchmarks/units.py [FOLDER]    the bundled maps, and the real maps of the folder
"""

from __future__ import annotations

import math
import statistics
import sys

import numpy as np
from budgets import maps

import terrain_gl as tg
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

SIZE = (1280, 720)
CELLS = 1024


def triangles(heightmap: tg.Heightmap, views: dict[str, tg.Camera]) -> np.ndarray:
    """Triangles for the largest error, in each view."""
    with tg.Renderer(heightmap, SIZE) as renderer:
        return np.array([renderer.draw(view, 1.0, metric="max", style=UNLIT)["triangles"] for view in views.values()])


def main() -> None:
    """Print a line for each view, then the median and the largest ratio."""
    print(f"{'map':44} {'view':7}{'triangles':>10}{'ratio':>7}")
    ratios: list[float] = []
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        own = triangles(heightmap, views)
        low, high = heightmap.range_m
        span = max(CELLS * math.sqrt(math.prod(heightmap.spacing_m)), high - low)
        span = 2.0 ** math.ceil(math.log2(span))
        heightmap.quantised_m = 0.5 * (low + high - span), 0.5 * (low + high + span)
        found = triangles(heightmap, views) / own
        for view, count, ratio in zip(views, own, found, strict=True):
            print(f"{name[-44:]:44} {view:7}{count:10,}{ratio:7.2f}", flush=True)
        ratios += found.tolist()
    print(f"median {statistics.median(ratios):.3f}, most {max(ratios):.2f}")


if __name__ == "__main__":
    main()
