"""shade: mean height and mean slope of the ground under a pixel."""

import numpy as np

# Every post's height holds for the square of one post around it. Over a box, exact for planes:
#   mean = Σ h / n,   slope = (mean of one half − mean of the other) / (the same of a ramp of slope 1)


def relief(
    heights: np.ndarray, post: tuple[float, float], extent: tuple[float, float], spacing_m: tuple[float, float]
) -> tuple[float, np.ndarray]:
    """Mean height and mean slope (east, north) under a box `extent` posts wide around `post`, (column, row).

    The box ends at the map's rim.
    """
    sums = np.pad(heights.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    size = np.array(heights.shape[::-1], float)
    a, c = (np.clip(np.array(post) + 0.5 + side * np.array(extent) / 2, 0, size) for side in (-1, 1))
    b = (a + c) / 2
    total, east, south = _halves(sums, a, b, c)
    ramps = [_halves(np.pad(ramp.cumsum(0).cumsum(1), ((1, 0), (1, 0))), a, b, c) for ramp in np.indices(heights.shape)]
    rise = np.array([east / ramps[1][1], south / ramps[0][2]])
    aside = np.array(post) - [ramps[1][0], ramps[0][0]]
    return total + float(rise @ aside), rise / spacing_m * [1, -1]


def _halves(sums: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[float, float, float]:
    """Mean over the box from a to c; east half minus west half; south half minus north half.

    Row 0 and column 0 of `sums` are 0.
    """

    def S(x: float, y: float) -> float:
        i, j = min(int(x), sums.shape[1] - 2), min(int(y), sums.shape[0] - 2)
        rows = sums[j : j + 2, i] * (1 - x + i) + sums[j : j + 2, i + 1] * (x - i)
        return float(rows[0] * (1 - y + j) + rows[1] * (y - j))

    def mean(x0: float, y0: float, x1: float, y1: float) -> float:
        return (S(x1, y1) - S(x0, y1) - S(x1, y0) + S(x0, y0)) / ((x1 - x0) * (y1 - y0))

    east = mean(b[0], a[1], c[0], c[1]) - mean(a[0], a[1], b[0], c[1])
    south = mean(a[0], b[1], c[0], c[1]) - mean(a[0], a[1], c[0], b[1])
    return mean(*a, *c), east, south


# h(x, y) = Σ_ij B_i(x) B_j(y) h[j, i],   B the uniform cubic B-spline:
#   6 B(t) = (1 − t)³,  4 − 6t² + 3t³,  1 + 3t + 3t² − 3t³,  t³


def spline_relief(
    heights: np.ndarray, post: tuple[float, float], spacing_m: tuple[float, float]
) -> tuple[float, np.ndarray]:
    """Height and slope (east, north) at `post` of the uniform cubic B-spline over the heights, clamped at the rim."""
    i, j = int(np.floor(post[0])), int(np.floor(post[1]))
    rows = np.clip(np.arange(j - 1, j + 3), 0, heights.shape[0] - 1)
    cols = np.clip(np.arange(i - 1, i + 3), 0, heights.shape[1] - 1)
    h = heights[rows[:, None], cols].astype(np.float64)
    basis = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6

    def weights(t: float) -> np.ndarray:
        return np.array([1, t, t * t, t**3]) @ basis

    def slopes(t: float) -> np.ndarray:
        return np.array([0, 1, 2 * t, 3 * t * t]) @ basis

    x, y = post[0] - i, post[1] - j
    slope = np.array([weights(y) @ h @ slopes(x), -(slopes(y) @ h @ weights(x))])
    return float(weights(y) @ h @ weights(x)), slope / spacing_m


def contour_cover(level: float, rise: float, width_px: float) -> float:
    """The share of a pixel that a contour line covers, 0 to 1.

    Parameters
    ----------
    level
        Height in units of the interval: there is a line at every whole number.
    rise
        Levels that one pixel spans. Above 0.16 lines fade; from 0.3 on there are none.
    """
    t = min(max((rise - 0.16) / (0.3 - 0.16), 0.0), 1.0)
    aside_px = abs(level - np.round(level)) / max(rise, 1e-7)
    return min(max(0.5 * width_px + 0.5 - aside_px, 0.0), 1.0) * (1 - t * t * (3 - 2 * t))
