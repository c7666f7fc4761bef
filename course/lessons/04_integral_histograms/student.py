"""Lesson 4: the largest error of any box from sums.

Errors are sorted into classes. limits[c] is the limit of class c in metres; limits fall as c rises.
"""

import numpy as np


def class_limits(span_m, classes, per_octave):
    """4.1 The limits: class c has span · 2^(-(c + 1) / per_octave). No error is above span.

    returns   (classes,) metres
    """
    raise NotImplementedError("write this")


def class_of(errors, limits):
    """4.2 For each error, the last class whose limit is not below the error; -1 if there is none.

    errors    (n,) metres
    returns   (n,) whole numbers
    """
    raise NotImplementedError("write this")


def class_tables(errors, limits):
    """4.3 A summed-area table for each class, which counts the cells above its limit.

    errors    (rows, cols) metres, of each cell
    returns   (classes, rows + 1, cols + 1) whole numbers: [c, b, a] counts the first b rows and the first a columns
    """
    raise NotImplementedError("write this")


def bound(tables, limits, span_m, boxes):
    """4.4 The bound of the largest error of each box: the limit of the last class with no cell above it.

    boxes     (n, 4) x0, y0, x1, y1: columns x0 to x1 - 1, rows y0 to y1 - 1
    returns   (n,) metres; span where every class has cells above it
    """
    raise NotImplementedError("write this")


def tile_errors(errors, tile):
    """4.5 The largest error of each tile of tile × tile cells. The last tiles may be cut off by the map's rim.

    returns   (rows / tile, cols / tile) metres, both rounded up
    """
    raise NotImplementedError("write this")


def tile_boxes(boxes, tile):
    """4.5 The same boxes in whole tiles: widened, never narrowed.

    boxes     (n, 4) in cells
    returns   (n, 4) in tiles
    """
    raise NotImplementedError("write this")
