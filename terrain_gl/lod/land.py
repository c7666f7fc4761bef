"""Which land is in the picture. The CPU finds it before any pass, from boxes as high as the map."""

from __future__ import annotations

import numpy as np

from ..basics.rect import Rect
from ..camera import Camera, boxes_in_picture
from ..heightmap import Heightmap
from .ring_layout import Ring

ACROSS = 32  # boxes along each side of the map


def posts_in_picture(heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float) -> Rect:
    """A rectangle of posts that holds all land in a picture of `size` (width, height)."""
    x, y = (np.unique(np.linspace(0, posts - 1, ACROSS + 1).astype(int)) for posts in (heightmap.cols, heightmap.rows))
    first = np.stack(np.meshgrid(x[:-1], y[:-1]), -1).reshape(-1, 2)
    last = np.stack(np.meshgrid(x[1:], y[1:]), -1).reshape(-1, 2)
    seen = _in_picture(np.hstack([first, last]), heightmap, camera, size, near_m)
    if not seen.any():
        return 0, 0, 1, 1
    west, north = first[seen].min(0).tolist()
    east, south = last[seen].max(0).tolist()
    return west, north, east, south


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
