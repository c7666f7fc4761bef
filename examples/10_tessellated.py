"""Example 10: a clipmap with hardware tessellation
================================================

A baseline: rings of patches, each edge cut by its length in the picture.

A patch is a square with four numbers, the segments of its edges. An edge's length on screen is the projected diameter
of its bounding sphere, so the patches on both sides get the same number. Where a ring meets a coarser ring, the coarse
edge has as many segments as the two fine edges together (Song, Yang, Ji 2017; Cantlay 2011).

The upper picture is the wireframe for edges of 12 pixels. The lower picture has the patches, coloured by the size of
their triangles.

Run: ``python 10_tessellated.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Heightmap, Renderer
from terrain_gl.comparison.tessellated import Edges
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "10_tessellated.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

with Renderer(terrain, size=(1280, 720)) as renderer:
    wires, patches = (
        renderer.render(known.camera, method="tessellated", parameters=Edges(edge_px=12, ring=32), style=style).image
        for style in ("wireframe", "lod")
    )
    for edge_px in (24, 12, 6, 3):
        options = {"method": "tessellated", "parameters": Edges(edge_px), "style": "normals"}  # for the mesh alone
        renderer.draw(known.camera, **options)
        achieved = renderer.measure()
        print("edges of {:4} px: {triangles:9,} triangles, {rms_error_px:.3f} px rms".format(edge_px, **achieved))

write_png(picture, np.concatenate([wires, patches]))
print("wrote", picture)
