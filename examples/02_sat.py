"""Example 2: the summed-area table
================================

The mean of a box of heights takes four fetches, for any size of box.

::

    S(x, y) = sum of all values above and to the left          (built once, by prefix sums along rows, then columns)
    box     = S(x1, y1) - S(x1, y0) - S(x0, y1) + S(x0, y0)    (Crow 1984)

The picture shows the map, and its means over boxes of 9, 33 and 129 posts a side. Sums of floats would lose digits. So
the table holds whole numbers of 32 bits that wrap around. The sum of a box fits into 32 bits, so it is exact for a map
of any size.

Run: ``python 02_sat.py [PICTURE.png [MAP]]``
"""

import sys
import time

import numpy as np

from terrain_gl import Heightmap, create_context
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png
from terrain_gl.sat import SummedAreaTables, Table

picture = sys.argv[1] if len(sys.argv) > 1 else "02_sat.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
rows, cols = terrain.heights.shape

# Heights as 16-bit whole numbers, in a buffer on the GPU.
low, high = terrain.range_m
values = np.round((terrain.heights - low) / (high - low) * 65535).astype(np.uint32)
ctx = create_context()
buffer, table, tables = ctx.buffer(values.tobytes()), Table(cols, rows), SummedAreaTables(ctx)

start = time.perf_counter()
tables.build(buffer, table)  # in place: the values become the table
ctx.finish()
print(f"table of {cols} x {rows} posts: {1e3 * (time.perf_counter() - start):.1f} ms")


def box_means(size):
    """Mean of the box of `size` posts a side around every post, cut off at the map's edges; size is odd."""
    y, x = np.mgrid[:rows, :cols].reshape(2, -1)
    x0, y0 = np.maximum(x - size // 2, 0), np.maximum(y - size // 2, 0)
    x1, y1 = np.minimum(x + size // 2 + 1, cols), np.minimum(y + size // 2 + 1, rows)
    boxes = np.stack([x0, y0, x1, y1], -1)
    tables.box_sums(buffer, table, boxes)  # once without timing, because the first use of memory takes longer
    start = time.perf_counter()
    sums = tables.box_sums(buffer, table, boxes)
    print(f"{len(sums)} boxes of {size} x {size}: {1e3 * (time.perf_counter() - start):.1f} ms")
    return (sums / ((x1 - x0) * (y1 - y0))).reshape(rows, cols)


def hillshade(heights):
    """Greys of the land, lit from the north-west."""
    south, east = np.gradient(heights * (high - low) / 65535 / terrain.spacing_m[0])
    light = (0.5 * east + 0.5 * south + 0.7) / np.sqrt(1 + east**2 + south**2)
    return (255 * np.clip(light, 0, 1)).astype(np.uint8)


means = [values.astype(float)] + [box_means(size) for size in (9, 33, 129)]
panels = [hillshade(heights) for heights in means]
write_png(picture, np.vstack([np.hstack(panels[:2]), np.hstack(panels[2:])]))
print("wrote", picture)
