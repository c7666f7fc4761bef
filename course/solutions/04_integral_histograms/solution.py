"""Lesson 4: the largest error of any box from sums.

Errors are sorted into classes. limits[c] is the limit of class c in metres; limits fall as c rises.
"""

import numpy as np


def class_limits(span_m, classes, per_octave):
    """4.1 The limits: class c has span · 2^(-(c + 1) / per_octave). No error is above span.

    returns   (classes,) metres
    """
    # solution
    return span_m * 2.0 ** (-(np.arange(classes) + 1) / per_octave)
    # end


def class_of(errors, limits):
    """4.2 For each error, the last class whose limit is not below the error; -1 if there is none.

    errors    (n,) metres
    returns   (n,) whole numbers
    """
    # solution
    return (errors[:, None] <= limits).sum(1) - 1
    # end


def class_tables(errors, limits):
    """4.3 A summed-area table for each class, which counts the cells above its limit.

    errors    (rows, cols) metres, of each cell
    returns   (classes, rows + 1, cols + 1) whole numbers: [c, b, a] counts the first b rows and the first a columns
    """
    # solution
    above = errors > limits[:, None, None]
    return np.pad(above.cumsum(1).cumsum(2), ((0, 0), (1, 0), (1, 0)))
    # end


def bound(tables, limits, span_m, boxes):
    """4.4 The bound of the largest error of each box: the limit of the last class with no cell above it.

    boxes     (n, 4) x0, y0, x1, y1: columns x0 to x1 - 1, rows y0 to y1 - 1
    returns   (n,) metres; span where every class has cells above it
    """
    # solution
    x0, y0, x1, y1 = boxes.T
    t = tables.astype(int)
    counts = t[:, y1, x1] - t[:, y0, x1] - t[:, y1, x0] + t[:, y0, x0]
    empty = (counts == 0).sum(0)  # counts rise with the class: the empty ones come first
    return np.append(span_m, limits)[empty]
    # end


def tile_errors(errors, tile):
    """4.5 The largest error of each tile of tile × tile cells. The last tiles may be cut off by the map's rim.

    returns   (rows / tile, cols / tile) metres, both rounded up
    """
    # solution
    rows, cols = (-(-n // tile) for n in errors.shape)
    padded = np.zeros((rows * tile, cols * tile))
    padded[: errors.shape[0], : errors.shape[1]] = errors
    return padded.reshape(rows, tile, cols, tile).max((1, 3))
    # end


def tile_boxes(boxes, tile):
    """4.5 The same boxes in whole tiles: widened, never narrowed.

    boxes     (n, 4) in cells
    returns   (n, 4) in tiles
    """
    # solution
    low, high = boxes[:, :2] // tile, -(-boxes[:, 2:] // tile)
    return np.concatenate([low, high], 1)
    # end
