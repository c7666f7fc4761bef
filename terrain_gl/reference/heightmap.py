"""heightmap: the truth. Posts have heights; between four posts the surface is bilinear."""

import numpy as np

# With x = i + f and y = j + g inside the cell (i, j):
#   h(x, y) = (1 − g) ((1 − f) h[j, i] + f h[j, i + 1]) + g ((1 − f) h[j + 1, i] + f h[j + 1, i + 1])


def bilinear_heights(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights at columns x and rows y inside the map."""
    rows, cols = heights.shape
    i, j = np.clip(x.astype(int), 0, cols - 2), np.clip(y.astype(int), 0, rows - 2)
    f = x - i
    g = y - j
    north = heights[j, i] * (1 - f) + heights[j, i + 1] * f
    south = heights[j + 1, i] * (1 - f) + heights[j + 1, i + 1] * f
    return north * (1 - g) + south * g


# Post (row, col) is at   x = col · s_x,   y = (rows − 1 − row) · s_y,   z = h[row, col];   row 0 is the north edge.


def world_m(heights: np.ndarray, spacing_m: tuple[float, float]) -> np.ndarray:
    """World metres east, north and up of each post, (3, rows, cols)."""
    rows, cols = np.indices(heights.shape)
    return np.stack([cols * spacing_m[0], (len(heights) - 1 - rows) * spacing_m[1], heights.astype(np.float64)])


# n = (−∂h/∂x, −∂h/∂y, 1), normalised; a slope in the middle of a cell is the mean of the slopes of two opposite edges


def normals_of(heights: np.ndarray, spacing_m: tuple[float, float]) -> np.ndarray:
    """Unit normals in the middle of each cell, (rows − 1, cols − 1, 3): east, north, up."""
    h = np.asarray(heights, float)
    east = (h[:-1, 1:] - h[:-1, :-1] + h[1:, 1:] - h[1:, :-1]) / (2 * spacing_m[0])
    north = (h[:-1, :-1] - h[1:, :-1] + h[:-1, 1:] - h[1:, 1:]) / (2 * spacing_m[1])
    n = np.stack([-east, -north, np.ones_like(east)], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)
