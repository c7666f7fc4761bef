"""An open raster file: the result of every reader, and functions that the readers share."""

import re
from collections.abc import Generator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from terrain_gl.basics.exceptions import TerrainError

BLOCK_POSTS = 1 << 20
MAX_CHANNELS = 4
INSTALL_GEO = "pip install 'terrain-gl[geo]'"
TRUST = "if you trust it, let GDAL follow it to other files and the network with --trust"

MOST_LISTED = 12  # bands that a message names

Spacing = tuple[float, float]
Band = int | str  # a band's number, from 1, or its name
# An index into rows and columns of the map, and pixels (rows, cols, channels).
Blocks = Generator[tuple[Any, np.ndarray], None, None]


def both(spacing_m: float | Spacing) -> Spacing:
    """The spacing east and north."""
    east, north = spacing_m if isinstance(spacing_m, tuple | list) else (spacing_m, spacing_m)
    return float(east), float(north)


def _no_blocks() -> Blocks:
    yield from ()


class Meaning(NamedTuple):
    """What one unit of the stored values is: see `readers/units.py`."""

    metres: float = 1.0  # below 0 if values count down
    words: str = "metres (no unit is given)"
    notes: tuple[str, ...] = ()
    may_be_depth: bool = False  # only a name says so


@dataclass(frozen=True)
class Raster:
    """An open raster file; its pixels come in blocks, and each post is in one block."""

    name: str  # of the file, in messages
    shape: tuple[int, int, int]  # rows, columns, channels
    dtype: np.dtype  # of the stored pixels
    blocks: Blocks = field(default_factory=_no_blocks)
    has_alpha: bool = False  # the last channel is opacity
    nodata: float | None = None  # the stored value that marks a void, if the file gives one
    spacing_m: Spacing | None = None  # metres between posts, if the file gives them
    scale: float = 1.0  # a height is value · scale + offset_m metres
    offset_m: float = 0.0
    notes: tuple[str, ...] = ()  # for the user, on how the file was interpreted
    bands: tuple[str, ...] = ()  # the file's names of its channels without opacity, if it names them
    meaning: Meaning = Meaning()  # of the values, before `scale` and `offset_m`, which have its metres
    georeference: Any = None  # a Georeference, north up, if the file gives it
    has_windows: bool = False  # whether GDAL reads parts of the file: not of archives, texts in UTF-16 and images

    def __getstate__(self) -> dict[str, Any]:
        """Everything except the blocks: a generator cannot be sent to another process."""
        return self.__dict__ | {"blocks": None}

    @property
    def colours(self) -> int:
        """Channels without opacity."""
        return self.shape[2] - self.has_alpha


def read_within(context: AbstractContextManager[Any], blocks: Blocks) -> Blocks:
    """Leave a context, such as an open file, after all blocks are read."""
    with context:
        yield from blocks


def number_of(band: Band, names: Sequence[str], file: str) -> int:
    """The number of a band, from 1, among bands with these names; `TerrainError` if there is no such band."""
    number = names.index(band) + 1 if band in names else int(band) if str(band).isdecimal() else 0
    if not 1 <= number <= len(names):
        raise TerrainError(f"{file}: {listed(names)}: there is no band {band}")
    return number


def listed(names: Sequence[str]) -> str:
    """Bands as text for a message: their number, and their names if they have any."""
    shown = [f"{i}: {name[:40]}" if name else f"{i}" for i, name in enumerate(names[:MOST_LISTED], 1)]
    words = f" ({', '.join(shown)}{', …' if len(names) > MOST_LISTED else ''})" if any(names) else ""
    return f"has {len(names)} bands{words}"


def rows_at_once(cols: int, unit: int = 1) -> int:
    """Rows of a block of about BLOCK_POSTS posts: a multiple of `unit` rows, unless a unit is much larger than that."""
    rows = max(1, BLOCK_POSTS // max(cols, 1))
    return rows if unit > 4 * rows else -(-rows // unit) * unit


def damaged(name: str, reason: str) -> TerrainError:
    """The error for a file whose data do not decode."""
    advice = "download or export it again"
    if name.lower().endswith((".tif", ".tiff")) and not has_rasterio():
        advice += f", or, if it is whole, let GDAL read it: {INSTALL_GEO}"
    return TerrainError(f"{name}: is damaged or cut short ({reason}): {advice}")


def one_line(error: BaseException) -> str:
    """A library's message as one short line; if the error has a cause, the message of the cause."""
    text = re.sub(r"\?if=[\w,]+", "", str(error.__cause__ or error))  # drivers that `local.py` adds to a name
    text = re.sub(r"<VRTDataset.*>: No such file or directory", "one of its elements is wrong", text, flags=re.DOTALL)
    return " ".join(text.split())[:120]


def gdal_failures() -> tuple[type[Exception], ...]:
    """Exceptions of rasterio if GDAL fails. They may quote bytes of the file that are not valid UTF-8."""
    from rasterio._err import CPLE_BaseError
    from rasterio.errors import CRSError, RasterioError

    return RasterioError, CRSError, CPLE_BaseError, UnicodeDecodeError


def has_rasterio() -> bool:
    """Whether the [geo] extra is installed."""
    try:
        import rasterio  # noqa: F401
    except ImportError:
        return False
    return True
