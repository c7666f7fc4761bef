"""mesh: the triangles of a patch. Vertices are posts (column, row); triangles are counter-clockwise seen from above."""

import numpy as np

# A patch of T segments a side has (T + 1)² vertices, at corner + (i, j) · step, and 2 T² triangles.


def patch_triangles(corner: tuple[int, int], step: int, segments: int) -> np.ndarray:
    """Triangles of a regular patch, (2 T², 3, 2) posts, each cell cut along its falling diagonal.

    The tessellator may cut cells along the rising diagonal: the bound of a quad holds for both.
    """
    y, x = np.indices((segments, segments)).reshape(2, -1)
    cells = np.array(corner) + step * np.stack([x, y], -1)[:, None]
    halves = step * np.array([[[0, 0], [1, 1], [1, 0]], [[0, 0], [0, 1], [1, 1]]])
    return np.concatenate([cells + half for half in halves])


def areas(triangles: np.ndarray) -> np.ndarray:
    """Signed area of each triangle (n, 3, 2), in cells; positive if it is seen from above."""
    (ax, ay), (bx, by) = (np.moveaxis(triangles[:, i] - triangles[:, 0], -1, 0) for i in (1, 2))
    return 0.5 * (bx * ay - ax * by)


# A vertex on a post has the post's height; in the middle of a cell it has the mean of the cell's corners.


def vertex_heights(heights: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Heights of vertices at (..., 2) columns and rows, posts or middles of cells."""
    low, high = np.floor(places).astype(int), np.ceil(places).astype(int)
    corners = [heights[rows[..., 1], cols[..., 0]] for rows in (low, high) for cols in (low, high)]
    return np.mean(corners, 0)
