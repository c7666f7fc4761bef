"""Which land is in the picture. The CPU finds it before any pass, from boxes as high as the map."""

from __future__ import annotations

import numpy as np

from ..camera import Camera, boxes_in_picture
from ..heightmap import Heightmap
from .ring_layout import Ring


def rings_in_picture(
    rings: list[Ring], heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float
) -> list[Ring]:
    """The rings up to the first one beyond which no land is in the picture."""
    needed = len(rings)
    last_post = (heightmap.cols - 1, heightmap.rows - 1)
    while needed > 1:  # land beyond a ring is also beyond all finer ones
        strips = rings[needed - 2].beyond(last_post)
        if strips and _in_picture(np.array(strips), heightmap, camera, size, near_m).any():
            break
        needed -= 1
    return rings[:needed]


def _in_picture(
    posts: np.ndarray, heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float
) -> np.ndarray:
    """Whether rectangles of posts, (n, 4) integers, may be in the picture: (n,) bool."""
    dx, dy = heightmap.spacing_m
    low_m, high_m = heightmap.quantised_m
    west, north, east, south = posts.T
    last = heightmap.rows - 1
    none = np.zeros(len(posts))
    low = np.stack([dx * west, dy * (last - south), none + low_m], 1)
    high = np.stack([dx * east, dy * (last - north), none + high_m], 1)
    return boxes_in_picture(camera, size, near_m, low, high)
