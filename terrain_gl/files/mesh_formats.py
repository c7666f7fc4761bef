"""Formats of triangle meshes: binary PLY, binary glTF, Wavefront OBJ, binary STL.

Vertices have float64 heights (`mesh.vertex_heights`). PLY holds float64 world metres, and OBJ 15 decimals of them. glTF
holds float32 numbers: columns, rows, and heights above `Mesh.base_m`; the node's scale is the spacing, and its
translation adds the base. So posts are exact, and heights between posts are rounded by less than the picture's. STL
holds a solid in millimetres above its base, for a 3D printer.
"""

import json
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..mesh import vertex_heights
from ..readers.place import Place
from ..terrain import quantisation_range

CHUNK = 1 << 17  # vertices or faces that are converted to bytes at a time
GLB_LIMIT = 2**32 - 1
PRINT_MM = 150.0  # longer side of a solid
BASE = 0.02  # thickness of a solid under its lowest place, as a part of its longer side
_ZERO = np.zeros(3)
_VERTICES, _FACES = 34962, 34963  # targets of a glTF's buffer views
_FACE = np.dtype([("n", "u1"), ("vertices", "<u4", 3)])
_VERTEX = np.dtype([("place", "<f8", 3), ("normal", "<f4", 3), ("texture", "<f4", 2)])
STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


@dataclass(frozen=True)
class Mesh:
    """Triangles over a map."""

    posts: np.ndarray  # (n, 2) columns and rows of the vertices: see `mesh.vertex_heights`
    faces: np.ndarray  # (m, 3) uint32 indices of vertices, counter-clockwise from above
    heights: np.ndarray  # (rows, cols) float32 metres, without voids
    spacing_m: tuple[float, float]  # metres between posts, east and north
    place: Place | None = None  # where the map lies; it is recorded in the file
    # the map seen from straight above, half a cell beyond the outermost posts: a PNG file, or for a page a JPEG file
    texture: bytes | None = None
    within_m: float | None = None  # certified largest error of height, between posts, too; None if there is no bound
    error_m: tuple[float, float] | None = None  # checked largest error of height, at posts and over the surface
    print_mm: float = PRINT_MM  # longer side of the map in a format for printing
    bottom_m: float | None = None  # height of such a solid's base; None for `BASE` below its lowest place
    vertices_m: np.ndarray | None = None  # (n,) heights of the vertices; None if they are the map's at their places

    def tops_m(self, part: slice) -> np.ndarray:
        """(k,) float64 heights of some vertices."""
        return vertex_heights(self.heights, self.posts[part]) if self.vertices_m is None else self.vertices_m[part]

    def world(self, part: slice) -> np.ndarray:
        """(k, 3) float64 world metres of some vertices."""
        col, row = self.posts[part].T
        north = (self.heights.shape[0] - 1 - row) * self.spacing_m[1]
        return np.stack([col * np.float64(self.spacing_m[0]), north, self.tops_m(part)], -1)

    @cached_property
    def base_m(self) -> float:
        """A height near the land: 0, or so close below high land that float32 holds the difference to any post."""
        ends = [(each.min(), each.max()) for each in map(self.tops_m, _parts(len(self.posts)))] or [(0.0, 0.0)]
        low, high = zip(*ends, strict=True)
        return quantisation_range(float(min(low)), float(max(high)))[0]

    def slopes(self, part: slice) -> np.ndarray:
        """(k, 2) float64 slope of the land east and north, from the next posts on both sides."""
        last = np.array(self.heights.shape[::-1]) - 1
        rises = []
        for axis in (0, 1):
            step = np.eye(2)[axis]
            low, high = (np.clip(self.posts[part] + sign * step, 0, last) for sign in (-1, 1))
            rise = vertex_heights(self.heights, high) - vertex_heights(self.heights, low)
            rises.append(rise / ((high - low)[:, axis] * self.spacing_m[axis]))
        return np.stack([rises[0], -rises[1]], -1)  # rows count to the south

    def normals(self, part: slice) -> np.ndarray:
        """(k, 3) float64 unit normals of the land, upwards."""
        east, north = self.slopes(part).T
        return _unit(np.stack([-east, -north, np.ones(len(east))], -1))

    def texture_upwards(self, part: slice) -> np.ndarray:
        """(k, 2) float64 places in a picture of the map, from 0 to 1: to the right and up."""
        return self.texture_places(part) * [1, -1] + [0, 1]

    def texture_places(self, part: slice) -> np.ndarray:
        """(k, 2) float64 places in a picture of the map, from 0 to 1: to the right and down."""
        return (self.posts[part] + 0.5) / self.heights.shape[::-1]

    @property
    def origin(self) -> dict[str, Any] | None:
        """How world metres become coordinates: `crs`, and for each axis coordinate = origin + scale · metres."""
        if self.place is None:
            return None
        x, y = self.place.to_map(0.0, 0.0)
        east, north = self.place.to_map(*self.spacing_m)
        scale = [(east - x) / self.spacing_m[0], (north - y) / self.spacing_m[1]]
        return {"crs": self.place.crs, "origin": [x, y], "scale": scale}

    @property
    def remarks(self) -> list[str]:
        """The origin as lines of ASCII text, for a comment in a file."""
        if not (origin := self.origin):
            return []
        x, y = origin["origin"]
        across, up = origin["scale"]
        crs = " ".join((origin["crs"] or "unknown").encode("ascii", "replace").decode().split())
        return [f"origin {x:.17g} {y:.17g}", f"scale {across:.17g} {up:.17g}", f"crs {crs}"]


