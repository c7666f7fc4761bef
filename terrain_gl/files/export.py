"""Triangle meshes for files: indexed vertices with normals and texture places, as PLY, glTF, OBJ, STL or HTML.

Vertices are on posts, or on 64ths between posts where cells are cut, so columns and rows are exact. Only where voids
are cut out, they are rounded. Heights are those of the map, in float64. The formats are in `files/mesh_formats.py` and
`files/page.py`.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.limits import is_too_large
from ..basics.replacing import replacing
from ..heightmap import Heightmap
from ..mesh import vertex_heights
from ..readers.place import Place
from .cutting import cut_voids
from .mesh_formats import FORMATS as OF_FILES
from .mesh_formats import Format, Mesh, material, with_whole_rim
from .page import land_page

__all__ = ["FORMATS", "Mesh", "files_beside", "land_mesh", "make_mesh", "mesh_format", "with_whole_rim", "write_mesh"]

FORMATS = OF_FILES | {".html": Format(land_page, (), passes=0)}


def land_mesh(
    heightmap: Heightmap, triangles: np.ndarray, heights: np.ndarray, voids: str = "fill", weld: bool = True
) -> Mesh:
    """Mesh of the triangles of a frame: see `make_mesh`. Voids are left out if `voids` is "hole", not if it is "fill".

    Raises
    ------
    TerrainError, UsageError
        No triangle is left without voids; or the map is too large to look for all its voids.
    """
    void = None
    if voids == "hole" and heightmap.voids:
        if is_too_large(heightmap.rows, heightmap.cols):
            raise UsageError(f"{heightmap.name}: has too many posts to cut its voids out of a mesh: drop --voids hole")
        void = np.isnan(heightmap.part(slice(0, heightmap.rows), slice(0, heightmap.cols)))
    mesh = make_mesh(triangles, heights, heightmap.spacing_m, weld, heightmap.place, void)
    if not len(mesh.faces):
        raise TerrainError(f"{heightmap.name}: no triangles without voids: drop --voids hole")
    return mesh


def make_mesh(
    triangles: np.ndarray,
    heights: np.ndarray,
    spacing_m: tuple[float, float],
    weld: bool = True,
    place: Place | None = None,
    void: np.ndarray | None = None,
) -> Mesh:
    """Mesh of captured triangles. With `weld`, triangles share vertices; without `weld`, each has three of its own.

    Parameters
    ----------
    triangles
        (m, 3, 2) columns and rows.
    heights
        (rows, cols) float32 metres. Voids must be filled, because vertices may be on them.
    place
        Where the map lies; it is recorded in the file.
    void
        (rows, cols) bool: posts whose cells are left out. See `files.cutting`.
    """
    posts = triangles.reshape(-1, 2)
    if not weld and void is None:
        return Mesh(posts, np.arange(len(posts), dtype="u4").reshape(-1, 3), heights, spacing_m, place)
    places = np.rint(64 * posts).astype(np.int64)  # vertices are on 64ths between posts
    used, number = np.unique(places[:, 1] << 32 | places[:, 0], return_inverse=True)
    shared = np.stack([used & 0xFFFFFFFF, used >> 32], -1) / 64
    faces = number.astype("u4").reshape(-1, 3)
    if void is None:
        return Mesh(shared, faces, heights, spacing_m, place)
    cut = cut_voids(shared, faces, vertex_heights(heights, shared), void)
    left = cut.faces.reshape(-1)
    used, number = np.unique(left, return_inverse=True) if weld else (left, np.arange(len(left)))
    faces = number.astype("u4").reshape(-1, 3)
    return Mesh(cut.posts[used], faces, heights, spacing_m, place, vertices_m=cut.heights_m[used])


def write_mesh(path: str | os.PathLike[str], mesh: Mesh, progress: Callable[[float], None] | None = None) -> None:
    """Write a mesh; the ending of the name, one of `FORMATS`, is its format. The file appears only when it is complete.

    The texture is inside a .glb or .html file; beside a .ply or .obj it is a file of its own, `files_beside`.

    Raises
    ------
    TerrainError, UsageError
        The file cannot be written, the format is unknown, or the mesh or its texture does not fit into it.
    """
    path = Path(path)
    form = mesh_format(path)
    for beside in files_beside(path) if mesh.texture else []:
        with replacing(beside) as part:
            part.write_bytes(material(path.stem) if beside.suffix == ".mtl" else mesh.texture or b"")
    total = form.count(mesh)
    with replacing(path) as part, open(part, "wb") as file:
        for done, piece in enumerate(form.pieces(mesh, path.stem)):
            file.write(piece)
            if progress:
                progress(min(1.0, done / max(total, 1)))


def mesh_format(path: str | os.PathLike[str]) -> Format:
    """The format for the ending of a file's name."""
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in FORMATS:
        raise UsageError(f"{os.fspath(path)}: a mesh file's name must end in one of {', '.join(FORMATS)}")
    return FORMATS[ending]


def files_beside(path: str | os.PathLike[str]) -> list[Path]:
    """Further files that a mesh with a texture needs beside its own; `UsageError` if the format has no texture."""
    beside = mesh_format(path).beside
    if beside is None:
        textured = ", ".join(ending for ending, form in FORMATS.items() if form.beside is not None)
        raise UsageError(f"{os.fspath(path)}: has no texture: write one of {textured}")
    return [Path(path).with_suffix(ending) for ending in beside]
