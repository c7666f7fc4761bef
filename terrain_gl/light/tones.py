"""How the values of a picture of the ground become colours: which bands, and which values are black and white.

8 bits are sRGB, and floats up to 1 are linear light. For other values a file rarely says what white is: its bits, if it
declares them (12 of 16), or else the highest value. A note names the stretch, and `--range` replaces it.
"""

import re
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..image import linear_from_srgb
from .ramps import Range

_BRIGHT = 99.9  # percentile of the values that is white: some pixels are faulty
_LINEAR = 1.5  # floats with a higher value are no albedos
_SRGB_8 = linear_from_srgb(np.arange(256)).astype("f4")
_COLOURS = ("red", "green", "blue")
_NANOMETRES = (660.0, 560.0, 480.0)
_FARTHEST = 60.0  # nanometres from a band to its colour
_NUMBERED = ("b04", "b03", "b02")  # Sentinel-2 and HLS
_SHORT = ("b4", "b3", "b2")  # the same in Earth Engine, and Landsat 8, if there is a band that Landsat 5 and 7 have not
_NEWER = {"b8", "b8a", "b9", "b11", "b12"}
_DARK = 32  # of 255: a grey picture of lower values, such as classes, is nearly black
_LEVELS = 32  # opacity has fewer levels between none and full, or few pixels there
_INFRARED = "a band is declared as opacity, but has the values of a picture, as near infrared has: it is left out"
_OTHERS = {"edge", "infra", "infrared", "near", "nir", "coastal", "i"}  # words of bands that are no colours


class Tones(NamedTuple):
    """Bands of a picture, and the values of black and white.

    Attributes
    ----------
    bands
        Of red, green and blue, or of one grey; counted from 1.
    range
        Black and white; None for 8-bit sRGB and for linear light.
    palette
        (n, 4) uint8 colours of indices, or None.
    notes
        For the user.
    has_opacity
        Whether an alpha band is opacity; in a TIFF, it may be near infrared.
    scale, offset
        What the file declares for its values, as for reflectances in 16 bits: scale · value + offset.
    """

    bands: tuple[int, ...] = (1,)
    range: Range | None = None
    palette: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    has_opacity: bool = True
    scale: float = 1.0
    offset: float = 0.0

    def linear(self, pixels: np.ndarray) -> np.ndarray:
        """(rows, cols, 1 or 3) float32 albedo, 0 to 1."""
        if (self.scale, self.offset) != (1.0, 0.0):
            pixels = pixels * self.scale + self.offset
        if self.palette is not None:
            return _SRGB_8[self.palette[np.minimum(pixels[..., 0], len(self.palette) - 1), :3]]
        if self.range:
            black, white = self.range
            with np.errstate(invalid="ignore"):
                return linear_from_srgb(np.clip((pixels - black) * (255 / (white - black)), 0, 255)).astype("f4")
        return _SRGB_8[pixels] if pixels.dtype == np.uint8 else np.clip(pixels, 0, 1).astype("f4")

    def opaque(self, pixels: np.ndarray) -> np.ndarray:
        """(rows, cols, 1) float32 share of each pixel that is opaque by its palette, and has a number."""
        if self.palette is not None:
            return self.palette[np.minimum(pixels[..., :1], len(self.palette) - 1), 3].astype("f4") / np.float32(255)
        return np.isfinite(pixels).all(-1, keepdims=True).astype("f4")


def range_of(
    values: np.ndarray, bits: int | None = None, asked: Range | None = None
) -> tuple[Range | None, tuple[str, ...]]:
    """The values of black and white in a sample of a picture, and a note if they are chosen here.

    `bits` are those that the file declares. Values that use the upper half of 16 bits reach to its end.
    """
    is_float = values.dtype.kind == "f"
    if asked or values.dtype == np.uint8 and not (bits and bits < 8):
        return asked, ()
    if bits and bits < 8 * values.dtype.itemsize and not is_float:
        return (0.0, 2.0**bits - 1), ()
    values = values[np.isfinite(values)]
    if not values.size:
        return None, ()
    low, high, bright = float(values.min()), float(values.max()), float(np.percentile(values, _BRIGHT))
    if is_float and high <= _LINEAR:
        clipped = "floats are linear light, so values below 0 or above 1 are clipped (--range)"
        return None, (clipped,) if low < 0 or high > 1 else ()
    full = 1.0 if is_float else float(np.iinfo(values.dtype).max)
    if values.dtype.kind == "u" and bright > full / 2:
        return (0.0, full), ()
    is_byte = is_float and high <= 255 < 2 * bright
    white = 255.0 if is_byte else bright if bright > 0 else max(high, 1.0)
    has = f"has values {low:g} to {high:g}" + ("" if is_float else f" of {full:.0f}")
    return (0.0, white), (f"{has}: black is 0, white is {white:g}; --range LO,HI sets others",)


