"""Example 9: geometry clipmaps
============================

A baseline: rings around the eye that do not depend on the land (Losasso, Hoppe 2004).

Each ring is a regular grid, twice as coarse as the ring inside it. So vertices have about equal distances in the
picture. Heights come from a pyramid of filtered maps. Plains get as many triangles as cliffs.

The upper picture shows the rings from straight above the eye, each in its own colour. Towards its border, a ring blends
into the next coarser ring, so there are no T-junctions. The lower picture is the wireframe of the same clipmap, seen
from the eye.

Run: ``python 09_clipmap.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.comparison.clipmap import Rings
from terrain_gl.comparison.curves import details_of
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "09_clipmap.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
rings = Rings(ring=63)

# The rings are chosen for the first camera. Both cameras look at them.
x, y = (0.5 * extent for extent in terrain.extent_m)
ground = terrain.heights[terrain.rows // 2, terrain.cols // 2]
eye = Camera((x, y, ground + 100), (x + 1000, y + 2000, ground), fov_deg=60)
above = Camera((x, y, ground + 0.75 * max(terrain.extent_m)), (x, y, ground), fov_deg=60)

with Renderer(terrain, size=(1280, 720)) as renderer:
    options = {"method": "clipmap", "parameters": rings}
    plan = renderer.render(above, chosen_for=eye, style="lod", cull=False, **options)
    view = renderer.render(eye, style="wireframe", **options)
    achieved = renderer.measure()
    print(f"{achieved['triangles']:7,} triangles, {achieved['rms_error_px']:.3f} px rms: {rings}")

    # 50,000 triangles in other rings: few levels of wide rings, or many levels of narrow rings.
    for each in details_of(renderer, eye, "clipmap", 50_000):
        renderer.draw(eye, method="clipmap", style="normals", **each)  # only the mesh is measured
        achieved = renderer.measure()
        print(f"{achieved['triangles']:7,} triangles, {achieved['rms_error_px']:.3f} px rms: {each['parameters']}")

    # The same number of triangles, chosen by the tables as in example 8: where they help most.
    renderer.draw(eye, triangles=50_000, style="normals")
    achieved = renderer.measure()
    print(f"{achieved['triangles']:7,} triangles, {achieved['rms_error_px']:.3f} px rms: by summed-area tables")

write_png(picture, np.concatenate([plan.image, view.image]))
print("wrote", picture)
