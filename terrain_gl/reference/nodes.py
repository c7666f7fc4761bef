"""error, continued: the nodes of a map, and which posts belong to each."""

from typing import NamedTuple

import numpy as np


class Nodes(NamedTuple):
    """The nodes of one level along one axis: node i covers the posts low[i] to high[i]."""

    low: np.ndarray  # (nodes,)
    mid: np.ndarray  # (nodes,)
    high: np.ndarray  # (nodes,)
    post: np.ndarray  # (nodes, at most 2^level + 1); past the map's last post, that post is repeated
    own: np.ndarray  # same shape; False for a node's last post, which belongs to its neighbour, and for repeated posts


def nodes_along(n: int, level: int) -> Nodes:
    """Cut an axis of n posts into nodes of a level."""
    side = 1 << level
    last = n - 1
    low = np.arange(0, last, side)
    high = np.minimum(low + side, last)
    post = low[:, None] + np.arange(min(side, last) + 1)
    own = (post < high[:, None]) | (post == last)
    return Nodes(low, np.minimum(low + side // 2, last), high, np.minimum(post, last), own)


def node_axes(shape: tuple[int, ...], level: int) -> tuple[Nodes, Nodes]:
    """Nodes of a level along the rows and along the columns of a map of this shape."""
    return nodes_along(shape[0], level), nodes_along(shape[1], level)


def per_node(y: Nodes, x: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Index that turns an array of posts into an array of nodes, (node rows, posts, node cols, posts)."""
    return y.post[:, :, None, None], x.post[None, None]


def at_nodes(h: np.ndarray, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Heights at one post of each node, (node rows, 1, node cols, 1)."""
    return h[rows[:, None, None, None], cols[None, None, :, None]]


def top_level(shape: tuple[int, ...]) -> int:
    """Level of the one node over a whole map of (rows, cols) posts; at least 1."""
    return max(1, int(max(shape) - 2).bit_length())
