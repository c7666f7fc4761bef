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
    # solution
    step = 4 << level
    x, y = (step * int(np.floor((at - 0.5 * blocks * (UNITS << level)) / step + 0.5)) for at in eye)
    return x, y
    # end


def ring_units(eye, blocks, level):
    """13.2 Which units of a ring are drawn: those that the next finer ring does not cover. Ring 0 is whole.

    The finer ring has as many blocks, and is half as wide.

    returns   (8 · blocks, 8 · blocks) bool, [row, column]
    """
    # solution
    n = UNITS * blocks
    drawn = np.ones((n, n), bool)
    if level:
        own, hole = np.array(ring_origin(eye, blocks, level)), np.array(ring_origin(eye, blocks, level - 1))
        x, y = (hole - own) >> level
        drawn[y : y + n // 2, x : x + n // 2] = False
    return drawn
    # end


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
    # solution
    n = len(heights) - 1
    t, s = np.indices(heights.shape) / n  # shares of the way to the south and to the east
    a, b, c, d = heights[0, 0], heights[0, -1], heights[-1, 0], heights[-1, -1]
    falling = a + np.where(s > t, s * (b - a) + t * (d - b), t * (c - a) + s * (d - c))
    rising = np.where(s + t < 1, a + s * (b - a) + t * (c - a), d + (1 - s) * (c - d) + (1 - t) * (b - d))
    up, down = np.maximum(falling, rising) - heights, heights - np.minimum(falling, rising)
    line = np.linspace(0, 1, n + 1)
    worst = 0.0
    for edge, w in ((heights[:, 0], 1 - s), (heights[0], 1 - t), (heights[:, -1], s), (heights[-1], t)):
        off = edge - (edge[0] + line * (edge[-1] - edge[0]))
        worst = max(worst, (up + w * off.max()).max(), (down - w * off.min()).max())
    return float(worst)
    # end


def is_within(tables, limits, span_m, low, end, tile, error_m):
    """13.4 Whether the tables prove that no tile that meets a box has an error above error_m.

    tables    (64, rows + 1, cols + 1) uint8: [c, b, a] counts the tiles in the first b rows and the first a columns
              that have an error above limits[c], modulo 256
    limits    (64,) metres, falling; no error is above span_m, so an error_m of span_m or more always holds
    low, end  the box: the land between the posts (x, y) low and end; it need not begin at a tile, and may stick out of
              the map. A tile that only touches the box from outside does not meet it
    tile      posts a side of a tile; the box meets 255 tiles at most, and one at least
    """
    # solution
    if error_m >= span_m:
        return True
    below = np.flatnonzero(limits <= error_m)
    if len(below) == 0:
        return False
    table = tables[below[0]].astype(int)
    rows, cols = table.shape[0] - 1, table.shape[1] - 1
    x0, y0 = (max(at, 0) // tile for at in low)
    x1, y1 = (min(-(-at // tile), n) for at, n in zip(end, (cols, rows)))
    return (table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]) % 256 == 0
    # end


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
    # solution
    leaves = np.zeros((UNITS, UNITS, 2), int)

    def cut(depth, x, y):
        side = UNITS >> depth
        own = leaves[y * side : (y + 1) * side, x * side : (x + 1) * side]
        if (depth, x, y) not in steps:
            own[...] = -1, 0
            return 0
        step = steps[depth, x, y]
        segments = np.inf if step is None else 2.0 ** (unit_log2 + 3 - depth - step)
        whole = 2 * segments**2 + PATCH_COST
        if depth < 3 and segments > 4:
            parts = sum(cut(depth + 1, 2 * x + i, 2 * y + j) for j in (0, 1) for i in (0, 1))
            if parts < whole:
                return parts
        own[...] = 3 - depth, step
        return whole

    cut(0, 0, 0)
    return leaves
    # end


def edge_step(squares, i, side):
    """13.6 The spacing of the vertices along one side of a square, log2 of posts.

    Where squares meet, the longer side is the edge. It gets the finest spacing among all squares along it, on both
    sides of it. A square that touches it at a corner alone is not along it. At the rim there is only the square itself.

    squares   (n, 4) whole numbers x, y, side, spacing: the first post, and log2 of the side and of the spacing in
              posts; together they cover the map once
    side      WEST, NORTH, EAST or SOUTH
    """

    # solution
    def beside(i, side):
        x, y, log2, _ = squares[i]
        n = 1 << log2
        ends = squares[:, :2] + (1 << squares[:, 2:3])
        at = {
            WEST: ends[:, 0] == x,
            NORTH: ends[:, 1] == y,
            EAST: squares[:, 0] == x + n,
            SOUTH: squares[:, 1] == y + n,
        }
        axis, first = (1, y) if side in (WEST, EAST) else (0, x)
        return np.flatnonzero(at[side] & (squares[:, axis] < first + n) & (ends[:, axis] > first))

    others = beside(i, side)
    larger = [k for k in others if squares[k, 2] > squares[i, 2]]
    if larger:
        i, others = larger[0], beside(larger[0], (side + 2) % 4)
    return int(min(squares[i, 3], *squares[others, 3])) if len(others) else int(squares[i, 3])
    # end
