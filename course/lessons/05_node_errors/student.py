"""Lesson 5: the errors of nodes, and bounds that are nested.

A node of level j covers 2^j × 2^j cells. Both sides of the map are multiples of 2^j cells, so no node is cut off.
"""

import numpy as np


def corners(heights, level):
    """Heights at the four corners of each node: north-west, north-east, south-west, south-east. Done for you."""
    n = 1 << level
    return heights[:-1:n, :-1:n], heights[:-1:n, n::n], heights[n::n, :-1:n], heights[n::n, n::n]


def posts(heights, level, dy, dx):
    """Heights at the post that is dy rows and dx columns from each node's north-west corner. Done for you."""
    n, (rows, cols) = 1 << level, heights.shape
    return heights[dy : rows - n + dy : n, dx : cols - n + dx : n]


def quad_errors(heights, level):
    """5.1 The largest distance of each node's two triangles from its posts, whichever diagonal the driver takes.

    All (2^level + 1)^2 posts of a node count, those on its edges too.

    returns   (node rows, node cols) metres
    """
    raise NotImplementedError("write this")


def fan_errors(heights, level):
    """5.2 The largest distance of each node's fan from its posts: four triangles around the middle post; level >= 1.

    returns   (node rows, node cols) metres
    """
    raise NotImplementedError("write this")


def cell_errors(heights):
    """5.3 The largest distance between each cell of the map drawn as two triangles and the bilinear truth.

    returns   (rows - 1, cols - 1) metres
    """
    raise NotImplementedError("write this")


def share_below(coarse, fine):
    """5.4 The share of the nodes of a level that have a smaller error than one of their four children, 0 to 1."""
    raise NotImplementedError("write this")


def nested(errors):
    """5.5 Nested bounds: the smallest numbers that are not below the node's error or a descendant's bound.

    errors    a list of arrays, one a level; each level has half as many nodes a side as the one before
    returns   a list of the same shapes
    """
    raise NotImplementedError("write this")
