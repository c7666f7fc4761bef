"""Lesson 4, levels of detail: from the error table and a camera to patches.

A metre of error is many pixels nearby and none far away. Each node of the quadtree is split until its error, seen from
the eye, is below the tolerance: rings around the eye, wider where the land is smooth. Neighbours differ by one level at
most. All of it is decided on the GPU, anew for every frame, from nothing but the table and the camera.

The picture looks straight down on the map: every patch in the colour of its level, from red (every post) to blue. The
eye is the white dot above the middle. One view sees a quarter of the horizon, so four of them make the picture; black
is what lies below all four.

Run: python 04_lod.py [PICTURE.png [MAP]]
"""

import sys

import numpy as np

from terrain_gl import Camera, Heightmap, create_context
from terrain_gl.error import ErrorTables
from terrain_gl.image import write_png
from terrain_gl.layout import PATCH
from terrain_gl.lod import Levels
from terrain_gl.maps import bundled
from terrain_gl.terrain import Terrain

TOLERANCE_PX = 2.0
COLOURS = np.array([(205, 55, 50), (240, 150, 60), (245, 220, 110), (150, 205, 120), (80, 170, 180), (70, 110, 190)])

picture = sys.argv[1] if len(sys.argv) > 1 else "04_lod.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine"
known = bundled()[name]
heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

ctx = create_context()
levels = Levels(ErrorTables(Terrain(ctx, heightmap)))
row, col = heightmap.rows // 2, heightmap.cols // 2
east, north = (0.5 * extent for extent in heightmap.extent_m)
eye = np.array([east, north, heightmap.heights[row, col] + 3 * heightmap.spacing_m[0]])


def patches_of(direction):
    """Corners (n, 2) as column and row, sides in posts, and levels of the patches that a view is drawn with."""
    camera = Camera(eye, eye + direction, fov_deg=90)
    chosen = levels.select(camera, (720, 720), 0.1 * heightmap.spacing_m[0], TOLERANCE_PX)
    print(f"{chosen.patches:6} patches, {chosen.triangles:6} triangles, at most {chosen.certified_px:.3f} px off")
    # A patch is two words: its north-west corner, and its shape (glsl/mesh/lattice.glsl).
    records = np.frombuffer(levels.patches.read(chosen.patches * PATCH.itemsize), PATCH)
    level, segments_log2 = (records["shape"] & 15) - 1, records["shape"] >> 4 & 7
    return records["corner"].astype(int), 1 << (level + segments_log2), level


def paint(direction):
    """(rows, cols, 3): the view's patches, outlined, in the colours of their levels."""
    seen = np.zeros((heightmap.rows, heightmap.cols, 3))
    for (x, y), side, level in zip(*patches_of(direction), strict=True):
        seen[y : y + side, x : x + side] = COLOURS[min(level, len(COLOURS) - 1)]
        seen[y, x : x + side] *= 0.8
        seen[y : y + side, x] *= 0.8
    return seen


print(f"the whole map has {2 * (heightmap.rows - 1) * (heightmap.cols - 1)} triangles")
to_east, to_south = np.meshgrid(np.arange(heightmap.cols) - col, np.arange(heightmap.rows) - row)
ahead = np.abs(to_south) >= np.abs(to_east)
quarters = {(0, 1): ahead & (to_south < 0), (0, -1): ahead & (to_south >= 0)}
quarters |= {(1, 0): ~ahead & (to_east > 0), (-1, 0): ~ahead & (to_east < 0)}
seen = sum(paint((*direction, 0)) * quarter[..., None] for direction, quarter in quarters.items())

south, east = np.gradient(heightmap.heights, heightmap.spacing_m[1])
light = 0.55 + 0.45 * np.clip((0.5 * east + 0.5 * south + 0.7) / np.sqrt(1 + east**2 + south**2), 0, 1)
seen *= light[..., None]
seen[row - 4 : row + 5, col - 4 : col + 5] = 255

write_png(picture, seen.astype(np.uint8))
print("wrote", picture)
