"""sat: summed-area tables, and the sum over any box from four of their entries (Crow 1984)."""

import numpy as np

# S(x, y) = Σ f(i, j) over i < x and j < y


def sat(values: np.ndarray) -> np.ndarray:
    """Summed-area table of a map.

    Parameters
    ----------
    values
        (rows, cols, ...) unsigned integers. Sums wrap at their word size.

    Returns
    -------
    table
        The shape and dtype of `values`, with table[y, x] = S(x + 1, y + 1).
    """
    return values.cumsum(1, dtype=values.dtype).cumsum(0, dtype=values.dtype)


# box(a, b) = S(b.x, b.y) − S(a.x, b.y) − S(b.x, a.y) + S(a.x, a.y)


def box_sum(table: np.ndarray, a: tuple[int, int], b: tuple[int, int]) -> int:
    """Sum over the columns from a[0] up to, but without, b[0], and over the rows from a[1] up to, but without, b[1].

    The difference of wrapped sums is exact as long as the box's own sum fits the table's word.
    """

    def S(x: int, y: int) -> int:
        return int(table[y - 1, x - 1]) if x and y else 0

    return (S(*b) - S(a[0], b[1]) - S(b[0], a[1]) + S(*a)) % 2 ** (8 * table.itemsize)
