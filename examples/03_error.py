"""Example 3: the error
====================

A coarse mesh does not go through all posts. This example shows how far the mesh is from the posts.

A node of level j covers 2^j x 2^j cells. It is drawn as two triangles through its four corners, so the posts between
the corners may lie above or below the triangles. The table stores the largest error of each node in metres: for the
worse of the two diagonals that the GPU may take, and whatever edges its neighbours cut. The errors depend only on the
map. Compute shaders find them once, and every view uses them.

The picture shows levels 2, 4 and 6: black is a tenth of a metre or less, white a kilometre.

Run: ``python 03_error.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Heightmap, create_context
from terrain_gl.error import ErrorTables
from terrain_gl.files.maps import bundled
from terrain_gl.gpu.layout import unpack_nodes
from terrain_gl.image import write_png
from terrain_gl.terrain import Terrain

LEVELS = (2, 4, 6)

picture = sys.argv[1] if len(sys.argv) > 1 else "03_error.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

ctx = create_context()
terrain = Terrain(ctx, heightmap)  # the heights as a texture
tables = ErrorTables(terrain)


def worst_m(level):
    """(rows, cols) largest error of each node in metres."""
    return unpack_nodes(tables.read_nodes(level), terrain.span_m)[0]


def heat(metres):
    """Colours by the logarithm of the error: black, violet, orange, white."""
    at = np.clip((np.log10(np.maximum(metres, 1e-9)) + 1) / 4, 0, 1)
    colours = np.array([(8, 6, 20), (90, 30, 110), (230, 110, 60), (255, 250, 220)])
    return np.stack([np.interp(at, np.linspace(0, 1, 4), channel) for channel in colours.T], -1).astype(np.uint8)


panels = []
for level in LEVELS:
    errors = worst_m(level)
    print(f"level {level}: {errors.size:6} nodes of {2**level} x {2**level} cells,", end=" ")
    print(f"median error {np.median(errors):6.2f} m, largest {errors.max():7.2f} m")
    across = heat(errors).repeat(2**level, 0).repeat(2**level, 1)
    panels.append(across[: heightmap.rows, : heightmap.cols])
write_png(picture, np.hstack(panels))
print("wrote", picture)
