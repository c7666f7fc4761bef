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


# The rim of a fan runs through its corners and the middles of its split edges. Each segment of the rim forms a triangle
# with the centre.


def fan_triangles(
    low: tuple[int, int], high: tuple[int, int], middle: tuple[float, float], edges: np.ndarray
) -> np.ndarray:
    """Triangles of a fan, (n, 3, 2) posts, without triangles that have no area.

    Parameters
    ----------
    low, high, middle
        Column and row of its north-west and south-east corners, and of its centre.
    edges
        (4,) bool: which of the edges west, north, east and south are split.
    """
    x0, y0 = low
    x1, y1 = high
    xm, ym = middle
    ring = [
        (x0, y0),
        (x0, ym),
        (x0, y1),
        (xm, y1),
        (x1, y1),
        (x1, ym),
        (x1, y0),
        (xm, y0),
    ]  # counter-clockwise on the map
    west, north, east, south = edges
    keep = [True, west, True, south, True, east, True, north]
    rim = np.array([post for post, kept in zip(ring, keep, strict=True) if kept], float)
    found = np.stack([np.broadcast_to(middle, rim.shape), rim, np.roll(rim, -1, 0)], 1)
    return found[areas(found) != 0]


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
