"""Budgets of triangles: the error of both metrics, beside the quadtree's, and how close the certificates are.

Three views of every map, 640 × 360 pixels, with 10,000, 50,000 and 250,000 triangles. The columns:

- rms:       root mean square screen error over the drawn surface, with least squares, of `sat` and of the quadtree
- certified: the bound of the largest error of `sat`, and its ratio to the achieved one, with least squares and with
             `--metric max`

Run: python benchmarks/budgets.py [FOLDER]    the bundled maps, and the real maps of the folder
"""

from __future__ import annotations

import math
import statistics
import sys
from typing import Any

from methods import maps

import terrain_gl as tg
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

SIZE = (640, 360)
BUDGETS = (10_000, 50_000, 250_000)
WAYS = {  # by the column's name
    "sat": {"method": "sat", "metric": "rms"},
    "quadtree": {"method": "quadtree", "metric": "rms"},
    "largest": {"method": "sat", "metric": "max"},
}


def measured(renderer: tg.Renderer, camera: tg.Camera, way: str, triangles: int) -> dict[str, Any]:
    """Stats of a mesh with this number of triangles, and the ratio of its certified error to the achieved one."""
    stats = renderer.draw(camera, triangles=triangles, style=UNLIT, **WAYS[way])
    stats |= renderer.measure()
    stats["ratio"] = stats["certified_max_error_px"] / stats["max_error_px"] if stats["max_error_px"] else math.nan
    return stats


def main() -> None:
    """Print a line for each view and budget, and the medians."""
    print(f"{'':62}{'rms px':>17}{'':7}{'certified px, least squares and max':>38}")
    print(
        f"{'map':44} {'view':7} {'triangles':>9} {'sat':>8} {'quadtree':>8} {'ratio':>6} {'rms':>9} {'ratio':>6}",
        end="",
    )
    print(f" {'max':>9} {'ratio':>6} {'max/rms':>7}")
    rows = []
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                for triangles in BUDGETS:
                    sat, tree, largest = (measured(renderer, camera, way, triangles) for way in WAYS)
                    errors = sat["rms_error_px"], tree["rms_error_px"]
                    bounds = sat["certified_max_error_px"], largest["certified_max_error_px"]
                    row = [a / b if b else math.nan for a, b in (errors, bounds[::-1])]
                    rows.append((row[0], sat["ratio"], largest["ratio"], row[1]))
                    print(
                        f"{name[-44:]:44} {view:7} {triangles:>9,} {errors[0]:8.4f} {errors[1]:8.4f} {row[0]:6.2f}",
                        end="",
                    )
                    print(
                        f" {bounds[0]:9.3f} {sat['ratio']:6.2f} {bounds[1]:9.3f} {largest['ratio']:6.2f} {row[1]:7.2f}",
                        flush=True,
                    )
    for i, what in enumerate(
        ("rms, sat / quadtree", "certified / achieved, rms", "the same, max", "certified, max / rms")
    ):
        known = [row[i] for row in rows if math.isfinite(row[i])]
        print(f"{what:28} median {statistics.median(known):.2f}, most {max(known):.2f}, of {len(known)} rows")


if __name__ == "__main__":
    main()
