"""Photos with a place: the GPS tags of EXIF (CIPA DC-008) as GeoJSON."""

import math
import os
from typing import Any

import OpenImageIO as oiio

from ..image import quiet_stderr

ENDINGS = (".jpg", ".jpeg")
_SIGHT_DEG = 0.003  # length of the line in the direction of the photo: about 330 m


def photo_in(path: str) -> dict[str, Any] | None:
    """A photo as a point with its file's name, and a line in the direction of the lens if the photo has it.

    None for a photo without a place, and for any other file. Only the header is read.
    """
    if not path.lower().endswith(ENDINGS):
        return None
    with quiet_stderr():
        file = oiio.ImageInput.open(path)
    if file is None:
        oiio.geterror()  # otherwise it is printed when the program ends
        return None
    spec = file.spec()
    file.close()
    lon, lat = (_degrees(spec, axis, side) for axis, side in (("Longitude", "W"), ("Latitude", "S")))
    if lon is None or lat is None or abs(lat) > 89 or abs(lon) > 180:
        return None
    shapes: list[tuple[str, list[Any], dict[str, str]]] = [("Point", [lon, lat], {"name": os.path.basename(path)})]
    heading = spec.getattribute("GPS:ImgDirection")
    if isinstance(heading, float | int) and math.isfinite(heading):
        turn = math.radians(heading)
        end = lon + _SIGHT_DEG * math.sin(turn) / math.cos(math.radians(lat)), lat + _SIGHT_DEG * math.cos(turn)
        shapes.append(("LineString", [[lon, lat], [*end]], {}))
    features = [
        {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": at}}
        for kind, at, properties in shapes
    ]
    return {"type": "FeatureCollection", "features": features}


def _degrees(spec: oiio.ImageSpec, axis: str, negative: str) -> float | None:
    """An angle of a header, from degrees, minutes and seconds; None if it is missing or no number."""
    parts = spec.getattribute(f"GPS:{axis}")
    if not isinstance(parts, tuple) or len(parts) != 3 or not all(map(math.isfinite, parts)):
        return None
    angle = float(parts[0]) + float(parts[1]) / 60 + float(parts[2]) / 3600
    return -angle if spec.getattribute(f"GPS:{axis}Ref") == negative else angle
