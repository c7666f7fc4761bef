"""One mesh by pymartini (Evans 1998: right triangles), as exact as the nearest land of the flight needs it."""

import time

import numpy as np
from entries._static import placed, tolerance_m
from pymartini import Martini


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera, in the first frame also the time of the one mesh."""
    started = time.perf_counter()
    error_m = tolerance_m(heights, spacing_m, cameras, size, tolerance_px)
    flat, triangles = Martini(len(heights)).create_tile(heights.astype(np.float32)).get_mesh(error_m)
    posts = np.asarray(flat, np.int64).reshape(-1, 2)
    vertices = placed(posts, heights[posts[:, 1], posts[:, 0]], spacing_m, len(heights))
    mesh = vertices, np.asarray(triangles, np.int64).reshape(-1, 3)
    ms = 1e3 * (time.perf_counter() - started)
    for i in range(len(cameras)):
        yield *mesh, ms if i == 0 else None
