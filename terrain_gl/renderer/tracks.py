"""Tracks of GPS devices as GeoJSON: GPX 1.0 and 1.1, KML, KMZ (a KML in a .zip), TCX, NMEA 0183 and IGC.

Only the standard XML parser is used. A file with a DOCTYPE is refused, because its entities can expand to gigabytes or
name other files. Elements are recognised by their names without namespaces, because devices write many namespaces.
"""

import gzip
import io
import re
import zipfile
import zlib
from collections.abc import Iterator
from typing import IO, Any
from xml.etree import ElementTree

Pairs = list[list[float]]
_XML = "GPX, KML or TCX"
FORMATS = "GPX, KML, TCX, NMEA or IGC"
_ZIP = b"PK\x03\x04"
_GZIP = b"\x1f\x8b"
_ENDINGS = (".kml", ".gpx", ".tcx", ".geojson", ".nmea", ".igc")  # of overlays in archives


class _NoDoctype(ElementTree.TreeBuilder):
    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Called by the parser before it reads the declarations of the DOCTYPE."""
        raise ValueError("it has a DOCTYPE, which is not read: remove it")


def unpacked(content: bytes, name: str, most_bytes: int) -> bytes:
    """The content of a .gz, or the first overlay in a .zip (in a KMZ, its main document); other content as it is.

    A ValueError says that there is no overlay, that it cannot be unpacked, or that it is larger than `most_bytes`.
    """
    if not content.startswith((_ZIP, _GZIP)):
        return content
    what = "it"
    try:
        if content.startswith(_GZIP):
            packed: gzip.GzipFile | IO[bytes] = gzip.GzipFile(fileobj=io.BytesIO(content))
        else:
            archive = zipfile.ZipFile(io.BytesIO(content))
            member = next((each for each in archive.infolist() if each.filename.lower().endswith(_ENDINGS)), None)
            if member is None:
                if any(each.lower().endswith(".shp") for each in archive.namelist()):
                    step = f"ogr2ogr -f GeoJSON {name.rpartition('.')[0]}.geojson /vsizip/{name}"
                    raise ValueError(f"is a zipped shapefile: {step}")
                raise ValueError("is a .zip without a .kml, a .gpx or a .geojson: unpack it, and name a file of it")
            what = member.filename[:40]
            packed = archive.open(member)
        with packed:
            text = packed.read(most_bytes + 1)
    except (OSError, EOFError, RuntimeError, zlib.error, zipfile.BadZipFile, NotImplementedError) as error:
        raise ValueError(f"does not unpack: {error}") from None
    if len(text) > most_bytes:
        raise ValueError(f"{what} unpacks to more than {most_bytes >> 20} MiB")
    return text


def track_in(content: bytes) -> dict[str, Any] | None:
    """The lines and points of XML, NMEA sentences or IGC records as GeoJSON, in degrees; None for any other content.

    A ValueError says what is wrong with the XML.
    """
    start = content[:64].removeprefix(b"\xef\xbb\xbf").lstrip()
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        start = start.decode("utf-16", "ignore").lstrip().encode()
    if not start.startswith(b"<"):
        return _track_of(content.decode("ascii", "replace"))
    try:
        root = ElementTree.fromstring(content, ElementTree.XMLParser(target=_NoDoctype()))
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError(f"is no whole XML: {error}") from None
    kind = _name(root)
    if kind not in _READERS:
        raise ValueError(f"is XML of the kind {kind[:40]!r}, not {_XML}: convert it with ogr2ogr -f GeoJSON")
    return {"type": "FeatureCollection", "features": list(_READERS[kind](root))}


# --- Lines of text ----------------------------------------------------------------------------------------------------

_ANGLE = r"(\d+)(\d\d\.?\d*)"  # degrees, minutes
_RMC = re.compile(rf"\$..RMC,[^,]*,A,{_ANGLE},([NS]),{_ANGLE},([EW])", re.MULTILINE)  # A: the position is valid
_GGA = re.compile(rf"\$..GGA,[^,]*,{_ANGLE},([NS]),{_ANGLE},([EW]),[1-9]", re.MULTILINE)
_IGC = re.compile(r"^B\d{6}(\d\d)(\d{5})([NS])(\d{3})(\d{5})([EW])", re.MULTILINE)  # minutes in thousandths


def _track_of(text: str) -> dict[str, Any] | None:
    for pattern, minutes in ((_RMC, 60.0), (_GGA, 60.0), (_IGC, 60_000.0)):
        if found := pattern.findall(text):
            return _feature([[_angle(fix[3:], minutes), _angle(fix[:3], minutes)] for fix in found])
    return None


def _angle(parts: tuple[str, str, str], of_degree: float) -> float:
    """Degrees, from degrees, minutes and a side of the Earth; a degree has `of_degree` of these minutes."""
    degrees, minutes, side = parts
    return (int(degrees) + float(minutes) / of_degree) * (-1 if side in "SW" else 1)


# --- XML --------------------------------------------------------------------------------------------------------------


def _gpx(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Tracks by their segments, routes and waypoints."""
    of_file = _gpx_style(root)
    style = of_file
    for element in root.iter():
        if _name(element) in ("trk", "rte"):
            style = of_file | _gpx_style(element)
        if _name(element) in ("trkseg", "rte"):
            points = [point for point in element if _name(point) in ("trkpt", "rtept")]
            yield _feature([_degrees(point.get("lon"), point.get("lat")) for point in points], **style)
        elif _name(element) == "wpt":
            name = _text(element, "name")
            yield _feature([_degrees(element.get("lon"), element.get("lat"))], name, **_gpx_style(element))


