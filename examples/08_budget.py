"""Example 8: a budget
===================

A given number of triangles, where they help most.

One price for a triangle decides everywhere in the picture: a triangle is drawn if it removes more squared pixels of
error than the price. The GPU searches for the price that gives the requested number of triangles. With four times as
many triangles, the price is about a fifteenth as high.

The picture shows one view with 1,000, 4,000, 16,000 and 64,000 triangles. A tolerance uses its triangles in another
way: it keeps the largest error the same everywhere. Beside each budget, the output has the RMS error of a tolerance
that needs the same number of triangles.

Run: ``python 08_budget.py [PICTURE.png [MAP]]``
"""

import sys

import numpy as np

from terrain_gl import Renderer
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.image import write_png

BUDGETS = (1000, 4000, 16000, 64000)

picture = sys.argv[1] if len(sys.argv) > 1 else "08_budget.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
heightmap, camera = open_map(name)[0], bundled()[name].camera


def tolerance_for(renderer, triangles):
    """The tolerance in pixels that needs about as many triangles, by bisection."""
    low, high = 0.01, 1000.0
    for _ in range(12):
        middle = (low * high) ** 0.5
        fits = renderer.choose(camera, middle)["triangles"] <= triangles
        low, high = (low, middle) if fits else (middle, high)
    return high


print("triangles   price px²   rms px   with a tolerance")
shots = []
with Renderer(heightmap, size=(480, 270)) as renderer:
    for budget in BUDGETS:
        renderer.draw(camera, tolerance_for(renderer, budget), style="normals")  # only the mesh is measured
        by_tolerance = renderer.measure()["rms_error_px"]
        shots.append(renderer.render(camera, triangles=budget, style="wireframe").image)
        stats = renderer.measure()
        print("{triangles:9,}{lambda:12.3g}{rms_error_px:9.3f}".format(**stats), f"{by_tolerance:18.3f}")

rows = [np.concatenate(shots[i : i + 2], 1) for i in (0, 2)]
write_png(picture, np.concatenate(rows)[..., :3])
print("wrote", picture)
