"""3D Tiles of any program (OGC 22-025, version 1.0 and 1.1) against a heightmap: declared errors and measured ones.

A tile's `geometricError` says how far its surface is from the truth. Here each tile is compared with the posts of the
full map. Tiles are placed in the Earth-centred system EPSG:4978, unless they say that they are local. Their triangles
are flat there, and so below the curved ground in between: they are divided until that is less than `sag_m` of the
declared error, and then put on the map. Heights above the ellipsoid are compared with the map's numbers as they are.
"""

import contextlib
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..verify.check import check_mesh
from .mesh_readers import gltf_triangles, name_below
from .quantized_mesh import quantized_tiles
from .tile_system import EARTH, RADIUS_M, TileSystem

_SAG = 1e-3  # of the declared error
_LEAST_SAG_M = 2e-4
_BLOCK = 1024  # cells along a side of the part of the map that is read at a time
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


def check_tiles(path: str, heightmap: Heightmap, crs: str | None = None) -> Iterator[TileError]:
    """Compare all tiles that lie on the map with it. `crs` is their system if it is not the Earth-centred one.

    Raises
    ------
    TerrainError
        The tile set cannot be read; or the map does not say where it lies, and the tiles are not local.
    """
    file = Path(path)
    if file.is_dir():
        file /= "layer.json" if (file / "layer.json").exists() else "tileset.json"
    system = TileSystem(heightmap, crs or (None if _is_local(file) else EARTH))
    for name, declared_m, places, faces in _tiles(file, np.eye(4)):
        if faces.size and not (faces.min() >= 0 and faces.max() < len(places)):
            raise TerrainError(f"{file.parent / name}: is damaged: a face names a vertex that is missing")
        yield TileError(name, declared_m, *tile_error(heightmap, system, places[faces], declared_m), len(faces))


def sag_m(system: TileSystem, error_m: float) -> float:
    """How exactly the error of a tile is measured whose error is about `error_m`: to this amount."""
    return 0.0 if system.is_local else max(_LEAST_SAG_M, _SAG * error_m)


def tile_error(
    heightmap: Heightmap, system: TileSystem, corners: np.ndarray, error_m: float
) -> tuple[float, float, int]:
    """Largest error of a tile at posts and over the surface, and how many posts it covers.

    `corners` are those of its triangles in the world, (m, 3, 3). `error_m` is about its error: see `sag_m`.
    """
    corners = divided(system, corners, error_m)
    places, heights_m = system.to_map(corners.reshape(-1, 3))
    posts, tops_m = places.reshape(-1, 3, 2), heights_m.reshape(-1, 3)
    a, b, c = np.moveaxis(posts * heightmap.spacing_m, 1, 0)
    flat = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    tall = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    is_land = flat > _WALL * tall
    posts, tops_m = posts[is_land], tops_m[is_land]
    low, high = posts.min(1, initial=np.inf), posts.max(1, initial=-np.inf)
    last = np.array([heightmap.cols, heightmap.rows]) - 1
    first, end = np.maximum(low.min(0, initial=np.inf), 0), np.minimum(high.max(0, initial=-np.inf), last)
    largest_m, surface_m, count = 0.0, 0.0, 0
    if not (end >= first).all():
        return largest_m, surface_m, count
    first, end = np.minimum(np.floor(first), last - 1).astype(int), np.ceil(end).astype(int)
    for row, col in ((y, x) for y in range(first[1], end[1], _BLOCK) for x in range(first[0], end[0], _BLOCK)):
        start, stop = np.array([col, row]), np.minimum(np.array([col, row]) + _BLOCK, end)
        here = ((high >= start) & (low <= stop)).all(1)
        faces = np.arange(3 * here.sum()).reshape(-1, 3)
        heights = heightmap.part(slice(row, stop[1] + 1), slice(col, stop[0] + 1))
        found = check_mesh(heights, posts[here].reshape(-1, 2) - start, tops_m[here].reshape(-1), faces)
        largest_m, surface_m = max(largest_m, found.posts), max(surface_m, found.surface)
        own = _BLOCK + (stop == end)  # posts between two blocks count once
        count += int(np.isfinite(found.of_posts[: own[1], : own[0]]).sum())
    return largest_m, surface_m, count


@contextlib.contextmanager
def _explained(file: Path) -> Iterator[None]:
    """Turn errors of a tile set that cannot be read into one line."""
    try:
        yield
    except OSError as error:
        raise TerrainError(f"{error.filename}: {error.strerror}") from None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        raise TerrainError(f"{file}: is damaged, or no such tile set ({error})") from None


def _is_local(file: Path) -> bool:
    """Whether a tile set says that it is in local metres."""
    with _explained(file):
        extras = json.loads(file.read_bytes()).get("asset", {}).get("extras")
        return isinstance(extras, dict) and bool(extras.get("is_local"))


def _tiles(file: Path, above: np.ndarray) -> Iterator[tuple[str, float, np.ndarray, np.ndarray]]:
    """Names, declared errors, vertices in the tile set's system and faces of all tiles with triangles."""
    with _explained(file):
        if file.name == "layer.json":
            yield from quantized_tiles(file)
            return
        waiting = [(json.loads(file.read_bytes())["root"], above)]
        while waiting:
            tile, outer = waiting.pop()
            if "implicitTiling" in tile:
                raise ValueError("implicit tiling is not read: 3d-tiles-tools turns it into explicit tiles")
            world = outer @ np.array(tile.get("transform", np.eye(4)), np.float64).reshape(4, 4).T
            waiting += [(child, world) for child in tile.get("children", [])]
            for content in [tile["content"]] if "content" in tile else tile.get("contents", []):
                name = name_below(content.get("uri") or content["url"])
                if name.lower().endswith(".json"):
                    yield from _tiles(file.parent / name, world)
                else:
                    places, faces = _content(file.parent / name)
                    yield name, float(tile["geometricError"]), places @ world[:3, :3].T + world[:3, 3], faces


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


def divided(system: TileSystem, corners: np.ndarray, error_m: float) -> np.ndarray:
    """Triangles (m, 3, 3), divided until the ground between their corners is flat to `sag_m`.

    Each step halves the longest side. So it depends on a side alone whether it is divided: triangles still meet.
    """
    if system.is_local:
        return corners
    longest_m = np.sqrt(8 * RADIUS_M * sag_m(system, error_m))
    done = []
    while len(corners):
        sides = np.linalg.norm(corners - np.roll(corners, -1, 1), axis=2)
        is_done = sides.max(1) <= longest_m
        done.append(corners[is_done])
        corners, first = corners[~is_done], sides[~is_done].argmax(1)
        a, b, c = (corners[np.arange(len(first)), (first + i) % 3] for i in range(3))
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate(done) if done else corners
