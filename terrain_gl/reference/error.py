"""error: the distance between the triangles of each node and the truth.

A node of level j covers 2^j × 2^j cells of the map. Past the map's last post its corners are clamped to that post. A
node is a cell of a patch: two triangles, whose edges neighbours may cut. The errors bound the whole surface, at the
posts and between them. They depend on the heights alone, not on the view.
"""

from typing import NamedTuple

import numpy as np

from .between import (
    bend_bounds,
    cell_twists,
    crossed_cells,
    measured_posts,
    over_cells,
    shares_of_posts,
    worst_corner,
)
from .nodes import Nodes, at_nodes, node_axes, per_node

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


# M = max e over the closed node, with whole edges. e is the larger error of the two diagonals.


def largest_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> np.ndarray:
    """Largest error of each node of a level ≥ 1 whose edges are whole, (rows, cols) metres. Void posts do not count."""
    pair = quad_errors(heights, level)
    measured = measured_posts(heights.shape, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    cells = over_cells(np.maximum(*pair), -np.minimum(*pair), heights, level, bend_bounds(heights, level)) * crossed
    at_posts = np.maximum(*map(np.abs, pair)) * measured
    return np.maximum(at_posts.max((1, 3)), cells.max((1, 3)))


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


def cut_edges(heights: np.ndarray, level: int) -> np.ndarray:
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
    edge_above, edge_below = cut_edges(heights, level)[:, :, :, None, :, None].swapaxes(0, 1)
    above = np.maximum(*pair) + (weights * edge_above).max(0)
    below = -np.minimum(*pair) + (weights * edge_below).max(0)
    bend = bend_bounds(heights, level)
    errors = np.maximum(above, below)
    crossed = crossed_cells(heights.shape, level, void)
    measured = measured_posts(heights.shape, level, void)
    cells = over_cells(above, below, heights, level, bend)
    largest = np.maximum((errors * measured).max((1, 3)), (cells * crossed).max((1, 3)))
    mean = np.abs(cell_twists(heights, level)) * np.sqrt(13 / 1024) + bend[:, None, :, None]
    between = (mean * (2 * worst_corner(errors) + mean) * crossed).sum((1, 3))
    shares = measured * shares_of_posts(heights.shape, level)
    return CutErrors(largest, (np.square(errors) * shares).sum((1, 3)) + between)
