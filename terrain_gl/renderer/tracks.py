"""Tracks of GPS devices as GeoJSON: GPX 1.0 and 1.1, KML, KMZ (a KML in a .zip) and TCX.

Only the standard XML parser is used. A file with a DOCTYPE is refused, because its entities can expand to gigabytes or
name other files. Elements are recognised by their names without namespaces, because devices write many namespaces.
"""

import io
import re
import zipfile
import zlib
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

Pairs = list[list[float]]
FORMATS = "GPX, KML or TCX"
_ZIP = b"PK\x03\x04"


class _NoDoctype(ElementTree.TreeBuilder):
    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Called by the parser before it reads the declarations of the DOCTYPE."""
        raise ValueError("it has a DOCTYPE, which is not read: remove it")


def is_xml(start: bytes) -> bool:
    """Whether a file that begins with these bytes may be XML."""
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    return text.startswith(b"<") or start.startswith((b"\xff\xfe", b"\xfe\xff"))


def is_zip(content: bytes) -> bool:
    """Whether a file may be a KMZ."""
    return content.startswith(_ZIP)


def unpacked(content: bytes, most_bytes: int) -> bytes:
    """The first .kml in a KMZ: its main document.

    Raises
    ------
    ValueError
        There is no .kml, or it cannot be unpacked, or it is larger than `most_bytes`.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            member = next((each for each in archive.infolist() if each.filename.lower().endswith(".kml")), None)
            if member is None:
                raise ValueError("is a .zip without a .kml: unpack it, and name a file of it")
            with archive.open(member) as packed:
                text = packed.read(most_bytes + 1)
    except (OSError, EOFError, RuntimeError, zlib.error, zipfile.BadZipFile, NotImplementedError) as error:
        raise ValueError(f"does not unpack: {error}") from None
    if len(text) > most_bytes:
        raise ValueError(f"{member.filename[:40]} unpacks to more than {most_bytes >> 20} MiB")
    return text


def features_of(content: bytes) -> dict[str, Any]:
    """The lines and points of a file as GeoJSON, in degrees.

    Raises
    ------
    ValueError
        The file is no XML or none of `FORMATS`, or a coordinate is no number.
    """
    try:
        root = ElementTree.fromstring(content, ElementTree.XMLParser(target=_NoDoctype()))
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError(f"is no whole XML: {error}") from None
    kind = _name(root)
    if kind not in _READERS:
        raise ValueError(f"is XML of the kind {kind[:40]!r}, not {FORMATS}")
    return {"type": "FeatureCollection", "features": list(_READERS[kind](root))}


def _gpx(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Tracks by their segments, routes and waypoints."""
    for element in root.iter():
        if _name(element) in ("trkseg", "rte"):
            points = [point for point in element if _name(point) in ("trkpt", "rtept")]
            yield _feature([_degrees(point.get("lon"), point.get("lat")) for point in points])
        elif _name(element) == "wpt":
            yield _feature([_degrees(element.get("lon"), element.get("lat"))], _text(element, "name"))


def _kml(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Lines, rings of polygons, points, and tracks with times."""
    for element in root.iter():
        if _name(element) in ("LineString", "LinearRing", "Point"):
            tuples = re.sub(r"\s*,\s*", ",", _text(element, "coordinates")).split()
            yield _feature([_degrees(*each.split(",")[:2]) for each in tuples])
        elif _name(element) == "Track":
            yield _feature([_degrees(*(each.text or "").split()[:2]) for each in element if _name(each) == "coord"])


def _tcx(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    """Tracks, without trackpoints that have no position (some devices only count)."""
    for track in (element for element in root.iter() if _name(element) == "Track"):
        positions = [each for each in track.iter() if _name(each) == "Position"]
        yield _feature([_degrees(_text(p, "LongitudeDegrees"), _text(p, "LatitudeDegrees")) for p in positions])


_READERS = {"gpx": _gpx, "kml": _kml, "TrainingCenterDatabase": _tcx}


def _feature(points: Pairs, name: str = "") -> dict[str, Any]:
    """A line, or a point if there is only one; without points, nothing."""
    kind, coordinates = ("Point", points[0]) if len(points) == 1 else ("LineString", points)
    return {"type": "Feature", "properties": {"name": name}, "geometry": {"type": kind, "coordinates": coordinates}}


def _name(element: ElementTree.Element) -> str:
    """The name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def _text(element: ElementTree.Element, name: str) -> str:
    return next((each.text or "" for each in element if _name(each) == name), "").strip()


def _degrees(longitude: str | None = None, latitude: str | None = None) -> list[float]:
    if not longitude or not latitude:
        raise ValueError("a point has no longitude or no latitude")
    return [float(longitude), float(latitude)]
