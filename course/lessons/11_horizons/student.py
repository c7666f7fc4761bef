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
    raise NotImplementedError("write this")


def horizons(heights, step_m):
    """11.2 The same in a time proportional to n: from the end to the beginning, with the upper hull on a stack.

    returns   (n,) slopes
    """
    raise NotImplementedError("write this")


def map_horizons(heights, spacing):
    """11.3 The horizons of a map's posts in four directions, with your `horizons`.

    heights   (rows, cols); row 0 is the north edge
    spacing   metres between posts to the east, to the north
    returns   (4, rows, cols): towards west, north, east, south
    """
    raise NotImplementedError("write this")


def disc_share(elevation, horizon, radius):
    """11.4 The share of the sun's disc above a straight, level horizon; all angles in radians.

    elevation of the disc's middle, the horizon's elevation, and the disc's radius; arrays or numbers
    returns   0 to 1
    """
    raise NotImplementedError("write this")


def sunlit(horizon_slopes, tan_elevation):
    """11.5 Whether each place sees a sun that is a point.

    horizon_slopes  slopes towards the sun, -inf where only sky lies ahead
    tan_elevation   tangent of the sun's elevation
    returns         bool
    """
    raise NotImplementedError("write this")
