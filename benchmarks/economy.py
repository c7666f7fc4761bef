"""Triangles for a certified error, compared with a restricted quadtree of quads for the same map, view and tolerance.

That quadtree is built from the true error of every post in the view (`pruned.quads_within`, in numpy). Its time and
memory grow with the whole map, so maps are cropped to their middle 1025 × 1025 posts.

Run: python benchmarks/economy.py [MAP ...]    (bundled names or files; the spacing is taken from the file)
"""

import sys

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.comparison import pruned
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.renderer.options import near_plane_m
from terrain_gl.shade.picture import UNLIT

SIZE = (1280, 720)
POSTS = 1025


def scene(name: str) -> tuple[Heightmap, Camera]:
    """A bundled map with its first view, or a file; only the middle of a large map."""
    whole, known = open_map(name)
    if known:
        return whole, known.camera
    row, col = max(0, whole.rows - POSTS) // 2, max(0, whole.cols - POSTS) // 2
    middle = Heightmap(whole.heights[row : row + POSTS, col : col + POSTS], whole.spacing_m, name)
    return middle, Camera.default(middle)


def compare(heightmap: Heightmap, camera: Camera, max_error_px: float) -> tuple[int, int, int]:
    """Triangles drawn, of the restricted quadtree of quads, and of the same without restriction."""
    with Renderer(heightmap, SIZE) as renderer:
        drawn = renderer.draw(camera, max_error_px, style=UNLIT, method="quadtree")["triangles"]
        filled = renderer.terrain.filled.astype(np.float64)
    near_m = near_plane_m(heightmap)
    void = np.isnan(heightmap.heights) if heightmap.voids else None
    restricted, plain = pruned.quads_within(filled, heightmap.spacing_m, camera, SIZE, near_m, max_error_px, void)
    return drawn, restricted.triangles, plain.triangles


print(f"{'map':24}{'px':>6}{'drawn':>10}{'restricted':>12}{'ratio':>7}{'plain':>10}{'ratio':>7}")
for name in sys.argv[1:] or list(bundled()):
    heightmap, camera = scene(name)
    for max_error_px in (0.5, 1.0, 2.0, 4.0):
        drawn, restricted, plain = compare(heightmap, camera, max_error_px)
        ratios = f"{restricted:12,}{drawn / restricted:7.2f}{plain:10,}{drawn / plain:7.2f}"
        print(f"{name[-24:]:24}{max_error_px:6.1f}{drawn:10,}{ratios}", flush=True)
