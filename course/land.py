"""Land from a seed for the checks: hills, a plain, a cliff and a spike, of any size; and voids."""

from __future__ import annotations

import numpy as np


def land(rng: np.random.Generator, rows: int, cols: int, relief_m: float = 400.0) -> np.ndarray:
    """Heights in metres, (rows, cols): sums of waves, each lower than the wave before, with a cliff through them."""
    y, x = np.indices((rows, cols)) / max(rows, cols)
    h = np.zeros((rows, cols))
    for octave in range(5):
        for _ in range(3):
            angle, phase = rng.uniform(0, 2 * np.pi, 2)
            h += 0.5**octave * np.sin(2 * np.pi * 2**octave * (x * np.cos(angle) + y * np.sin(angle)) + phase)
    h += 2.0 * (x + 0.3 * np.sin(5 * y) > rng.uniform(0.3, 0.6))
    h = np.where(y > 0.75, 0.1 * h, h)  # a plain in the south
    return h * relief_m / np.ptp(h) + 1000.0


def spike(heights: np.ndarray, rng: np.random.Generator, rise_m: float = 300.0) -> np.ndarray:
    """The same land with one post far above its neighbours."""
    found = heights.copy()
    found[rng.integers(1, len(found) - 1), rng.integers(1, found.shape[1] - 1)] += rise_m
    return found


def voids(rng: np.random.Generator, rows: int, cols: int, count: int = 3) -> np.ndarray:
    """Posts without data, (rows, cols) bool: a few small rectangles, one of them at the rim."""
    hole = np.zeros((rows, cols), bool)
    for i in range(count):
        y, x = (0 if i == 0 else rng.integers(1, rows - 2)), rng.integers(1, cols - 2)
        hole[y : y + rng.integers(1, 4), x : x + rng.integers(1, 4)] = True
    return hole
