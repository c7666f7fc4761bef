"""Which rings are in the picture, and whether the eye is above the ground. The CPU decides this before any pass."""

import numpy as np

from ..camera import Camera, boxes_in_picture
from ..heightmap import Heightmap
from ..terrain import Terrain
from .ring_layout import Ring

ROUGH_PX = 64.0  # a mesh with larger errors may be above an eye that is above the ground


def rings_in_picture(
    rings: list[Ring], heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float
) -> list[Ring]:
    """The finest rings that together contain all land in the picture."""
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
    """For each of n rectangles of posts, (n, 4) integers: whether it may be in the picture, (n,) bool."""
    dx, dy = heightmap.spacing_m
    low_m, high_m = heightmap.quantised_m
    west, north, east, south = posts.T
    last = heightmap.rows - 1
    none = np.zeros(len(posts))
    low = np.stack([dx * west, dy * (last - south), none + low_m], 1)
    high = np.stack([dx * east, dy * (last - north), none + high_m], 1)
    return boxes_in_picture(camera, size, near_m, low, high)


def is_above_ground(terrain: Terrain, post: tuple[int, int], up_m: float, reach_m: float) -> bool:
    """Whether the eye is over the map, and every point within `reach_m` of it is above the ground.

    Parameters
    ----------
    post, up_m
        Column and row of the post nearest to the eye, and the eye's height in metres above the terrain's base.
    reach_m
        Distance of the near plane's corners. The near plane may cut the ground although the eye is above it.
    """
    col, row = post
    heightmap = terrain.heightmap
    is_over_map = 0 < col < heightmap.cols - 1 and 0 < row < heightmap.rows - 1
    if not is_over_map or 2 * reach_m > min(heightmap.spacing_m):
        return False
    highest_m = terrain.filled[row - 1 : row + 2, col - 1 : col + 2].max() - terrain.base_m
    return bool(up_m - reach_m > highest_m)
