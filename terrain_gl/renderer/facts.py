"""What the pixels of a picture show: kind, depth, place and normal, all of the same samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap
from ..shade.picture import Picture

KINDS = ("sky", "land", "water", "surroundings", "void")  # by number: glsl/shade/facts.frag


@dataclass(frozen=True)
class Facts:
    """Arrays of a picture's size, first row on top.

    Attributes
    ----------
    depth
        (height, width) float32 metres along the view; infinite for the sky.
    places
        (height, width, 3) float64 world metres; NaN for the sky.
    normals
        (height, width, 3) float32 unit vectors east, north, up; 0 for the sky.
    kind
        (height, width) uint8: index into `KINDS`.
    """

    depth: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    kind: np.ndarray


def facts_of(picture: Picture, eye: Camera) -> Facts:
    """The facts of the last picture, which `eye` sees; in true metres, also where the relief is exaggerated."""
    first, second = picture.facts()
    factor = picture.terrain.heightmap.exaggeration
    depth = factor * first[..., 3]
    with np.errstate(invalid="ignore"):
        places = (first[..., :3].astype(np.float64) + eye.eye) * [factor, factor, 1.0]
    places[~np.isfinite(depth)] = np.nan
    normals = second[..., :3] * np.array([1.0, 1.0, factor], np.float32)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return Facts(depth, places, normals / np.where(length > 0, length, 1), np.rint(second[..., 3]).astype(np.uint8))


class PlaceSeen(NamedTuple):
    """A place of the picture: world metres, and degrees on the datum of the map if it has a coordinate system."""

    x: float
    y: float
    z: float
    lon: float | None = None
    lat: float | None = None


def place_seen(facts: Facts, heightmap: Heightmap, column: int, row: int) -> PlaceSeen | None:
    """The place that a pixel shows; None for the sky."""
    x, y, z = (float(v) for v in facts.places[row, column])
    if math.isnan(x):
        return None
    place = heightmap.place
    lon, lat = place.to_lonlat(x, y) if place and place.crs else (None, None)
    return PlaceSeen(x, y, z, lon, lat)
