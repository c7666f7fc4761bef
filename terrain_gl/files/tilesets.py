"""3D Tiles of any program (OGC 22-025, version 1.0 and 1.1) against a heightmap: declared errors and measured ones.

A tile's `geometricError` says how far its surface is from the truth. Here each tile is compared with the posts of the
full map. Tiles are placed in the Earth-centred system EPSG:4978. Their triangles are flat there, and so below the
curved ground in between: they are divided until that is less than `_SAG` of the declared error, and then put on the
map. Heights above the ellipsoid are compared with the map's numbers as they are.
"""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..readers.place import to_degrees
from ..readers.raster import INSTALL_GEO
from ..verify.check import check_mesh
from .mesh_readers import gltf_triangles

_RADIUS_M = 6.35e6  # of the Earth, at least
_SAG = 1e-3  # of the declared error
_LEAST_SAG_M = 1e-3
_WALL = 1e-3  # area on the map for each area of a triangle: less is a wall or a skirt, which hides cracks


class TileError(NamedTuple):
    """The error of a tile."""

    name: str
    declared_m: float
    posts_m: float  # largest measured error at posts
    surface_m: float  # the same over the bilinear surface
    posts: int  # posts that the tile covers
    triangles: int

    @property
    def lies(self) -> bool:
        """Whether the tile declares less than it has."""
        return self.posts_m > self.declared_m * (1 + 1e-9)


def is_tileset(path: str) -> bool:
    """Whether a path names a tile set: a folder with one, or its .json file."""
    return Path(path).is_dir() or path.lower().endswith(".json")


def check_tiles(path: str, heightmap: Heightmap) -> Iterator[TileError]:
    """Compare all tiles that lie on the map with it.

    Raises
    ------
    TerrainError
        The tile set cannot be read; or the map does not say where it lies.
    """
    if heightmap.place is None or heightmap.place.crs is None:
        raise TerrainError(f"{heightmap.name}: does not say where it lies: tiles need a map with a coordinate system")
    heights = heightmap.part(slice(0, heightmap.rows), slice(0, heightmap.cols))
    file = Path(path) / "tileset.json" if Path(path).is_dir() else Path(path)
    for name, declared_m, places, faces in _tiles(file, np.eye(4)):
        corners = _divided(places[faces], max(_LEAST_SAG_M, _SAG * declared_m))
        posts, tops_m = _on_map(corners.reshape(-1, 3), heightmap)
        a, b, c = np.moveaxis((posts * heightmap.spacing_m).reshape(-1, 3, 2), 1, 0)
        flat = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        tall = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        land = np.arange(len(posts)).reshape(-1, 3)[flat > _WALL * tall]
        error = check_mesh(heights, posts, tops_m, land)
        covered = int(np.isfinite(error.of_posts).sum())
        yield TileError(name, declared_m, error.posts, error.surface, covered, len(faces))


def _tiles(file: Path, above: np.ndarray) -> Iterator[tuple[str, float, np.ndarray, np.ndarray]]:
    """Names, declared errors, vertices in the tile set's system and faces of all tiles with triangles."""
    try:
        waiting = [(json.loads(file.read_bytes())["root"], above)]
        while waiting:
            tile, outer = waiting.pop()
            if "implicitTiling" in tile:
                raise ValueError("implicit tiling is not read: 3d-tiles-tools turns it into explicit tiles")
            world = outer @ np.array(tile.get("transform", np.eye(4)), np.float64).reshape(4, 4).T
            waiting += [(child, world) for child in tile.get("children", [])]
            for content in [tile["content"]] if "content" in tile else tile.get("contents", []):
                name = unquote(content.get("uri") or content["url"])
                if ":" in name or Path(name).is_absolute() or ".." in Path(name).parts:
                    raise ValueError(f"{name:.60} lies elsewhere")
                if name.lower().endswith(".json"):
                    yield from _tiles(file.parent / name, world)
                else:
                    places, faces = _content(file.parent / name)
                    yield name, float(tile["geometricError"]), places @ world[:3, :3].T + world[:3, 3], faces
    except OSError as error:
        raise TerrainError(f"{error.filename}: {error.strerror}") from None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        raise TerrainError(f"{file}: is damaged, or no such tile set ({error})") from None


def _content(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, z up, and faces of a .glb, .gltf or .b3dm file."""
    data = path.read_bytes()
    centre = np.zeros(3)
    if data[:4] == b"b3dm":
        lengths = struct.unpack_from("<4I", data, 12)
        features: dict[str, Any] = json.loads(data[28 : 28 + lengths[0]] or b"{}")
        centre = np.array(features.get("RTC_CENTER", centre), np.float64)
        data = data[28 + sum(lengths) :]
    places, faces = gltf_triangles(path, data)
    return places + centre, faces


def _divided(corners: np.ndarray, sag_m: float) -> np.ndarray:
    """Triangles (m, 3, 3), each divided into four until the ground between its corners is flat to `sag_m`."""
    longest_m = np.sqrt(8 * _RADIUS_M * sag_m)
    done = []
    while len(corners):
        sides = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
        done.append(corners[sides <= longest_m])
        a, b, c = np.moveaxis(corners[sides > longest_m], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
        corners = np.concatenate([np.stack(part, 1) for part in parts])
    return np.concatenate(done) if done else corners


def _on_map(places: np.ndarray, heightmap: Heightmap) -> tuple[np.ndarray, np.ndarray]:
    """Columns and rows (n, 2), and heights, of Earth-centred places."""
    try:
        import pyproj
    except ImportError:
        raise TerrainError(f"tiles need pyproj: {INSTALL_GEO}") from None
    place = heightmap.place
    assert place and place.crs
    to_ellipsoid = pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
    lon, lat, tops_m = to_ellipsoid.transform(*places.T)
    easting, northing = to_degrees(place.crs).transform(lon, lat, direction="INVERSE")
    grid = place.georeference.grid
    col = (place.nearest_turn(np.asarray(easting)) - grid.c) / grid.a - 0.5
    return np.stack([col, (np.asarray(northing) - grid.f) / grid.e - 0.5], -1), np.asarray(tops_m)
