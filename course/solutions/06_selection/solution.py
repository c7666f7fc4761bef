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
    # solution
    splits = [np.zeros(e.shape, bool) for e in errors]
    exists = np.ones((1, 1), bool)
    for j in range(len(errors) - 1, 0, -1):
        splits[j] = exists & (errors[j] > tolerance)
        exists = splits[j].repeat(2, 0).repeat(2, 1)
    return splits
    # end


def balance(splits):
    """6.2 Split as few further nodes as possible, so that leaves with a common edge are within one level.

    This holds if and only if the parents of a split node's four neighbours are split.
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
    """6.3 The error of each post as the middle of a longest side, and at least the errors of the triangles inside.

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
    """6.4 Cut triangles while the error at the middle of their longest side is above the tolerance.

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
