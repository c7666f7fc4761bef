"""error: how far the triangles of each quadtree node are from the heights.

A node of level j covers 2^j × 2^j cells of the map. Past the map's last post its corners are clamped to that post. A
node is drawn as a quad (two triangles) or as a fan (triangles around its centre). The errors bound the whole surface,
at the posts and between them. They depend on the heights alone, not on the view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .bound import cell_squares, twists


class Nodes(NamedTuple):
    """The nodes of one level along one axis: node i covers the posts low[i] to high[i]."""

    low: np.ndarray  # (nodes,)
    mid: np.ndarray  # (nodes,)
    high: np.ndarray  # (nodes,)
    post: np.ndarray  # (nodes, up to 2^level + 1), the map's last post repeated where the map ends first
    own: np.ndarray  # like `post`: False for a node's last post, which is its neighbour's, and for repeated posts


class NodeErrors(NamedTuple):
    """Errors of each node of a level in metres and square metres, (rows, cols) of nodes."""

    quad_max: np.ndarray
    fan_max: np.ndarray
    quad_square: np.ndarray  # means over the node's own posts without voids
    fan_square: np.ndarray


def nodes_along(n: int, level: int) -> Nodes:
    """Cut an axis of n posts into nodes of a level."""
    side, last = 1 << level, n - 1
    low = np.arange(0, last, side)
    high = np.minimum(low + side, last)
    post = low[:, None] + np.arange(min(side, last) + 1)
    own = (post < high[:, None]) | (post == last)
    return Nodes(low, np.minimum(low + side // 2, last), high, np.minimum(post, last), own)


def node_axes(shape: tuple[int, ...], level: int) -> tuple[Nodes, Nodes]:
    """Nodes of a level along the rows and along the columns of a map of this shape."""
    return nodes_along(shape[0], level), nodes_along(shape[1], level)


def per_node(y: Nodes, x: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Index that spreads an array of posts to (node rows, posts, node cols, posts)."""
    return y.post[:, :, None, None], x.post[None, None]


