"""A bound of how far float32 rounding on the GPU moves a vertex on the screen; derived in docs/precision.md."""

import numpy as np

from terrain_gl.camera import Camera

ROUNDING = 2.0**-24  # relative error of one float32 operation
CLIP_ROUNDINGS = 9  # roundings of a clip coordinate: 3 of a position, 5 of a matrix product, 1 for their products
SCREEN_ROUNDINGS = 4  # roundings of the division by depth and of the viewport transform


def rounding_px(
    camera: Camera, size: tuple[int, int], spacing_m: tuple[float, float], points: np.ndarray, reach_m: float = 0.0
) -> np.ndarray:
    """Bound the distance between a point's position in float32 and its exact position in the picture.

    The rasteriser's grid adds up to half a step of 1/256 pixel along each axis, on all GPUs seen so far.

    Parameters
    ----------
    camera : Camera
    size : (int, int)
        Width and height of the picture in pixels.
    spacing_m : (float, float)
        Metres between posts, east and north.
    points : numpy.ndarray, shape (n, 3)
        World metres; points in the picture.
    reach_m : float
        The longest edge of the triangle that contains a point; 0 for vertices.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Pixels.
    """
    from_eye = points - np.asarray(camera.eye)
    away = np.linalg.norm(from_eye, axis=1) + reach_m + np.hypot(*spacing_m)
    depth = from_eye @ camera.forward
    tan_x, tan_y = camera.half_extent(size)
    spread = np.hypot(1 + tan_x, 1 + tan_y)  # the errors of x and y, plus that of depth at the picture's rim
    of_clip = CLIP_ROUNDINGS * camera.focal_px(size[1]) * spread * away / depth
    return ROUNDING * (of_clip + SCREEN_ROUNDINGS * np.hypot(*size))
