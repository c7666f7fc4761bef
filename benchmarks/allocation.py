"""Screen error for a number of triangles, compared with pruned quadtrees of quads with as many triangles.

The quadtrees are pruned by the true error of every post in the view (`pruned.pruned_quads`, in numpy: minutes for maps
of 4096 posts a side). Restricted: neighbours differ by at most one level, so there are no cracks. Plain: without this
restriction. A factor is our root mean square error over the whole surface, divided by that of a pruned quadtree over
posts alone. So a pruned quadtree is no lower limit for our error.

Run: python benchmarks/allocation.py MAP [--spacing M ...] [--view NAME] [--budgets N,N,...]
"""

import argparse
import sys
import time

import numpy as np

from terrain_gl.cli import options
from terrain_gl.cli.records import DrawOptions, told
from terrain_gl.cli.scene import make_renderer, open_scene
from terrain_gl.comparison import pruned
from terrain_gl.renderer.options import near_plane_m

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_map(parser)
options.add_rendering(parser)
parser.add_argument("--budgets", metavar="N,N,...", default="100000,300000,1000000", help="numbers of triangles")
args = parser.parse_args()
asked = told(DrawOptions, args)
budgets = [int(n) for n in args.budgets.split(",")]
scene = open_scene(asked)
heightmap = scene.heightmap

with make_renderer(scene, asked) as renderer:
    drawn = []
    for budget in budgets:
        renderer.draw(scene.camera, triangles=budget, method="quadtree")
        drawn.append(renderer.measure())
    filled = renderer.terrain.filled.astype(np.float64)

started = time.perf_counter()
near_m = near_plane_m(heightmap, asked.frame.near_m)
void = np.isnan(heightmap.heights) if heightmap.voids else None
best = pruned.pruned_quads(filled, heightmap.spacing_m, scene.camera, asked.camera.size, near_m, budgets, void)
print(f"{heightmap.name}: {time.perf_counter() - started:.0f} s for the best", file=sys.stderr)

columns = ("budget", "drawn", "lambda", "rms px", "max px", "ms", "restricted", "factor", "plain", "factor")
print("".join(f"{column:>11}" for column in columns))
for i, (budget, stats) in enumerate(zip(budgets, drawn, strict=True)):
    rms_px = stats["rms_error_px"]
    line = f"{budget:11,}{stats['triangles']:11,}{stats['lambda']:11.3g}{rms_px:11.4f}{stats['max_error_px']:11.2f}"
    beside = (f"{best_px:11.4f}{rms_px / max(best_px, 1e-12):11.2f}" for best_px in (b.rms_px[i] for b in best))
    print(f"{line}{stats['ms']['lod']:11.0f}", *beside, sep="", flush=True)
