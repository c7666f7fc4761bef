"""Image files: write pictures, read pictures, and compare two of them."""

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from .basics.exceptions import TerrainError
from .basics.inputs import check_input
from .basics.replacing import make_sure_of_space, replacing

FORMATS = {".png": "uint8", ".jpg": "uint8", ".jpeg": "uint8", ".tif": "uint8", ".tiff": "uint8", ".exr": "float"}
TYPES: dict[str, np.dtype] = {
    "uint8": np.dtype("u1"),
    "uint16": np.dtype("u2"),
    "float": np.dtype("f4"),
}  # as OpenImageIO calls them
Rows = Callable[[np.ndarray], None]
_OPAQUE = (".jpg", ".jpeg")  # formats without alpha


def write_image(path: str | os.PathLike[str], pixels: np.ndarray) -> None:
    """Write a picture; the ending of the file's name chooses the format.

    Parameters
    ----------
    path
        A name that ends in one of `FORMATS`. EXR stores linear light as 32-bit floats, other formats 8-bit sRGB.
    pixels
        (height, width, 1, 3 or 4) or (height, width); uint8 sRGB, or floats of linear light. All formats but EXR clip
        light to 0 to 1.

    Raises
    ------
    TerrainError
        An unknown ending, or the file cannot be written.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or 0 in pixels.shape:
        raise ValueError(f"expected (height, width, 1, 3 or 4) pixels, got {pixels.shape}")
    with writing_image(path, (pixels.shape[1], pixels.shape[0]), pixels.shape[2]) as write:
        write(pixels)


@contextmanager
def writing_image(path: str | os.PathLike[str], size: tuple[int, int], channels: int = 4) -> Iterator[Rows]:
    """Yield a function that writes the next rows of a picture, (n, width, channels): see `write_image`.

    `size` is the picture's width and height. It need not fit in memory.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise TerrainError(f"{path}: cannot write {suffix or 'a file without an ending'}: use {', '.join(FORMATS)}")
    shape = *size, min(channels, 3) if suffix in _OPAQUE else channels
    attributes: dict[str, str | int] = {"oiio:UnassociatedAlpha": 1}
    if FORMATS[suffix] == "uint8":
        attributes |= {"oiio:ColorSpace": "sRGB", "CompressionQuality": 95}
        attributes["png:compressionLevel"] = 4  # level 6 takes three times as long for files 6 % smaller
        attributes["png:filter"] = 16  # libpng's PNG_FILTER_SUB; a choice for each row takes 1.6 times as long
    with writing_rows(path, shape, FORMATS[suffix], attributes) as write:
        yield lambda rows: write(_stored(rows, suffix))


