"""Example 4: levels of detail
===========================

From the tables and a camera, the GPU chooses patches.

A metre of error is many pixels near the eye, and a small part of a pixel far away. A clipmap surrounds the eye: ring l
has cells of 2^l posts. Each of its blocks is cut into squares. The summed-area tables say how coarse each square may
be: four fetches tell whether any cell in a box has an error above the limit of a class. The GPU repeats this in every
frame, from the tables and the camera.

The picture looks straight down on the map. Every patch has the colour of its spacing, from red (every post) to blue.
The white dot is the eye, above the middle of the map. A camera with a field of view of 90 degrees sees a quarter of the
horizon, so four views make the picture. Land that none of the four views shows, below the eye, is black.

Run: ``python 04_lod.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Camera, Heightmap, create_context
from terrain_gl.error import ErrorTables
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png
from terrain_gl.lod import Goal, RingsSelector
from terrain_gl.terrain import Terrain

TOLERANCE_PX = 2.0
COLOURS = np.array([(205, 55, 50), (240, 150, 60), (245, 220, 110), (150, 205, 120), (80, 170, 180), (70, 110, 190)])

picture = sys.argv[1] if len(sys.argv) > 1 else "04_lod.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

ctx = create_context()
selector = RingsSelector(ErrorTables(Terrain(ctx, heightmap)))
row, col = heightmap.rows // 2, heightmap.cols // 2
east, north = (0.5 * extent for extent in heightmap.extent_m)
eye = np.array([east, north, heightmap.heights[row, col] + 3 * heightmap.spacing_m[0]])


def patches_of(direction):
    """Corners as column and row (n, 2), sides in posts (n,), and levels of the patches of a view."""
    camera = Camera(eye, eye + direction, fov_deg=90)
    chosen = selector.select(camera, (720, 720), 0.1 * heightmap.spacing_m[0], Goal(TOLERANCE_PX))
    print(f"{chosen.patches:6} patches, {chosen.triangles:6} triangles, at most {chosen.certified_px:.3f} px off")
    patches = selector.chosen(chosen)
    return patches.corner, 1 << patches.side_log2, patches.step_log2


def paint(direction):
    """(rows, cols, 3): the view's patches, outlined, in the colours of their levels."""
    seen = np.zeros((heightmap.rows, heightmap.cols, 3))
    for (x, y), side, level in zip(*patches_of(direction), strict=True):
        low_x, low_y = max(x, 0), max(y, 0)  # a ring may reach beyond the map
        seen[low_y : y + side, low_x : x + side] = COLOURS[np.clip(level, 0, len(COLOURS) - 1)]
        seen[low_y, low_x : x + side] *= 0.8
        seen[low_y : y + side, low_x] *= 0.8
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
