"""The precision of a planet: float32 coordinates, in pixels.

Run: python -m course.field.planet
"""

import numpy as np

from course.field import own

two = own(2)
RADIUS_M, FOCAL_PX = 6_371_000.0, 900.0
UP = np.array([0.6, 0.48, 0.64])  # of the eye's place, from the middle of the planet
EAST = np.array([-0.48, 0.6, 0.0]) / np.hypot(0.48, 0.6)


def main():
    """Print how far rounding moves places near an eye on the screen."""
    rng = np.random.default_rng(1)
    north = np.cross(UP, EAST)
    axes = np.stack([EAST, UP, north])  # right, up and ahead
    eye = RADIUS_M * UP + 2.0 * UP
    for away_m in (3.0, 30.0, 300.0, 3000.0):
        seen = np.stack([*rng.uniform(-0.5, 0.5, (2, 2000)), np.ones(2000)]) * away_m
        places = eye + seen.T @ axes
        whole = (np.float32(places) - np.float32(eye)).astype(float)  # both rounded, then subtracted
        beside = np.float32(places - eye).astype(float)  # subtracted in 64 bits, then rounded
        worst = []
        for each in (whole, beside):
            off = each @ axes.T - seen.T
            metres = np.linalg.norm(off, axis=1)
            v = (off / np.maximum(metres, 1e-30)[:, None]).T
            px = [two.shift_px(seen[:, i : i + 1], v[:, i], FOCAL_PX, metres[i : i + 1])[0] for i in range(2000)]
            worst.append(max(px))
        print(f"{away_m:g} m away: {worst[0]:.3g} px from the planet's middle, {worst[1]:.2g} px from the eye")


if __name__ == "__main__":
    main()