@contextmanager
def writing_rows(
    path: str | os.PathLike[str],
    shape: tuple[int, int, int],
    kind: str,
    attributes: dict[str, Any],
    names: Sequence[str] = (),
) -> Iterator[Rows]:
    """Yield a function that writes the next rows of an image file, from top to bottom, as they are stored.

    The file appears when the block ends and all rows are written.

    Parameters
    ----------
    shape
        Width, height and channels.
    kind
        Type of the numbers, one of `TYPES`.
    attributes
        Attributes of the file, by their names in OpenImageIO.
    names
        Names of the channels, if they are not those of a picture.

    Raises
    ------
    TerrainError
        The file cannot be written.
    """
    width, height, channels = shape
    done = 0
    with replacing(path) as beside:
        make_sure_of_space(beside, width * height * channels * TYPES[kind].itemsize)
        spec = oiio.ImageSpec(*shape, kind)
        for name, value in attributes.items():
            spec.attribute(name, value)
        if names:
            spec.channelnames, spec.alpha_channel = tuple(names), -1
        file: Any = oiio.ImageOutput.create(os.fspath(beside))

        def ensure(works: bool) -> None:
            if not works:
                raise TerrainError(f"{path}: cannot write: {reason_of(file or oiio)}")

        def write(rows: np.ndarray) -> None:
            nonlocal done
            ensure(file.write_scanlines(done, done + len(rows), 0, rows))
            done += len(rows)

        ensure(file is not None and file.open(os.fspath(beside), spec))
        try:
            yield write
            if done < height:
                raise ValueError(f"expected {height} rows, got {done}")
        except BaseException:
            if beside.suffix.lower() == ".png" and done < height:  # libpng prints an error if a picture has no data
                with suppress(TerrainError):
                    write(np.zeros((min(height - done, 1 + 2**22 // width), width, channels), TYPES[kind]))
            file.close()
            raise
        ensure(file.close())


def write_png(path: str | os.PathLike[str], pixels: np.ndarray) -> None:
    """Write a picture as PNG; see `write_image`."""
    if Path(path).suffix.lower() != ".png":
        raise TerrainError(f"{path}: this picture is written as PNG: use a name that ends in .png")
    write_image(path, pixels)


def png_bytes(pixels: np.ndarray) -> bytes:
    """A picture as the bytes of a PNG file; see `write_image`."""
    return file_bytes(pixels, ".png")


def file_bytes(pixels: np.ndarray, ending: str) -> bytes:
    """A picture as the bytes of a file with an ending of `FORMATS`; see `write_image`."""
    with tempfile.TemporaryDirectory() as folder:
        write_image(file := Path(folder) / f"picture{ending}", pixels)
        return file.read_bytes()


def read_image(path: str | os.PathLike[str], most_pixels: int = 1 << 28) -> np.ndarray:
    """(height, width, channels) pixels as they are stored; `TerrainError` if the picture is incomplete or too large."""
    check_input(path, "name a picture")
    as_it_is = oiio.ImageSpec()
    as_it_is.attribute("oiio:UnassociatedAlpha", 1)
    with quiet_stderr():
        file = oiio.ImageInput.open(os.fspath(path), as_it_is)
    if file is None:
        raise TerrainError(f"{path}: not a readable picture: {reason_of(oiio)}")
    width, height = file.spec().width, file.spec().height
    if width * height > most_pixels:
        raise TerrainError(f"{path}: has {width} x {height} pixels, more than {most_pixels:,}: reduce the picture")
    with quiet_stderr():
        pixels = file.read_image(oiio.UNKNOWN)
    file.close()
    if pixels is None:
        raise TerrainError(f"{path}: not a whole picture: {reason_of(file)}")
    return pixels.reshape(*pixels.shape[:2], -1)


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Picture of the difference of two pictures: (height, width, 3) uint8, 8 times the largest difference of a channel.

    The pictures have one shape and one type: integers, or floats with a full scale of 1.
    """
    if one.shape != other.shape:
        raise ValueError(f"expected pictures of one shape, got {one.shape} and {other.shape}")
    full = np.iinfo(one.dtype).max if np.issubdtype(one.dtype, np.integer) else 1
    distance = np.abs(one.astype(np.float32) - other.astype(np.float32)).max(-1, keepdims=True) * np.float32(255 / full)
    return np.minimum(8 * distance, 255).round().astype(np.uint8).repeat(3, -1)


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Linear light, 0 to 1, of 8-bit sRGB (IEC 61966-2-1)."""
    c = encoded.astype(np.float64) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


_LINEAR = linear_from_srgb(np.arange(256)).astype(np.float32)


def srgb_from_linear(light: np.ndarray) -> np.ndarray:
    """8-bit sRGB of linear light, 0 to 1."""
    c = np.clip(light, 0, 1)
    return np.round(255 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)).astype(np.uint8)


def reduced(pixels: np.ndarray, n: int) -> np.ndarray:
    """Reduce an 8-bit sRGB picture n times along each side, which must be multiples of n.

    A new pixel has the mean linear light and alpha of n × n pixels. Alpha is the weight of their light.
    """
    height, width, channels = pixels.shape
    if height % n or width % n:
        raise ValueError(f"expected sides that are multiples of {n}, got {width}x{height}")
    if n == 1:
        return pixels
    alpha = pixels[..., 3:] / np.float32(255) if channels == 4 else np.ones((height, width, 1), np.float32)
    light = np.concatenate([alpha * _LINEAR[pixels[..., :3]], alpha], -1)
    mean = light.reshape(height // n, n, width // n, n, 4).mean((1, 3))
    colour = srgb_from_linear(mean[..., :3] / np.where(mean[..., 3:] > 0, mean[..., 3:], 1))
    return np.concatenate([colour, np.round(255 * mean[..., 3:]).astype(np.uint8)], -1)[..., :channels]


def _stored(pixels: np.ndarray, suffix: str) -> np.ndarray:
    """Convert pixels to what the format stores; alpha stays linear."""
    if suffix in _OPAQUE:
        pixels = pixels[..., :3]
    colour = pixels[..., :3]
    alpha = pixels[..., 3:]
    if FORMATS[suffix] == "float" and pixels.dtype == np.uint8:
        colour = linear_from_srgb(colour)
        alpha = alpha / 255
    elif FORMATS[suffix] == "uint8" and pixels.dtype != np.uint8:
        colour = srgb_from_linear(colour)
        alpha = np.round(255 * np.clip(alpha, 0, 1))
    return np.ascontiguousarray(np.concatenate([colour, alpha], -1).astype(TYPES[FORMATS[suffix]]))


def reason_of(source: Any) -> str:
    """OpenImageIO's last error in one line; for some damaged files its text is not valid UTF-8."""
    try:
        text = source.geterror()
    except UnicodeDecodeError:
        text = ""
    first, _, _ = text.strip().partition("\n")  # further lines repeat it
    return " ".join(first.split())[:120] or "its data do not decode"


@contextmanager
def quiet_stderr() -> Iterator[None]:
    """Silence libpng, which writes to file descriptor 2. Our own message says the same in one line."""
    saved = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)
