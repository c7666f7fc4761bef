"""One mesh by pydelatin (Garland and Heckbert 1995), as exact as the nearest land of the flight needs it."""

import time

import numpy as np
from entries._static import placed, tolerance_m
from pydelatin import Delatin


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera, in the first frame also the time of the one mesh."""
    started = time.perf_counter()
    error_m = tolerance_m(heights, spacing_m, cameras, size, tolerance_px)
    tin = Delatin(np.ascontiguousarray(heights, np.float32), max_error=error_m)
    vertices = np.asarray(tin.vertices, np.float64).reshape(-1, 3)
    posts = np.column_stack([vertices[:, 0], len(heights) - 1 - vertices[:, 1]])  # its rows count from the south
    mesh = placed(posts, vertices[:, 2], spacing_m, len(heights)), np.asarray(tin.triangles).reshape(-1, 3)
    ms = 1e3 * (time.perf_counter() - started)
    for i in range(len(cameras)):
        yield *mesh, ms if i == 0 else None
