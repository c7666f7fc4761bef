"""Budgets that would pay for every post, compared with the mesh that draws them all.

Crops of real maps, three views each. `full` draws every post, two triangles a cell. `sat` gets 1, 1.05 and 1.3 times as
many triangles. Errors are root mean squares in pixels, 640 × 360: over the whole surface, where a large cell counts as
much as a small one, and over the picture, as each pixel shows it.

Run: TERRAIN_GL_DEM=FOLDER python benchmarks/all_posts.py
"""

import os
import sys
from pathlib import Path

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import REAL  # noqa: E402  the tests' own maps, and how to open them

NAMES = ("greenriver.tif", "N37W123.hgt", "mt_rainier_90m.tif")
CROPS = ((465, 457), (129, 129), (57, 90), (20, 33))
SHARES = (1.0, 1.05, 1.3)


def errors_px(renderer, camera, **options):
    """Triangles of a mesh, and its root mean square errors over the surface and over the picture."""
    triangles = renderer.draw(camera, style=UNLIT, **options)["triangles"]
    shown = renderer.inspector.error_map()
    return triangles, np.array([renderer.measure()["rms_error_px"], np.sqrt(np.nanmean(shown**2))])


def two(errors):
    """Both errors as text."""
    return f"{errors[0]:.4f} {errors[1]:.4f}"


def main():
    """Print a line a view, and in how many views `sat` is worse."""
    worse = {share: np.zeros(2, int) for share in SHARES}
    views = 0
    for name in NAMES:
        whole = Heightmap.open(Path(os.environ["TERRAIN_GL_DEM"]) / name, **REAL[name])
        for rows, cols in CROPS:
            top, left = whole.rows // 3, whole.cols // 3
            crop = np.ascontiguousarray(whole.heights[top : top + rows, left : left + cols])
            heightmap = Heightmap(crop, whole.spacing_m)
            with Renderer(heightmap, (640, 360)) as renderer:
                for view in ("default", "ridge", "valley"):
                    camera = Camera.default(heightmap) if view == "default" else standard_view(heightmap, view)
                    triangles, full_px = errors_px(renderer, camera, method="full")
                    line = f"{name:20} {rows:>4} x {cols:<4} {view:8} full {triangles:>7} {two(full_px)}"
                    for share in SHARES:
                        _, px = errors_px(renderer, camera, triangles=max(2, int(share * triangles)))
                        worse[share] += px > full_px
                        line += f"   {share} {two(px)}"
                    views += 1
                    print(line, flush=True)
    for share, (surface, picture) in worse.items():
        print(f"{share} x the triangles: worse over the surface in {surface}, in the picture in {picture}, of {views}")


if __name__ == "__main__":
    main()