# of Garmin's DisplayColor; names in other files are the same
NAMED = {
    "black": "000000",
    "white": "ffffff",
    "red": "ff0000",
    "green": "00ff00",
    "blue": "0000ff",
    "yellow": "ffff00",
}
NAMED |= {"cyan": "00ffff", "magenta": "ff00ff", "darkred": "8b0000", "darkgreen": "006400", "darkblue": "00008b"}
NAMED |= {"darkyellow": "808000", "darkcyan": "008b8b", "darkmagenta": "8b008b", "lightgray": "d3d3d3"}
NAMED |= {"darkgray": "a9a9a9"}


def _gpx_style(element: ElementTree.Element) -> dict[str, Any]:
    """Colour, opacity and width in extensions of a track or of a file, as Garmin, OsmAnd and GPX Style write them."""
    extensions = next((each for each in element if _name(each) == "extensions"), None)
    found: dict[str, Any] = {}
    for each in extensions.iter() if extensions is not None else ():
        text = (each.text or "").strip()
        if _name(each) in ("color", "DisplayColor"):
            digits = NAMED.get(text.lower(), text.lstrip("#"))
            found["stroke"] = digits[-6:]
            if re.fullmatch("[0-9a-fA-F]{8}", digits):  # OsmAnd writes aarrggbb
                found["stroke-opacity"] = int(digits[:2], 16) / 255
        elif _name(each) == "opacity":
            found["stroke-opacity"] = text
        elif _name(each) == "width":
            found["stroke-width"] = text
    return found


