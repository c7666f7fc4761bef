"""Example 1: the heightmap
========================

A heightmap is a grid of posts; row 0 is the north edge. The picture shows the map from above, lit from the north-west.

Run: ``python 01_heightmap.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Heightmap
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "01_heightmap.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"

# The file holds 16-bit integers: a post's height is value × z_scale + z_offset.
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
print(terrain)

# Slopes are differences divided by the spacing. Rows count to the south: the slope to the north is -to_south.
to_south, to_east = np.gradient(terrain.heights, terrain.spacing_m[1], terrain.spacing_m[0])
normal = np.stack([-to_east, to_south, np.ones_like(to_east)], -1)  # (rows, cols, 3): east, north, up
normal /= np.linalg.norm(normal, axis=-1, keepdims=True)

# Lambert's law: light is the cosine between the normal and the direction of the sun.
light = 0.25 + 0.75 * np.clip(normal @ [-0.5, 0.5, 0.707], 0, 1)

# Colours by height: meadow, heath, rock, snow.
at = np.interp([0.0, 0.35, 0.65, 1.0], [0, 1], terrain.range_m)
colours = np.array([(96, 128, 84), (172, 160, 116), (150, 132, 118), (250, 250, 255)])
tint = np.stack([np.interp(terrain.heights, at, channel) for channel in colours.T], -1)

write_png(picture, (tint * light[..., None]).astype(np.uint8))
print("wrote", picture)
