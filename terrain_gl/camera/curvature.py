"""The Earth is round: how much lower land is drawn, the further away it is.

At the distance r from the eye, a post is drawn lower by its drop r² / 2R. R is the radius of the Earth or of another
body. Air bends light downwards, which makes the drop smaller: with the coefficient of refraction k, the radius in
effect is R / (1 − k).
Between posts the drop is bilinear, like the heights (glsl/blocks/view.glsl).
"""

import re

import numpy as np

from ..heightmap import Heightmap
from ..readers.geodesy import WGS84
from .camera import Camera

MODES = ("auto", "on", "off")
FROM_M = 50e3  # "auto" draws a map flat if its longer side is shorter than this


def bend_per_m(heightmap: Heightmap, mode: str, refraction: float) -> float:
    """1 / 2R, with the radius in effect, for one of `MODES`; 0 if the map is drawn flat.

    "auto" is "on" for a map with a coordinate system whose longer side is at least `FROM_M`, and at most the radius.
    On a larger map, such as that of a whole planet, r² / 2R is far from the true drop.
    """
    radius_m = body_radius_m(heightmap)
    if mode == "off" or (mode == "auto" and not _is_round(heightmap, radius_m)):
        return 0.0
    return (1 - refraction) / (2 * radius_m)


def body_radius_m(heightmap: Heightmap) -> float:
    """The semi-major axis of the body that the map is of; the Earth's if its coordinate system does not give one."""
    georeference = heightmap.georeference
    text = str(georeference.crs) if georeference else ""
    found = re.search(r'(?:SPHEROID|ELLIPSOID)\["[^"]*",\s*([\d.]+)', text)
    return float(found[1]) if found and float(found[1]) > 0 else WGS84[0]


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


def _is_round(heightmap: Heightmap, radius_m: float) -> bool:
    georeference = heightmap.georeference
    longest_m = max(heightmap.extent_m)
    return georeference is not None and georeference.crs is not None and FROM_M <= longest_m <= radius_m
