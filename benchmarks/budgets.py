"""Method sat compared with the quadtree at equal triangles: root mean square screen error over the whole surface.

Three views of every map, 640 × 360 pixels, with 10,000, 50,000 and 250,000 triangles.

Run: python benchmarks/budgets.py [FOLDER]    the bundled maps, and the real maps of the folder
"""

from __future__ import annotations

import sys

from methods import maps

import terrain_gl as tg
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

SIZE = (640, 360)
BUDGETS = (10_000, 50_000, 250_000)


def rms_px(renderer: tg.Renderer, camera: tg.Camera, method: str, triangles: int) -> float:
    """The error of a method with so many triangles."""
    renderer.draw(camera, method=method, triangles=triangles, style=UNLIT)
    return renderer.measure()["rms_error_px"]


def main() -> None:
    """Print a line for each view and budget."""
    print(f"{'map':44} {'view':7} {'triangles':>9} {'sat':>8} {'quadtree':>8}  ratio")
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                for triangles in BUDGETS:
                    sat, quadtree = (rms_px(renderer, camera, method, triangles) for method in ("sat", "quadtree"))
                    ratio = f"{sat / quadtree:5.2f}" if quadtree else "  both 0"
                    print(f"{name:44} {view:7} {triangles:>9,} {sat:8.4f} {quadtree:8.4f}  {ratio}", flush=True)


if __name__ == "__main__":
    main()
