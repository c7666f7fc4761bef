"""Example 5: the mesh
===================

Patches become triangles in the tessellation shaders.

A patch is drawn as one vertex. The control shader sets the number of segments of each edge. The evaluation shader puts
every new vertex on a post of the map (close to the eye, also between posts). The patches on both sides of an edge
compute the same whole numbers. So neighbours meet without cracks, even where a fine patch meets a coarse patch.

The picture is the wireframe of the first view with a tolerance of 4 pixels: smooth land has large triangles, ridges
have small triangles.

Run: ``python 05_mesh.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "05_mesh.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

with Renderer(terrain, size=(1280, 720)) as renderer:
    frame = renderer.render(known.camera, max_error_px=4.0, style="wireframe")

    # The triangles of this frame, captured from the GPU: (n, 3, 2) columns and rows of posts.
    triangles = renderer.triangles()

a, b, c = (triangles[:, i].astype(int) for i in range(3))
doubled = np.abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))
print(f"{len(triangles)} triangles in the picture; the whole map has {2 * (terrain.rows - 1) * (terrain.cols - 1)}")
for size in np.unique(doubled):
    print(f"  {np.count_nonzero(doubled == size):6} of {size / 2:7.1f} cells")

write_png(picture, frame.image)
print("wrote", picture)
