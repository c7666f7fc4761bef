"""Sums over all boxes of one size by a summed-area table, and reductions of blocks, in numpy."""

import numpy as np


def box_sums(values: np.ndarray, height: int, width: int) -> np.ndarray:
    """Sum over every box of `height` rows and `width` columns.

    Parameters
    ----------
    values
        (rows, cols), summed in float64.

    Returns
    -------
    sums
        (rows - height + 1, cols - width + 1); entry [r, c] is the sum of the box that begins at row r and column c.
    """
    table = np.pad(values.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    east, west = table[:, width:], table[:, :-width]
    return (east[height:] - east[:-height]) - (west[height:] - west[:-height])


def over_blocks(reduce: np.ufunc, values: np.ndarray, side: int) -> np.ndarray:
    """Reduce each block of side × side values with a ufunc; blocks at the far edges may be smaller."""
    for axis in (0, 1):
        values = reduce.reduceat(values, np.arange(0, values.shape[axis], side), axis)
    return values
