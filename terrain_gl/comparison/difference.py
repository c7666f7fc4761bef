"""The difference of two pictures that should be equal, and whether it is within a tolerance.

The difference of a pixel is the largest difference of its channels, in steps. One step is 1/255 of the full scale, or
one step of an 8-bit picture. The full scale of floats, which are linear light, is 1.
"""

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..image import difference, linear_from_srgb, read_image, write_png
from .likeness import flip_of_light

STEPS = 255
Name = str | os.PathLike[str]


class Tolerance(NamedTuple):
    """How much two pictures may differ: at most `share` of the pixels by more than `steps`."""

    steps: float = 1.0
    share: float = 0.0


EXACT = Tolerance()
# a driver with another compiler rounds differently, which may change this many pixels
OTHER_DRIVER = Tolerance(1.0, 0.001)


class Difference(NamedTuple):
    """The difference of two pictures."""

    rmse: float  # root mean square difference over all channels, of a full scale of 1
    flip: float | None  # mean FLIP error, 0 to 1 (`likeness.flip`); None if this OpenImageIO has no FLIP
    largest: float  # the largest difference of a pixel in steps
    share: float  # share of the pixels that differ by more than the tolerance
    worst: tuple[int, int]  # column and row of the pixel with the largest difference, from the top left
    tolerance: Tolerance

    @property
    def is_within(self) -> bool:
        """Whether the pictures are equal within the tolerance."""
        return self.share <= self.tolerance.share

    def record(self) -> dict[str, Any]:
        """The numbers for JSON."""
        tolerance = {"tolerance": self.tolerance.steps, "allowed_share": self.tolerance.share}
        return self._asdict() | {"worst": list(self.worst)} | tolerance | {"within": self.is_within}


def differ(expected: np.ndarray, seen: np.ndarray, tolerance: Tolerance = EXACT, with_flip: bool = True) -> Difference:
    """Compare two pictures, (height, width, channels), for which `check_alike` raises no error.

    FLIP takes longer than all other numbers; without `with_flip` it is None.
    """
    full = _full_scale(expected)
    wide = np.int64 if np.issubdtype(expected.dtype, np.integer) else np.float64
    off = np.abs(seen.astype(wide) - expected.astype(wide))
    of_pixel = off.max(-1) / (full / STEPS)
    row, col = np.unravel_index(of_pixel.argmax(), of_pixel.shape)
    flip = None
    if with_flip:
        flip = flip_of_light(_light(expected), _light(seen)) if of_pixel.any() else 0.0
    rmse = float(np.sqrt(np.square(off / full).mean()))
    share = float((of_pixel > tolerance.steps).mean())
    return Difference(rmse, flip, float(of_pixel.max()), share, (int(col), int(row)), tolerance)


def differ_files(expected: Name, seen: Name, tolerance: Tolerance, output: str | None) -> Difference:
    """Compare two files, and write the picture of their difference to `output`, a PNG, if that is not None."""
    pictures = read_image(expected), read_image(seen)
    check_alike(pictures, (expected, seen))
    found = differ(*pictures, tolerance)
    if output is not None:
        write_png(output, difference(*pictures))
    return found


def check_alike(pictures: tuple[np.ndarray, np.ndarray], names: tuple[Name, Name]) -> None:
    """Raise `TerrainError` if two pictures differ in size, channels or type, or have numbers that are not finite."""
    one, other = pictures
    first, second = (os.fspath(name) for name in names)
    for what, a, b in (
        ("pixels", _size(one), _size(other)),
        ("channels", one.shape[2], other.shape[2]),
        ("values", one.dtype, other.dtype),
    ):
        if a != b:
            raise TerrainError(f"{second}: has {b} {what}, and {first} has {a} {what}: compare pictures of one kind")
    for picture, name in zip(pictures, (first, second), strict=True):
        if not np.isfinite(picture).all():
            raise TerrainError(f"{name}: has values that are not finite: they cannot be compared")


def difference_name(picture: str | os.PathLike[str]) -> str:
    """The name of the difference picture beside a picture: hill.png has hill-difference.png."""
    path = Path(picture)
    return str(path.with_name(f"{path.stem}-difference.png"))


def _size(picture: np.ndarray) -> str:
    return f"{picture.shape[1]} x {picture.shape[0]}"


def _full_scale(picture: np.ndarray) -> float:
    return float(np.iinfo(picture.dtype).max) if np.issubdtype(picture.dtype, np.integer) else 1.0


def _light(picture: np.ndarray) -> np.ndarray:
    """(height, width, 3) linear light, 0 to 1; grey has three equal channels, alpha is left out."""
    colour = picture[..., :3] if picture.shape[2] >= 3 else picture[..., :1].repeat(3, -1)
    scaled = np.clip(colour / _full_scale(picture), 0, 1)
    return scaled if np.issubdtype(picture.dtype, np.floating) else linear_from_srgb(STEPS * scaled)
