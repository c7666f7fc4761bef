"""Lines and points that are drawn over a map: from GeoJSON, GPS tracks, or objects of geopandas and shapely."""

import json
import os
import re
from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.inputs import check_input
from ..heightmap import Heightmap
from ..readers.georeference import DEGREES, flat_crs
from ..readers.place import to_degrees
from ..readers.refusals import step_for
from . import tracks
from .photos import photo_in

MAX_BYTES = 1 << 28  # largest file
LABEL = "name"  # the property of a point that is its name
LONGEST_NAME = 60  # characters
_DEEPEST = 10  # most collections inside each other


Colour = tuple[int, int, int, int]  # sRGB and opacity


class Style(NamedTuple):
    """How a shape is drawn, as far as its file says so."""

    stroke: Colour | None = None  # of lines, rings and points; None for the colour of the overlay
    width: float = 1.0  # of lines, in usual widths; 0 for no lines
    fill: Colour | None = None  # of polygons; None for none


PLAIN = Style()
_USUAL_PX = 2.0  # a stroke-width of simplestyle that is one usual width
_FILL_OPACITY = 0.6  # of simplestyle
_HEX = re.compile(r"#?([0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


class Overlay(NamedTuple):
    """Lines and points in columns and rows of a map; a polygon is given by its rings."""

    lines: tuple[np.ndarray, ...]  # columns and rows of each line, (n, 2)
    points: np.ndarray  # columns and rows of all points, (m, 2)
    names: tuple[str, ...] = ()  # of the points, "" for points without a name; empty if there are no names
    styles: tuple[Style, ...] = ()  # of the lines, then of the points; empty if there are none
    areas: tuple[tuple[tuple[np.ndarray, ...], Colour], ...] = ()  # rings of filled polygons, and their colours
    path: str = ""  # the file that was read; "" if there is none
    label: str = LABEL  # the property of a point that is its name
    paint: str = ""  # what `painted` was told; "" for no colour of its own


def paint_of(colour: Colour, everywhere: bool = False) -> str:
    """A colour as `painted` takes it."""
    return ("all:" if everywhere else "") + "#" + bytes(colour[:3]).hex()


def read_paint(paint: str) -> tuple[Colour, bool]:
    """The colour that `painted` is told, and whether it is for everything; `UsageError` for another text."""
    if colour := _colour(paint.removeprefix("all:"), None, 1.0):
        return colour, paint.startswith("all:")
    raise UsageError(f"colour of an overlay: expected #rrggbb or all:#rrggbb, got {paint!r}")


def painted(overlay: Overlay, paint: str) -> Overlay:
    """The overlay in a colour: "#rrggbb" for what has no colour in its file, "all:#rrggbb" for all lines and points."""
    colour, everywhere = read_paint(paint)
    styles = overlay.styles or (PLAIN,) * (len(overlay.lines) + len(overlay.points))
    own = tuple(each._replace(stroke=colour if everywhere else each.stroke or colour) for each in styles)
    return overlay._replace(styles=own, paint=paint)


def read_overlay(source: Any, heightmap: Heightmap, label: str = LABEL) -> Overlay:
    """Place lines and points on a map.

    Parameters
    ----------
    source
        The path of a file of GeoJSON, GPX, KML, KMZ, TCX, NMEA or IGC, or of a photo with a place; a GeoJSON mapping;
        or any object with `__geo_interface__`, such as a GeoDataFrame or a geometry of shapely. GeoJSON is in degrees
        (RFC 7946), unless it has a member "crs". The coordinates of an object are in its `crs`; without a `crs`, in the
        coordinates of the map; if the map has no coordinates, in metres from its south-west post.
    label
        The property of a point that is its name.

    Raises
    ------
    TerrainError
        The source cannot be read, or its coordinates cannot be converted to the map's. The message names the file.
    """
    name, content, crs = _loaded(source)
    try:
        shapes = list(_shapes(content, label))
        lines = [shape for shape in shapes if shape.at.ndim == 2 and len(shape.at) > 1]
        points = [shape for shape in shapes if shape.at.ndim == 1 or len(shape.at) == 1]
        placed = [_posts(line.at, crs, heightmap, is_line=True) for line in lines]
        areas: dict[int, tuple[list[np.ndarray], Colour]] = {}
        for line, posts in zip(lines, placed, strict=True):
            if line.area and line.style.fill:
                areas.setdefault(line.area, ([], line.style.fill))[0].append(posts)
        at = np.concatenate([*(point.at.reshape(1, 2) for point in points), np.zeros((0, 2))])
        return Overlay(
            tuple(placed),
            _posts(at, crs, heightmap, is_line=False),
            tuple(point.name for point in points),
            tuple(shape.style for shape in (*lines, *points)),
            tuple((tuple(rings), colour) for rings, colour in areas.values()),
            os.fspath(source) if isinstance(source, str | os.PathLike) else "",
            label,
        )
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        words = f"{_words(error)} is missing" if isinstance(error, KeyError) else _words(error)
        raise TerrainError(f"{name}: has no lines and points that can be read: {words}") from None
    except TerrainError as error:
        raise TerrainError(f"{name}: {error}") from None


def _words(error: Exception, most: int = 80) -> str:
    return " ".join(str(error).split())[:most]


def _loaded(source: Any) -> tuple[str, Any, Any]:
    """Name, GeoJSON and coordinate system of a source; None for the map's coordinate system."""
    if isinstance(source, str | os.PathLike):
        name = os.fspath(source)
        check_input(name, "name a file of GeoJSON, GPX, KML, TCX, NMEA or IGC", MAX_BYTES)
        return name, *_read(name)
    if isinstance(source, Mapping):
        return "overlay", source, _crs_of(source)
    if hasattr(source, "__geo_interface__"):
        return "overlay", source.__geo_interface__, getattr(source, "crs", None)
    raise TerrainError(f"overlay: expected a file or __geo_interface__, got {type(source).__name__}")


def _read(name: str) -> tuple[Any, Any]:
    if photo := photo_in(name):
        return photo, DEGREES
    try:
        with open(name, "rb") as file:
            text = file.read()
    except OSError as error:
        raise TerrainError(f"{name}: cannot be read: {error.strerror}") from None
    try:
        text = tracks.unpacked(text, name, MAX_BYTES)
        if track := tracks.track_in(text):
            return track, DEGREES
    except (ValueError, RecursionError) as error:
        raise TerrainError(f"{name}: {_words(error, 110)}") from None
    try:
        content = _json_of(text)
    except (ValueError, RecursionError) as error:
        is_json = text.lstrip().startswith((b"{", b"[")) or name.lower().endswith(("json", "jsonl"))
        step = None if is_json else step_for(name, name, text[:512])
        if step and "--overlay:" in step:
            raise TerrainError(re.sub(", not a grid of heights:.*--overlay:", ":", step).partition(";")[0]) from None
        advice = f"it breaks off or has an error ({_words(error)})" if is_json else _converted(name)
        raise TerrainError(f"{name}: is no GeoJSON, and no {tracks.FORMATS}: {advice}") from None
    if isinstance(content, Mapping) and content.get("type") == "Topology":
        raise TerrainError(f"{name}: is TopoJSON: {_converted(name)}")
    return content, _crs_of(content)


def _converted(name: str) -> str:
    return f"convert it with gpsbabel, or ogr2ogr -f GeoJSON {os.path.splitext(name)[0]}.geojson {name}"


def _json_of(text: bytes) -> Any:
    """JSON, or a sequence of GeoJSON features, one a line (RFC 8142)."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        if error.msg != "Extra data" and not text.startswith(b"\x1e"):
            raise
    lines = [line for line in re.split(rb"[\x1e\r\n]+", text) if line.strip()]
    return {"type": "FeatureCollection", "features": [json.loads(line) for line in lines]}


def _crs_of(content: Any) -> Any:
    crs = content.get("crs", {}) if isinstance(content, Mapping) else {}
    if crs is None:  # GeoJSON 2008: no coordinate system is assumed
        return None
    named = crs.get("properties", {}).get("name") if isinstance(crs, Mapping) else None
    return named or DEGREES


class _Shape(NamedTuple):
    """A line (n, 2) or a point (2,) of GeoJSON."""

    at: np.ndarray
    name: str
    style: Style
    area: int  # a number that the rings of one polygon share; 0 for other lines


def _shapes(
    content: Any, label: str, name: str = "", style: Style = PLAIN, depth: int = 0, areas: Iterator[int] | None = None
) -> Iterator[_Shape]:
    """The lines and points of a GeoJSON object."""
    areas = areas or count(1)
    if depth > _DEEPEST:
        raise ValueError("too many collections inside each other")
    kind = content["type"]
    if kind in ("FeatureCollection", "GeometryCollection"):
        for part in content["features" if kind == "FeatureCollection" else "geometries"]:
            yield from _shapes(part, label, name, style, depth + 1, areas)
    elif kind == "Feature":
        if content["geometry"]:
            own = _style_in(content)
            yield from _shapes(content["geometry"], label, _name_in(content, label), own, depth + 1, areas)
    else:
        nested = {"Point": 0, "MultiPoint": 1, "LineString": 0, "MultiLineString": 1, "Polygon": 1, "MultiPolygon": 2}
        if kind not in nested:
            raise ValueError(f"type {str(kind)[:40]!r}")
        coordinates = content["coordinates"]
        polygons = [coordinates] if kind == "Polygon" else coordinates if kind == "MultiPolygon" else []
        for polygon in polygons:
            area = next(areas)
            yield from (_Shape(ring, name, style, area) for ring in _unpacked(polygon, 1))
        if not kind.endswith("Polygon"):
            yield from (_Shape(shape, name, style, 0) for shape in _unpacked(coordinates, nested[kind]))


def _style_in(feature: Any) -> Style:
    """The style of a feature by simplestyle 1.1: stroke, stroke-width, fill, marker-color and their opacities."""
    properties = feature.get("properties")
    if not isinstance(properties, Mapping):
        return PLAIN
    stroke = _colour(properties.get("stroke", properties.get("marker-color")), properties.get("stroke-opacity"), 1.0)
    fill = _colour(properties.get("fill"), properties.get("fill-opacity"), _FILL_OPACITY)
    return Style(stroke, _number(properties.get("stroke-width"), _USUAL_PX) / _USUAL_PX, fill)


def _colour(text: object, opacity: object, usual: float) -> Colour | None:
    """A colour of three or six hexadecimal digits, or its name, with its opacity; None for any other text."""
    word = str(text).strip().lower() if text else ""
    found = _HEX.fullmatch(tracks.NAMED.get(word, word))
    if not found:
        return None
    digits = found[1] if len(found[1]) == 6 else "".join(2 * digit for digit in found[1])
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue, round(255 * min(1.0, _number(opacity, usual)))


def _number(value: Any, usual: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return usual
    return number if 0 <= number < 100 else usual


def _name_in(feature: Any, label: str) -> str:
    """A property of a feature in one line of text; "" if it has none."""
    properties = feature.get("properties")
    name = properties.get(label) if isinstance(properties, Mapping) else None
    return "" if name is None else " ".join(str(name).split())[:LONGEST_NAME]


def _unpacked(coordinates: Any, nested: int) -> Iterator[np.ndarray]:
    if nested:
        for part in coordinates:
            yield from _unpacked(part, nested - 1)
        return
    if len(coordinates):
        shape = np.asarray(coordinates, float)[..., :2]  # without heights: lines lie on the land
        if shape.shape[-1] != 2 or not np.isfinite(shape).all():
            raise ValueError("coordinates are not pairs of numbers")
        yield shape


def _posts(at: np.ndarray, crs: Any, heightmap: Heightmap, is_line: bool) -> np.ndarray:
    """(n, 2) columns and rows of coordinates (n, 2) of a line, or of points."""
    place = heightmap.place
    east_m, north_m = heightmap.spacing_m
    x, y = at[:, 0], at[:, 1]
    if place is None and crs is not None:
        advice = 'with "crs": null, GeoJSON has metres from its south-west corner'
        raise TerrainError(f"the map does not say where it lies: {advice}")
    if place is not None:
        if crs is not None:
            x, y = _to_crs(x, y, crs, place.crs)
            x = place.nearest_turn(x, is_line)
        x, y = place.from_map(x, y)  # type: ignore[arg-type, assignment]  # arrays, too
    return np.stack([x / east_m, heightmap.rows - 1 - y / north_m], -1)


def _to_crs(x: np.ndarray, y: np.ndarray, crs: Any, own: str | None) -> tuple[np.ndarray, np.ndarray]:
    if own is None:
        raise TerrainError("the map has no coordinate system: give it one with gdal_translate -a_srs")
    if crs == own or not len(x):
        return x, y
    systems = flat_crs(crs), flat_crs(own)  # raises an error if pyproj is missing
    import pyproj

    try:
        if crs == DEGREES:  # of another planet, too
            turned = to_degrees(own).transform(x, y, direction="INVERSE")
        else:
            turned = pyproj.Transformer.from_crs(*systems, always_xy=True).transform(x, y)
    except pyproj.exceptions.ProjError as error:
        raise TerrainError(f"cannot be converted to map coordinates: {_words(error)}") from None
    if not np.isfinite(turned).all():
        most = float(np.abs(x).max()), float(np.abs(y).max())
        if crs == DEGREES and (most[0] > 720 or most[1] > 90):
            own_system = 'if they are in the map\'s own system, give GeoJSON the member "crs": null'
            raise TerrainError(f"coordinates up to {most[0]:.9g}, {most[1]:.9g} are no degrees: {own_system}")
        raise TerrainError("some coordinates have no place in the map's coordinate system")
    return turned[0], turned[1]
