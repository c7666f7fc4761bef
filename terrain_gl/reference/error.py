"""error: the distance between the triangles of each quadtree node and the truth.

A node of level j covers 2^j × 2^j cells of the map. Past the map's last post its corners are clamped to that post. A
node is drawn as a quad (two triangles) or as a fan (triangles around its centre). The errors bound the whole surface,
at the posts and between them. They depend on the heights alone, not on the view.
"""

from typing import NamedTuple

import numpy as np

from .between import (
    cell_twists,
    crossed_cells,
    kinks,
    measured_posts,
    of_corners,
    over_cells,
    own_posts,
    shares_of_posts,
    worst_corner,
)
from .bound import cell_squares
from .nodes import Nodes, at_nodes, node_axes, per_node, top_level


class NodeErrors(NamedTuple):
    """Errors of each node of a level in metres and square metres, (rows, cols) of nodes."""

    quad_max: np.ndarray
    fan_max: np.ndarray
    quad_square: np.ndarray  # means over the node's own posts without voids
    fan_square: np.ndarray


# With corners a, b, c, d (north-west, north-east, south-west, south-east) and 0 ≤ x, y ≤ 1 across the node:
#   falling diagonal   x ≥ y:      a + (b − a) x + (d − b) y        else   a + (c − a) y + (d − c) x
#   rising diagonal    x + y ≤ 1:  a + (b − a) x + (c − a) y        else   d + (c − d)(1 − x) + (b − d)(1 − y)


def quad_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Drawn minus true height at each post of each node as a quad: with the falling and with the rising diagonal.

    OpenGL does not say which diagonal a tessellator takes. Arrays (node rows, posts, node cols, posts).
    """
    h = heights.astype(np.float64)
    y, x = node_axes(h.shape, level)
    t, s = _places(y, x)
    a, b, c, d = (at_nodes(h, rows, cols) for rows in (y.low, y.high) for cols in (x.low, x.high))
    falling = np.where(t >= s, a + (b - a) * t + (d - b) * s, a + (c - a) * s + (d - c) * t)
    rising = np.where(s + t <= 1, a + (b - a) * t + (c - a) * s, d + (c - d) * (1 - t) + (b - d) * (1 - s))
    truth = h[per_node(y, x)]
    return falling - truth, rising - truth


def _places(y: Nodes, x: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Place of each post in its node, 0 to 1: along x (1, 1, cols, posts), and along y (rows, posts, 1, 1)."""
    t, s = ((axis.post - axis.low[:, None]) / (axis.high - axis.low)[:, None] for axis in (x, y))
    return t[None, None], s[:, :, None, None]


# In the wedge between the centre, of height m, and an edge, the drawn height is
#   w m + (1 − w) e
# w is the centre's weight: 1 at the centre, 0 on the edge. e is the edge's height where the ray from the centre through
# the post meets it. A whole edge is the line between its ends. A split edge is two lines that meet at its middle post.


def fan_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Drawn minus true height at each post of each node as a fan: with all edges whole, and with all edges split.

    Arrays (node rows, posts, node cols, posts).
    """
    h = heights.astype(np.float64)
    y, x = node_axes(h.shape, level)
    across, weight_y = _wedges(h, y, x)
    along, weight_x = _wedges(h.T, x, y)
    north_or_south = weight_y <= weight_x.transpose(2, 3, 0, 1)
    truth = h[per_node(y, x)]
    whole, split = (
        np.where(north_or_south, a, b.transpose(2, 3, 0, 1)) - truth for a, b in zip(across, along, strict=True)
    )
    return whole, split


def _wedges(h: np.ndarray, y: Nodes, x: Nodes) -> tuple[list[np.ndarray], np.ndarray]:
    """Heights in the wedges north and south of the centre, edge whole and split, and the centre's weight."""
    north, weight = _from_middle(y)
    north = north[:, :, None, None]
    weight = weight[:, :, None, None]
    a, m, b = (np.where(north, at_nodes(h, y.low, c), at_nodes(h, y.high, c)) for c in (x.low, x.mid, x.high))
    before, after = (x.mid - x.low)[:, None], (x.high - x.mid)[:, None]
    at = (x.post - x.mid[:, None]) / np.where(weight < 1, 1 - weight, 1)  # where the ray from the centre meets the edge
    whole = a + (b - a) * (at + before) / (before + after)
    split = m + np.where(at <= 0, (m - a) * at / before, (b - m) * at / np.maximum(after, 1))
    return [weight * at_nodes(h, y.mid, x.mid) + (1 - weight) * edge for edge in (whole, split)], weight


