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
    # solution
    step = 2 << level
    x, y = (step * int(np.floor((at - 0.5 * (cells << level)) / step + 0.5)) for at in eye)
    return x, y
    # end


def ring_squares(eye, cells, levels, size):
    """6.2 The squares of all rings. Level 0 is whole; every other ring leaves out what the next finer one covers.

    cells     ring cells a side of each ring, a multiple of 4
    levels    number of rings, 0 to levels - 1
    size      posts a side of the map: it spans the posts 0 to size - 1; squares wholly outside are left out
    returns   (n, 3) whole numbers x, y, level: ring cells with their north-west post, in any order
    """
    # solution
    found = []
    for level in range(levels):
        (x0, y0), side = ring_origin(eye, cells, level), 1 << level
        hole, width = (ring_origin(eye, cells, level - 1), cells << (level - 1)) if level else ((0, 0), 0)
        for y in range(y0, y0 + cells * side, side):
            for x in range(x0, x0 + cells * side, side):
                covered = hole[0] <= x < hole[0] + width and hole[1] <= y < hole[1] + width
                if not covered and -side < x < size - 1 and -side < y < size - 1:
                    found.append((x, y, level))
    return np.array(found)
    # end


def step_of(x, y, level, tables, limits, tolerance_m):
    """6.3 The largest j ≤ level such that the tables hold every node of level j in a square within the tolerance.

    x, y          the square's north-west post, multiples of 2^level; the square is 2^level posts wide, inside the map
    tables[j]     (classes, rows + 1, cols + 1) of level j: [c, b, a] counts the nodes in the first b rows and the
                  first a columns of nodes whose error is above limits[c]
    limits        (classes,) metres, falling
    returns       j, or 0 if no level holds: the nodes of level 0 are the map itself
    """
    # solution
    below = np.flatnonzero(limits <= tolerance_m)
    for j in range(level, 0, -1):
        if len(below):
            table = tables[j][below[0]].astype(int)
            a, b, n = x >> j, y >> j, 1 << (level - j)
            if table[b + n, a + n] - table[b, a + n] - table[b + n, a] + table[b, a] == 0:
                return j
    return 0
    # end


# --- A quadtree -------------------------------------------------------------------------------------------------------


def refine(errors, tolerance):
    """6.4 From the root down, split every node that exists and is over tolerance.

    errors    errors[j] of the nodes of level j, (2^(top-j), 2^(top-j)); the last one is the root, (1, 1)
    returns   splits[j], of the same shapes, bool; level 0 is never split
    """
    # solution
    splits = [np.zeros(e.shape, bool) for e in errors]
    exists = np.ones((1, 1), bool)
    for j in range(len(errors) - 1, 0, -1):
        splits[j] = exists & (errors[j] > tolerance)
        exists = splits[j].repeat(2, 0).repeat(2, 1)
    return splits
    # end


def balance(splits):
    """6.5 Split as few further nodes as possible, so that leaves with a common edge are within one level.

    That is so if and only if the parents of a split node's four neighbours are split.
    """
    # solution
    splits = [s.copy() for s in splits]
    for j in range(1, len(splits) - 1):
        padded = np.pad(splits[j], 1)
        wide = splits[j] | padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
        n = len(splits[j]) // 2
        splits[j + 1] |= wide.reshape(n, 2, n, 2).any((1, 3))
    return splits
    # end


# --- Right triangles --------------------------------------------------------------------------------------------------


def rtin_errors(heights):
    """6.6 The error of each post as the middle of a longest side, never below the errors of the triangles inside.

    A triangle is cut from its right angle to the middle of its longest side. The root triangles share the diagonal from
    post (0, 0) to the last post.

    heights   (n, n) metres, n = 2^k + 1
    returns   (n, n) metres: |height - mean of the two ends| at the middle, or more, if a triangle inside has more.
              The four corners are 0.
    """
    # solution
    last = len(heights) - 1
    errors = np.zeros(heights.shape)

    def visit(a, b, c):
        m = ((a[0] + b[0]) // 2, (a[1] + b[1]) // 2)
        if m in (a, b) or (a[0] + b[0]) % 2 or (a[1] + b[1]) % 2:
            return 0.0
        own = abs(heights[m[1], m[0]] - 0.5 * (heights[a[1], a[0]] + heights[b[1], b[0]]))
        errors[m[1], m[0]] = max(errors[m[1], m[0]], own, visit(c, a, m), visit(b, c, m))
        return errors[m[1], m[0]]

    # A triangle may be visited before its twin across the longest side: repeat until nothing changes.
    while True:
        before = errors.copy()
        visit((0, 0), (last, last), (last, 0))
        visit((last, last), (0, 0), (0, last))
        if (errors == before).all():
            return errors
    # end


def rtin_mesh(errors, tolerance_m):
    """6.7 Cut triangles while the error at the middle of their longest side is above the tolerance.

    returns   (n, 3, 2) whole numbers: the posts (x, y) of each triangle
    """
    # solution
    last, found = len(errors) - 1, []

    def visit(a, b, c):
        m = ((a[0] + b[0]) // 2, (a[1] + b[1]) // 2)
        whole = (a[0] + b[0]) % 2 == 0 and (a[1] + b[1]) % 2 == 0
        if whole and errors[m[1], m[0]] > tolerance_m:
            visit(c, a, m)
            visit(b, c, m)
        else:
            found.append((a, b, c))

    visit((0, 0), (last, last), (last, 0))
    visit((last, last), (0, 0), (0, last))
    return np.array(found)
    # end
