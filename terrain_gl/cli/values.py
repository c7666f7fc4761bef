"""Values on the command line: functions that parse a text, or raise an error of one line."""

import argparse
import math
import re
from collections.abc import Callable
from datetime import datetime

from ..basics.exceptions import UsageError
from ..comparison.clipmap import Rings
from ..comparison.tessellated import Edges
from ..renderer.methods import REMOVED

FARTHEST_M = 1e9  # larger numbers are refused as mistakes


def method(text: str) -> str:
    """The name of a method. A method that was removed has an error of its own."""
    if text in REMOVED:
        raise argparse.ArgumentTypeError(REMOVED[text])
    return text


def number(text: str) -> float:
    """A finite number."""
    return _numbers(text, "a number", 1)[0]


def nodata(text: str) -> float:
    """Any number; "none" is NaN, which no value equals."""
    try:
        return float("nan" if text.lower() == "none" else text)
    except ValueError:
        raise _expected("a number, or none", text) from None


def positive(text: str) -> float:
    """A number above 0."""
    return _numbers(text, "a positive number", 1, fits=lambda value: value > 0)[0]


def not_negative(text: str) -> float:
    """A number from 0."""
    return _numbers(text, "a number from 0", 1, fits=lambda value: value >= 0)[0]


def share(text: str) -> float:
    """A number from 0 to 1."""
    return _numbers(text, "a number from 0 to 1", 1, fits=lambda value: 0 <= value <= 1)[0]


class Length(float):
    """A length as it was typed, with its unit: "m", "ft", or "" for the unit of --units."""

    unit: str = ""


def interval(text: str) -> Length:
    """A length above 0, such as 40 or 40ft; "auto" and 0 give 0, an interval that suits the map."""
    number_of, unit = re.fullmatch(r"(.*?)\s*(m|ft|)", "0" if text == "auto" else text, re.DOTALL).groups()  # type: ignore[union-attr]
    length = Length(_numbers(number_of, "metres above 0, or auto", 1, fits=lambda value: value >= 0)[0])
    length.unit = unit
    return length


def count(text: str) -> int:
    """A whole number above 0."""
    if not re.fullmatch(r"\d{1,9}", text) or int(text) < 1:
        raise _expected("a whole number above 0", text)
    return int(text)


def band(text: str) -> int | str:
    """The number of a band, from 1, or its name."""
    return count(text) if re.fullmatch(r"[-+.\d]+", text) else text


def rings(text: str) -> Rings:
    """A clipmap's ring: a number of vertices."""
    try:
        return Rings(count(text))
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def edges(text: str) -> Edges:
    """A tessellated clipmap's edges in pixels."""
    return Edges(positive(text))


def spacing(text: str) -> tuple[float, float]:
    """Metres M, or EAST,NORTH."""
    values = _numbers(text, "metres M or EAST,NORTH above 0", 1, 2, fits=lambda *values: min(values) > 0)
    return values[0], values[-1]


def point(text: str) -> tuple[float, float, float]:
    """X,Y,Z in metres."""
    x, y, z = _numbers(text, "metres X,Y,Z", 3)
    return x, y, z


def span(text: str) -> tuple[float, float]:
    """LO,HI, the lower number first."""
    low, high = _numbers(text, "numbers LO,HI, the lower one first", 2, fits=lambda low, high: low < high)
    return low, high


def lonlat(text: str) -> tuple[float, ...]:
    """LON,LAT in degrees, or with metres above the ground LON,LAT,M."""
    what = "degrees LON,LAT, or LON,LAT,M with metres above the ground"
    return tuple(_numbers(text, what, 2, 3, fits=lambda lon, lat, *_: abs(lon) <= 360 and abs(lat) <= 90))


def sun(text: str) -> tuple[float, float]:
    """AZIMUTH,ELEVATION in degrees."""
    what = "degrees AZIMUTH,ELEVATION, the elevation from -90 to 90"
    azimuth, elevation = _numbers(text, what, 2, fits=lambda _, elevation: abs(elevation) <= 90)
    return azimuth, elevation


def time(text: str) -> datetime:
    """A date and a time, ISO 8601."""
    try:
        return datetime.fromisoformat(re.sub("[zZ]$", "+00:00", text))
    except ValueError:
        raise _expected("a time like 2026-06-21T18:30", text) from None


def latitude(text: str) -> float:
    """Degrees north of the equator."""
    return _numbers(text, "degrees from -90 to 90", 1, fits=lambda value: abs(value) <= 90)[0]


def size(text: str) -> tuple[int, int]:
    """WxH in pixels."""
    found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    width, height = map(int, found.groups()) if found else (0, 0)
    if min(width, height) < 1:
        raise _expected("pixels WxH of at least 1x1", text)
    return width, height


def _numbers(text: str, what: str, *counts: int, fits: Callable[..., bool] = lambda *_: True) -> list[float]:
    """Numbers with commas between them; `fits` says whether they are in range."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise _expected(what, text) from None
    if len(values) not in counts or not all(map(math.isfinite, values)):
        raise _expected(what, text)
    if max(map(abs, values)) > FARTHEST_M:
        raise _expected(f"{what}, at most {FARTHEST_M:g}", text)
    if not fits(*values):
        raise _expected(what, text)
    return values


def _expected(what: str, text: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"expected {what}, got {text!r}")
