"""Image files: write pictures, read pictures, and compare two of them."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from .basics.exceptions import TerrainError
from .basics.inputs import check_input
from .basics.replacing import make_sure_of_space, replacing

FORMATS = {".png": "uint8", ".jpg": "uint8", ".jpeg": "uint8", ".tif": "uint8", ".tiff": "uint8", ".exr": "float"}
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
    """Write a picture from top to bottom, a few rows at a time, so that it need not fit in memory.

    Parameters
    ----------
    path
        As for `write_image`.
    size
        Width and height in pixels.

    Returns
    -------
    Rows
        A function that writes the next rows, (n, width, channels). When the block ends and all rows are written, the
        file appears.

    Raises
    ------
    TerrainError
        An unknown ending, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise TerrainError(f"{path}: cannot write {suffix or 'a file without an ending'}: use {', '.join(FORMATS)}")
    channels = min(channels, 3) if suffix in _OPAQUE else channels
    with replacing(path) as beside:
        make_sure_of_space(beside, size[0] * size[1] * channels * (4 if FORMATS[suffix] == "float" else 1))
        file = _opened(beside, path, (*size, channels), FORMATS[suffix])
        done = 0

        def write(rows: np.ndarray) -> None:
            nonlocal done
            stored = _stored(rows, suffix)
            if not file.write_scanlines(done, done + len(stored), 0, stored):
                raise TerrainError(f"{path}: cannot write: {reason_of(file)}")
            done += len(stored)

        try:
            yield write
            if done < size[1]:
                raise ValueError(f"expected {size[1]} rows, got {done}")
        except BaseException:
            if suffix == ".png" and done < size[1]:  # libpng prints an error if a picture has no data
                write(np.zeros((min(size[1] - done, 1 + 2**22 // size[0]), size[0], channels), np.uint8))
            file.close()
            raise
        closed = file.close()
        if not closed:
            raise TerrainError(f"{path}: cannot write: {reason_of(file)}")


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
    """(height, width, channels) pixels, as they are stored in the file.

    Raises
    ------
    TerrainError
        The file is not a complete picture, or has more than `most_pixels` pixels.
    """
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

    The pictures have one type: integers, or floats with a full scale of 1.

    Raises
    ------
    ValueError
        The shapes differ.
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
    """Reduce an 8-bit sRGB picture n times along each side. A new pixel has the mean linear light and alpha of n × n.

    Raises
    ------
    ValueError
        A side is not a multiple of n.
    """
    height, width, channels = pixels.shape
    if height % n or width % n:
        raise ValueError(f"expected sides that are multiples of {n}, got {width}x{height}")
    if n == 1:
        return pixels
    light = np.concatenate([_LINEAR[pixels[..., :3]], pixels[..., 3:] / np.float32(255)], -1)
    mean = light.reshape(height // n, n, width // n, n, channels).mean((1, 3))
    return np.concatenate([srgb_from_linear(mean[..., :3]), np.round(255 * mean[..., 3:]).astype(np.uint8)], -1)


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
    return np.ascontiguousarray(np.concatenate([colour, alpha], -1).astype("f4" if suffix == ".exr" else "u1"))


def _opened(to: Path, name: str | os.PathLike[str], shape: tuple[int, int, int], kind: str) -> Any:
    """Open a file for writing with OpenImageIO."""
    spec = oiio.ImageSpec(*shape, kind)
    if kind == "uint8":
        spec.attribute("oiio:ColorSpace", "sRGB")
        spec.attribute("CompressionQuality", 95)
        spec.attribute("png:compressionLevel", 4)  # level 6 takes three times as long for files 6 % smaller
    spec.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageOutput.create(os.fspath(to))
    if file is None or not file.open(os.fspath(to), spec):
        raise TerrainError(f"{name}: cannot write: {reason_of(file or oiio)}")
    return file


def reason_of(source: Any) -> str:
    """OpenImageIO's last error in one line; for some damaged files its text is not valid UTF-8."""
    try:
        text = source.geterror()
    except UnicodeDecodeError:
        text = ""
    return one_line(text) or "its data do not decode"


def one_line(text: str) -> str:
    """The first line of OpenImageIO's text; further lines repeat it."""
    first, _, _ = text.strip().partition("\n")
    return " ".join(first.split())[:120]


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
