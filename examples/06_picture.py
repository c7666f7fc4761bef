"""Example 6: the picture
======================

All stages at once, and the measured error beside the certified error.

::

    heightmap -> sat -> error -> lod -> mesh -> shade -> image

The renderer certifies that no point of the surface is drawn further than one pixel from its true place. Then it
measures the error: it draws the same mesh from straight above, and compares the mesh with the map.

Run: ``python 06_picture.py [PICTURE.png [MAP]]``
"""

import sys

from terrain_gl import Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "06_picture.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

with Renderer(terrain, size=(1280, 720)) as renderer:
    frame = renderer.render(known.camera, max_error_px=1.0, sun=known.sun)
    stats = renderer.measure()

print(f"drawn by {stats['gl_renderer']}")
print(f"{stats['triangles']} triangles in {stats['patches']} patches")
print("tolerance  at most {requested_max_error_px:.3f} px".format(**stats))
print("certified  at most {certified_max_error_px:.3f} px".format(**stats))
print("achieved           {max_error_px:.3f} px, {rms_error_px:.3f} px rms, {posts_measured} posts".format(**stats))
print("holes              {holes}".format(**stats))
for stage, ms in stats["ms"].items():
    print(f"{stage:6} {ms:8.1f} ms")

write_png(picture, frame.image)
print("wrote", picture)
