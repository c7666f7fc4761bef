"""Read triangle meshes of other programs: PLY, glTF (.glb, .gltf), OBJ, STL, as vertices (x, y, z up) and faces."""

import base64
import json
import os
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from .mesh_formats import STL

_PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_PLY_TYPES |= {"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"}
_PLY_TYPES |= {f"{kind}{8 * size}": f"{kind[0]}{size}" for kind in ("int", "uint") for size in (1, 2, 4)}
_GLTF_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


def read_mesh(path: str | os.PathLike[str]) -> tuple[np.ndarray, np.ndarray]:
    """Read a mesh: its places (n, 3), and its faces, which are indices of places. Equal places become one.

    Raises
    ------
    TerrainError, UsageError
        The file is missing or cannot be read, or its ending is of no format that is read.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None and not path.exists():
        raise TerrainError(f"{path}: there is no such file or folder")
    if reader is None:
        raise UsageError(f"{path}: a mesh to read must end in one of {', '.join(READERS)}")
    try:
        places, faces = reader(path)
    except OSError as error:
        raise TerrainError(f"{path}: {error.strerror or error}") from None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        raise TerrainError(f"{path}: is damaged, or no such mesh ({error})") from None
    if not len(faces):
        raise TerrainError(f"{path}: has no triangles")
    if faces.min() < 0 or faces.max() >= len(places) or not np.isfinite(places[faces]).all():
        raise TerrainError(f"{path}: is damaged: a face names a vertex that is missing or not finite")
    return welded(places, faces)


def welded(places: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same triangles; vertices at the same place become one."""
    number = np.zeros(len(places), np.int64)
    for column in places.T:  # sorting numbers is many times faster than sorting rows
        number = np.unique(number * len(places) + np.unique(column, return_inverse=True)[1], return_inverse=True)[1]
    shared = np.empty((number.max(initial=-1) + 1, 3))
    shared[number] = places
    return shared, number[faces]


def _ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """PLY (Turk 1994): binary of both byte orders, or ASCII; faces of more corners, as quads, become fans."""
    head, found, body = path.read_bytes().partition(b"end_header\n")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    if not found or lines[0] != ["ply"]:
        raise ValueError("no PLY header")
    form = next(line[1] for line in lines if line[0] == "format")
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in lines:
        if line[0] == "element":
            elements.append((line[1], int(line[2]), []))
        elif line[0] == "property":
            elements[-1][2].append(line[1:])
    order = ">" if form == "binary_big_endian" else "<"
    words = iter(np.array(body.split(), np.float64)) if form == "ascii" else None
    places, faces, at = np.zeros((0, 3)), np.zeros((0, 3), np.int64), 0
    for name, count, properties in elements:
        names = [each[-1] for each in properties]
        if all(each[0] != "list" for each in properties):
            if words is not None:
                rows = np.fromiter(words, np.float64, count * len(names)).reshape(count, -1)
                columns = {key: rows[:, i] for i, key in enumerate(names)}
            else:
                record = np.dtype(
                    [(key, order + _PLY_TYPES[each[0]]) for key, each in zip(names, properties, strict=True)]
                )
                table = np.frombuffer(body, record, count, at)
                at += count * record.itemsize
                columns = {key: table[key] for key in names}
            if name == "vertex":
                places = np.stack([columns[axis] for axis in "xyz"], -1).astype(np.float64)
        elif words is not None:
            fans = []
            for _ in range(count):
                corners = [int(next(words)) for _ in range(int(next(words)))]
                fans += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:], strict=False)]
            faces = np.array(fans, np.int64).reshape(-1, 3)
        else:
            if len(properties) > 1:
                raise ValueError("faces with more than their vertices are not read")
            of_count, of_index = (np.dtype(order + _PLY_TYPES[kind]) for kind in properties[0][1:3])
            most = int(np.frombuffer(body, of_count, 1, at)[0]) if count else 3
            record = np.dtype([("n", of_count), ("corners", of_index, (most,))])
            table = np.frombuffer(body, record, count, at)
            if (table["n"] != most).any():
                raise ValueError("faces of different numbers of corners are not read from binary files")
            at += count * record.itemsize
            parts = [table["corners"][:, [0, i, i + 1]] for i in range(1, most - 1)]
            faces = np.concatenate(parts or [np.zeros((0, 3))]).astype(np.int64)
    return places, faces


