"""Lesson 9: the best use of a number of triangles.

A quadtree is a list of levels. squares[j] holds the squared error of each node of level j if it is a leaf, summed over
its posts: an array (2^(top-j), 2^(top-j)). The last level is the root. A leaf has two triangles.
splits[j] says which nodes are split; a split node's parent is split; level 0 is never split.
"""

import heapq

import numpy as np


def totals(squares, splits):
    """9.1 Triangles and squared error of a tree: over all leaves, the nodes that exist and are not split.

    returns   (triangles, squared error)
    """
    # solution
    triangles, error, exists = 0, 0.0, np.ones((1, 1), bool)
    for square, split in zip(squares[::-1], splits[::-1]):
        leaf = exists & ~split
        triangles += 2 * int(leaf.sum())
        error += float(square[leaf].sum())
        exists = split.repeat(2, 0).repeat(2, 1)
    return triangles, error
    # end


def greedy(squares, triangles):
    """9.2 From the root, split the leaf that gains most, again and again, as long as the tree keeps to the budget.

    The gain is the leaf's squared error minus the squared errors of its four children as leaves. If gains are equal,
    take the larger node, then the smaller row, then the smaller column. Leaves of level 0 cannot be split.

    returns   splits
    """
    # solution
    splits, count = [np.zeros(s.shape, bool) for s in squares], 2
    heap = []

    def push(j, y, x):
        if j > 0:
            gain = squares[j][y, x] - squares[j - 1][2 * y : 2 * y + 2, 2 * x : 2 * x + 2].sum()
            heapq.heappush(heap, (-gain, -j, y, x))

    push(len(squares) - 1, 0, 0)
    while heap and count + 6 <= triangles:
        _, j, y, x = heapq.heappop(heap)
        splits[-j][y, x] = True
        count += 6
        for k in range(4):
            push(-j - 1, 2 * y + k // 2, 2 * x + k % 2)
    return splits
    # end


def prune(squares, price):
    """9.3 The tree with the least squared error + price · triangles, of all trees.

    From the leaves up: a node is split if the best trees of its children cost less than the node as a leaf.

    returns   splits
    """
    # solution
    splits, best = [np.zeros(squares[0].shape, bool)], squares[0] + 2 * price
    for square in squares[1:]:
        n = len(square)
        parts = best.reshape(n, 2, n, 2).sum((1, 3))
        own = square + 2 * price
        splits.append(parts < own)
        best = np.minimum(parts, own)
    exists = np.ones((1, 1), bool)
    for j in range(len(splits) - 1, -1, -1):
        splits[j] &= exists
        exists = splits[j].repeat(2, 0).repeat(2, 1)
    return splits
    # end


def budget(squares, triangles):
    """9.4 The best tree that `prune` can make with at most this number of triangles, two or more.

    The number of triangles falls as the price rises. Find the lowest price within the budget, by bisection of its
    logarithm: prices run over many powers of ten.

    returns   splits
    """
    # solution
    low, high = -80.0, 80.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        if totals(squares, prune(squares, 2.0**middle))[0] > triangles:
            low = middle
        else:
            high = middle
    return prune(squares, 2.0**high)
    # end
