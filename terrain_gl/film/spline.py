"""Curves through given points: smooth in space, in orientation and in time.

A pyramid of interpolations evaluates the curve (Barry & Goldman 1988, "A recursive evaluation algorithm for a class of
Catmull-Rom splines"). Linear interpolation gives a curve of positions. Interpolation along great arcs gives a curve of
orientations (Schlag 1991, "Using geometric constructions to interpolate orientation with quaternions").
"""

from collections.abc import Callable

import numpy as np

Blend = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def centripetal_knots(points: np.ndarray) -> np.ndarray:
    """(n,) knots of a curve through points (n, 3); their differences are square roots of the points' distances.

    Such a curve has no cusps and no loops between neighbours (Yuksel et al. 2011, "Parameterization and applications of
    Catmull-Rom curves").
    """
    steps = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    least = 1e-6 * steps.max(initial=0.0) or 1.0  # avoids a division by 0 where two points are equal
    return np.concatenate([[0.0], np.cumsum(np.maximum(steps, least))])


def catmull_rom(four: np.ndarray, knots: np.ndarray, t: np.ndarray, blend: Blend) -> np.ndarray:
    """Values (n, k) at parameters t (n,) between the second and the third of four values (k,) at four knots."""
    t = np.asarray(t)
    row = list(four)
    reach = 1
    while len(row) > 2:
        row = [blend(row[i], row[i + 1], (t - knots[i]) / (knots[i + reach] - knots[i])) for i in range(len(row) - 1)]
        reach += 1
    return blend(row[0], row[1], (t - knots[1]) / (knots[2] - knots[1]))


def lerp(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Linear interpolation from a to b (k,) at t (n,)."""
    return a + np.asarray(t)[..., None] * (b - a)


def slerp(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Interpolation along the great arc from unit vector a to b; t may lie outside 0 to 1 (Shoemake 1985, eq. 1)."""
    across = b - a * np.sum(a * b, -1, keepdims=True)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.arctan2(length, np.sum(a * b, -1, keepdims=True))
    turn = angle * np.asarray(t)[..., None]
    return a * np.cos(turn) + across / np.maximum(length, 1e-300) * np.sin(turn)


def quaternion_from_axes(axes: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion w, x, y, z of a camera whose rows are right, up and forward.

    4 q qᵀ is linear in the rotation matrix; its longest row, normalised, is ±q (Shepperd 1978).
    """
    (a, d, g), (b, e, h), (c, f, i) = axes * [[1.0], [1.0], [-1.0]]  # right, up and backward: a rotation's columns
    rows = np.array(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, b + d, c + g],
            [c - g, b + d, 1 - a + e - i, f + h],
            [d - b, c + g, f + h, 1 - a - e + i],
        ]
    )
    longest = rows[np.argmax(np.diag(rows))]
    return longest / np.linalg.norm(longest)


def axes_from_quaternion(q: np.ndarray) -> np.ndarray:
    """(3, 3) right, up and forward, one a row, of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    right = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    up = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)]
    backward = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    return np.array([right, up, np.negative(backward)])


def the_short_way(quaternions: np.ndarray) -> np.ndarray:
    """The same orientations (n, 4) with signs that make neighbours close: q and −q are the same rotation."""
    signs = np.where(np.sum(quaternions[1:] * quaternions[:-1], -1) < 0, -1.0, 1.0)
    return quaternions * np.cumprod(np.concatenate([[1.0], signs]))[:, None]


def monotone(x: np.ndarray, y: np.ndarray, at: float) -> float:
    """A rising curve through rising points, with a continuous first derivative (Fritsch & Butland 1984).

    At a point between secants of slopes d and e over widths g and h, the curve's slope is their weighted harmonic mean,
    3(g + h) / ((2h + g)/d + (h + 2g)/e). It is at most three times the smaller of d and e, so the cubic never falls.
    """
    widths = np.diff(x)
    secants = np.diff(y) / np.diff(x)
    d = secants[:-1]
    e = secants[1:]
    g = widths[:-1]
    h = widths[1:]
    with np.errstate(divide="ignore"):  # beside a level part the mean is 3(g + h) / ∞ = 0
        means = 3 * (g + h) / ((2 * h + g) / d + (h + 2 * g) / e)
    slopes = np.concatenate([secants[:1], means, secants[-1:]])
    i = int(np.clip(np.searchsorted(x, at, "right") - 1, 0, len(widths) - 1))
    u = (at - x[i]) / widths[i]
    hermite = y[i] + (y[i + 1] - y[i]) * u * u * (3 - 2 * u)
    return float(hermite + widths[i] * u * (1 - u) * (slopes[i] * (1 - u) - slopes[i + 1] * u))
