"""The map from straight above, almost without perspective: a rendered picture as a texture for meshes."""

import math
from typing import Any

import numpy as np

from ..camera import Camera
from .renderer import Renderer

AWAY = 450.0  # the eye's distance, in multiples of the map's depth; further away, the field of view would be too small
LONGEST_PX = 2048


def plan(renderer: Renderer, longest_px: int = LONGEST_PX, **look: Any) -> np.ndarray:
    """Picture of the whole map, north up. The outermost posts lie half a cell inside its edges.

    Parameters
    ----------
    longest_px
        Pixels along the longer side.
    look
        Fields of `FrameOptions`, by name.

    Returns
    -------
    picture
        (rows, cols, 3) uint8 sRGB.
    """
    heightmap = renderer.heightmap
    east, north = heightmap.spacing_m
    rows, cols = heightmap.heights.shape
    width, depth = cols * east, rows * north
    px = longest_px / max(width, depth)
    size = max(1, round(px * width)), max(1, round(px * depth))
    away = AWAY * depth
    level = float(np.mean(heightmap.range_m))
    x, y = (cols - 1) * east / 2, (rows - 1) * north / 2
    camera = Camera((x, y, level + away), (x, y, level), math.degrees(2 * math.atan(depth / 2 / away)))
    own: dict[str, Any] = {"near_m": away / 2, "curvature": "off"}
    if heightmap.is_store:  # errors of height move nothing, but light and colours need the detail of finer tiles
        own["max_error_px"] = 1 / (2 * AWAY)
    image = renderer.render(camera, size=size, **look | own).image
    inside = [_inside(size[1], rows), _inside(size[0], cols)]
    return image[np.ix_(*inside)][..., :3]


def _inside(pixels: int, posts: int) -> np.ndarray:
    """For each pixel of a line, the nearest pixel that shows only land: the picture ends half a cell beyond the map."""
    at = (np.arange(pixels) + 0.5) / pixels * posts - 0.5
    whole = posts / pixels  # a pixel at the rim is partly sky
    good = np.flatnonzero((at > whole) & (at < posts - 1 - whole))
    if not len(good):
        return np.arange(pixels)
    return np.clip(np.arange(pixels), good[0], good[-1])
