"""Example 9: geometry clipmaps
============================

A baseline: rings around the eye that do not depend on the land (Losasso, Hoppe 2004).

Each ring is a regular grid, twice as coarse as the one inside it. So vertices have about equal distances in the
picture. Heights come from a pyramid of filtered maps. Plains get as many triangles as cliffs.

Above are the rings from straight above the eye. Each ring has a colour. At its border, where it becomes its coarser
neighbour, there are no T-junctions. Below is the wireframe of the same clipmap in perspective.

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

# The same rings from two eyes: chosen for the first, looked at by both.
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

    # The same number of triangles in other rings: few levels of wide ones, or many levels of narrow ones.
    for each in details_of(renderer, eye, "clipmap", 50_000):
        renderer.draw(eye, method="clipmap", style="normals", **each)  # only the mesh is measured
        achieved = renderer.measure()
        print(f"{achieved['triangles']:7,} triangles, {achieved['rms_error_px']:.3f} px rms: {each['parameters']}")

    # And with the triangles of example 8, placed where they help most.
    renderer.draw(eye, triangles=50_000, style="normals")
    achieved = renderer.measure()
    print(f"{achieved['triangles']:7,} triangles, {achieved['rms_error_px']:.3f} px rms: by summed-area tables")

write_png(picture, np.concatenate([plan.image, view.image]))
print("wrote", picture)
