"""Lesson 12: honest comparison.

A curve is a list of (triangles, error) with rising triangles and falling errors: what a method achieves at several
budgets.
"""

import numpy as np


def error_at(curve, triangles):
    """12.1 The error of a method at a number of triangles: along straight lines between log(triangles) and log(error).

    returns   a number; NaN outside the curve, because nothing was measured there
    """
    # solution
    n, e = np.log(np.array(curve, float)).T
    at = np.log(triangles)
    return float(np.exp(np.interp(at, n, e))) if n[0] <= at <= n[-1] else float("nan")
    # end


def triangles_for(curve, error):
    """12.2 How many triangles a method needs for an error, along the same lines; NaN outside the curve."""
    # solution
    n, e = np.log(np.array(curve, float)).T
    at = np.log(error)
    return float(np.exp(np.interp(at, e[::-1], n[::-1]))) if e[-1] <= at <= e[0] else float("nan")
    # end


def summary(ours, theirs):
    """12.3 How many times as many triangles the other method needs, over the errors that both curves reach.

    Take 33 errors, equally spaced in their logarithm, from the largest to the smallest error that both curves have.

    returns   (least, median, largest) ratio of their triangles to ours; three NaN if the curves share no error
    """
    # solution
    high = min(ours[0][1], theirs[0][1])
    low = max(ours[-1][1], theirs[-1][1])
    if low > high:
        return (float("nan"),) * 3
    errors = np.exp(np.linspace(np.log(high), np.log(low), 33)).clip(low, high)
    ratios = [triangles_for(theirs, e) / triangles_for(ours, e) for e in errors]
    return float(np.min(ratios)), float(np.median(ratios)), float(np.max(ratios))
    # end


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
    # solution
    found = set()
    if len({(row["map"], row["view"], tuple(row["size"])) for row in rows}) > 1:
        found.add("inputs")
    if len({row["metric"] for row in rows}) > 1:
        found.add("metric")
    if any(row["measured"] != "achieved" for row in rows):
        found.add("own metric")
    for at in zip(*(row["points"] for row in rows)):
        counts = [triangles for triangles, _ in at]
        if max(counts) - min(counts) > 0.02 * min(counts):
            found.add("triangles")
    if min(len(row["points"]) for row in rows) < 5:
        found.add("budgets")
    if len({row["tuned"] for row in rows}) > 1:
        found.add("tuning")
    return sorted(found)
    # end


def places():
    """12.5 Facts about four methods.

    returns   name -> (year of the paper, what it is made of, what decides the level), for "ROAM",
              "geometry clipmaps", "CDLOD" and "CBT". Made of: "bintree", "quadtree" or "rings". Decides: "error" of the
              land on the screen, "distance" from the eye alone, or "edge length" on the screen.
    """
    # solution
    return {
        "ROAM": (1997, "bintree", "error"),
        "geometry clipmaps": (2004, "rings", "distance"),
        "CDLOD": (2009, "quadtree", "distance"),
        "CBT": (2020, "bintree", "edge length"),
    }
    # end


def doctored(measured):
    """12.6 Break the fairness of a comparison once, so that a quick reader believes that ours is better than it is.

    measured  rows as in 12.4. The first two are a fair pair, ours and theirs. The others are the same two methods
              under other conditions: look at their labels. Every row is honest on its own.

    returns   two rows, ours and then theirs, with exactly one fault of 12.4. You may take any of the rows, and leave
              points out. You may not change a label or a number, or put points in another order. The reader goes down
              both lists of points and divides their errors, theirs by ours: the median of these ratios must be at
              least 1.3 times that of the fair pair.
    """
    # solution
    ours, theirs = measured[:2]
    return [{**ours, "points": ours["points"][2:]}, {**theirs, "points": theirs["points"][:-2]}]
    # end


def verdict():
    """12.7 What is wrong with a fellow student's comparison.

    returns   (table, fault): the whole text of the table that you were given, and the name of its fault as in 12.4
    """
    # solution
    table = """method,map,view,size,metric,measured,tuned,triangles,error
ours,canyon,ridge,640x360,rms,achieved,True,2000,0.05343
ours,canyon,ridge,640x360,rms,achieved,True,5657,0.02886
ours,canyon,ridge,640x360,rms,achieved,True,16000,0.01618
ours,canyon,ridge,640x360,rms,achieved,True,45255,0.00854
ours,canyon,ridge,640x360,rms,achieved,True,128000,0.004567
theirs,canyon,ridge,640x360,rms,achieved,False,2000,0.09225
theirs,canyon,ridge,640x360,rms,achieved,False,5657,0.04975
theirs,canyon,ridge,640x360,rms,achieved,False,16000,0.02598
theirs,canyon,ridge,640x360,rms,achieved,False,45255,0.01422
theirs,canyon,ridge,640x360,rms,achieved,False,128000,0.00742"""
    return table, "tuning"
    # end
