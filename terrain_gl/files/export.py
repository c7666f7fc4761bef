"""Triangle meshes as files: binary PLY, binary glTF, Wavefront OBJ.

Vertices are posts of the map, or middles of its cells, so every position is exact: PLY holds float64 world metres, glTF
holds columns, heights and rows with the spacing in the node's scale, OBJ holds decimals that round to the same numbers.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..exceptions import TerrainError, UsageError
from ..image import replacing
from ..mesh import vertex_heights

CHUNK = 1 << 17  # vertices or faces that are turned into bytes at a time
GLB_LIMIT = 2**32 - 1
_FACE = np.dtype([("n", "u1"), ("vertices", "<u4", 3)])


@dataclass(frozen=True)
class Mesh:
    """Triangles over a map.

    Attributes
    ----------
    posts
        (n, 2) columns and rows of the vertices, see `mesh.vertex_heights`.
    faces
        (m, 3) uint32 indices of vertices, counter-clockwise from above.
    heights
        (rows, cols) float32 metres, without voids.
    spacing_m
        Metres between posts, east and north.
    """

    posts: np.ndarray
    faces: np.ndarray
    heights: np.ndarray
    spacing_m: tuple[float, float]

    def world(self, part: slice) -> np.ndarray:
        """(k, 3) float64 world metres of some vertices."""
        col, row = self.posts[part].T
        north = (self.heights.shape[0] - 1 - row) * self.spacing_m[1]
        heights = vertex_heights(self.heights, self.posts[part]).astype(np.float64)
        return np.stack([col * np.float64(self.spacing_m[0]), north, heights], -1)


def make_mesh(triangles: np.ndarray, heights: np.ndarray, spacing_m: tuple[float, float], weld: bool = False) -> Mesh:
    """Mesh of captured triangles, each with its own three vertices, or sharing those in one place if `weld`.

    Parameters
    ----------
    triangles
        (m, 3, 2) columns and rows.
    heights
        (rows, cols) float32 metres; voids filled, for a vertex may stand on one.
    """
    posts = triangles.reshape(-1, 2)
    if not weld:
        return Mesh(posts, np.arange(len(posts), dtype="u4").reshape(-1, 3), heights, spacing_m)
    places = np.rint(64 * posts).astype(np.int64)  # vertices stand on 64ths between posts
    used, number = np.unique(places[:, 1] << 32 | places[:, 0], return_inverse=True)
    shared = np.stack([used & 0xFFFFFFFF, used >> 32], -1) / 64
    return Mesh(shared, number.astype("u4").reshape(-1, 3), heights, spacing_m)


def write_mesh(path: str | os.PathLike[str], mesh: Mesh, progress: Callable[[float], None] | None = None) -> None:
    """Write a mesh; the ending of the name, one of `FORMATS`, says how. The file appears whole or not at all.

    Parameters
    ----------
    progress
        Called with the part done, 0 to 1.

    Raises
    ------
    TerrainError
        The file cannot be written, or the mesh is too large for its format.
    UsageError
        No such format.
    """
    pieces = mesh_format(path)(mesh)
    total = _chunks(len(mesh.posts)) + _chunks(len(mesh.faces))
    with replacing(path) as part, open(part, "wb") as file:
        for done, piece in enumerate(pieces):
            file.write(piece)
            if progress:
                progress(min(1.0, done / max(total, 1)))


def mesh_format(path: str | os.PathLike[str]) -> Callable[[Mesh], Iterator[bytes]]:
    """The function that turns a mesh into the bytes of the format that a file's name ends in."""
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in FORMATS:
        raise UsageError(f"{os.fspath(path)}: a mesh file's name must end in one of {', '.join(FORMATS)}")
    return FORMATS[ending]


