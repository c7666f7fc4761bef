"""Every stage in plain numpy, a few lines each: the specification, and what the tests compare with.

The sections follow the stages: sat → error → lod → mesh → shade.
"""

from __future__ import annotations

import numpy as np

# --- sat ---------------------------------------------------------------------------------------------------------


def sat(values: np.ndarray) -> np.ndarray:
    """Summed-area table of unsigned `values` (rows, cols, ...), wrapped to their dtype: table[y, x] = S(x + 1, y + 1).

    S(x, y) = sum of values[j, i] over i < x, j < y (Crow 1984).
    """
    return values.cumsum(1, dtype=values.dtype).cumsum(0, dtype=values.dtype)


def box_sum(table: np.ndarray, a: tuple[int, int], b: tuple[int, int]) -> int:
    """Sum over columns a[0] to b[0] and rows a[1] to b[1], ends outside; exact while below 2^bits of the table."""

    def S(x: int, y: int) -> int:
        return int(table[y - 1, x - 1]) if x and y else 0

    return (S(*b) - S(a[0], b[1]) - S(b[0], a[1]) + S(*a)) % 2 ** (8 * table.itemsize)