def at_nodes(h: np.ndarray, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Heights at one post of each node, (node rows, 1, node cols, 1)."""
    return h[rows[:, None, None, None], cols[None, None, :, None]]


# With corners a, b, c, d (north-west, north-east, south-west, south-east) and 0 ≤ x, y ≤ 1 across the node:
#   falling diagonal   x ≥ y:      a + (b − a) x + (d − b) y        else   a + (c − a) y + (d − c) x
#   rising diagonal    x + y ≤ 1:  a + (b − a) x + (c − a) y        else   d + (c − d)(1 − x) + (b − d)(1 − y)


def quad_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Drawn minus true height at each post of each node as a quad: with the falling and with the rising diagonal.

    OpenGL does not say which diagonal a tessellator takes. Arrays (node rows, posts, node cols, posts).
    """
    h = heights.astype(np.float64)
    y, x = node_axes(h.shape, level)
    t = ((x.post - x.low[:, None]) / (x.high - x.low)[:, None])[None, None]
    s = ((y.post - y.low[:, None]) / (y.high - y.low)[:, None])[:, :, None, None]
    a, b, c, d = (at_nodes(h, rows, cols) for rows in (y.low, y.high) for cols in (x.low, x.high))
    falling = np.where(t >= s, a + (b - a) * t + (d - b) * s, a + (c - a) * s + (d - c) * t)
    rising = np.where(s + t <= 1, a + (b - a) * t + (c - a) * s, d + (c - d) * (1 - t) + (b - d) * (1 - s))
    truth = h[per_node(y, x)]
    return falling - truth, rising - truth


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
    north, weight = north[:, :, None, None], weight[:, :, None, None]
    a, m, b = (np.where(north, at_nodes(h, y.low, c), at_nodes(h, y.high, c)) for c in (x.low, x.mid, x.high))
    before, after = (x.mid - x.low)[:, None], (x.high - x.mid)[:, None]
    at = (x.post - x.mid[:, None]) / np.where(weight < 1, 1 - weight, 1)  # where the ray from the centre meets the edge
    whole = a + (b - a) * (at + before) / (before + after)
    split = m + np.where(at <= 0, (m - a) * at / before, (b - m) * at / np.maximum(after, 1))
    return [weight * at_nodes(h, y.mid, x.mid) + (1 - weight) * edge for edge in (whole, split)], weight


def _from_middle(axis: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Whether a post is at or before its node's middle, and its weight: 1 there, 0 at both ends, (nodes, posts)."""
    to = axis.post - axis.mid[:, None]
    before, after = (axis.mid - axis.low)[:, None], (axis.high - axis.mid)[:, None]
    return to <= 0, 1 - np.abs(to) / np.where(to <= 0, before, np.maximum(after, 1))


def wedges_of_posts(heights: np.ndarray, level: int) -> np.ndarray:
    """The fan wedge that each post lies in: 0 west, 1 north, 2 east, 3 south; (node rows, posts, node cols, posts)."""
    y, x = node_axes(heights.shape, level)
    (north, weight_y), (west, weight_x) = _from_middle(y), _from_middle(x)
    north_or_south = weight_y[:, :, None, None] <= weight_x
    return np.where(north_or_south, np.where(north[:, :, None, None], 1, 3), np.where(west, 0, 2))


# Between the posts the truth is bilinear. In a cell that one triangle covers, the error is largest at a post. If an
# edge of the mesh crosses a cell, drawn minus true is at most
#   e = worst + |t|/4 + kink                and in the root mean square   worst + m,   m = |t|/√90 + kink
# worst is the largest error at the cell's posts, and t its twist. The diagonals of a square node run through posts, so
# kink is 0. In a node that the map's rim cuts off, they may cross any cell. The planes of a rectangle of w × h cells
# with the twist τ differ by |τ| |x/w − y/h|, so by
#   kink = |τ| min(1/w + 1/h, 1)
# at most within a cell that the diagonal crosses.


def crossed_cells(shape: tuple[int, ...], level: int, void: np.ndarray | None = None) -> np.ndarray:
    """Cells of each node that an edge of the mesh may cross, without holes: (node rows, cells, node cols, cells)."""
    y, x = node_axes(shape, level)
    row, col = (np.arange(axis.post.shape[1] - 1) for axis in (y, x))
    diagonal = (row[:, None, None] == col) | (row[:, None, None] + col == (1 << level) - 1)
    square = _square_nodes(shape, level)[:, None, :, None]
    of_node = (np.diff(y.post) > 0)[:, :, None, None] & (np.diff(x.post) > 0)
    corners = _of_corners(_measured(np.zeros(shape), level, void))
    return of_node & (diagonal | ~square) & np.logical_and.reduce(corners)


def kinks(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Largest bend of each node's diagonals within a cell, metres, (rows, cols) of nodes: as quad, and as fan."""
    h, (y, x) = heights.astype(np.float64), node_axes(heights.shape, level)
    ends_y, ends_x = ((axis.low, axis.high) for axis in (y, x))
    at = {(i, j): h[np.ix_(rows, cols)] for i, rows in enumerate(ends_y) for j, cols in enumerate(ends_x)}
    quad = _bend(at[0, 0] - at[0, 1] - at[1, 0] + at[1, 1], (y.high - y.low)[:, None], x.high - x.low)
    share_y, share_x = ((axis.mid - axis.low) / (axis.high - axis.low) for axis in (y, x))
    fan = np.zeros(quad.shape)
    for i, j in at:  # the quarter between the centre and each corner, both of its outer edges whole or split
        rows, cols = np.abs(y.mid - ends_y[i])[:, None], np.abs(x.mid - ends_x[j])
        line_x = at[i, 0] + (at[i, 1] - at[i, 0]) * share_x
        line_y = at[0, j] + (at[1, j] - at[0, j]) * share_y[:, None]
        for along_x in (line_x, h[np.ix_(ends_y[i], x.mid)]):
            for along_y in (line_y, h[np.ix_(y.mid, ends_x[j])]):
                fan = np.maximum(fan, _bend(at[i, j] + h[np.ix_(y.mid, x.mid)] - along_x - along_y, rows, cols))
    square = _square_nodes(heights.shape, level)
    return np.where(square, 0.0, quad), np.where(square, 0.0, fan)


def _bend(twist: np.ndarray, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    share = np.minimum(1 / np.maximum(rows, 1) + 1 / np.maximum(cols, 1), 1.0)
    return np.where((rows > 0) & (cols > 0), np.abs(twist) * share, 0.0)


def _square_nodes(shape: tuple[int, ...], level: int) -> np.ndarray:
    """Nodes that the map's rim does not cut off, (rows, cols) of nodes."""
    rows, cols = (axis.high - axis.low == 1 << level for axis in node_axes(shape, level))
    return rows[:, None] & cols


def _of_corners(posts: np.ndarray) -> list[np.ndarray]:
    """Values at the four posts of each cell, of an array (node rows, posts, node cols, posts)."""
    ends = (np.s_[:-1], np.s_[1:])
    return [posts[:, rows, :, cols] for rows in ends for cols in ends]


def _worst_corner(errors: np.ndarray) -> np.ndarray:
    return np.maximum.reduce(_of_corners(np.abs(errors)))


def _cell_twists(heights: np.ndarray, level: int) -> np.ndarray:
    """Size |t| of the twist of each cell of each node, (node rows, cells, node cols, cells)."""
    y, x = (
        np.minimum(axis.post[:, :-1], n - 2)
        for axis, n in zip(node_axes(heights.shape, level), heights.shape, strict=True)
    )
    return np.abs(twists(heights.astype(np.float64)))[y[:, :, None, None], x]


def wedge_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Largest error in each wedge of each node's fan, west, north, east and south, (rows, cols, 4) of nodes.

    A crossed cell counts in each wedge that one of its posts lies in.

    Returns
    -------
    whole, split
        With the wedge's edge whole, and with it split.
    """
    wedge, measured = wedges_of_posts(heights, level), _measured(heights, level, void)
    crossed, bend = crossed_cells(heights.shape, level, void), _bends(heights, level)[1]
    found = []
    for errors in fan_errors(heights, level):
        cells = (_worst_corner(errors) + bend) * crossed
        at_posts = [(np.abs(errors) * (measured & (wedge == k))).max((1, 3)) for k in range(4)]
        within = [(cells * np.logical_or.reduce(_of_corners(wedge == k))).max((1, 3)) for k in range(4)]
        found.append(np.maximum(np.stack(at_posts, -1), np.stack(within, -1)))
    return found[0], found[1]


# A finer neighbour cuts an edge of a cell: it gets more vertices. They are posts. They lie between −below and above
# off the straight line between the cell's corners. With the vertices on that line the drawing lies between both
# diagonals, or is the fan if the patch is a single cell. Only vertices of one cut edge take part in a triangle. Their
# weights at a place sum to v: 1 on their edge, 0 on the opposite side (of a fan: 0 at the centre). So for each edge
#   highest diagonal − h + v · above   and   h − lowest diagonal + v · below     (of a fan: the same of its wedge)
# bound the error of every triangulation. Both are linear where the diagonals are, so crossed cells add |t|/4 + kink.


def cut_moves(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """How far the posts of each node's west, north, east and south edge lie above, and below, a straight edge.

    Arrays (4, rows, cols) of nodes, metres.
    """
    h, (y, x) = heights.astype(np.float64), node_axes(heights.shape, level)
    north, south = (_off_lines(h[rows], x) for rows in (y.low, y.high))
    west, east = (_off_lines(h.T[cols], y).transpose(0, 2, 1) for cols in (x.low, x.high))
    sides = np.stack([west, north, east, south], 1)
    return sides[0], sides[1]


def _off_lines(lines: np.ndarray, axis: Nodes) -> np.ndarray:
    """Of lines of posts (n, posts): (2, n, nodes), the most above and below the line between each node's ends."""
    share = (axis.post - axis.low[:, None]) / (axis.high - axis.low)[:, None]
    low, high = lines[:, axis.low, None], lines[:, axis.high, None]
    off = lines[:, axis.post] - low - (high - low) * share
    return np.stack([off.max(-1), -off.min(-1)])


def cut_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Errors of each node as a cell of a patch, whatever edges of it are cut, (rows, cols) of nodes.

    The largest, in metres, and the sum of squares over the node's own posts and its crossed cells, m².
    """
    errors, crossed = _cut_at_posts(heights, level), crossed_cells(heights.shape, level, void)
    corner, measured = _worst_corner(errors), _measured(heights, level, void)
    cells = (corner + np.maximum(*_bends(heights, level))) * crossed
    largest = np.maximum((errors * measured).max((1, 3)), cells.max((1, 3)))
    mean = _cell_twists(heights, level) / np.sqrt(90) + np.maximum(*kinks(heights, level))[:, None, :, None]
    between = (mean * (2 * corner + mean) * crossed).sum((1, 3))
    return largest, np.square(errors * _own(heights, level, void)).sum((1, 3)) + between


def _cut_at_posts(heights: np.ndarray, level: int) -> np.ndarray:
    """The bound at each post of each node, (node rows, posts, node cols, posts)."""
    y, x = node_axes(heights.shape, level)
    t = ((x.post - x.low[:, None]) / (x.high - x.low)[:, None])[None, None]
    s = ((y.post - y.low[:, None]) / (y.high - y.low)[:, None])[:, :, None, None]
    pair, fan = quad_errors(heights, level), fan_errors(heights, level)[0]
    weights = np.stack(np.broadcast_arrays(1 - t, 1 - s, t, s, fan)[:4])
    above, below = (move[:, :, None, :, None] for move in cut_moves(heights, level))
    up = np.maximum(*pair) + (weights * above).max(0)
    down = -np.minimum(*pair) + (weights * below).max(0)
    wedge, outward = wedges_of_posts(heights, level)[None], 1 - _centre_weights(heights.shape, level)
    of_wedge = [np.take_along_axis(np.broadcast_to(m, weights.shape), wedge, 0)[0] for m in (above, below)]
    return np.maximum.reduce([up, down, fan + outward * of_wedge[0], -fan + outward * of_wedge[1]])


def _centre_weights(shape: tuple[int, ...], level: int) -> np.ndarray:
    """Weight of a fan's centre at each post of each node, (node rows, posts, node cols, posts)."""
    of_y, of_x = (_from_middle(axis)[1] for axis in node_axes(shape, level))
    return np.minimum(of_y[:, :, None, None], of_x)


def _bends(heights: np.ndarray, level: int) -> list[np.ndarray]:
    """The increase of a cell's largest error by an edge that crosses it: |t|/4 + kink, as quad and as fan."""
    twist = _cell_twists(heights, level)
    return [twist / 4 + kink[:, None, :, None] for kink in kinks(heights, level)]


# M = max e over the closed node,   Σ e² over the node's own posts,   e the worse of both ways to draw it.
# Each crossed cell adds m (2 worst + m) to Σ e², m = |t|/√90 + kink.


def node_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> NodeErrors:
    """Errors of every node of a level ≥ 1; posts (rows, cols) in metres. Void posts are drawn but not measured.

    Fan maxima here are those of the level alone. The GPU's table is nested: the maximum of these and the children's.
    """
    measured, crossed = _measured(heights, level, void), crossed_cells(heights.shape, level, void)
    largest = []
    for pair, bend in zip(_both(heights, level), _bends(heights, level), strict=True):
        errors = _worse(pair)
        cells = (_worst_corner(errors) + bend) * crossed
        largest.append(np.maximum((errors * measured).max((1, 3)), cells.max((1, 3))))
    posts = np.maximum(_own(heights, level, void).sum((1, 3)), 1)
    quad, fan = (sums / posts for sums in squared_errors(heights, level, void))
    return NodeErrors(largest[0], largest[1], quad, fan)


def squared_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Sums of squared errors over each node's own posts without voids and its crossed cells, m²: as quads, as fans."""
    own, crossed = _own(heights, level, void), crossed_cells(heights.shape, level, void)
    twist, found = _cell_twists(heights, level), []
    for pair, kink in zip(_both(heights, level), kinks(heights, level), strict=True):
        errors, mean = _worse(pair), twist / np.sqrt(90) + kink[:, None, :, None]
        between = mean * (2 * _worst_corner(errors) + mean) * crossed
        found.append(np.square(errors * own).sum((1, 3)) + between.sum((1, 3)))
    return found[0], found[1]


def _both(heights: np.ndarray, level: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Both ways to draw a quad, and both to draw a fan."""
    return [quad_errors(heights, level), fan_errors(heights, level)]


def _worse(pair: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.maximum(*map(np.abs, pair))


def _measured(heights: np.ndarray, level: int, void: np.ndarray | None) -> np.ndarray:
    seen = np.ones(heights.shape, bool) if void is None else ~void
    return seen[per_node(*node_axes(heights.shape, level))]


def _own(heights: np.ndarray, level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts are each node's own and no voids: (node rows, posts, node cols, posts)."""
    y, x = node_axes(heights.shape, level)
    return _measured(heights, level, void) & y.own[:, :, None, None] & x.own


# A split replaces a leaf by its parts. At a price of λ a triangle, a leaf costs Σ e² + λ · triangles. It pays below
#   λ = (Σ e² of the leaf − Σ e² of its parts) / (triangles added)


def split_gains(heights: np.ndarray, void: np.ndarray | None = None) -> list[np.ndarray]:
    """Squared error that a split removes for each triangle that it adds, m², for each level from 1 on.

    Gains are nested: never below the gains of the node's children. Mean squares of fans are nested too.
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
    """Price below which the parts are cheaper than both kinds of leaf."""
    for_quad = (quad - parts) / np.maximum(triangles - 2, 1)
    fan_pays = (quad - fan) / np.maximum(fan_triangles - 2, 1)
    for_fan = (fan - parts) / np.maximum(triangles - fan_triangles, 1)
    return np.maximum(np.where((for_quad >= fan_pays) | (triangles <= fan_triangles), for_quad, for_fan), 0)


def top_level(shape: tuple[int, ...]) -> int:
    """Level of the one node over a whole map of (rows, cols) posts; at least 1."""
    return max(1, int(max(shape) - 2).bit_length())


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
