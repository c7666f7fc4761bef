"""The Earth is round: how much lower land is drawn, the further away it is.

At the distance r from the eye, a post is drawn lower by its drop r² / 2R. R is the radius of the Earth or of another
body. Air bends light downwards, which makes the drop smaller: with the coefficient of refraction k, the radius in
effect is R / (1 − k).
Between posts the drop is bilinear, like the heights (glsl/blocks/view.glsl).
"""

import numpy as np

from .. import sight
from ..heightmap import Heightmap
from .camera import Camera


def bend_per_m(heightmap: Heightmap, mode: str, refraction: float) -> float:
    """1 / 2R, with the radius in effect, for one of `sight.CURVATURES`; 0 if the map is drawn flat."""
    return sight.bend_per_m(heightmap.georeference, max(heightmap.extent_m), mode, refraction)


def radius_of(bend: float) -> float | None:
    """The radius in effect, metres; None if the ground is flat."""
    return 1 / (2 * bend) if bend else None


def drop_between_m(camera: Camera, heightmap: Heightmap, cols: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The drop at places between posts, given as fractional columns and rows: bilinear, like the heights."""
    east, north = heightmap.spacing_m
    bulge = sum(
        np.square(step) * (part := at - np.floor(at)) * (1 - part) for step, at in ((east, cols), (north, rows))
    )
    return camera.drop_m(cols * east, (heightmap.rows - 1 - rows) * north) + camera.bend_per_m * bulge
