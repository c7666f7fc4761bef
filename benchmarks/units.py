"""Triangles with other units of the tables, beside those with units from the map's heights.

Units from the spacing alone are for heights of 1,024 cells, rounded up to a power of two of metres. Three views of
every map, 1280 x 720, 1 px. The units only change what the tables round, so all meshes are certified.
Units that edits keep are those of the map before an edit: a cone in its middle, an eighth of the map wide and some
times as high as the map's range of heights. A view of the whole map, and one beside the cone, 640 x 360.

Run: python benchmarks/units.py [FOLDER]    units from the spacing: the bundled maps, and the real maps of the folder
     python benchmarks/units.py edits       units that edits keep: two bundled maps
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


def edits() -> None:
    """For each cone and view: triangles and certified pixels with units of the old map, then with new units."""
    for name in ("alpine-30m", "canyon-15m"):
        old = tg.bundled_map(name)
        (low, high), (width, depth) = old.range_m, old.extent_m
        y, x = np.mgrid[-1 : 1 : old.rows * 1j, -1 : 1 : old.cols * 1j]
        for times in (0.5, 1, 2, 3):
            height = times * (high - low)
            cone = np.maximum(1 - 8 * np.hypot(x, y), 0) * height
            beside = tg.Camera(
                (0.425 * width, 0.375 * depth, high + 0.3 * height), (0.5 * width, 0.5 * depth, high), 60.0
            )
            line = f"{name:11} cone {times:3g}"
            for units_m in (old.quantised_m, None):
                edited = tg.Heightmap(old.heights + cone, old.spacing_m)
                edited.quantised_m = units_m or edited.quantised_m
                with tg.Renderer(edited, (640, 360)) as renderer:
                    for view in (tg.Camera.default(old), beside):
                        stats = renderer.choose(view, 1.0, metric="max")
                        line += f"{stats['triangles']:11,}{stats['certified_max_error_px']:8.3f}"
            print(line, flush=True)


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
    edits() if sys.argv[1:] == ["edits"] else main()
