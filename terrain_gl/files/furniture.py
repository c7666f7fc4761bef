"""Furniture of a printed map, drawn over the rows of a picture: title, north arrow, scale bar, legend and names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio

from ..basics.exceptions import TerrainError
from ..basics.words import UNITS
from ..camera import Camera
from ..heightmap import Heightmap, bilinear
from ..image import srgb_from_linear
from ..light.ramps import Ramp

INK = np.array([255, 255, 255], np.float32)  # colour of type, also of names in the window: viewer/theme.py
PAPER = np.array([20, 24, 28], np.float32)  # colour of the panels under the type
OPACITY = 0.6  # of these panels
_LARGE = {"m": ("km", 1000.0), "ft": ("mi", 5280.0)}  # the next larger unit
_PART = 0.2  # the longest scale bar, as a part of the picture's width
_FINE = 4  # subsamples along each side of a pixel, for the arrow


class Stamp(NamedTuple):
    """Pixels (height, width, 4) float32: colours 0 to 255, opacity 0 to 1; and the place of their upper left corner."""

    left: int
    top: int
    pixels: np.ndarray


def furniture(
    size: tuple[int, int],
    camera: Camera,
    away_m: float,
    title: str,
    ramp: Ramp | None = None,
    unit: str = "",
    north_deg: float = 0.0,
    units: str = "m",
) -> list[Stamp]:
    """The furniture of a picture. `TerrainError` if there is no font.

    Parameters
    ----------
    size
        Width and height of the picture in pixels. Above a height of 720 pixels, furniture grows with the height.
    away_m
        Metres to the land in mid-picture, where the scale bar is correct (`land_ahead_m`); NaN for no bar.
    title
        Text of the title; "" for none.
    ramp, unit
        The legend's colours, and the unit of its numbers.
    north_deg
        Direction of true north, clockwise from the grid's.
    units
        "m" or "ft", of the scale bar, and of a legend of heights.
    """
    px = _type_px(16, size)
    gap = px
    stamps = []
    if title:
        stamps.append(_panel(_line(title, round(1.3 * px)), (gap, gap), px))
    arrow = _panel(_arrow(camera, north_deg, px), (0, gap), px)
    stamps.append(arrow._replace(left=size[0] - gap - arrow.pixels.shape[1]))
    if away_m > 0:
        bar = _panel(_scale_bar(size, camera, away_m, px, units), (gap, 0), px)
        stamps.append(bar._replace(top=size[1] - gap - bar.pixels.shape[0]))
    if ramp:
        unit_m = UNITS[units] if unit else 1.0
        legend = _panel(_legend(ramp, unit, unit_m, px), (0, 0), px)
        height, width = legend.pixels.shape[:2]
        stamps.append(legend._replace(left=size[0] - gap - width, top=size[1] - gap - height))
    return stamps


def name_stamps(
    size: tuple[int, int], names: Sequence[tuple[str, float, float, bool]], taken: Sequence[Stamp] = ()
) -> list[Stamp]:
    """Names in a picture; a name that would cover an earlier name, or a stamp `taken`, is left out.

    `TerrainError` if there is no font.

    Parameters
    ----------
    names
        For each the text, a column, a row, and whether the middle of the text is there; otherwise the text begins at
        the lower right of this place.
    """
    px = _type_px(14, size)
    stamps: list[Stamp] = []
    for words, column, row, is_centred in names:
        ink = _line(words, px)
        left = column - (0.5 * ink.shape[1] + px // 4 if is_centred else -0.4 * px)
        top = row - (0.5 * ink.shape[0] + px // 4 if is_centred else -0.4 * px)
        made = _panel(ink, (round(left), round(top)), px // 2)
        if not any(_overlap(made, other) for other in (*taken, *stamps)):
            stamps.append(made)
    return stamps


def _type_px(px: int, size: tuple[int, int]) -> int:
    """Height of the type. Above a height of 720 pixels, it grows with the picture."""
    return round(px * max(1.0, size[1] / 720))


def _overlap(one: Stamp, other: Stamp) -> bool:
    across = one.left < other.left + other.pixels.shape[1] and other.left < one.left + one.pixels.shape[1]
    return across and one.top < other.top + other.pixels.shape[0] and other.top < one.top + one.pixels.shape[0]


def stamp(rows: np.ndarray, first: int, stamps: list[Stamp]) -> None:
    """Draw stamps over rows (n, width, 3 or 4) of uint8; `first` is the number of the first row in the picture."""
    for each in stamps:
        height, width = each.pixels.shape[:2]
        left, right = max(each.left, 0), min(each.left + width, rows.shape[1])
        top, bottom = max(each.top, first), min(each.top + height, first + len(rows))
        if left >= right or top >= bottom:
            continue
        part = each.pixels[top - each.top : bottom - each.top, left - each.left : right - each.left]
        under = rows[top - first : bottom - first, left:right]
        opacity = part[..., 3:]
        alpha = under[..., 3:] / 255 if under.shape[2] == 4 else np.ones(opacity.shape)
        total = np.where(alpha == 1, 1, alpha + opacity * (1 - alpha))
        share = opacity / np.maximum(total, 1e-9)  # of the stamp in the colour
        under[..., :3] = np.rint(under[..., :3] * (1 - share) + part[..., :3] * share)
        under[..., 3:] = np.rint(255 * total)[..., : under.shape[2] - 3]


def land_ahead_m(land: Heightmap, camera: Camera) -> float:
    """Metres from the eye to the first land in mid-picture, to about 1/400; NaN if the sky is there."""
    east_m, north_m = land.spacing_m
    size_m = math.hypot(*land.extent_m, land.range_m[1] - land.range_m[0])
    farthest_m = math.dist(camera.eye, (land.extent_m[0] / 2, land.extent_m[1] / 2, land.range_m[0])) + size_m
    nearest_m = min(east_m, north_m) / 10
    steps = math.ceil(400 * math.log(farthest_m / nearest_m))
    away_m = np.geomspace(nearest_m, farthest_m, steps)
    x, y, z = np.array(camera.eye)[:, None] + camera.axes[2][:, None] * away_m
    heights_m = bilinear(land.heights, x / east_m, land.rows - 1 - y / north_m) - camera.drop_m(x, y)
    below = np.flatnonzero(z <= heights_m)
    return float(away_m[below[0]]) if len(below) else math.nan


def length_of(size: tuple[int, int], camera: Camera, away_m: float, unit_m: float = 1.0) -> tuple[float, float]:
    """The length of the scale bar: 1, 2 or 5 times a power of ten, in units, and in pixels at this distance."""
    m_per_px = (1.0 if camera.is_orthographic else away_m) / (camera.focal_px(size[1]) * camera.aspect(size)) / unit_m
    most = _PART * size[0] * m_per_px
    power = 10.0 ** math.floor(math.log10(most))
    length = next(digit * power for digit in (5, 2, 1) if digit * power <= most * (1 + 1e-9))
    return length, length / m_per_px


def north_of(camera: Camera, north_deg: float = 0.0) -> tuple[float, float]:
    """Direction of north at the target: a unit vector (right, up) in the picture; (0, 0) if north is along the view."""
    right, up, _ = camera.axes
    north = np.array([math.sin(math.radians(north_deg)), math.cos(math.radians(north_deg)), 0.0])
    across, along = float(right @ north), float(up @ north)
    length = math.hypot(across, along)
    return (across / length, along / length) if length > 1e-6 else (0.0, 0.0)


def _panel(ink: np.ndarray, at: tuple[int, int], px: int) -> Stamp:
    """Ink (height, width, 4) on a panel with a margin."""
    margin = px // 2
    over = np.pad(ink, ((margin, margin), (margin, margin), (0, 0)))
    opacity = over[..., 3:] + OPACITY * (1 - over[..., 3:])
    colours = (over[..., :3] * over[..., 3:] + PAPER * OPACITY * (1 - over[..., 3:])) / opacity
    return Stamp(*at, np.concatenate([colours, opacity], -1))


def _ink(opacity: np.ndarray) -> np.ndarray:
    """(height, width, 4) white of an opacity (height, width)."""
    return np.concatenate([np.broadcast_to(INK, (*opacity.shape, 3)), opacity[..., None]], -1).astype("f4")


def _line(words: str, px: int) -> np.ndarray:
    box = oiio.ImageBufAlgo.text_size(words, px)
    height, width = round(1.25 * px), max(1, box.xend - box.xbegin)
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, 1, "float"))
    if not box.defined or not oiio.ImageBufAlgo.render_text(image, -box.xbegin, px, words, px, "", (1.0,)):
        reason = " ".join(image.geterror().split())
        raise TerrainError(
            f"furniture needs a font ({reason or 'none is found'}): install one, such as fonts-dejavu-core"
        )
    return _ink(np.clip(np.asarray(image.get_pixels(oiio.FLOAT))[..., 0], 0, 1))


def _stacked(parts: list[np.ndarray], gap: int) -> np.ndarray:
    """Parts one below the other, centred."""
    width = max(part.shape[1] for part in parts)
    rows = []
    for part in parts:
        left = (width - part.shape[1]) // 2
        rows.append(np.pad(part, ((0, gap), (left, width - part.shape[1] - left), (0, 0))))
    return np.concatenate(rows)[:-gap]


def _arrow(camera: Camera, north_deg: float, px: int) -> np.ndarray:
    """An arrow to the north at the target, and the letter N."""
    side = 3 * px
    towards = np.array(north_of(camera, north_deg)) * [1, -1]  # rows count down
    at = (np.indices((side * _FINE, side * _FINE))[::-1] + 0.5).reshape(2, -1).T / _FINE - side / 2
    along, across = at @ towards, at @ np.array([-towards[1], towards[0]])
    head = (along <= 0.5 * side) & (np.abs(across) <= 0.5 * (0.5 * side - along)) & (along >= -0.05 * side)
    shaft = (np.abs(across) <= 0.07 * side) & (along >= -0.45 * side) & (along < 0)
    inside = (head | shaft) & bool(towards.any())
    opacity = inside.reshape(side, _FINE, side, _FINE).mean((1, 3))
    return _stacked([_ink(opacity), _line("N", px)], px // 4)


def _scale_bar(size: tuple[int, int], camera: Camera, away_m: float, px: int, units: str) -> np.ndarray:
    large, per_large = _LARGE[units]  # a length of a mile or more is round in miles
    length, long = length_of(size, camera, away_m, UNITS[units])
    if length >= per_large:
        length, long = length_of(size, camera, away_m, UNITS[units] * per_large)
        units = large
    bar = np.zeros((max(3, px // 2), max(2, round(long))))
    bar[-max(1, px // 8) :] = 1
    bar[:, : max(1, px // 8)] = bar[:, -max(1, px // 8) :] = 1
    return _stacked([_line(f"{length:g} {units} in mid-picture", px), _ink(bar)], px // 4)


def _legend(ramp: Ramp, unit: str, unit_m: float, px: int) -> np.ndarray:
    """A bar of the ramp's colours, and the numbers at its ends and in its middle."""
    width = 14 * px
    bar = np.ones((px, width, 4), np.float32)
    bar[..., :3] = srgb_from_linear(ramp.colours(np.linspace(ramp.low, ramp.high, width)))
    numbers = np.zeros((round(1.25 * px), width + 4 * px, 4), np.float32)
    for share, value in ((0.0, ramp.low), (0.5, (ramp.low + ramp.high) / 2), (1.0, ramp.high)):
        text = _line(f"{value / unit_m:.4g}{' ' + unit if unit else ''}", px)
        left = round(2 * px + share * width - text.shape[1] / 2)
        left = min(max(left, 0), numbers.shape[1] - text.shape[1])
        numbers[:, left : left + text.shape[1]] = text
    return _stacked([bar, numbers], px // 4)
