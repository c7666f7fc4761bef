"""Every post of the map is a vertex: two triangles for each cell, with one diagonal for all."""

import numpy as np


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera."""
    rows, cols = heights.shape
    row, col = np.indices(heights.shape).reshape(2, -1)
    vertices = np.stack([col * spacing_m[0], (rows - 1 - row) * spacing_m[1], heights.reshape(-1)], -1)
    number = np.arange(heights.size).reshape(heights.shape)
    nw, ne, sw, se = (number[i : rows - 1 + i, j : cols - 1 + j].reshape(-1) for i in (0, 1) for j in (0, 1))
    triangles = np.concatenate([np.stack([nw, sw, ne], -1), np.stack([ne, sw, se], -1)])
    for _ in cameras:
        yield vertices, triangles
