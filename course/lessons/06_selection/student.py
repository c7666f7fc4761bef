"""Lesson 6: three ways to choose a level of detail: a clipmap, a quadtree, and right triangles (RTIN).

Places are posts: x the column, y the row. Level j has every 2^j-th post.
"""

import numpy as np

# --- A clipmap --------------------------------------------------------------------------------------------------------


def ring_origin(eye, cells, level):
    """6.1 The first column and row of a ring: a square of cells × cells ring cells, each 2^level posts wide.

    The ring begins at an even place of its own lattice, a multiple of 2 · 2^level, with its middle nearest to the eye.

    eye       (x, y) in posts, any numbers
    returns   (x, y), whole numbers
    """
    raise NotImplementedError("write this")


def ring_squares(eye, cells, levels, size):
    """6.2 The squares of all rings. Level 0 is whole; every other ring leaves out what the next finer one covers.

    cells     ring cells a side of each ring, a multiple of 4
    levels    number of rings, 0 to levels - 1
    size      posts a side of the map: it spans the posts 0 to size - 1; squares wholly outside are left out
    returns   (n, 3) whole numbers x, y, level: ring cells with their north-west post, in any order
    """
    raise NotImplementedError("write this")


def step_of(x, y, level, tables, limits, tolerance_m):
    """6.3 The largest j ≤ level such that the tables hold every node of level j in a square within the tolerance.

    x, y          the square's north-west post, multiples of 2^level; the square is 2^level posts wide, inside the map
    tables[j]     (classes, rows + 1, cols + 1) of level j: [c, b, a] counts the nodes in the first b rows and the
                  first a columns of nodes whose error is above limits[c]
    limits        (classes,) metres, falling
    returns       j, or 0 if no level holds: the nodes of level 0 are the map itself
    """
    raise NotImplementedError("write this")


# --- A quadtree -------------------------------------------------------------------------------------------------------


def refine(errors, tolerance):
    """6.4 From the root down, split every node that exists and is over tolerance.

    errors    errors[j] of the nodes of level j, (2^(top-j), 2^(top-j)); the last one is the root, (1, 1)
    returns   splits[j], of the same shapes, bool; level 0 is never split
    """
    raise NotImplementedError("write this")


def balance(splits):
    """6.5 Split as few further nodes as possible, so that leaves with a common edge are within one level.

    That is so if and only if the parents of a split node's four neighbours are split.
    """
    raise NotImplementedError("write this")


# --- Right triangles --------------------------------------------------------------------------------------------------


def rtin_errors(heights):
    """6.6 The error of each post as the middle of a longest side, never below the errors of the triangles inside.

    A triangle is cut from its right angle to the middle of its longest side. The root triangles share the diagonal from
    post (0, 0) to the last post.

    heights   (n, n) metres, n = 2^k + 1
    returns   (n, n) metres: |height - mean of the two ends| at the middle, or more, if a triangle inside has more.
              The four corners are 0.
    """
    raise NotImplementedError("write this")


def rtin_mesh(errors, tolerance_m):
    """6.7 Cut triangles while the error at the middle of their longest side is above the tolerance.

    returns   (n, 3, 2) whole numbers: the posts (x, y) of each triangle
    """
    raise NotImplementedError("write this")