def _chunks(n: int) -> int:
    return -(-n // CHUNK)


def _parts(n: int) -> Iterator[slice]:
    for first in range(0, n, CHUNK):
        yield slice(first, min(n, first + CHUNK))


def _ply(mesh: Mesh) -> Iterator[bytes]:
    """Binary little-endian PLY (Turk 1994), positions in double precision."""
    lines = ["ply", "format binary_little_endian 1.0", "comment metres: x east, y north, z up"]
    lines += [f"element vertex {len(mesh.posts)}", *(f"property double {axis}" for axis in "xyz")]
    lines += [f"element face {len(mesh.faces)}", "property list uchar uint vertex_indices", "end_header\n"]
    yield "\n".join(lines).encode("ascii")
    for part in _parts(len(mesh.posts)):
        yield mesh.world(part).astype("<f8").tobytes()
    for part in _parts(len(mesh.faces)):
        faces = np.empty(part.stop - part.start, _FACE)
        faces["n"], faces["vertices"] = 3, mesh.faces[part]
        yield faces.tobytes()


def _obj(mesh: Mesh) -> Iterator[bytes]:
    """Wavefront OBJ, one line a vertex and a face; 9 digits tell float32 heights apart, 15 name places."""
    yield b"# metres: x east, y north, z up\n"
    for part in _parts(len(mesh.posts)):
        places = mesh.world(part)
        yield ("v %.15g %.15g %.9g\n" * len(places) % tuple(places.ravel().tolist())).encode("ascii")
    for part in _parts(len(mesh.faces)):
        faces = mesh.faces[part].astype(np.int64) + 1
        yield ("f %d %d %d\n" * len(faces) % tuple(faces.ravel().tolist())).encode("ascii")


def _glb(mesh: Mesh) -> Iterator[bytes]:
    """Binary glTF 2.0 (Khronos 2021): y up, so that a world place (x, y, z) is stored as (x, z, -y)."""
    header = _glb_header(mesh)
    yield header
    for part in _parts(len(mesh.posts)):
        yield _lattice(mesh, part).tobytes()
    for part in _parts(len(mesh.faces)):
        yield mesh.faces[part].astype("<u4").tobytes()


def _lattice(mesh: Mesh, part: slice) -> np.ndarray:
    """(k, 3) float32 column, height and row: whole numbers and heights, so that nothing is rounded."""
    col, row = mesh.posts[part].T
    return np.stack([col, vertex_heights(mesh.heights, mesh.posts[part]), row], -1).astype("<f4")


def _glb_header(mesh: Mesh) -> bytes:
    sizes = 12 * len(mesh.posts), 12 * len(mesh.faces)
    text = json.dumps(_gltf(mesh, *sizes), separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + sum(sizes)
    if total > GLB_LIMIT:
        raise TerrainError(f"{len(mesh.faces)} triangles are more than a .glb file holds: write .ply, or weld them")
    start = struct.pack("<4sIIII", b"glTF", 2, total, len(text), 0x4E4F534A)  # "JSON"
    return start + text + struct.pack("<II", sum(sizes), 0x004E4942)  # "BIN"


def _gltf(mesh: Mesh, vertex_bytes: int, face_bytes: int) -> dict[str, object]:
    east, north = mesh.spacing_m
    corners = [_lattice(mesh, part) for part in _parts(len(mesh.posts))]
    low = np.min([c.min(0) for c in corners], 0).tolist() if corners else [0.0] * 3
    high = np.max([c.max(0) for c in corners], 0).tolist() if corners else [0.0] * 3
    south = -north * (mesh.heights.shape[0] - 1)
    position = {
        "bufferView": 0,
        "componentType": 5126,
        "count": len(mesh.posts),
        "type": "VEC3",
        "min": low,
        "max": high,
    }
    indices = {"bufferView": 1, "componentType": 5125, "count": 3 * len(mesh.faces), "type": "SCALAR"}
    rough = {"baseColorFactor": [0.55, 0.5, 0.42, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return {
        "asset": {"version": "2.0", "generator": "terrain-gl"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "terrain", "mesh": 0, "scale": [east, 1.0, north], "translation": [0.0, 0.0, south]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": rough}],
        "accessors": [position, indices],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": vertex_bytes, "target": 34962},
            {"buffer": 0, "byteOffset": vertex_bytes, "byteLength": face_bytes, "target": 34963},
        ],
        "buffers": [{"byteLength": vertex_bytes + face_bytes}],
    }


FORMATS: dict[str, Callable[[Mesh], Iterator[bytes]]] = {".ply": _ply, ".glb": _glb, ".obj": _obj}
