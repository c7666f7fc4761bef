"""The bands of a GDAL raster that are read: heights or colours, and opacity, which marks voids.

A file may say "no data here" by a value (readers/values.py), or by opacity: a mask inside the file or beside it (.msk),
an alpha band, or a palette's transparent entries. Opacity is read as one more channel, 0 where a post is void.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.raster import MAX_CHANNELS, Band, listed, number_of


@dataclass(frozen=True)
class Bands:
    """Which bands of a dataset are read, and how. Bands are counted from 1."""

    heights: tuple[int, ...]  # bands of heights or colours
    names: tuple[str, ...]  # the file's names of these bands; empty for bands without a name
    alphas: tuple[int, ...]  # bands of opacity
    has_mask: bool  # the first band has a mask besides its no-data value
    greys: np.ndarray | None  # grey level and opacity of each index of a palette: (n, 2) uint8

    @property
    def has_opacity(self) -> bool:
        """Whether the last channel is opacity."""
        return self.has_mask or bool(self.alphas) or self.greys is not None

    @property
    def channels(self) -> int:
        """Number of channels that `read` returns."""
        return len(self.heights) + self.has_opacity

    def read(self, data: Any, window: Any = None, size: tuple[int, int] | None = None) -> np.ndarray:
        """Pixels (rows, cols, channels) of a window; with `size`, only so many rows and columns, spread over it."""
        where = {"window": window, "out_shape": size}
        pixels = np.stack([data.read(band, **where) for band in self.heights], -1)
        if not self.has_opacity:
            return pixels
        opaque = np.ones(pixels.shape[:2], bool)
        if self.has_mask:
            opaque &= data.read_masks(self.heights[0], **where) != 0
        for band in self.alphas:
            opaque &= data.read(band, **where) != 0
        if self.greys is not None:
            entries = self.greys[np.minimum(pixels[..., 0], len(self.greys) - 1)]
            opaque &= entries[..., 1] != 0
            pixels = entries[..., :1]
        return np.concatenate([pixels, opaque[..., None].astype(pixels.dtype)], -1)


def bands_of(data: Any, name: str, band: Band | None) -> Bands:
    """Choose the bands of a rasterio dataset: the band with this number or name, or else all bands.

    `TerrainError` lists the bands, if there is no such band or if they hold no heights.
    """
    from rasterio.enums import ColorInterp

    alphas = tuple(i + 1 for i, meaning in enumerate(data.colorinterp) if meaning == ColorInterp.alpha)
    others = tuple(i for i in range(1, data.count + 1) if i not in alphas) or alphas
    names = tuple(_name(data, i + 1) for i in range(data.count))
    if band is not None:
        others = (number_of(band, names, name),)
    elif len(others) > MAX_CHANNELS:
        has = listed([names[i - 1] for i in others])
        raise TerrainError(f"{name}: {has}: say which holds the heights, as with --band 1")
    first = others[0] - 1
    if data.dtypes[first].startswith("complex"):
        raise TerrainError(f"{name}: holds complex numbers: convert it to one real height per post")
    alphas = tuple(alpha for alpha in alphas if alpha not in others)
    greys = _greys(data, others[0], name) if data.colorinterp[first] == ColorInterp.palette else None
    has_mask = _has_mask(data, first) or (greys is not None and data.nodatavals[first] is not None)
    return Bands(others, tuple(names[i - 1] for i in others), alphas, has_mask, greys)


def _name(data: Any, band: int) -> str:
    try:
        return data.descriptions[band - 1] or data.tags(band).get("NETCDF_VARNAME", "")
    except UnicodeDecodeError:
        return ""


def _has_mask(data: Any, first: int) -> bool:
    """Whether a band has a mask besides its no-data value and the alpha band, which are read in other ways."""
    from rasterio.enums import MaskFlags

    return set(data.mask_flag_enums[first]) not in (
        {MaskFlags.all_valid},
        {MaskFlags.nodata},
        {MaskFlags.per_dataset, MaskFlags.alpha},
    )


def _greys(data: Any, band: int, name: str) -> np.ndarray:
    """The grey levels of a palette; `TerrainError` if it has other colours."""
    palette: dict[int, Sequence[int]] = data.colormap(band)
    entries = np.zeros((max(palette, default=0) + 1, 4), np.uint8)
    for index, colour in palette.items():
        entries[index] = colour
    opaque = entries[entries[:, 3] > 0]
    if not (opaque[:, :1] == opaque[:, 1:3]).all():
        raise TerrainError(f"{name}: holds palette indices, not heights: convert it to one grey channel")
    return entries[:, [0, 3]]
