"""Lesson 1: heightmaps, and the surface that counts as the truth.

heights[row, col] in metres; row 0 is the north edge. spacing is a pair: metres between posts to the east, to the north.
World coordinates are x to the east, y to the north, z up. The south-west corner, post (rows - 1, 0), is x = y = 0.
"""

import numpy as np


def world(heights, spacing):
    """1.1 The world coordinates of each post.

    returns   (rows, cols, 3) metres x, y, z
    """
    raise NotImplementedError("write this")


def height_at(heights, spacing, x, y):
    """1.2 The truth at places of the world: bilinear between the four posts around each place.

    x, y      (n,) metres; all places are on the map, its edges included
    returns   (n,) metres
    """
    raise NotImplementedError("write this")


def normals(heights, spacing):
    """1.3 The unit normal of the truth in the middle of each cell.

    returns   (rows - 1, cols - 1, 3): east, north, up
    """
    raise NotImplementedError("write this")


def fill(heights, void):
    """1.4 Fill the posts without data smoothly: each becomes the mean of its up to four neighbours on the map.

    heights   (rows, cols); the values at void posts mean nothing
    void      (rows, cols) bool; not all posts are void
    returns   (rows, cols): other posts as they are; void posts within a millimetre of the mean
    """
    raise NotImplementedError("write this")


def mean_height(heights, void):
    """1.5 The mean of all posts that have data. For every mean, ask which values count.

    returns   a number
    """
    raise NotImplementedError("write this")
