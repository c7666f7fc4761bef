"""Read folders of quantized-mesh tiles (Cesium, version 1.0): `layer.json`, and a .terrain file for each tile.

A tile has no error of its own. Viewers take 77,067 m / 2^level: the circumference of the Earth, divided by the 2 tiles
of level 0, by 65 posts of each, and by 4. Vertices are at longitudes, latitudes and heights above the ellipsoid.
"""

import gzip
import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..readers.georeference import WGS84

LEVEL_0_M = 2 * np.pi * WGS84[0] / 4 / (2 * 65)
_HEAD = struct.Struct("<3d2f7dI")  # centre, least and largest height, sphere and horizon point, number of vertices
_MOST = 32767  # of a quantized coordinate
_WIDE = 65536  # more vertices than this have indices of 32 bits


def quantized_tiles(file: Path) -> Iterator[tuple[str, float, np.ndarray, np.ndarray]]:
    """Names, errors that viewers assume, vertices in EPSG:4978 and faces of all tiles beside a layer.json."""
    import pyproj

    head = json.loads(file.read_bytes())
    if head.get("projection", "EPSG:4326") != "EPSG:4326":
        raise ValueError(f"tiles in {head['projection']:.20} are not read, only in EPSG:4326")
    to_earth = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    for path in sorted(file.parent.glob("[0-9]*/[0-9]*/[0-9]*.terrain")):
        level, col, row = (int(part) for part in path.with_suffix("").parts[-3:])
        if head.get("scheme", "tms") != "tms":
            row = 2**level - 1 - row
        shares, heights_m, faces = _tile(path.read_bytes())
        lon, lat = (np.array([col, row]) + shares).T * 180 / 2**level - [[180], [90]]
        places = np.stack(to_earth.transform(lon, lat, heights_m), -1)
        yield str(path.relative_to(file.parent)), LEVEL_0_M / 2**level, places, faces


def _tile(data: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares of the tile's width and height (n, 2), heights, and faces."""
    if data[:2] == b"\x1f\x8b":
        data = gzip.decompress(data)
    *_, count = head = _HEAD.unpack_from(data)
    coded = np.frombuffer(data, "<u2", 3 * count, _HEAD.size).reshape(3, count).astype(np.int64)
    u, v, height = np.cumsum((coded >> 1) ^ -(coded & 1), 1) / _MOST  # differences, the sign in the last bit
    kind = np.dtype("<u4" if count > _WIDE else "<u2")
    at = -(-(_HEAD.size + coded.size * 2) // kind.itemsize) * kind.itemsize
    (triangles,) = struct.unpack_from("<I", data, at)
    codes = np.frombuffer(data, kind, 3 * triangles, at + 4).astype(np.int64)
    new = np.cumsum(codes == 0) - (codes == 0)  # vertices so far: a code counts back from the next new one
    low_m, high_m = head[3:5]
    return np.stack([u, v], -1), low_m + height * (high_m - low_m), (new - codes).astype(kind).reshape(-1, 3)
