"""Lesson 12: honest comparison.

A curve is a list of (triangles, error) with rising triangles and falling errors: what a method achieves at several
budgets.
"""

import numpy as np


def error_at(curve, triangles):
    """12.1 The error of a method at a number of triangles: along straight lines between log(triangles) and log(error).

    returns   a number; NaN outside the curve, because nothing was measured there
    """
    raise NotImplementedError("write this")


def triangles_for(curve, error):
    """12.2 How many triangles a method needs for an error, along the same lines; NaN outside the curve."""
    raise NotImplementedError("write this")


def summary(ours, theirs):
    """12.3 How many times as many triangles the other method needs, over the errors that both curves reach.

    Take 33 errors, equally spaced in their logarithm, from the largest to the smallest error that both curves have.

    returns   (least, median, largest) ratio of their triangles to ours; three NaN if the curves share no error
    """
    raise NotImplementedError("write this")


def faults(rows):
    """12.4 What makes a comparison unfair.

    rows      dicts: method, map, view, size (width, height), metric, measured (how the error was found), tuned
              (whether the method's own parameters were searched), points (a list of (triangles, error))

    returns   the names of all faults, in any order:
              "inputs"     map, view or size differ
              "metric"     the metrics differ
              "own metric" a row's error was not "achieved", measured on the mesh that is drawn, but "certified"
              "triangles"  the k-th points of two rows differ by more than 2 per cent of the smaller number of triangles
              "budgets"    a row has fewer than five points
              "tuning"     some rows are tuned and others are not
    """
    raise NotImplementedError("write this")


def places():
    """12.5 Facts about four methods.

    returns   name -> (year of the paper, what it is made of, what decides the level), for "ROAM",
              "geometry clipmaps", "CDLOD" and "CBT". Made of: "bintree", "quadtree" or "rings". Decides: "error" of the
              land on the screen, "distance" from the eye alone, or "edge length" on the screen.
    """
    raise NotImplementedError("write this")


def doctored(measured):
    """12.6 Break the fairness of a comparison once, so that a quick reader believes that ours is better than it is.

    measured  rows as in 12.4. The first two are a fair pair, ours and theirs. The others are the same two methods
              under other conditions: look at their labels. Every row is honest on its own.

    returns   two rows, ours and then theirs, with exactly one fault of 12.4. You may take any of the rows, and leave
              points out. You may not change a label or a number, or put points in another order. The reader goes down
              both lists of points and divides their errors, theirs by ours: the median of these ratios must be at
              least 1.3 times that of the fair pair.
    """
    raise NotImplementedError("write this")


def verdict():
    """12.7 What is wrong with a fellow student's comparison.

    returns   (table, fault): the whole text of the table that you were given, and the name of its fault as in 12.4
    """
    raise NotImplementedError("write this")
