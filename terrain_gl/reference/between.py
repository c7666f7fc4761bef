"""error, continued: the errors of triangles between the posts, where the truth is bilinear."""

import numpy as np

from .bound import twists
from .nodes import node_axes, per_node

# In a cell that one triangle covers, the error is largest at a post. A diagonal of a square node may cross a cell with
# the corners a, b, c, d and the twist t = a − b − c + d. On the way from a to d, drawn minus true height is
#   e_a (1 − s) + e_d s + t s (1 − s)        with the errors e_a and e_d at both posts, and 0 ≤ s ≤ 1
# (from b to c: −t). Within each half of the cell it is largest at a post or on the diagonal.
# In a node that the map's rim cuts off, diagonals do not run through posts, and may cross any cell. The planes of a
# rectangle of w × h cells with the twist τ differ by |τ| |x/w − y/h|. So the error is at most
#   worst + |t|/4 + bend                     worst: the largest error at the cell's posts,  bend = |τ| min(1/w + 1/h, 1)
# In the root mean square, a crossed cell adds m = |t|/√90 + bend. Over the 5 × 5 places of a cell that `measure` takes,
# the first term is larger, up to |t| √(13/1024). So the tables add that.


def crest(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The largest value of a (1 − s) + b s + t s (1 − s) for 0 ≤ s ≤ 1."""
    inside = t > np.abs(a - b)
    bend = np.where(inside, t, 1.0)
    return np.where(inside, (a + b) / 2 + bend / 4 + np.square(a - b) / (4 * bend), np.maximum(a, b))


def crossed_cells(shape: tuple[int, ...], level: int, void: np.ndarray | None = None) -> np.ndarray:
    """Cells of each node that an edge of the mesh may cross, without holes: (node rows, cells, node cols, cells)."""
    row, col = (np.arange(axis.post.shape[1] - 1) for axis in node_axes(shape, level))
    diagonal = (row[:, None, None] == col) | (row[:, None, None] + col == (1 << level) - 1)
    square = _square_nodes(shape, level)[:, None, :, None]
    return cells_with_data(shape, level, void) & (diagonal | ~square)


def bend_bounds(heights: np.ndarray, level: int) -> np.ndarray:
    """Bound of the bend of each node's diagonals within a cell, metres, (rows, cols) of nodes; 0 for whole nodes."""
    h = heights.astype(np.float64)
    y, x = node_axes(heights.shape, level)
    a, b, c, d = (h[np.ix_(rows, cols)] for rows in (y.low, y.high) for cols in (x.low, x.high))
    share = np.minimum(1 / (y.high - y.low)[:, None] + 1 / (x.high - x.low), 1.0)
    return np.where(_square_nodes(heights.shape, level), 0.0, np.abs(a - b - c + d) * share)


def _square_nodes(shape: tuple[int, ...], level: int) -> np.ndarray:
    """For each node whether it lies wholly on the map, (rows, cols) of nodes."""
    rows, cols = (axis.high - axis.low == 1 << level for axis in node_axes(shape, level))
    return rows[:, None] & cols


def of_corners(posts: np.ndarray) -> list[np.ndarray]:
    """Values at the four posts of each cell, of an array (node rows, posts, node cols, posts)."""
    ends = (np.s_[:-1], np.s_[1:])
    return [posts[:, rows, :, cols] for rows in ends for cols in ends]


def worst_corner(errors: np.ndarray) -> np.ndarray:
    """Largest error at the four posts of each cell, of an array (node rows, posts, node cols, posts)."""
    return np.maximum.reduce(of_corners(np.abs(errors)))


def cell_twists(heights: np.ndarray, level: int) -> np.ndarray:
    """Twist t of each cell of each node, (node rows, cells, node cols, cells)."""
    y, x = (
        np.minimum(axis.post[:, :-1], n - 2)
        for axis, n in zip(node_axes(heights.shape, level), heights.shape, strict=True)
    )
    return twists(heights.astype(np.float64))[y[:, :, None, None], x]


def over_cells(above: np.ndarray, below: np.ndarray, heights: np.ndarray, level: int, bend: np.ndarray) -> np.ndarray:
    """Largest error in each cell that an edge of the mesh crosses, (node rows, cells, node cols, cells).

    `above` and `below` are errors at the posts, drawn minus true and true minus drawn.
    """
    twist = cell_twists(heights, level)
    square = _square_nodes(heights.shape, level)[:, None, :, None]
    row, col = (np.arange(axis.post.shape[1] - 1) for axis in node_axes(heights.shape, level))
    falling = row[:, None, None] == col
    found = []
    for errors, t in ((above, twist), (below, -twist)):
        nw, ne, sw, se = of_corners(errors)
        on_diagonal = crest(np.where(falling, nw, ne), np.where(falling, se, sw), np.where(falling, t, -t))
        worst = np.maximum.reduce([nw, ne, sw, se])
        at_rim = worst + np.abs(twist) / 4 + bend[:, None, :, None]
        found.append(np.where(square, np.maximum(worst, on_diagonal), at_rim))
    return np.maximum(*found)


def posts_with_data(shape: tuple[int, ...], level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts of each node are no voids, (node rows, posts, node cols, posts)."""
    seen = np.ones(shape, bool) if void is None else ~void
    return seen[per_node(*node_axes(shape, level))]


# A node draws land only over its cells with data. If none of them touches a post, the land there belongs to neighbours,
# and so does the error. But a post may lie alone among voids. So a node always has the errors of its own posts.


def cells_with_data(shape: tuple[int, ...], level: int, void: np.ndarray | None) -> np.ndarray:
    """Which cells of each node have data at their four posts, (node rows, cells, node cols, cells)."""
    y, x = node_axes(shape, level)
    of_node = (np.diff(y.post) > 0)[:, :, None, None] & (np.diff(x.post) > 0)
    return of_node & np.logical_and.reduce(of_corners(posts_with_data(shape, level, void)))


def measured_posts(shape: tuple[int, ...], level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts meet one of the node's cells with data, or are its own: (node rows, posts, node cols, posts)."""
    cells = np.pad(cells_with_data(shape, level, void), [(0, 0), (1, 1), (0, 0), (1, 1)])
    return np.logical_or.reduce(of_corners(cells)) | own_posts(shape, level, void)


def shares_of_posts(shape: tuple[int, ...], level: int) -> np.ndarray:
    """The part of the cells around each post that belong to the node: (node rows, posts, node cols, posts)."""
    cells = np.pad(cells_with_data(shape, level, None), [(0, 0), (1, 1), (0, 0), (1, 1)])
    return np.sum(of_corners(cells), 0) / 4


def own_posts(shape: tuple[int, ...], level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts are each node's own and no voids: (node rows, posts, node cols, posts)."""
    y, x = node_axes(shape, level)
    return posts_with_data(shape, level, void) & y.own[:, :, None, None] & x.own
