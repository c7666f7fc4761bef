"""Lesson 13: the clipmap that the tables steer.

Places are posts: x the column, y the row. A ring of level l is made of blocks. A block has 8 × 8 units, a unit is 2^l
posts wide. A square is 8, 4, 2 or 1 units of a block wide, and it is drawn as a patch of T × T segments.
"""

import numpy as np

UNITS = 8  # units a side of a block
PATCH_COST = 14  # cost of a patch in triangles, besides its own triangles
WEST, NORTH, EAST, SOUTH = range(4)


def ring_origin(eye, blocks, level):
    """13.1 The first column and row of a ring of blocks × blocks blocks.

    A ring begins at each fourth place of its lattice, a multiple of 4 · 2^level, with its middle nearest to the eye.
    Of two such places that are equally near, take the larger.

    eye       (x, y) in posts, any numbers
    returns   (x, y), whole numbers
    """
    raise NotImplementedError("write this")


def ring_units(eye, blocks, level):
    """13.2 Which units of a ring are drawn: those that the next finer ring does not cover. Ring 0 is whole.

    The finer ring has as many blocks, and is half as wide.

    returns   (8 · blocks, 8 · blocks) bool, [row, column]
    """
    raise NotImplementedError("write this")


def cut_error(heights):
    """13.3 C of one cell: the largest error at its posts, with either diagonal, and whichever edges are cut.

    The cell's corners are the corners of the array. Along each edge, α is how far the highest post lies above the
    straight line between its ends, β how far the lowest lies below it; 0 or more. At a place with the weight w of an
    edge, 1 on it and 0 on the opposite side, the error is at most
    max over edges of  max(I⁺ − h + w α, h − I⁻ + w β).
    I⁺ is the higher and I⁻ the lower of the two surfaces that the two diagonals make.

    heights   (n + 1, n + 1) metres, n a power of two; rows run to the south
    returns   metres
    """
    raise NotImplementedError("write this")


def is_within(tables, limits, span_m, low, end, tile, error_m):
    """13.4 Whether the tables prove that no tile that meets a box has an error above error_m.

    tables    (64, rows + 1, cols + 1) uint8: [c, b, a] counts the tiles in the first b rows and the first a columns
              that have an error above limits[c], modulo 256
    limits    (64,) metres, falling; no error is above span_m, so an error_m of span_m or more always holds
    low, end  the box: the land between the posts (x, y) low and end; it need not begin at a tile, and may stick out of
              the map. A tile that only touches the box from outside does not meet it
    tile      posts a side of a tile; the box meets 255 tiles at most, and one at least
    """
    raise NotImplementedError("write this")


def cut_block(steps, unit_log2):
    """13.5 Cut a block into squares, as cheaply as possible.

    A square costs 2 T² + 14, with T = side / spacing. Take the square, or its four parts if they cost less. A square
    of at most four segments is never cut.

    steps      dict: steps[depth, x, y] is log2 of the spacing of the x-th square in the y-th row of squares that are
               8 >> depth units wide; None if the square cannot be one patch. Squares without anything to draw are
               not in it. A unit, of depth 3, is never None.
    unit_log2  log2 of the posts along a unit
    returns    (8, 8, 2) whole numbers, [row, column]: for each unit, log2 of the units a side of the square that it is
               in, and log2 of its spacing; (-1, 0) if no square is drawn there. A drawn square may have units
               without land: they have the numbers of the square
    """
    raise NotImplementedError("write this")


def edge_step(squares, i, side):
    """13.6 The spacing of the vertices along one side of a square, log2 of posts.

    Where squares meet, the longer side is the edge. It gets the finest spacing among all squares along it, on both
    sides of it. A square that touches it at a corner alone is not along it. At the rim there is only the square itself.

    squares   (n, 4) whole numbers x, y, side, spacing: the first post, and log2 of the side and of the spacing in
              posts; together they cover the map once
    side      WEST, NORTH, EAST or SOUTH
    """

    raise NotImplementedError("write this")
