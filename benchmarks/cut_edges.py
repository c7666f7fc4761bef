"""How much larger the error of a cell is if its edges may be cut, level by level.

Prints the geometric mean over all cells of a level of C / M: C holds whatever edges are cut, M is for whole edges
(docs/guarantee.md, section 3). Beside it the same for a bound without signs: M plus the largest
displacement of a vertex.

Run: python benchmarks/cut_edges.py [MAP ...]    (bundled names or files)
"""

import sys

import numpy as np

from terrain_gl import reference
from terrain_gl.error import ErrorTables
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.gpu.context import create_context
from terrain_gl.gpu.layout import unpack_nodes
from terrain_gl.terrain import Terrain

LEVELS = 6

ctx = create_context("auto")
print(f"{'map':24}{'level':>6}{'cells':>9}{'C / M':>8}{'no signs':>10}")
for name in sys.argv[1:] or list(bundled()):
    terrain = Terrain(ctx, open_map(name)[0])
    tables = ErrorTables(terrain)
    for level in range(1, min(LEVELS, terrain.top_level) + 1):
        cut, _ = unpack_nodes(tables.read_nodes(level), terrain.span_m)
        quads = reference.largest_errors(terrain.filled, level)
        moves = np.max(reference.cut_edges(terrain.filled, level), (0, 1))
        rough = quads > 0
        whole = quads[rough]
        means = [np.exp(np.log(each[rough] / whole).mean()) for each in (cut, quads + moves)]
        print(f"{name[-24:]:24}{level:6}{rough.sum():9,}{means[0]:8.2f}{means[1]:10.2f}", flush=True)
    tables.release()
    terrain.release()