def _kml(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Lines, polygons, points, and tracks with times, each with its name and its style."""
    styles = {each.get("id", ""): each for each in root.iter() if _name(each) in ("Style", "StyleMap")}
    marks = [each for each in root.iter() if _name(each) == "Placemark"]
    for mark in marks or [root]:  # a file may be one geometry
        properties = {"name": _text(mark, "name")} | _kml_style(mark, styles)
        in_polygons = {ring for polygon in _all(mark, "Polygon") for ring in polygon.iter()}
        for element in mark.iter():
            kind = _name(element)
            if kind == "Polygon":
                rings = [_coordinates(ring) for ring in _all(element, "LinearRing")]
                geometry = {"type": "Polygon", "coordinates": rings}
                yield {"type": "Feature", "properties": properties, "geometry": geometry}
            elif kind in ("LineString", "LinearRing", "Point") and element not in in_polygons:
                yield _feature(_coordinates(element), **properties)
            elif kind == "Track":
                coords = [(each.text or "").split()[:2] for each in element if _name(each) == "coord"]
                yield _feature([_degrees(*each) for each in coords], **properties)


def _all(element: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    return [each for each in element.iter() if _name(each) == name]


def _coordinates(element: ElementTree.Element) -> Pairs:
    tuples = re.sub(r"\s*,\s*", ",", _text(element, "coordinates")).split()
    return [_degrees(*each.split(",")[:2]) for each in tuples]


def _kml_style(mark: ElementTree.Element, styles: dict[str, ElementTree.Element]) -> dict[str, Any]:
    """The style of a placemark as properties of simplestyle: its own, or the one that it names, by a StyleMap too."""
    own = next((each for each in mark if _name(each) == "Style"), None)
    style = styles.get(_text(mark, "styleUrl").rpartition("#")[2]) if own is None else own
    if style is not None and _name(style) == "StyleMap":
        pairs = [each for each in style if _name(each) == "Pair"]
        normal = next((each for each in pairs if _text(each, "key") == "normal"), None)
        inside = None if normal is None else next((each for each in normal if _name(each) == "Style"), None)
        url = "" if normal is None else _text(normal, "styleUrl").rpartition("#")[2]
        style = styles.get(url) if inside is None else inside
    if style is None:
        return {}
    line, area, icon = (next(iter(_all(style, f"{kind}Style")), None) for kind in ("Line", "Poly", "Icon"))
    found: dict[str, Any] = {}
    if line is not None:
        found |= _kml_colour(line, "stroke") | ({"stroke-width": width} if (width := _text(line, "width")) else {})
    if area is not None and _text(area, "fill") != "0":
        found |= {"fill": "ffffff", "fill-opacity": 1.0} | _kml_colour(area, "fill")
    if area is not None and _text(area, "outline") == "0":
        found["stroke-width"] = 0
    return found | (_kml_colour(icon, "marker-color") if icon is not None else {})


def _kml_colour(style: ElementTree.Element, name: str) -> dict[str, Any]:
    """A colour aabbggrr as a property and its opacity."""
    text = _text(style, "color").lstrip("#")
    if not re.fullmatch("[0-9a-fA-F]{8}", text):
        return {}
    return {name: text[6:] + text[4:6] + text[2:4], f"{name}-opacity": int(text[:2], 16) / 255}


def _tcx(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Tracks, without trackpoints that have no position: some devices write those, too."""
    for track in (element for element in root.iter() if _name(element) == "Track"):
        positions = [each for each in track.iter() if _name(each) == "Position"]
        yield _feature([_degrees(_text(p, "LongitudeDegrees"), _text(p, "LatitudeDegrees")) for p in positions])


_READERS = {"gpx": _gpx, "kml": _kml, "TrainingCenterDatabase": _tcx}


def _feature(points: Pairs, name: str = "", **style: object) -> dict[str, Any]:
    """A line, or a point if there is only one place; without places, a line of no points, which draws nothing."""
    kind, coordinates = ("Point", points[0]) if len(points) == 1 else ("LineString", points)
    return {
        "type": "Feature",
        "properties": {"name": name} | style,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _name(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _text(element: ElementTree.Element, name: str) -> str:
    return next((each.text or "" for each in element if _name(each) == name), "").strip()


def _degrees(longitude: str | None = None, latitude: str | None = None) -> list[float]:
    if not longitude or not latitude:
        raise ValueError("a point has no longitude or no latitude")
    return [float(longitude), float(latitude)]