def _from_middle(axis: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Whether a post is at or before its node's middle, and its weight: from 1 at the middle to 0 at both ends.

    Arrays (nodes, posts).
    """
    to = axis.post - axis.mid[:, None]
    before, after = (axis.mid - axis.low)[:, None], (axis.high - axis.mid)[:, None]
    return to <= 0, 1 - np.abs(to) / np.where(to <= 0, before, np.maximum(after, 1))


def wedges_of_posts(heights: np.ndarray, level: int) -> np.ndarray:
    """The fan wedge that each post lies in: 0 west, 1 north, 2 east, 3 south; (node rows, posts, node cols, posts)."""
    y, x = node_axes(heights.shape, level)
    north, weight_y = _from_middle(y)
    west, weight_x = _from_middle(x)
    north_or_south = weight_y[:, :, None, None] <= weight_x
    return np.where(north_or_south, np.where(north[:, :, None, None], 1, 3), np.where(west, 0, 2))


def wedge_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Largest error in each wedge of each node's fan, west, north, east and south, (rows, cols, 4) of nodes.

    A cell that a diagonal may cross (`crossed_cells`) counts in each wedge that has one of the cell's posts.

    Returns
    -------
    whole, split
        With the wedge's edge whole, and with it split.
    """
    wedge = wedges_of_posts(heights, level)
    measured = measured_posts(heights.shape, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    kink = kinks(heights, level)[1]
    found = []
    for errors in fan_errors(heights, level):
        cells = over_cells(errors, -errors, heights, level, kink) * crossed
        at_posts = [(np.abs(errors) * (measured & (wedge == k))).max((1, 3)) for k in range(4)]
        within = [(cells * np.logical_or.reduce(of_corners(wedge == k))).max((1, 3)) for k in range(4)]
        found.append(np.maximum(np.stack(at_posts, -1), np.stack(within, -1)))
    return found[0], found[1]


# A finer neighbour cuts an edge: the edge gets more vertices, which are posts. They lie at most `above` above and
# `below` below the line between the edge's ends. In each triangle, only vertices of one cut edge take part. Their
# weights at a place sum to v, which is 1 on their edge and 0 on the opposite side. So for each edge, every
# triangulation is bounded by
#   highest diagonal − h + v · above   and   h − lowest diagonal + v · below
# Both bounds are linear where the drawn surface is linear. So between posts we treat them like errors.


class CutErrors(NamedTuple):
    """Errors of each node as a cell of a patch, whatever edges are cut, (rows, cols) of nodes."""

    largest: np.ndarray  # metres
    squares: np.ndarray  # sums over the node's area in m²: a post on an edge counts half, one at a corner a quarter


def cut_moves(heights: np.ndarray, level: int) -> np.ndarray:
    """How far the posts of each node's edges lie above, and below, the straight line between the edge's ends.

    Returns
    -------
    array
        (4, 2, rows, cols) of nodes, metres: the edges west, north, east, south; above, below.
    """
    h = heights.astype(np.float64)
    y, x = node_axes(heights.shape, level)
    north, south = (_off_lines(h[rows], x) for rows in (y.low, y.high))
    west, east = (_off_lines(h.T[cols], y).transpose(0, 2, 1) for cols in (x.low, x.high))
    return np.stack([west, north, east, south])


def _off_lines(lines: np.ndarray, axis: Nodes) -> np.ndarray:
    """Largest distances of posts above and below the straight edges of nodes, on lines (n, posts): (2, n, nodes)."""
    share = (axis.post - axis.low[:, None]) / (axis.high - axis.low)[:, None]
    rise = lines[:, axis.high] - lines[:, axis.low]
    off = lines[:, axis.post] - lines[:, axis.low, None] - rise[..., None] * share
    return np.array([off.max(-1), -off.min(-1)])


def cut_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> CutErrors:
    """Errors of each node of a level ≥ 1 in any triangulation, whatever edges are cut."""
    y, x = node_axes(heights.shape, level)
    t, s = _places(y, x)
    pair = quad_errors(heights, level)
    weights = np.stack(np.broadcast_arrays(1 - t, 1 - s, t, s, pair[0])[:4])
    move_up, move_down = cut_moves(heights, level)[:, :, :, None, :, None].swapaxes(0, 1)
    above = np.maximum(*pair) + (weights * move_up).max(0)
    below = -np.minimum(*pair) + (weights * move_down).max(0)
    kink = kinks(heights, level)[0]
    errors = np.maximum(above, below)
    crossed = crossed_cells(heights.shape, level, void)
    measured = measured_posts(heights.shape, level, void)
    cells = over_cells(above, below, heights, level, kink)
    largest = np.maximum((errors * measured).max((1, 3)), (cells * crossed).max((1, 3)))
    mean = np.abs(cell_twists(heights, level)) * np.sqrt(13 / 1024) + kink[:, None, :, None]
    between = (mean * (2 * worst_corner(errors) + mean) * crossed).sum((1, 3))
    shares = measured * shares_of_posts(heights.shape, level)
    return CutErrors(largest, (np.square(errors) * shares).sum((1, 3)) + between)


# M = max e over the closed node,   Σ e² over the node's own posts,   e the larger error of the two ways to draw it.
# Each crossed cell adds m (2 worst + m) to Σ e²; m and worst as in `between`.


def node_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> NodeErrors:
    """Errors of every node of a level ≥ 1; posts (rows, cols) in metres. Void posts are drawn but not measured.

    The largest errors of fans do not include the children. The GPU's table has the maximum with the children's errors.
    """
    quad_max, fan_max = _largest(heights, level, void)
    posts = np.maximum(own_posts(heights.shape, level, void).sum((1, 3)), 1)
    quad, fan = (sums / posts for sums in squared_errors(heights, level, void))
    return NodeErrors(quad_max, fan_max, quad, fan)


def _largest(heights: np.ndarray, level: int, void: np.ndarray | None) -> list[np.ndarray]:
    """Largest error of each node, as quad and as fan."""
    measured = measured_posts(heights.shape, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    found = []
    for pair, kink in zip(_both(heights, level), kinks(heights, level), strict=True):
        cells = over_cells(np.maximum(*pair), -np.minimum(*pair), heights, level, kink) * crossed
        found.append(np.maximum((_worse(pair) * measured).max((1, 3)), cells.max((1, 3))))
    return found


def squared_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Sums of squared errors over each node's own posts without voids and its crossed cells, m²: as quads, as fans.

    A root mean square is at most the largest error. So a sum is at most that error squared, times the number of posts.
    """
    own = own_posts(heights.shape, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    twist = np.abs(cell_twists(heights, level))
    posts = own_posts(heights.shape, level, None).sum((1, 3))
    found = []
    for pair, kink, most in zip(
        _both(heights, level), kinks(heights, level), _largest(heights, level, void), strict=True
    ):
        errors = _worse(pair)
        mean = twist / np.sqrt(90) + kink[:, None, :, None]
        between = mean * (2 * worst_corner(errors) + mean) * crossed
        found.append(np.minimum(np.square(errors * own).sum((1, 3)) + between.sum((1, 3)), np.square(most) * posts))
    return found[0], found[1]


def _both(heights: np.ndarray, level: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Errors for the two ways to draw a quad, and for the two ways to draw a fan."""
    return [quad_errors(heights, level), fan_errors(heights, level)]


def _worse(pair: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.maximum(*map(np.abs, pair))


# A split replaces a leaf by its parts. At a price of λ a triangle, a leaf costs Σ e² + λ · triangles. A split pays
# below
#   λ = (Σ e² of the leaf − Σ e² of its parts) / (triangles added)


def split_gains(heights: np.ndarray, void: np.ndarray | None = None) -> list[np.ndarray]:
    """Squared error that a split removes for each triangle that it adds, m², for each level from 1 on.

    Gains are nested: a node's gain is never below the gains of its children. Mean squares of fans are nested, too.
    """
    gains: list[np.ndarray] = []
    holes = np.zeros(heights.shape, bool) if void is None else void
    solid = ~(holes[1:, 1:] | holes[1:, :-1] | holes[:-1, 1:] | holes[:-1, :-1])
    parts = np.where(solid, cell_squares(heights.astype(np.float64))[0], 0.0)  # cells have errors between their posts
    nested = fan_mean = np.zeros(parts.shape)
    for level in range(1, top_level(heights.shape) + 1):
        y, x = node_axes(heights.shape, level)
        posts = y.own.sum(1)[:, None] * x.own.sum(1)
        quad, fan = squared_errors(heights, level, void)
        children = sum_children(np.ones(parts.shape), quad.shape)
        fan_mean = np.maximum(fan / posts, max_children(fan_mean, quad.shape))
        fan_triangles = 4.0 - (y.mid == y.high)[:, None] - (x.mid == x.high)
        own = _split_gain(quad, fan_mean * posts, fan_triangles, sum_children(parts, quad.shape), 2 * children)
        nested = np.maximum(own, max_children(nested, quad.shape))
        gains.append(nested)
        parts = quad
    return gains


def _split_gain(
    quad: np.ndarray, fan: np.ndarray, fan_triangles: np.ndarray, parts: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """Price below which the parts cost less than the node as a quad and as a fan."""
    for_quad = (quad - parts) / np.maximum(triangles - 2, 1)
    fan_pays = (quad - fan) / np.maximum(fan_triangles - 2, 1)
    for_fan = (fan - parts) / np.maximum(triangles - fan_triangles, 1)
    return np.maximum(np.where((for_quad >= fan_pays) | (triangles <= fan_triangles), for_quad, for_fan), 0)


def sum_children(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Sum over the up to four children of each node of a level of this shape."""
    return _children(values, shape).sum((1, 3))


def max_children(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Maximum over the up to four children of each node of a level of this shape; values ≥ 0."""
    return _children(values, shape).max((1, 3))


def _children(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    padded = np.zeros((2 * shape[0], 2 * shape[1]), values.dtype)
    padded[: values.shape[0], : values.shape[1]] = values
    return padded.reshape(shape[0], 2, shape[1], 2)
