"""Not part of the line: fans and the restricted quadtree, for comparison and for the course.

splits[j] is an array over the nodes of level j, (rows, cols): which are split.
"""

import numpy as np

from .nodes import Nodes, at_nodes, node_axes, per_node


def unsplit(shape: tuple[int, ...], top: int) -> list[np.ndarray]:
    """Levels 0 to top of a map of (rows, cols) posts, no node split."""
    return [np.zeros([-(-(n - 1) >> level) for n in shape], bool) for level in range(top + 1)]


def children_of(nodes: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Spread values of a level to the level below, of this shape."""
    return nodes.repeat(2, 0).repeat(2, 1)[: shape[0], : shape[1]]


# A node exists if its parent is split; it is a leaf if it exists and is not split.


def existing(splits: list[np.ndarray]) -> list[np.ndarray]:
    """For each level, the nodes that exist."""
    found = [np.ones((1, 1), bool)]
    for fine, coarse in zip(splits[-2::-1], splits[:0:-1], strict=True):
        found.append(children_of(coarse, fine.shape))
    return found[::-1]


def grow(splits: list[np.ndarray], coarse: list[np.ndarray]) -> None:
    """From the root down, split the nodes that exist and are too coarse."""
    exists = np.ones((1, 1), bool)
    for level in range(len(splits) - 1, 0, -1):
        splits[level] |= exists & coarse[level]
        exists = children_of(splits[level], splits[level - 1].shape)


# Restricted (Von Herzen, Barr 1987): the parents of a split node's neighbours are split, so neighbours differ by at
# most one level.


def balance(splits: list[np.ndarray]) -> bool:
    """From the cells up, split the parents of each split node and of its neighbours; returns whether any changed."""
    before = sum(int(level.sum()) for level in splits)
    for fine, coarse in zip(splits[1:], splits[2:], strict=False):
        around = fine | np.logical_or.reduce(neighbours(fine))
        coarse |= sum_children(around.astype(int), coarse.shape) > 0
    return sum(int(level.sum()) for level in splits) > before


def neighbours(nodes: np.ndarray) -> list[np.ndarray]:
    """Values of each node's neighbours to the west, north, east and south; False beyond the map."""
    padded = np.pad(nodes, 1)
    return [padded[1:-1, :-2], padded[:-2, 1:-1], padded[1:-1, 2:], padded[2:, 1:-1]]


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
