"""How far the GPU's float32 moves a vertex on the screen, at most: docs/precision.md derives it."""

from __future__ import annotations

import numpy as np

from ..camera import Camera

ROUNDING = 2.0**-24  # relative error of one float32 operation
CLIP_ROUNDINGS = 9  # of a clip coordinate: 3 of a position, 5 of a matrix product, 1 for products of them
SCREEN_ROUNDINGS = 4  # of the division by depth and of the viewport


def rounding_px(
    camera: Camera, size: tuple[int, int], spacing_m: tuple[float, float], points: np.ndarray, reach_m: float = 0.0
) -> np.ndarray:
    """Bound the distance between where float32 puts points in the picture and where they belong.

    The rasteriser's own grid comes on top: half a step of 1/256 pixel along each axis, on all GPUs seen so far.

    Parameters
    ----------
    camera : Camera
    size : (int, int)
        Width and height of the picture in pixels.
    spacing_m : (float, float)
        Metres between posts, east and north.
    points : numpy.ndarray, shape (n, 3)
        World metres; in the picture.
    reach_m : float
        Longest edge of the triangle that a point lies in; 0 for vertices.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Pixels.
    """
    from_eye = points - np.asarray(camera.eye)
    away = np.linalg.norm(from_eye, axis=1) + reach_m + np.hypot(*spacing_m)
    depth = from_eye @ camera.forward
    tan_x, tan_y = camera.half_extent(size)
    spread = np.hypot(1 + tan_x, 1 + tan_y)  # a clip coordinate's own error, and that of depth, at the picture's rim
    of_clip = CLIP_ROUNDINGS * camera.focal_px(size[1]) * spread * away / depth
    return ROUNDING * (of_clip + SCREEN_ROUNDINGS * np.hypot(*size))
