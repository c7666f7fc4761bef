"""lod: hidden land, found with a horizon around the eye from lower bounds of the map (Lloyd & Egbert 2002)."""

import math

import numpy as np

SECTORS = 1024
SHELLS_PER_DOUBLING = 45.0
SHELL_SPACINGS = 64.0

# The angle from the direction ahead is measured along a square around the eye, from -2 to 2; (p, q) are the parts of a
# direction ahead and to the left:   t = q / (|p| + |q|) ahead,   ±2 - t behind.   Sector 0 begins behind, on the right.


def sectors_of(ahead: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Sector numbers, with fractions, of horizontal directions (..., 2)."""
    p, q = towards @ ahead, ahead[0] * towards[..., 1] - ahead[1] * towards[..., 0]
    t = q / (np.abs(p) + np.abs(q))
    return SECTORS / 4 * np.where(p >= 0, 2 + t, np.where(q >= 0, 4 - t, -t))


def sector_directions(ahead: np.ndarray, sectors: np.ndarray) -> np.ndarray:
    """Unit vectors at which sectors begin, (..., 2): the inverse of `sectors_of`."""
    a = sectors * (4 / SECTORS) - 2
    p, q = 1 - np.abs(a), np.where(np.abs(a) <= 1, a, np.sign(a) * 2 - a)
    towards = np.stack([p * ahead[0] - q * ahead[1], p * ahead[1] + q * ahead[0]], -1)
    return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


# r_k = 64 s (2^(k / 45) − 1)


def shell_radii_m(shells: int, spacing_m: tuple[float, float]) -> np.ndarray:
    """Radius of each shell."""
    return SHELL_SPACINGS * min(spacing_m) * (2 ** (np.arange(shells) / SHELLS_PER_DOUBLING) - 1)


# Between the directions a and b, a sight line passes over the chord from r a to r b. The land under the chord is at
# least as high as the lowest corner h of the cells around it. So for every sight line of the sector
#     slope of the land in front ≥ (h − eye − drop) / d,     r |a + b| / 2 ≤ d ≤ r


def horizon_around(
    heights: np.ndarray,
    spacing_m: tuple[float, float],
    eye: np.ndarray,
    ahead: np.ndarray,
    shells: int,
    bend_per_m: float = 0.0,
) -> np.ndarray:
    """(SECTORS, shells): for each sector the largest slope of land up to each shell; -inf if there is none.

    Voids (NaN) are no land: nothing bounds the surface that is drawn over them.
    """
    towards = sector_directions(ahead, np.arange(SECTORS + 1))
    middle = np.linalg.norm(towards[1:] + towards[:-1], axis=1) / 2
    slopes = np.full((SECTORS, shells), -np.inf)
    rows, cols = heights.shape
    bulge_m = bend_per_m * (spacing_m[0] ** 2 + spacing_m[1] ** 2) / 4
    for k, r in enumerate(shell_radii_m(shells, spacing_m)[1:], 1):
        x = (eye[0] + r * towards[:, 0]) / spacing_m[0]
        y = rows - 1 - (eye[1] + r * towards[:, 1]) / spacing_m[1]
        ends = np.sort(np.stack([[x[:-1], x[1:]], [y[:-1], y[1:]]]), 1)
        first, last = np.floor(ends[:, 0]).astype(int), np.ceil(ends[:, 1]).astype(int)
        for i in np.flatnonzero((first >= 0).all(0) & (last[0] < cols) & (last[1] < rows)):
            low = heights[first[1, i] : last[1, i] + 1, first[0, i] : last[0, i] + 1].min()
            if np.isnan(low):
                continue
            up = low - eye[2] - bend_per_m * r**2 - bulge_m
            slopes[i, k] = up / (r if up > 0 else r * middle[i])
    return np.maximum.accumulate(slopes, 1)


# The surface is drawn at most E pixels off. Seen from the eye, that is an angle of at most
#     φ = 2 arctan(E / 2K)                                                                          (docs/hidden.md)
# tan(arctan s + φ) grows with s, so the highest sight line of a box decides.


def angle_off(error_px: float, focal_px: float) -> float:
    """The largest angle, in radians, between two points of a picture that are `error_px` pixels apart."""
    return 2 * math.atan(error_px / (2 * focal_px))


def horizon_needed(slope: float, off: float) -> float:
    """Slope that the horizon must exceed to block sight lines of a slope; off = φ, in radians."""
    steeper = math.atan(slope) + off
    return math.tan(steeper) if steeper < math.pi / 2 else math.inf


def is_hidden(
    horizon: np.ndarray,
    spacing_m: tuple[float, float],
    ahead: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    off: float,
) -> bool:
    """Whether land in front hides the box from low to high, (3,) metres from the eye; off = φ, in radians."""
    nearest, farthest = np.clip(0, low[:2], high[:2]), np.maximum(np.abs(low[:2]), np.abs(high[:2]))
    near, far = np.linalg.norm(nearest), np.linalg.norm(farthest)
    corners = np.array([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
    if near == 0 or np.ptp(seen := sectors_of(ahead, corners)) > SECTORS / 2:
        return False
    k = np.searchsorted(shell_radii_m(horizon.shape[1], spacing_m), near, "right") - 1
    highest = high[2] / (near if high[2] > 0 else far)
    between = horizon[int(seen.min()) : int(seen.max()) + 1, k]
    return bool(between.min() > horizon_needed(highest, off))
