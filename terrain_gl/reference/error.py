"""error: how far the triangles of each quadtree node are from the heights.

A node of level j covers 2^j × 2^j cells of the map. Past the map's last post its corners are clamped to that post. A
node is drawn as a quad (two triangles) or as a fan (triangles around its centre). The errors bound the whole surface,
at the posts and between them. They depend on the heights alone, not on the view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .between import cell_twists, crest, crossed_cells, kinks, measured_posts, of_corners, over_cells, worst_corner
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
    """Place of each post in its node along x and along y, 0 to 1, in arrays that broadcast to those of errors."""
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
    """Whether a post is at or before its node's middle, and its weight: 1 there, 0 at both ends, (nodes, posts)."""
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

    A crossed cell counts in each wedge that one of its posts lies in.

    Returns
    -------
    whole, split
        With the wedge's edge whole, and with it split.
    """
    wedge = wedges_of_posts(heights, level)
    measured = measured_posts(heights, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    kink = kinks(heights, level)[1]
    found = []
    for errors in fan_errors(heights, level):
        cells = over_cells(errors, -errors, heights, level, kink) * crossed
        at_posts = [(np.abs(errors) * (measured & (wedge == k))).max((1, 3)) for k in range(4)]
        within = [(cells * np.logical_or.reduce(of_corners(wedge == k))).max((1, 3)) for k in range(4)]
        found.append(np.maximum(np.stack(at_posts, -1), np.stack(within, -1)))
    return found[0], found[1]


# A finer neighbour cuts an edge: it gets more vertices. They are posts. They lie between −below and above off a
# straight line. Only vertices of one cut edge take part in a triangle; their weights at a place sum to v: 1 on their
# edge, 0 on the opposite side (of a fan: 0 at the centre). So these bound the error of every triangulation:
#   a cell of a patch       highest diagonal − h + v · above   and   h − lowest diagonal + v · below,  for each edge,
#                           with the line between the cell's corners
#   a patch of 2 × 2        fan with split edges − h + v · above   and   h − this fan + v · below,
#   segments, i.e. a fan    with the lines between a corner and the middle of its edge
# A patch of one cell is a fan whose edges are whole or cut: the larger error of the fan and of both bounds. All are
# linear where the drawing is: between posts they are like errors.


class CutErrors(NamedTuple):
    """Errors of each node whatever edges are cut, (rows, cols) of nodes: metres, and sums over own posts in m²."""

    largest: np.ndarray  # as a cell of a patch, or a patch of one cell
    squares: np.ndarray
    fan_largest: np.ndarray  # as a patch of 2 × 2 segments
    fan_squares: np.ndarray


def cut_moves(heights: np.ndarray, level: int) -> np.ndarray:
    """How far the posts of each node's edges lie above, and below, straight lines.

    Returns
    -------
    array
        (4, 3, 2, rows, cols) of nodes, metres: the edges west, north, east, south; the line between the edge's ends,
        from its first end to its middle, and from there to its other end; above, below.
    """
    h = heights.astype(np.float64)
    y, x = node_axes(heights.shape, level)
    north, south = (_off_lines(h[rows], x) for rows in (y.low, y.high))
    west, east = (_off_lines(h.T[cols], y).transpose(0, 1, 3, 2) for cols in (x.low, x.high))
    return np.stack([west, north, east, south])


def _off_lines(lines: np.ndarray, axis: Nodes) -> np.ndarray:
    """Of lines of posts (n, posts): (3, 2, n, nodes)."""
    found = []
    for low, high in ((axis.low, axis.high), (axis.low, axis.mid), (axis.mid, axis.high)):
        share = (axis.post - low[:, None]) / np.maximum(high - low, 1)[:, None]
        off = lines[:, axis.post] - lines[:, low, None] - (lines[:, high] - lines[:, low])[..., None] * share
        off = np.where((share >= 0) & (share <= 1) & (high > low)[:, None], off, 0.0)
        found.append([off.max(-1), -off.min(-1)])
    return np.array(found)


def cut_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> CutErrors:
    """Errors of each node of a level ≥ 1 in any triangulation, whatever edges are cut."""
    cell, fan, drawn = _cut_at_posts(heights, level)
    of_quad, of_fan = kinks(heights, level)
    bounds = [(*cell, of_quad), (*fan, of_fan), (*drawn, of_fan)]
    largest, squares = _over_node(heights, level, void, bounds, np.maximum(of_quad, of_fan))
    return CutErrors(largest, squares, *_over_node(heights, level, void, bounds[1:2], of_fan))


def _over_node(
    heights: np.ndarray, level: int, void: np.ndarray | None, bounds: list[tuple[np.ndarray, ...]], bend: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The largest of bounds (above, below, kink), and the sum of squares over own posts and crossed cells."""
    errors = np.maximum.reduce([each for above, below, _ in bounds for each in (above, below)])
    crossed = crossed_cells(heights.shape, level, void)
    corner = worst_corner(errors)
    measured = measured_posts(heights, level, void)
    cells = [over_cells(above, below, heights, level, kink) for above, below, kink in bounds]
    largest = np.maximum((errors * measured).max((1, 3)), (np.maximum.reduce(cells) * crossed).max((1, 3)))
    mean = np.abs(cell_twists(heights, level)) / np.sqrt(90) + bend[:, None, :, None]
    between = (mean * (2 * corner + mean) * crossed).sum((1, 3))
    return largest, np.square(errors * _own(heights, level, void)).sum((1, 3)) + between


