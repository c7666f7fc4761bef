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
    # solution
    a, b, c, d = corners(heights, level)
    n, worst = 1 << level, np.zeros(corners(heights, level)[0].shape)
    for dy in range(n + 1):
        for dx in range(n + 1):
            s, t = dy / n, dx / n
            falling = a + (b - a) * t + (d - b) * s if t >= s else a + (c - a) * s + (d - c) * t
            rising = a + (b - a) * t + (c - a) * s if s + t <= 1 else d + (c - d) * (1 - t) + (b - d) * (1 - s)
            truth = posts(heights, level, dy, dx)
            worst = np.maximum(worst, np.maximum(np.abs(falling - truth), np.abs(rising - truth)))
    return worst
    # end


def fan_errors(heights, level):
    """5.2 The largest distance of each node's fan from its posts: four triangles around the middle post; level >= 1.

    returns   (node rows, node cols) metres
    """
    # solution
    a, b, c, d = corners(heights, level)
    n, worst = 1 << level, np.zeros(a.shape)
    middle = posts(heights, level, n // 2, n // 2)
    for dy in range(n + 1):
        for dx in range(n + 1):
            v, u = dy / (n / 2) - 1, dx / (n / 2) - 1  # -1 to 1, 0 in the middle
            away = max(abs(v), abs(u))
            if away == 0:
                continue
            if abs(v) >= abs(u):
                left, right, along = (a, b, u / away) if v < 0 else (c, d, u / away)
            else:
                left, right, along = (a, c, v / away) if u < 0 else (b, d, v / away)
            edge = left + (right - left) * 0.5 * (along + 1)
            drawn = (1 - away) * middle + away * edge
            worst = np.maximum(worst, np.abs(drawn - posts(heights, level, dy, dx)))
    return worst
    # end


def cell_errors(heights):
    """5.3 The largest distance between each cell of the map drawn as two triangles and the bilinear truth.

    returns   (rows - 1, cols - 1) metres
    """
    # solution
    a, b, c, d = corners(heights, 0)
    return np.abs(a - b - c + d) / 4
    # end


def share_below(coarse, fine):
    """5.4 The share of the nodes of a level that have a smaller error than one of their four children, 0 to 1."""
    # solution
    n, m = coarse.shape
    return float((coarse < fine.reshape(n, 2, m, 2).max((1, 3))).mean())
    # end


def nested(errors):
    """5.5 Nested bounds: the smallest numbers that are not below the node's error or a descendant's bound.

    errors    a list of arrays, one a level; each level has half as many nodes a side as the one before
    returns   a list of the same shapes
    """
    # solution
    bounds = [errors[0]]
    for own in errors[1:]:
        n, m = own.shape
        bounds.append(np.maximum(own, bounds[-1].reshape(n, 2, m, 2).max((1, 3))))
    return bounds
    # end
