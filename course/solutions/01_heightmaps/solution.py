"""Lesson 1: heightmaps, and the surface that counts as the truth.

heights[row, col] in metres; row 0 is the north edge. spacing is a pair: metres between posts to the east, to the north.
World coordinates are x to the east, y to the north, z up. The south-west corner, post (rows - 1, 0), is x = y = 0.
"""

import numpy as np


def world(heights, spacing):
    """1.1 The world coordinates of each post.

    returns   (rows, cols, 3) metres x, y, z
    """
    # solution
    row, col = np.indices(heights.shape)
    return np.stack([col * spacing[0], (len(heights) - 1 - row) * spacing[1], heights], -1)
    # end


def height_at(heights, spacing, x, y):
    """1.2 The truth at places of the world: bilinear between the four posts around each place.

    x, y      (n,) metres; all places are on the map, its edges included
    returns   (n,) metres
    """
    # solution
    rows, cols = heights.shape
    u, v = x / spacing[0], rows - 1 - y / spacing[1]
    i, j = np.clip(u.astype(int), 0, cols - 2), np.clip(v.astype(int), 0, rows - 2)
    f, g = u - i, v - j
    north = (1 - f) * heights[j, i] + f * heights[j, i + 1]
    south = (1 - f) * heights[j + 1, i] + f * heights[j + 1, i + 1]
    return (1 - g) * north + g * south
    # end


def normals(heights, spacing):
    """1.3 The unit normal of the truth in the middle of each cell.

    returns   (rows - 1, cols - 1, 3): east, north, up
    """
    # solution
    a, b, c, d = heights[:-1, :-1], heights[:-1, 1:], heights[1:, :-1], heights[1:, 1:]
    east, north = (b - a + d - c) / (2 * spacing[0]), (a - c + b - d) / (2 * spacing[1])
    n = np.stack([-east, -north, np.ones_like(east)], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)
    # end


def fill(heights, void):
    """1.4 Fill the posts without data smoothly: each becomes the mean of its up to four neighbours on the map.

    heights   (rows, cols); the values at void posts mean nothing
    void      (rows, cols) bool; not all posts are void
    returns   (rows, cols): other posts as they are; void posts within a millimetre of the mean
    """
    # solution
    filled = np.where(void, heights[~void].mean(), heights)
    inside = np.pad(np.ones(heights.shape), 1)
    count = inside[:-2, 1:-1] + inside[2:, 1:-1] + inside[1:-1, :-2] + inside[1:-1, 2:]
    for _ in range(100000):
        p = np.pad(filled, 1)
        mean = (p[:-2, 1:-1] + p[2:, 1:-1] + p[1:-1, :-2] + p[1:-1, 2:]) / count
        change = np.abs(mean - filled)[void].max(initial=0.0)
        filled = np.where(void, mean, filled)
        if change < 1e-7:
            return filled
    return filled
    # end


def mean_height(heights, void):
    """1.5 The mean of all posts that have data. For every mean, ask which values count.

    returns   a number
    """
    # solution
    return heights[~void].mean()
    # end