def _cut_at_posts(heights: np.ndarray, level: int) -> list[list[np.ndarray]]:
    """Bounds above and below at each post, (node rows, posts, node cols, posts): cell, cut fan, fan."""
    y, x = node_axes(heights.shape, level)
    t, s = _places(y, x)
    pair = quad_errors(heights, level)
    fan = fan_errors(heights, level)
    weights = np.stack(np.broadcast_arrays(1 - t, 1 - s, t, s, fan[0])[:4])
    above, below = cut_moves(heights, level)[:, 0, :, :, None, :, None].swapaxes(0, 1)
    cell = [np.maximum(*pair) + (weights * above).max(0), -np.minimum(*pair) + (weights * below).max(0)]
    move = _fan_moves(heights, level)
    return [cell, [fan[1] + move[0], move[1] - fan[1]], [np.maximum(*fan), -np.minimum(*fan)]]


def _fan_moves(heights: np.ndarray, level: int) -> np.ndarray:
    """How far cuts move a fan with split edges at each post: above, below, (2, node rows, posts, node cols, posts).

    Spokes from the centre to corners and middles part the fan in eight. A post on a spoke takes the larger move of both
    sides. In a node that the map's rim cuts off, spokes run between posts; there one bound serves all eight.
    """
    moves = cut_moves(heights, level)[:, 1:]
    y, x = node_axes(heights.shape, level)
    square = (y.high - y.low == 1 << level)[:, None] & (x.high - x.low == 1 << level)
    moves = np.where(square, moves, moves.max((0, 1)))[:, :, :, :, None, :, None]
    of_y, of_x = (_from_middle(axis)[1] for axis in (y, x))
    of_y = of_y[:, :, None, None]
    of_x = of_x[None, None]
    down, right = ((axis.post - axis.mid[:, None]) for axis in (y, x))
    down = down[:, :, None, None]
    right = right[None, None]
    most = np.zeros((2, *np.broadcast_shapes(down.shape, right.shape)))
    in_row = of_y <= of_x
    in_column = of_x <= of_y
    wedges = [(down, -right, in_column), (right, -down, in_row), (down, right, in_column), (right, down, in_row)]
    for side, (along, across, inside) in enumerate(wedges):
        for half, sign in enumerate((-1, 1)):
            within = inside & (across >= 0) & (sign * along >= 0)
            most = np.where(within, np.maximum(most, moves[side, half]), most)
    return (1 - np.minimum(of_y, of_x)) * most


# A patch of 4 × 4 or 8 × 8 segments is a star: each diagonal points to its middle. A cell of it has one diagonal,
# and only the edges that meet in the diagonal's outer end may be cut. Each is a leg of one triangle. In this triangle v
# is larger for this edge than for the other. So these bound the error of the cell:
#   e + v · above   and   v · below − e        with the error e, drawn minus true, of the cell with this diagonal
# Both are linear in each triangle: largest at a post, or on the diagonal.


