"""A pyramid of depths hides blocks of land.

Run: python -m course.field.depths
"""

import numpy as np

from course.field import own
from course.land import land

four = own(4)
SIDE, BLOCK, BINS, LOW, HIGH = 256, 16, 1024, -0.6, 0.4  # posts; posts of a block; pixels of a column, and their slopes


def main():
    """The eye stands west of the map, and each row of posts is a column of the picture."""
    heights = land(np.random.default_rng(3), SIDE, SIDE, 120.0)
    away = 20.0 * (np.arange(SIDE) + 4.0)
    slopes = (heights - heights[:, :1] - 30.0) / away
    pixel = np.clip(((slopes - LOW) / (HIGH - LOW) * BINS).astype(int), 0, BINS - 1)
    before = np.pad(np.maximum.accumulate(slopes, 1)[:, :-1], ((0, 0), (1, 0)), constant_values=-np.inf)
    depth = np.full((SIDE, BINS), np.inf)
    for row, post in np.ndindex(SIDE, SIDE):  # the nearest land of each pixel that it fills
        filled = depth[row, : pixel[row, post]]
        np.minimum(filled, away[post], out=filled)
    for step in range(5):
        found = []
        texels = four.tile_errors(depth, 1 << step)  # the farthest depth of each square of pixels
        for y, x in np.ndindex(SIDE // BLOCK, SIDE // BLOCK):
            part = np.s_[y * BLOCK : (y + 1) * BLOCK, x * BLOCK : (x + 1) * BLOCK]
            rows = np.s_[y * BLOCK >> step : (y + 1) * BLOCK >> step]
            over = texels[rows, pixel[part].min() >> step : (pixel[part].max() >> step) + 1]
            found.append(((slopes[part] < before[part]).all(), away[x * BLOCK] > over.max(), over.size))
        hidden, culled, count = np.array(found).T
        told = f"{culled.sum():.0f} of {hidden.sum():.0f} hidden blocks found, {(culled > hidden).sum()} of them seen"
        print(f"texels of {1 << step}: {told}, {count.mean():.0f} fetches a block")


if __name__ == "__main__":
    main()
