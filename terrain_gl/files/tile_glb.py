"""The file of one tile: binary glTF 2.0 (Khronos 2021), y up, so that a place (x, y, z) is stored as (x, z, -y)."""

import json
import struct

import numpy as np

_GROUND = {
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0, "baseColorFactor": [0.55, 0.5, 0.42, 1.0]}
}
_FLOATS, _NUMBERS = 5126, 5125  # types of components
_VERTICES, _FACES = 34962, 34963  # targets of buffer views


def tile_glb(places: np.ndarray, normals: np.ndarray, faces: np.ndarray) -> bytes:
    """The bytes of a mesh: (n, 3) float32 places, (n, 3) unit normals, (m, 3) indices."""
    stored = [_y_up(places), _y_up(normals), faces.astype("<u4")]
    sizes = [each.nbytes for each in stored]
    starts = np.cumsum([0, *sizes]).tolist()
    of_vertices = {"componentType": _FLOATS, "count": len(places), "type": "VEC3"}
    text = json.dumps(
        {
            "asset": {"version": "2.0", "generator": "terrain-gl"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}]}],
            "materials": [_GROUND],
            "accessors": [
                {"bufferView": 0, "min": stored[0].min(0).tolist(), "max": stored[0].max(0).tolist()} | of_vertices,
                {"bufferView": 1} | of_vertices,
                {"bufferView": 2, "componentType": _NUMBERS, "count": faces.size, "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": start, "byteLength": size, "target": target}
                for start, size, target in zip(starts, sizes, (_VERTICES, _VERTICES, _FACES), strict=False)
            ],
            "buffers": [{"byteLength": sum(sizes)}],
        },
        separators=(",", ":"),
    ).encode("ascii")
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + sum(sizes)
    head = struct.pack("<4sIIII", b"glTF", 2, total, len(text), 0x4E4F534A)  # "JSON"
    return head + text + struct.pack("<II", sum(sizes), 0x004E4942) + b"".join(each.tobytes() for each in stored)


def _y_up(vectors: np.ndarray) -> np.ndarray:
    x, y, z = vectors.T
    return np.stack([x, z, -y], -1).astype("<f4")
