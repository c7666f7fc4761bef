"""Lesson 2: from metres of height to pixels on the screen.

Coordinates are the camera's: x to the right, y up, z the depth. Arrays of points have the shape (3, n).
"""

import itertools

import numpy as np


def shift_px(p, v, focal_px, rise_m):
    """2.1 Pixels by which points move on the screen if they rise along the vertical.

    p         (3, n) points in camera coordinates, metres; z > 0
    v         (3,) the vertical, a unit vector in camera coordinates
    focal_px  K, the focal length in pixels
    rise_m    (n,) metres, positive or negative; no point moves behind the eye
    returns   (n,) pixels, never negative
    """
    raise NotImplementedError("write this")


def tolerance_m(p, v, focal_px, error_px):
    """2.2 The largest δ such that each point may rise or fall by δ and moves by error_px at most.

    p, v, focal_px as above; returns (n,) metres
    """
    raise NotImplementedError("write this")


def box_corners(low, high):
    """The 8 corners of the box between two points, (3, 8). This is done for you."""
    return np.array(list(itertools.product(*zip(low, high))), float).T


def bound_px(corners, v, focal_px, error_m):
    """2.3 Pixels that no point of a box can exceed if it rises or falls by at most error_m.

    corners   (3, 8) the corners of the box in camera coordinates; all are in the picture
    error_m   metres; no point of the box moves behind the eye
    returns   a number
    """
    raise NotImplementedError("write this")