class Format(NamedTuple):
    """A format of files of meshes."""

    pieces: Callable[[Mesh, str], Iterator[bytes]]  # the file's bytes, of a mesh and the file's name
    beside: tuple[str, ...] | None = None  # endings of further files with a texture; None if there are no textures
    passes: int = 1  # how often the vertices are written

    def count(self, mesh: Mesh) -> int:
        """The number of pieces of a file, without its header."""
        return self.passes * -(-len(mesh.posts) // CHUNK) + -(-len(mesh.faces) // CHUNK)


def _parts(n: int) -> Iterator[slice]:
    for first in range(0, n, CHUNK):
        yield slice(first, min(n, first + CHUNK))


def _unit(vectors: np.ndarray) -> np.ndarray:
    lengths: np.ndarray = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / lengths


# --- PLY --------------------------------------------------------------------------------------------------------------


def _ply(mesh: Mesh, name: str) -> Iterator[bytes]:
    """Binary little-endian PLY (Turk 1994), positions in double precision; s and t as in Blender and MeshLab, t up."""
    lines = ["ply", "format binary_little_endian 1.0", "comment metres: x east, y north, z up"]
    lines += [f"comment {remark}" for remark in mesh.remarks]
    lines += [f"comment TextureFile {_ascii(name)}.png"] if mesh.texture else []
    lines += [f"element vertex {len(mesh.posts)}", *(f"property double {axis}" for axis in "xyz")]
    lines += [f"property float {value}" for value in ("nx", "ny", "nz", "s", "t")]
    lines += [f"element face {len(mesh.faces)}", "property list uchar uint vertex_indices", "end_header\n"]
    yield "\n".join(lines).encode("ascii")
    for part in _parts(len(mesh.posts)):
        vertices = np.empty(part.stop - part.start, _VERTEX)
        vertices["place"] = mesh.world(part)
        vertices["normal"] = mesh.normals(part)
        vertices["texture"] = mesh.texture_upwards(part)
        yield vertices.tobytes()
    for part in _parts(len(mesh.faces)):
        faces = np.empty(part.stop - part.start, _FACE)
        faces["n"] = 3
        faces["vertices"] = mesh.faces[part]
        yield faces.tobytes()


def _ascii(name: str) -> str:
    return name.encode("ascii", "replace").decode()


# --- OBJ --------------------------------------------------------------------------------------------------------------


def _obj(mesh: Mesh, name: str) -> Iterator[bytes]:
    """Wavefront OBJ, three lines a vertex. Places and heights have 15 digits."""
    lines = ["# metres: x east, y north, z up", *(f"# {remark}" for remark in mesh.remarks)]
    lines += [f"mtllib {_ascii(name)}.mtl", "usemtl land"] if mesh.texture else []
    yield ("\n".join(lines) + "\n").encode("ascii")
    for part in _parts(len(mesh.posts)):
        rows = np.concatenate([mesh.world(part), mesh.texture_upwards(part), mesh.normals(part)], -1)
        lines_of = "v %.15g %.15g %.15g\nvt %.9g %.9g\nvn %.7g %.7g %.7g\n"
        yield (lines_of * len(rows) % tuple(rows.ravel().tolist())).encode("ascii")
    for part in _parts(len(mesh.faces)):
        faces = np.repeat(mesh.faces[part].astype(np.int64) + 1, 3, axis=1)
        yield ("f %d/%d/%d %d/%d/%d %d/%d/%d\n" * len(faces) % tuple(faces.ravel().tolist())).encode("ascii")


def material(name: str) -> bytes:
    """The material of an OBJ, without shading: the texture already includes light."""
    return f"newmtl land\nillum 0\nKd 1 1 1\nmap_Kd {_ascii(name)}.png\n".encode("ascii")


# --- glTF -------------------------------------------------------------------------------------------------------------


def _glb(mesh: Mesh, name: str) -> Iterator[bytes]:
    """Binary glTF 2.0 (Khronos 2021): y up, so that a world place (x, y, z) is stored as (x, z, -y)."""
    east, north = mesh.spacing_m
    corners = [_lattice(mesh, part) for part in _parts(len(mesh.posts))]
    box = [np.min([c.min(0) for c in corners], 0), np.max([c.max(0) for c in corners], 0)] if corners else [_ZERO] * 2
    node: dict[str, Any] = {"name": "terrain", "mesh": 0, "scale": [east, 1.0, north]}
    node["translation"] = [0.0, mesh.base_m, -north * (mesh.heights.shape[0] - 1)]
    extras = mesh.origin and mesh.origin | {"metres": "x east, y up, z south: coordinate = origin + scale (x, -z)"}
    yield gltf_head(len(mesh.posts), len(mesh.faces), box, node, mesh.texture, extras=extras)
    for of in (_lattice, _lattice_normals, Mesh.texture_places):
        for part in _parts(len(mesh.posts)):
            yield of(mesh, part).astype("<f4").tobytes()
    for part in _parts(len(mesh.faces)):
        yield mesh.faces[part].astype("<u4").tobytes()
    if mesh.texture:
        yield padded(mesh.texture)


def _lattice(mesh: Mesh, part: slice) -> np.ndarray:
    """(k, 3) float32 column, height above the base, and row; float32 holds 64ths of columns and rows exactly."""
    col, row = mesh.posts[part].T
    return np.stack([col, mesh.tops_m(part) - mesh.base_m, row], -1).astype("<f4")


def _lattice_normals(mesh: Mesh, part: slice) -> np.ndarray:
    """(k, 3) normals that the node's scale turns into the normals of the land."""
    east, north = mesh.spacing_m
    x, y, z = mesh.normals(part).T
    return _unit(np.stack([east * x, z, -north * y], -1))


def padded(data: bytes) -> bytes:
    """Bytes with zeros up to a multiple of 4, as parts of a binary glTF must have."""
    return data + b"\0" * (-len(data) % 4)


def gltf_head(
    vertices: int,
    faces: int,
    box: Sequence[np.ndarray],
    node: dict[str, Any],
    picture: bytes | None,
    has_places: bool = True,
    extras: dict[str, Any] | None = None,
) -> bytes:
    """All of a binary glTF before its data: places, normals, places in the picture (if any), faces, padded picture.

    The picture already includes light, so it is shown without shading.
    """
    widths = {"POSITION": 3, "NORMAL": 3} | ({"TEXCOORD_0": 2} if has_places else {})
    sizes = [4 * width * vertices for width in widths.values()] + [12 * faces]
    starts = np.cumsum([0, *sizes]).tolist()
    total = starts[-1] + len(padded(picture or b""))
    targets = [_VERTICES] * len(widths) + [_FACES]
    views: list[dict[str, Any]] = [
        {"buffer": 0, "byteOffset": start, "byteLength": size, "target": target}
        for start, size, target in zip(starts, sizes, targets, strict=False)
    ]
    accessors: list[dict[str, Any]] = [
        {"bufferView": i, "componentType": 5126, "count": vertices, "type": f"VEC{width}"}
        for i, width in enumerate(widths.values())
    ]
    accessors[0] |= {"min": box[0].tolist(), "max": box[1].tolist()}
    accessors.append({"bufferView": len(widths), "componentType": 5125, "count": 3 * faces, "type": "SCALAR"})
    attributes = {name: i for i, name in enumerate(widths)}
    rough: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    material: dict[str, Any] = {"pbrMetallicRoughness": rough}
    gltf: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "terrain-gl"} | ({"extras": extras} if extras else {}),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": len(widths), "material": 0}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": total}],
        "materials": [material],
    }
    if picture:
        kind = "image/png" if picture.startswith(b"\x89PNG") else "image/jpeg"
        views.append({"buffer": 0, "byteOffset": starts[-1], "byteLength": len(picture)})
        rough["baseColorTexture"] = {"index": 0}
        material["extensions"] = {"KHR_materials_unlit": {}}
        gltf |= {
            "extensionsUsed": ["KHR_materials_unlit"],
            "textures": [{"source": 0, "sampler": 0}],
            "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
            "images": [{"bufferView": len(views) - 1, "mimeType": kind}],
        }
    else:
        rough["baseColorFactor"] = [0.55, 0.5, 0.42, 1.0]
    text = json.dumps(gltf, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    whole = 12 + 8 + len(text) + 8 + total
    if whole > GLB_LIMIT:
        raise TerrainError(f"{faces} triangles are more than a .glb file holds: write .ply, or weld them")
    head = struct.pack("<4sIIII", b"glTF", 2, whole, len(text), 0x4E4F534A)  # "JSON"
    return head + text + struct.pack("<II", total, 0x004E4942)  # "BIN"


# --- STL --------------------------------------------------------------------------------------------------------------


def _stl(mesh: Mesh, name: str) -> Iterator[bytes]:
    """Binary STL (3D Systems 1989) of a solid in millimetres: the land, walls along its rim, and a level base."""
    mesh = shared(mesh)
    top = _millimetres(mesh)
    n = len(top)
    bottom = top * [1, 1, 0]
    corners = np.concatenate([top, bottom])
    rim = rim_of(mesh.faces.astype(np.int64))
    a, b = rim.T
    walls = np.concatenate([np.stack([a, a + n, b + n], -1), np.stack([a, b + n, b], -1)])
    faces = np.concatenate([mesh.faces.astype(np.int64), walls, mesh.faces[:, ::-1].astype(np.int64) + n])
    yield f"solid in mm, {mesh.print_mm:g} mm the longer side".encode("ascii").ljust(80) + struct.pack("<I", len(faces))
    for part in _parts(len(faces)):
        triangles = np.zeros(part.stop - part.start, STL)
        triangles["corners"] = corners[faces[part]]
        a, b, c = (triangles["corners"][:, i].astype(np.float64) for i in range(3))
        triangles["normal"] = _unit(np.cross(b - a, c - a))
        yield triangles.tobytes()


def shared(mesh: Mesh) -> Mesh:
    """The mesh with shared vertices: only one at each place."""
    posts, first, number = np.unique(mesh.posts, axis=0, return_index=True, return_inverse=True)
    vertices_m = None if mesh.vertices_m is None else mesh.vertices_m[first]
    return replace(mesh, posts=posts, faces=number.reshape(-1)[mesh.faces].astype("u4"), vertices_m=vertices_m)


def _millimetres(mesh: Mesh) -> np.ndarray:
    """(n, 3) float32 places of a solid's top, its base at height 0. `UsageError` if the land reaches below the base."""
    world = np.concatenate([mesh.world(part) for part in _parts(len(mesh.posts))])
    lowest = world.min(0)
    scale = mesh.print_mm / (world - lowest)[:, :2].max()
    if mesh.bottom_m is None:
        return ((world - lowest) * scale + [0, 0, BASE * mesh.print_mm]).astype("f4")
    if mesh.bottom_m >= lowest[2]:
        raise UsageError(f"--base-m must be below the lowest height, {lowest[2]:g} m, got {mesh.bottom_m:g}")
    return ((world - [*lowest[:2], mesh.bottom_m]) * scale).astype("f4")


def with_whole_rim(mesh: Mesh) -> Mesh:
    """The mesh with every post of the map's rim as a vertex, so that the meshes of two neighbouring maps meet exactly.

    An edge on the rim is divided at its posts, and its triangle becomes a fan. If heights of the mesh are off by at
    most E, those of the result are off by at most 2 E: a place moves by no more than the rim beside it.
    """
    mesh = shared(mesh)
    posts, faces = mesh.posts, mesh.faces.astype(np.int64)
    last = np.array(mesh.heights.shape[::-1]) - 1
    for axis, value in ((0, 0), (0, last[0]), (1, 0), (1, last[1])):
        along = posts[:, 1 - axis]
        is_on = (posts[:, axis] == value)[faces]
        of_rim = is_on.sum(1) == 2
        fans: list[tuple[int, int, int]] = []
        more = [posts]
        count = len(posts)
        for face, on in zip(faces[of_rim], is_on[of_rim], strict=True):
            a, b, apex = np.roll(face, -int(np.flatnonzero(~on)[0]) - 1)
            low, high = sorted((along[a], along[b]))
            between = np.arange(np.floor(low) + 1, np.ceil(high))
            between = between if along[a] < along[b] else between[::-1]
            added = np.full((len(between), 2), float(value))
            added[:, 1 - axis] = between
            chain = [a, *range(count, count + len(added)), b]
            more.append(added)
            count += len(added)
            fans += [(one, two, apex) for one, two in zip(chain, chain[1:], strict=False)]
        posts = np.concatenate(more)
        faces = np.concatenate([faces[~of_rim], np.array(fans, np.int64).reshape(-1, 3)])
    new_m = vertex_heights(mesh.heights, posts[len(mesh.posts) :])
    vertices_m = None if mesh.vertices_m is None else np.concatenate([mesh.vertices_m, new_m])
    return replace(mesh, posts=posts, faces=faces.astype("u4"), vertices_m=vertices_m)


def rim_of(faces: np.ndarray) -> np.ndarray:
    """(k, 2) edges that belong to only one face, in the direction of that face."""
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    n = int(faces.max()) + 1
    return edges[~np.isin(edges @ [n, 1], edges @ [1, n])]


FORMATS = {
    ".ply": Format(_ply, (".png",)),
    ".glb": Format(_glb, (), passes=3),
    ".obj": Format(_obj, (".png", ".mtl")),
    ".stl": Format(_stl, passes=0),
}
