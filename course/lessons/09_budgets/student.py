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
    raise NotImplementedError("write this")


def greedy(squares, triangles):
    """9.2 From the root, split the leaf that gains most, again and again, as long as the tree keeps to the budget.

    The gain is the leaf's squared error minus the squared errors of its four children as leaves. If gains are equal,
    take the larger node, then the smaller row, then the smaller column. Leaves of level 0 cannot be split.

    returns   splits
    """
    raise NotImplementedError("write this")


def prune(squares, price):
    """9.3 The tree with the least squared error + price · triangles, of all trees.

    From the leaves up: a node is split if the best trees of its children cost less than the node as a leaf.

    returns   splits
    """
    raise NotImplementedError("write this")


def budget(squares, triangles):
    """9.4 The best tree that `prune` can make with at most this number of triangles, two or more.

    The number of triangles falls as the price rises. Find the lowest price within the budget, by bisection of its
    logarithm: prices run over many powers of ten.

    returns   splits
    """
    raise NotImplementedError("write this")