def _obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Wavefront OBJ: vertices and faces; faces of more corners become fans."""
    places: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    with open(path, encoding="latin-1") as file:
        for line in file:
            kind, *words = line.split() or [""]
            if kind == "v":
                places.append([float(word) for word in words[:3]])
            elif kind == "f":
                numbers = [int(word.partition("/")[0]) for word in words]
                corners = [n - 1 if n > 0 else len(places) + n for n in numbers]
                faces += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:], strict=False)]
    return np.array(places).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)


def _stl(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """STL (3D Systems 1989), binary or ASCII."""
    data = path.read_bytes()
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        places = np.frombuffer(data, STL, offset=84)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        rows = [line.split()[1:4] for line in data.decode("ascii").splitlines() if line.strip().startswith("vertex")]
        places = np.array(rows, np.float64).reshape(-1, 3)
    return places, np.arange(len(places)).reshape(-1, 3)


def gltf_triangles(path: Path, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """GlTF 2.0 (Khronos 2021), also with KHR_mesh_quantization: all triangles of its scene, in world places, z up.

    `data` are the file's bytes; further files are beside `path`.
    """
    own = b""
    if data[:4] == b"glTF":
        length = struct.unpack_from("<I", data, 12)[0]
        head, own = json.loads(data[20 : 20 + length]), data[28 + length :]
    else:
        head = json.loads(data)
    if lacking := set(head.get("extensionsRequired", [])) - {"KHR_mesh_quantization", "KHR_texture_transform"}:
        raise ValueError(f"needs {', '.join(sorted(lacking))}")
    buffers = [own if "uri" not in buffer else _buffer(path, buffer["uri"]) for buffer in head.get("buffers", [])]

    def values(number: int) -> np.ndarray:
        accessor = head["accessors"][number]
        if "sparse" in accessor:
            raise ValueError("sparse accessors are not read")
        kind = np.dtype(_GLTF_TYPES[accessor["componentType"]])
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        view = head["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step = view.get("byteStride", width * kind.itemsize)
        record = np.dtype({"names": ["v"], "formats": [(kind, width)], "itemsize": step})
        count = accessor["count"]
        used = step * (count - 1) + width * kind.itemsize
        part = buffers[view["buffer"]][start : start + used]
        if len(part) < used:
            raise ValueError("the file is cut short")
        found = np.frombuffer(part.ljust(step * count, b"\0"), record, count)["v"]
        if accessor.get("normalized"):
            return np.maximum(found / np.float64(np.iinfo(kind).max), -1.0)
        return found

    places, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    waiting = [(number, np.eye(4)) for number in head["scenes"][head.get("scene", 0)]["nodes"]]
    while waiting:
        number, above = waiting.pop()
        node = head["nodes"][number]
        world = above @ _matrix(node)
        waiting += [(child, world) for child in node.get("children", [])]
        for primitive in head["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            if primitive.get("mode", 4) != 4:
                continue
            at = values(primitive["attributes"]["POSITION"]).astype(np.float64)
            corners = values(primitive["indices"]) if "indices" in primitive else np.arange(len(at))
            x, y, z = (at @ world[:3, :3].T + world[:3, 3]).T
            places.append(np.stack([x, -z, y], -1))
            faces.append(corners.reshape(-1, 3).astype(np.int64) + count)
            count += len(at)
    return np.concatenate(places), np.concatenate(faces)


def _buffer(path: Path, uri: str) -> bytes:
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return (path.parent / name_below(uri)).read_bytes()


def name_below(uri: str) -> str:
    """The name of a file that a URI gives: in the folder of the file that has it, or below."""
    name = unquote(uri)
    if ":" in name or Path(name).is_absolute() or ".." in Path(name).parts:
        raise ValueError(f"{uri:.60} lies elsewhere")
    return name


def _matrix(node: dict[str, Any]) -> np.ndarray:
    """(4, 4) transformation of a node: its matrix, or its scale, rotation and translation."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _gltf(path: Path) -> tuple[np.ndarray, np.ndarray]:
    return gltf_triangles(path, path.read_bytes())


READERS = {".ply": _ply, ".glb": _gltf, ".gltf": _gltf, ".obj": _obj, ".stl": _stl}
