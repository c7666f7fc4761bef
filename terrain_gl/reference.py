"""Every stage in plain numpy, a few lines each: the specification, and what the tests compare with.

The sections follow the stages: sat → error → lod → mesh → shade.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# --- sat ---------------------------------------------------------------------------------------------------------


def sat(values: np.ndarray) -> np.ndarray:
    """Summed-area table of unsigned `values` (rows, cols, ...), wrapped to their dtype: table[y, x] = S(x + 1, y + 1).

    S(x, y) = sum of values[j, i] over i < x, j < y (Crow 1984).
    """
    return values.cumsum(1, dtype=values.dtype).cumsum(0, dtype=values.dtype)


def box_sum(table: np.ndarray, a: tuple[int, int], b: tuple[int, int]) -> int:
    """Sum over columns a[0] to b[0] and rows a[1] to b[1], ends outside; exact while below 2^bits of the table."""

    def S(x: int, y: int) -> int:
        return int(table[y - 1, x - 1]) if x and y else 0

    return (S(*b) - S(a[0], b[1]) - S(b[0], a[1]) + S(*a)) % 2 ** (8 * table.itemsize)


# --- error -------------------------------------------------------------------------------------------------------


class Nodes(NamedTuple):
    """The nodes of one level along one axis of n posts: node i covers posts low[i] to high[i], clamped to the last."""

    low: np.ndarray  # (nodes,)
    mid: np.ndarray  # (nodes,)
    high: np.ndarray  # (nodes,)
    post: np.ndarray  # (nodes, up to 2^level + 1), the last one again where the map ends before the node
    own: np.ndarray  # whether the post is this node's: not its last, unless that is the map's, and not again


class DrawingErrors(NamedTuple):
    """Metres between the truth and each node of a level as drawn, (rows, cols) of nodes."""

    quad_max: np.ndarray
    fan_max: np.ndarray
    quad_square: np.ndarray  # means over the node's own posts, voids aside
    fan_square: np.ndarray


def nodes_along(n: int, level: int) -> Nodes:
    """Cut an axis of n posts into nodes of a level."""
    side, last = 1 << level, n - 1
    low = np.arange(0, last, side)
    high = np.minimum(low + side, last)
    post = low[:, None] + np.arange(min(side, last) + 1)
    own = (post < high[:, None]) | (post == last)
    return Nodes(low, np.minimum(low + side // 2, last), high, np.minimum(post, last), own)


def drawing_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> DrawingErrors:
    """Errors of every node of a level ≥ 1, posts (rows, cols) in metres; at void posts heights are drawn, not measured.

    Fan maxima are those of the level alone: the table's are nested, the maximum with those of the children.
    """
    y, x = nodes_along(heights.shape[0], level), nodes_along(heights.shape[1], level)
    seen = np.ones(heights.shape, bool) if void is None else ~void
    measured = seen[_per_node(y, x)]
    quad = np.maximum(*map(np.abs, quad_errors(heights, level))) * measured
    fan = np.maximum(*map(np.abs, fan_errors(heights, level))) * measured
    own = measured & y.own[:, :, None, None] & x.own
    posts = np.maximum(own.sum((1, 3)), 1)
    squares = [np.square(e * own).sum((1, 3)) / posts for e in (quad, fan)]
    return DrawingErrors(quad.max((1, 3)), fan.max((1, 3)), *squares)


def quad_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Drawn minus true height at each post of each node, as two triangles, for either diagonal.

    Arrays (node rows, posts, node cols, posts).
    """
    h = heights.astype(np.float64)
    y, x = nodes_along(h.shape[0], level), nodes_along(h.shape[1], level)
    t = ((x.post - x.low[:, None]) / (x.high - x.low)[:, None])[None, None]
    s = ((y.post - y.low[:, None]) / (y.high - y.low)[:, None])[:, :, None, None]
    nw, ne, sw, se = (_corner(h, rows, cols) for rows in (y.low, y.high) for cols in (x.low, x.high))
    falling = np.where(t >= s, nw + (ne - nw) * t + (se - ne) * s, nw + (sw - nw) * s + (se - sw) * t)
    rising = np.where(s + t <= 1, nw + (ne - nw) * t + (sw - nw) * s, se + (sw - se) * (1 - t) + (ne - se) * (1 - s))
    truth = h[_per_node(y, x)]
    return falling - truth, rising - truth


def fan_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Like `quad_errors` for a fan around the node's centre, for edges drawn whole and drawn in halves."""
    h = heights.astype(np.float64)
    y, x = nodes_along(h.shape[0], level), nodes_along(h.shape[1], level)
    across, weight_y = _wedges(h, y, x)
    along, weight_x = _wedges(h.T, x, y)
    north_or_south = weight_y <= weight_x.transpose(2, 3, 0, 1)
    truth = h[_per_node(y, x)]
    whole, halves = (
        np.where(north_or_south, a, b.transpose(2, 3, 0, 1)) - truth for a, b in zip(across, along, strict=True)
    )
    return whole, halves


def _wedges(h: np.ndarray, y: Nodes, x: Nodes) -> tuple[list[np.ndarray], np.ndarray]:
    """Heights in the fans' wedges north and south of the centre, edge whole and in halves, and the centre's weight."""
    north, weight = _from_middle(y)
    north, weight = north[:, :, None, None], weight[:, :, None, None]
    a, m, b = (np.where(north, _corner(h, y.low, c), _corner(h, y.high, c)) for c in (x.low, x.mid, x.high))
    before, after = (x.mid - x.low)[:, None], (x.high - x.mid)[:, None]
    at = (x.post - x.mid[:, None]) / np.where(weight < 1, 1 - weight, 1)  # where the ray from the centre meets the edge
    whole = a + (b - a) * (at + before) / (before + after)
    halves = m + np.where(at <= 0, (m - a) * at / before, (b - m) * at / np.maximum(after, 1))
    return [weight * _corner(h, y.mid, x.mid) + (1 - weight) * edge for edge in (whole, halves)], weight


def _from_middle(axis: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Whether a post is at or before its node's middle, and its weight: 1 there, 0 at both ends, (nodes, posts)."""
    to = axis.post - axis.mid[:, None]
    before, after = (axis.mid - axis.low)[:, None], (axis.high - axis.mid)[:, None]
    return to <= 0, 1 - np.abs(to) / np.where(to <= 0, before, np.maximum(after, 1))


def _per_node(y: Nodes, x: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Index that spreads an array of posts out to (node rows, posts, node cols, posts)."""
    return y.post[:, :, None, None], x.post[None, None]


def _corner(h: np.ndarray, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    return h[rows[:, None, None, None], cols[None, None, :, None]]
