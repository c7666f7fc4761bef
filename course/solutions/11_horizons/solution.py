"""Lesson 11: what each place sees of the sky.

The horizon of a post in a direction is the largest slope (rise over level distance) to any post ahead; -inf if there is
none ahead.
"""

import numpy as np


def slow_horizons(heights, step_m):
    """11.1 The horizon of each post of a line towards its end, by looking at every pair.

    heights   (n,) metres, posts step_m apart
    returns   (n,) slopes; the last one is -inf
    """
    # solution
    n = len(heights)
    found = np.full(n, -np.inf)
    for i in range(n - 1):
        found[i] = ((heights[i + 1 :] - heights[i]) / (step_m * np.arange(1, n - i))).max()
    return found
    # end


def horizons(heights, step_m):
    """11.2 The same in a time proportional to n: from the end to the beginning, with the upper hull on a stack.

    returns   (n,) slopes
    """
    # solution
    h, found, hull = heights.tolist(), [-np.inf] * len(heights), []
    for i in range(len(h) - 1, -1, -1):
        while len(hull) > 1 and (h[hull[-1]] - h[i]) * (hull[-2] - i) <= (h[hull[-2]] - h[i]) * (hull[-1] - i):
            hull.pop()
        if hull:
            found[i] = (h[hull[-1]] - h[i]) / (step_m * (hull[-1] - i))
        hull.append(i)
    return np.array(found)
    # end


def map_horizons(heights, spacing):
    """11.3 The horizons of a map's posts in four directions, with your `horizons`.

    heights   (rows, cols); row 0 is the north edge
    spacing   metres between posts to the east, to the north
    returns   (4, rows, cols): towards west, north, east, south
    """
    # solution
    east = np.array([horizons(row, spacing[0]) for row in heights])
    west = np.array([horizons(row[::-1], spacing[0])[::-1] for row in heights])
    south = np.array([horizons(col, spacing[1]) for col in heights.T]).T
    north = np.array([horizons(col[::-1], spacing[1])[::-1] for col in heights.T]).T
    return np.stack([west, north, east, south])
    # end


def disc_share(elevation, horizon, radius):
    """11.4 The share of the sun's disc above a straight, level horizon; all angles in radians.

    elevation of the disc's middle, the horizon's elevation, and the disc's radius; arrays or numbers
    returns   0 to 1
    """
    # solution
    x = np.clip((np.asarray(elevation) - horizon) / radius, -1, 1)
    return 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi
    # end


def sunlit(horizon_slopes, tan_elevation):
    """11.5 Whether each place sees a sun that is a point.

    horizon_slopes  slopes towards the sun, -inf where only sky lies ahead
    tan_elevation   tangent of the sun's elevation
    returns         bool
    """
    # solution
    return horizon_slopes < tan_elevation
    # end
