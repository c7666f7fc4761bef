"""Lesson 6: two trees that choose a level of detail: a quadtree, and right triangles (RTIN).

Places are posts: x the column, y the row. Level j has every 2^j-th post.
"""

import numpy as np

# --- A quadtree -------------------------------------------------------------------------------------------------------


def refine(errors, tolerance):
    """6.1 From the root down, split every node that exists and is over tolerance.

    errors    errors[j] of the nodes of level j, (2^(top-j), 2^(top-j)); the last one is the root, (1, 1)
    returns   splits[j], of the same shapes, bool; level 0 is never split
    """
    raise NotImplementedError("write this")


def balance(splits):
    """6.2 Split as few further nodes as possible, so that leaves with a common edge are within one level.

    This holds if and only if the parents of a split node's four neighbours are split.
    """
    raise NotImplementedError("write this")


# --- Right triangles --------------------------------------------------------------------------------------------------


def rtin_errors(heights):
    """6.3 The error of each post as the middle of a longest side, and at least the errors of the triangles inside.

    A triangle is cut from its right angle to the middle of its longest side. The root triangles share the diagonal from
    post (0, 0) to the last post.

    heights   (n, n) metres, n = 2^k + 1
    returns   (n, n) metres: |height - mean of the two ends| at the middle, or more, if a triangle inside has more.
              The four corners are 0.
    """
    raise NotImplementedError("write this")


def rtin_mesh(errors, tolerance_m):
    """6.4 Cut triangles while the error at the middle of their longest side is above the tolerance.

    returns   (n, 3, 2) whole numbers: the posts (x, y) of each triangle
    """
    raise NotImplementedError("write this")
