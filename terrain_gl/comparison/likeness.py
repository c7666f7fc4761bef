"""The difference between a picture and the truth, in numbers. Both pictures have the same size.

rmse      root mean square difference over all channels; channels run from 0, black, to 1, as displayed (sRGB)
flip      the difference that people see when the two pictures alternate (Andersson et al. 2020, "FLIP: a difference
          evaluator for alternating images"), 0 to 1, mean over the picture, at 67 pixels per degree
skyline   the distance between the skylines of the two pictures in pixels, computed from the share of sky in each pixel
"""

from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio

from ..image import linear_from_srgb


class Skyline(NamedTuple):
    """Vertical distance between two skylines: the mean and the largest over the picture's columns, in pixels."""

    mean_px: float
    max_px: float


def rmse(one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square difference of two pictures, (height, width, 3 or 4) uint8 sRGB; alpha is ignored."""
    return float(np.sqrt(np.square(difference_of(one, other)).mean()))


def difference_of(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(height, width) root mean square difference over the channels of each pixel, 0 to 1."""
    _check(one, other)
    difference = one[..., :3].astype(np.float64) - other[..., :3]
    return np.sqrt(np.square(difference / 255).mean(-1))


def flip(truth: np.ndarray, test: np.ndarray) -> float | None:
    """Mean FLIP error of two pictures, (height, width, 3 or 4) uint8 sRGB; None if this OpenImageIO has no FLIP."""
    _check(truth, test)
    return flip_of_light(linear_from_srgb(truth[..., :3]), linear_from_srgb(test[..., :3]))


def flip_of_light(truth: np.ndarray, test: np.ndarray) -> float | None:
    """`flip` of two pictures of linear light, (height, width, 3) from 0 to 1."""
    if not hasattr(oiio.ImageBufAlgo, "FLIP_diff"):  # OpenImageIO has it since 3.2
        return None
    return float(flip_map(truth, test).mean())


def flip_map(truth: np.ndarray, test: np.ndarray) -> np.ndarray:
    """FLIP of each pixel, (height, width) float64, of two pictures of linear light; needs OpenImageIO 3.2."""
    light = [oiio.ImageBuf(np.ascontiguousarray(picture, np.float32)) for picture in (truth, test)]
    error = oiio.ImageBufAlgo.FLIP_diff(light[0], light[1], hdr=0)
    return np.asarray(error.get_pixels(), np.float64).reshape(truth.shape[:2])


def skyline(truth: np.ndarray, test: np.ndarray) -> Skyline:
    """Distance of two skylines, from the share of sky in each pixel, (height, width) from 0 to 1."""
    _check(truth, test)
    off = np.abs(truth.sum(0, dtype=np.float64) - test.sum(0, dtype=np.float64))
    return Skyline(float(off.mean()), float(off.max()))


def _check(one: np.ndarray, other: np.ndarray) -> None:
    if one.shape != other.shape:
        raise ValueError(f"expected pictures of one shape, got {one.shape} and {other.shape}")
