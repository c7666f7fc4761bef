"""lod: the restricted quadtree. splits[j] is an array over the nodes of level j, (rows, cols): which are split."""

import numpy as np

from .error import sum_children


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
