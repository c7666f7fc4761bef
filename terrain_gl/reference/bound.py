"""error, continued: the bound over any box of nodes from summed-area tables, and the error between the posts."""

import numpy as np

from .sat import box_sum, sat

WIDE = 4  # classes; the narrow ones are an eighth of an octave each
NARROW = 56
LAST = 4

# Class c counts the nodes with M > limit(c) = span · 2^−o(c + 1). The function o is linear from 0 at 0 to z at 4, from
# there to z + 7 at 60, and from there to z + 14 at 64. Most decisions are about errors below the width of 16 cells:
#   z = max(2, log2(span / (16 √(s_x s_y))))
# The box holds no such node if and only if its count is 0 (integral histogram, Porikli 2005). So
#   M of the box ≤ limit(c),   c the last class with count 0;   and M ≤ most_m if there is none.
# most_m is the highest minus the lowest height of the map.


def class_limits(span_m: float, spacing_m: tuple[float, float]) -> np.ndarray:
    """Error limit of each class in metres, from the largest down."""
    z = max(2.0, np.log2(span_m / (16 * np.sqrt(spacing_m[0] * spacing_m[1]))))
    ends = np.cumsum([0, WIDE, NARROW, LAST])
    return span_m * 2.0 ** -np.interp(np.arange(1, ends[-1] + 1), ends, [0, z, z + 7, z + 14])


def class_tables(errors: np.ndarray, limits_m: np.ndarray) -> list[np.ndarray]:
    """Summed-area table of each class's counts for maximum errors (rows, cols), metres."""
    return [sat((errors > limit).astype(np.uint32)) for limit in limits_m]


def bound_max_m(
    tables: list[np.ndarray], a: tuple[int, int], b: tuple[int, int], most_m: float, limits_m: np.ndarray
) -> float:
    """Bound of the maximum error in metres over a box of table entries, from a to b as in `box_sum`."""
    empty = [box_sum(table, a, b) == 0 for table in tables]
    sure = max((c for c in range(len(tables)) if empty[c]), default=None)
    return most_m if sure is None else float(limits_m[sure])


# RMS of a box = √(Σ E / n),   E the squared error of each entry,   n the posts of the box


def bound_rms_m(table: np.ndarray, a: tuple[int, int], b: tuple[int, int], posts: int, step_m2: float) -> float:
    """Root mean square error in metres over a box, from a table of squared errors rounded up to multiples of a step."""
    return float(np.sqrt(box_sum(table, a, b) * step_m2 / posts))


def square_table(squares: np.ndarray, step_m2: float) -> np.ndarray:
    """Summed-area table of squared errors (rows, cols), m², rounded up to whole steps in 64-bit words."""
    return sat(np.ceil(squares / step_m2).astype(np.uint64))


# Between the posts the truth is bilinear. A cell has corners a, b, c, d and the twist t = a − b − c + d. The error
# inside the cell exceeds the largest error at its posts by at most
#   |t| / 4         where a diagonal crosses the cell
#   |t| / 16        as four triangles around the middle at (a + b + c + d) / 4
#   |t| / (4 n²)    as n × n equal parts, two triangles each


def twists(heights: np.ndarray) -> np.ndarray:
    """Twist t of each cell, (rows − 1, cols − 1) metres."""
    return heights[:-1, :-1] - heights[:-1, 1:] - heights[1:, :-1] + heights[1:, 1:]


def diagonal_error(twist: np.ndarray) -> np.ndarray:
    """Largest distance between a cell cut along a diagonal and the bilinear truth."""
    return np.abs(twist) / 4


def fan_error(twist: np.ndarray) -> np.ndarray:
    """Largest distance between four triangles around a cell's middle and the bilinear truth."""
    return np.abs(twist) / 16


def parts_error(twist: np.ndarray, n: int) -> np.ndarray:
    """Largest distance between n × n equal parts of a cell, two triangles each, and the bilinear truth."""
    return np.abs(twist) / (4 * n * n)