def turned_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> np.ndarray:
    """Largest error of each node of a level ≥ 1 as one cell whose diagonal ends in one corner.

    Both edges that meet in this corner may be cut.

    Returns
    -------
    array
        (rows, cols, 4) of nodes: the corners north-west, north-east, south-east, south-west. Metres; infinite in nodes
        that the map's rim cuts off.
    """
    y, x = node_axes(heights.shape, level)
    side = 1 << level
    found = np.full((len(y.low), len(x.low), 4), np.inf)
    if side >= min(heights.shape):
        return found
    t, s = _places(y, x)
    pair = quad_errors(heights, level)
    twist = cell_twists(heights, level)
    weights = (1 - t, 1 - s, t, s)
    moves = cut_moves(heights, level)[:, 0, :, :, None, :, None]
    measured = measured_posts(heights, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    for k, (one, other) in enumerate([(0, 1), (1, 2), (2, 3), (3, 0)]):  # edges in the order of `cut_moves`
        move = np.maximum(weights[one] * moves[one], weights[other] * moves[other])
        rises = k % 2
        row = np.arange(side + 1)
        col, cell = (row[::-1], (row[:-1], row[-2::-1])) if rises else (row, (row[:-1], row[:-1]))
        largest = np.zeros((len(y.low), len(x.low)))
        for sign, off in zip((1, -1), move, strict=True):
            errors = sign * pair[rises] + off
            ends = errors[:, row, :, col]
            bend = sign * (-1) ** rises * twist[:, cell[0], :, cell[1]]
            within = (crest(ends[:-1], ends[1:], bend) * crossed[:, cell[0], :, cell[1]]).max(0)
            largest = np.maximum.reduce([largest, (errors * measured).max((1, 3)), within])
        found[..., k] = largest
    whole = (y.high - y.low == side)[:, None] & (x.high - x.low == side)
    return np.where(whole[..., None], found, np.inf)


def star_errors(heights: np.ndarray, level: int, segments_log2: int, void: np.ndarray | None = None) -> np.ndarray:
    """Largest error of each node as a patch of 2^segments_log2 segments a side, whatever outer edges are cut.

    Inner cells have no outer edge, so a bound with cuts at either end of the diagonal holds. Metres, (rows, cols) of
    nodes of a level > segments_log2; infinite in nodes that the map's rim cuts off.
    """
    turned = turned_errors(heights, level - segments_log2, void)
    y, x = node_axes(heights.shape, level)
    n = 1 << segments_log2
    cells = np.full((n * len(y.low), n * len(x.low), 4), np.inf)
    cells[: turned.shape[0], : turned.shape[1]] = turned
    cells = cells.reshape(len(y.low), n, len(x.low), n, 4)
    corner = np.kron([[0, 1], [3, 2]], np.ones((n // 2, n // 2), int))[None, :, None, :, None]
    outer, inner = (np.take_along_axis(cells, at, -1)[..., 0] for at in (corner, (corner + 2) % 4))
    outer[:, 1:-1, :, 1:-1] = np.minimum(outer, inner)[:, 1:-1, :, 1:-1]
    return outer.max((1, 3))


# M = max e over the closed node,   Σ e² over the node's own posts,   e the worse of both ways to draw it.
# Each crossed cell adds m (2 worst + m) to Σ e².


def node_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> NodeErrors:
    """Errors of every node of a level ≥ 1; posts (rows, cols) in metres. Void posts are drawn but not measured.

    Fan maxima here are those of the level alone. The GPU's table is nested: the maximum of these and the children's.
    """
    quad_max, fan_max = _largest(heights, level, void)
    posts = np.maximum(_own(heights, level, void).sum((1, 3)), 1)
    quad, fan = (sums / posts for sums in squared_errors(heights, level, void))
    return NodeErrors(quad_max, fan_max, quad, fan)


def _largest(heights: np.ndarray, level: int, void: np.ndarray | None) -> list[np.ndarray]:
    """Largest error of each node, as quad and as fan."""
    measured = measured_posts(heights, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    found = []
    for pair, kink in zip(_both(heights, level), kinks(heights, level), strict=True):
        cells = over_cells(np.maximum(*pair), -np.minimum(*pair), heights, level, kink) * crossed
        found.append(np.maximum((_worse(pair) * measured).max((1, 3)), cells.max((1, 3))))
    return found


def squared_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Sums of squared errors over each node's own posts without voids and its crossed cells, m²: as quads, as fans.

    A root mean square is at most the largest error.
    """
    own = _own(heights, level, void)
    crossed = crossed_cells(heights.shape, level, void)
    twist = np.abs(cell_twists(heights, level))
    posts = _own(heights, level, None).sum((1, 3))
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
    """Both ways to draw a quad, and both to draw a fan."""
    return [quad_errors(heights, level), fan_errors(heights, level)]


def _worse(pair: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.maximum(*map(np.abs, pair))


def _own(heights: np.ndarray, level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts are each node's own and no voids: (node rows, posts, node cols, posts)."""
    y, x = node_axes(heights.shape, level)
    return measured_posts(heights, level, void) & y.own[:, :, None, None] & x.own


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
