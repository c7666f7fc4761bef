"""lod, continued: the Earth is round, so land far away is drawn lower.

R is the radius in effect, and b = 1 / 2R. The drawn surface and the truth are both lower by a drop.
"""

import numpy as np

# A post at the place (x, y) from the eye has the drop   q = b (x² + y²).   Between posts the drop is bilinear, like
# the heights. q has no mixed part x y, so within a cell of the map the drop is a plane.


def drop_m(shape: tuple[int, ...], spacing_m: tuple[float, float], eye: np.ndarray, bend_per_m: float) -> np.ndarray:
    """Drop of each post of a map of (rows, cols) posts, metres."""
    rows, cols = np.indices(shape)
    x, y = cols * spacing_m[0] - eye[0], (shape[0] - 1 - rows) * spacing_m[1] - eye[1]
    return bend_per_m * (np.square(x) + np.square(y))


# A triangle inside a cell of 2^j posts draws the weighted mean of the drops of its corners; the truth under it has the
# drop of the place. The difference is the sag:   0 ≤ sag ≤ b · (half the cell's diagonal)² = b 4^j (s_x² + s_y²) / 4


def largest_sag_m(level: int, spacing_m: tuple[float, float], bend_per_m: float) -> float:
    """Bound of the sag in cells of 2^level posts, metres; 0 for the map's own cells and parts of them."""
    return bend_per_m * 4.0**level * (spacing_m[0] ** 2 + spacing_m[1] ** 2) / 4 if level > 0 else 0.0
