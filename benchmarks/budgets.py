"""Budgets of triangles: the error of both metrics, and how close the certificates are.

Three views of every map, 640 × 360 pixels, with 10,000, 50,000 and 250,000 triangles. The columns:

- rms:       root mean square screen error over the drawn surface, with least squares
- certified: the bound of the largest error, and its ratio to the achieved one, with least squares and with
             `--metric max`

Run: python benchmarks/budgets.py [FOLDER]    the bundled maps, and four real maps in the folder
"""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import REAL, SMALL_REAL  # noqa: E402  the tests' own maps, and how to open them

SIZE = (640, 360)
BUDGETS = (10_000, 50_000, 250_000)
WAYS = {  # by the column's name
    "sat": {"method": "sat", "metric": "rms"},
    "largest": {"method": "sat", "metric": "max"},
}


def maps(folder: str | None) -> Iterator[tuple[str, tg.Heightmap, tg.Camera]]:
    """Name, map and first view, one at a time."""
    for name, known in bundled().items():
        yield name, open_map(name)[0], known.camera
    for name in SMALL_REAL if folder else ():
        if (path := Path(folder or "") / name).exists():
            heightmap = tg.Heightmap.open(path, **REAL[name])
            yield name, heightmap, tg.Camera.default(heightmap)


def measured(renderer: tg.Renderer, camera: tg.Camera, way: str, triangles: int) -> dict[str, Any]:
    """Stats of a mesh with this number of triangles, and the ratio of its certified error to the achieved one."""
    stats = renderer.draw(camera, triangles=triangles, style=UNLIT, **WAYS[way])
    stats |= renderer.measure()
    stats["ratio"] = stats["certified_max_error_px"] / stats["max_error_px"] if stats["max_error_px"] else math.nan
    return stats


def main() -> None:
    """Print a line for each view and budget, and the medians."""
    head("map", "view", "triangles", "rms px", "certified, rms", "ratio", "certified, max", "ratio", "max / rms")
    rows = []
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                for triangles in BUDGETS:
                    sat, largest = (measured(renderer, camera, way, triangles) for way in WAYS)
                    bounds = sat["certified_max_error_px"], largest["certified_max_error_px"]
                    ratio = bounds[1] / bounds[0] if bounds[0] else math.nan
                    rows.append((sat["ratio"], largest["ratio"], ratio))
                    cells = bounds[0], sat["ratio"], bounds[1], largest["ratio"], ratio
                    errors = (f"{sat['rms_error_px']:.4f}", *(f"{cell:.2f}" for cell in cells))
                    row(name, view, f"{triangles:,}", *errors)
    head("what", "median", "largest", "rows")
    for i, what in enumerate(
        ("certified / achieved, `rms`", "certified / achieved, `max`", "certified, `max` / `rms`")
    ):
        known = [each[i] for each in rows if math.isfinite(each[i])]
        row(what, f"{statistics.median(known):.2f}", f"{max(known):.2f}", len(known))


if __name__ == "__main__":
    main()
