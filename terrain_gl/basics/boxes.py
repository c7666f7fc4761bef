"""Sums over all boxes of one size, by a summed-area table in numpy."""

import numpy as np


def box_sums(values: np.ndarray, height: int, width: int) -> np.ndarray:
    """Sum over every box of a size, by the box's first row and column.

    Parameters
    ----------
    values
        (rows, cols), summed in float64.

    Returns
    -------
    sums
        (rows - height + 1, cols - width + 1).
    """
    table = np.pad(values.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    east, west = table[:, width:], table[:, :-width]
    return (east[height:] - east[:-height]) - (west[height:] - west[:-height])