def tones_of(picture: Any, name: str, asked: Range | None, most_side: int) -> Tones:
    """The tones of a rasterio dataset, by at most `most_side`² of its pixels."""
    from rasterio.enums import ColorInterp

    meanings = [each.name for each in picture.colorinterp]
    if ColorInterp.palette in picture.colorinterp:
        palette = np.zeros((256, 4), np.uint8)
        for index, colour in picture.colormap(meanings.index("palette") + 1).items():
            palette[index] = colour
        return Tones((meanings.index("palette") + 1,), None, palette)
    if "cyan" in meanings and "black" in meanings:
        raise TerrainError(f"{name}: is in printing inks (CMYK): convert it to RGB first")
    bands, notes = _colours(picture, meanings)
    bits = picture.tags(bands[0], ns="IMAGE_STRUCTURE").get("NBITS")
    values = np.zeros(0, picture.dtypes[bands[0] - 1])
    if not asked and not bits and values.dtype != np.uint8:
        size = len(bands), *(min(side, most_side) for side in picture.shape)
        values = picture.read(list(bands), out_shape=size, masked=True).compressed()
    scale, offset = picture.scales[bands[0] - 1], picture.offsets[bands[0] - 1]
    if (scale, offset) != (1.0, 0.0) and values.dtype != np.uint8:
        values = values * scale + offset
    else:
        scale, offset = 1.0, 0.0
    found, words = range_of(values, int(bits) if bits else None, asked)
    if len(bands) == 1 and values.dtype == np.uint8 and not asked:
        size = tuple(min(side, most_side) for side in picture.shape)
        high = int(picture.read(bands[0], out_shape=size, masked=True).filled(0).max())
        if 0 < high < _DARK:
            words += (f"has values up to {high} of 255, nearly black: --range 0,{high} stretches them",)
    tones = Tones(bands, found, None, notes + words, scale=scale, offset=offset)
    return with_opacity(tones, _declared(picture, meanings, most_side))


def with_opacity(tones: Tones, declared: np.ndarray | None) -> Tones:
    """The tones of a picture whose opacity has these values of 8 bits, if they are opacity.

    Many programs declare the fourth of four bands as opacity whatever it is. Opacity is none or full nearly everywhere,
    or has few levels.
    """
    if declared is None:
        return tones
    between = declared[(declared > 0) & (declared < 255)]
    if between.size < 0.5 * np.count_nonzero(declared) or len(np.unique(between)) < _LEVELS:
        return tones
    return tones._replace(notes=(*tones.notes, f"{_INFRARED}; as .png, it counts as opacity"), has_opacity=False)


def _declared(picture: Any, meanings: list[str], most_side: int) -> np.ndarray | None:
    """A sample of what a TIFF of 8 bits declares as opacity; None for other files, where only opacity is declared."""
    if picture.driver != "GTiff" or "alpha" not in meanings or "?" in picture.name:  # see `laid._without_opacity`
        return None
    band = meanings.index("alpha") + 1
    is_of_8_bits = picture.dtypes[band - 1] == "uint8"
    return picture.read(band, out_shape=tuple(min(side, most_side) for side in picture.shape)) if is_of_8_bits else None


def _colours(picture: Any, meanings: list[str]) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Bands of red, green and blue, by what the file says of its bands; else the first three, or the first."""
    others = [i + 1 for i, meaning in enumerate(meanings) if meaning != "alpha"]
    if len(others) < 3:
        return tuple(others or (1,))[:1], ()
    if set(_COLOURS) <= set(meanings):
        return tuple(meanings.index(colour) + 1 for colour in _COLOURS), ()
    words = [re.findall(r"[a-z0-9]+", (text or "").lower()) for text in picture.descriptions]
    is_newer = any(_NEWER & set(each) for each in words)
    for wanted in (_COLOURS, _NUMBERED, *((_SHORT,) if is_newer else ())):
        named = [
            next((i for i, each in enumerate(words, 1) if word in each and not _OTHERS & set(each)), 0)
            for word in wanted
        ]
        if all(named):
            return tuple(named), ()
    waves = [_wavelength(picture, i) for i in range(1, picture.count + 1)]
    nearest = [min(range(len(waves)), key=lambda i: abs(waves[i] - nm)) for nm in _NANOMETRES]
    if all(abs(waves[i] - nm) <= _FARTHEST for i, nm in zip(nearest, _NANOMETRES, strict=True)):
        return tuple(i + 1 for i in nearest), ()
    silent = (
        "does not say which bands are red, green and blue: 1, 2 and 3 count as such; gdal_translate -b reorders them"
    )
    return tuple(others[:3]), (silent,) if len(others) > 3 else ()


def _wavelength(picture: Any, band: int) -> float:
    """Nanometres of a band; infinite if the file does not say."""
    told = picture.tags(band) | picture.tags(band, ns="IMAGERY")
    text = told.get("wavelength") or told.get("CENTRAL_WAVELENGTH_UM") or "inf"
    try:
        length = float(text)
    except ValueError:
        return np.inf
    return length * 1000 if length < 100 else length  # micrometres
