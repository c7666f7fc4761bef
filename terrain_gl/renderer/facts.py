"""What the pixels of a picture show: kind, depth, place and normal, all of the same samples."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..basics.exceptions import UsageError
from ..basics.replacing import replacing
from ..camera import Camera
from ..camera.pieces import Piece
from ..heightmap import Heightmap
from ..image import writing_rows
from ..shade.picture import Picture

KINDS = ("sky", "land", "water", "surroundings", "void")  # by number: glsl/shade/facts.frag
FORMATS = (".npz", ".exr")
CHANNELS = ("Z", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "kind")  # of an .exr


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

    @classmethod
    def empty(cls, size: tuple[int, int]) -> Facts:
        """Arrays for a picture of a size, to be filled by `put`."""
        shape = size[1], size[0]
        metres, normals = np.empty((*shape, 3)), np.empty((*shape, 3), np.float32)
        return cls(np.empty(shape, np.float32), metres, normals, np.empty(shape, np.uint8))

    def put(self, piece: Piece, facts: Facts) -> None:
        """Fill in the facts of a piece of the picture."""
        for each in fields(self):
            getattr(self, each.name)[piece.rows, piece.cols] = getattr(facts, each.name)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the arrays to a file.

        Parameters
        ----------
        path
            `.npz`: the arrays by their names, with their types. `.exr`: float32 channels, `Z` for the depth, `P.X`,
            `P.Y`, `P.Z` for the place, `N.X`, `N.Y`, `N.Z` for the normal, and `kind`.

        Raises
        ------
        UsageError, TerrainError
            Another ending, or the file cannot be written.
        """
        ending = Path(path).suffix.lower()
        if ending not in FORMATS:
            raise UsageError(f"{path}: what pixels show is written to a name that ends in one of {', '.join(FORMATS)}")
        if ending == ".npz":
            with replacing(path) as beside, open(beside, "wb") as file:
                np.savez_compressed(file, depth=self.depth, places=self.places, normals=self.normals, kind=self.kind)
            return
        height, width = self.kind.shape
        with writing_rows(path, (width, height, len(CHANNELS)), "float", {}, CHANNELS) as write:
            layers = self.depth[..., None], self.places, self.normals, self.kind[..., None]
            write(np.concatenate(layers, -1, dtype=np.float32, casting="same_kind"))


def facts_of(picture: Picture, eye: Camera) -> Facts:
    """The facts of the last picture, which `eye` sees; in true metres, also where the relief is exaggerated."""
    first, second = picture.facts()
    factor = picture.terrain.heightmap.exaggeration
    depth = factor * first[..., 3]
    with np.errstate(invalid="ignore", under="ignore"):  # slopes of flat land may be tiny
        places = (first[..., :3].astype(np.float64) + eye.eye) * [factor, factor, 1.0]
        normals = second[..., :3] * np.array([1.0, 1.0, factor], np.float32)
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        normals /= np.where(length > 0, length, 1)
    places[~np.isfinite(depth)] = np.nan
    return Facts(depth, places, normals, np.rint(second[..., 3]).astype(np.uint8))


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
