"""Check a triangle mesh of any program against a heightmap: `check`, the function behind `terrain-gl check`."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.limits import is_too_large
from ..camera import Camera, boxes_in_picture
from ..camera.camera import screen_shift_px
from ..gpu.layout import PLACES
from ..heightmap import Heightmap, bilinear
from ..verify.check import Measure, MeshError, check_mesh
from ..verify.seams import Seams, find_seams, is_closed
from .mesh_readers import read_mesh, welded
from .tile_system import TileSystem
from .tilesets import divided

_BLOCK = 64  # cells along a side of the parts of the map that are looked at more closely
_LARGE_PX = 1.0  # a cell of this width in the picture, at least, is large


@dataclass(frozen=True)
class Checked:
    """What `check` finds."""

    error: MeshError  # in metres
    seams: Seams
    triangles: int
    flipped: int  # triangles that are seen from below
    vertical: int  # triangles without an area on the map, as those of walls and skirts; they are not compared
    error_px: MeshError | None = None  # with a camera: in pixels, where the true place is in the picture

    def record(self, heightmap: Heightmap) -> dict[str, Any]:
        """The numbers of docs/stats.md."""
        col, row = self.error.place
        east, north = heightmap.spacing_m
        found: dict[str, Any] = {
            "triangles": self.triangles,
            "max_error_posts_m": self.error.posts,
            "rms_error_posts_m": self.error.posts_rms,
            "max_error_surface_m": self.error.surface,
            "rms_error_surface_m": self.error.surface_rms,
            "place_m": [col * east, (heightmap.rows - 1 - row) * north],
            "covered": self.error.covered,
            "posts_covered": self.error.posts_covered,
            "overlap": self.error.overlap,
            "flipped": self.flipped,
            "vertical": self.vertical,
            "gaps_cells": self.seams.gaps,
            "t_junctions": self.seams.t_junctions,
            "largest_crack_m": self.seams.largest_crack_m,
        }
        if self.error_px:
            found |= {"max_error_posts_px": self.error_px.posts, "max_error_surface_px": self.error_px.surface}
        return found


def check(
    mesh: str | os.PathLike[str] | tuple[np.ndarray, np.ndarray],
    heightmap: Heightmap,
    camera: Camera | None = None,
    size: tuple[int, int] = (1280, 720),
    origin: tuple[float, ...] = (0.0, 0.0, 0.0),
    unit_m: float = 1.0,
    crs: str | None = None,
) -> Checked:
    """Compare a mesh with a heightmap, exactly: its largest and root mean square error, and where it is torn.

    Parameters
    ----------
    mesh
        A file (.ply, .glb, .gltf, .obj, .stl), or vertices (n, 3) and faces (m, 3).
    heightmap
        The map. Its world metres are x east and y north of the south-western post, and z up.
    camera, size
        With a camera, errors are also measured in pixels in its picture of `size`.
    origin, unit_m
        World metres = origin + unit_m · the mesh's numbers.
    crs
        With it, these are coordinates of this system, such as EPSG:32632, or EPSG:4978 with x, y, z from the Earth's
        middle, not world metres. Triangles are flat there.

    Returns
    -------
    Checked
        Errors at posts, and over the surface, which is bilinear between posts.

    Raises
    ------
    TerrainError, UsageError
        The mesh cannot be read, or lies beside the map; the map is too large for memory.
    """
    if is_too_large(heightmap.rows, heightmap.cols):
        raise UsageError(f"{heightmap.name}: has too many posts to be checked in memory")
    places, faces = welded(*mesh) if isinstance(mesh, tuple) else read_mesh(mesh)
    places = places * unit_m + np.resize([*origin, 0.0], 3)
    system = TileSystem(heightmap, crs)
    posts, tops_m = system.to_map(places)
    if not np.isfinite(posts).all():
        raise TerrainError(f"{heightmap.name}: places of the mesh have no coordinates in the map's system")
    a, b, c = np.moveaxis(posts[faces], 1, 0)
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]  # rows count to the south
    is_solid = (turn > 0).any() and is_closed(faces, len(posts))  # then its top is the land
    used = faces[turn < 0 if is_solid else turn != 0]
    seams = find_seams(posts, tops_m, used, (heightmap.rows, heightmap.cols))
    heights = heightmap.part(slice(0, heightmap.rows), slice(0, heightmap.cols))
    error = check_mesh(heights, posts, tops_m, used)
    if not system.is_local:  # between vertices, a triangle is flat in its own system
        longest_m = np.linalg.norm(np.ptp(places[used], 1), axis=1).max()
        corners = divided(system, places[used], max(error.posts, system.sag_m(longest_m)))
        posts, tops_m = system.to_map(corners.reshape(-1, 3))
        used = np.arange(len(posts)).reshape(-1, 3)
        error = check_mesh(heights, posts, tops_m, used)
    if not error.posts_covered and not error.covered:
        told = "give its place with --origin, --unit or --crs"
        raise TerrainError(f"{heightmap.name}: the mesh lies beside the map: {told}")
    in_px = None
    if camera:
        seen = replace(camera, bend_per_m=heightmap.bend_per_m("auto", 0.0))
        in_px = check_mesh(heights, posts, tops_m, used, _pixels(seen, heightmap, size))
        for found in _inside_cells(heights, posts, tops_m, used, heightmap, seen, size):
            if found.surface > in_px.surface:
                in_px = replace(in_px, surface=found.surface, place=found.place)
    return Checked(error, seams, len(faces), 0 if is_solid else int((turn > 0).sum()), int((turn == 0).sum()), in_px)


def _pixels(
    camera: Camera, heightmap: Heightmap, size: tuple[int, int], corner: tuple[int, int] = (0, 0), posts: int = 1
) -> Measure:
    """Errors in pixels: the exact distance on the screen between the true place and the drawn one.

    Columns and rows count from `corner`, `posts` for each of the map's.
    """
    east, north = heightmap.spacing_m

    def px(col: np.ndarray, row: np.ndarray, truth_m: np.ndarray, drawn_m: np.ndarray) -> np.ndarray:
        col, row, known = corner[0] + col / posts, corner[1] + row / posts, np.nan_to_num(truth_m)
        points = np.stack([col * east, (heightmap.rows - 1 - row) * north, known], -1)
        shift, seen = screen_shift_px(camera, size, points, drawn_m - known, 1e-3)
        return np.where(seen, shift, 0.0)

    return px


def _inside_cells(
    heights: np.ndarray,
    posts: np.ndarray,
    tops_m: np.ndarray,
    faces: np.ndarray,
    heightmap: Heightmap,
    camera: Camera,
    size: tuple[int, int],
) -> Iterator[MeshError]:
    """Errors in pixels also at places inside cells, where these are large in the picture.

    There, a metre is not equally many pixels within a cell. The largest error in pixels may then lie inside it. So the
    map gets `PLACES` times the posts: its surface stays the same.
    """
    east, north = heightmap.spacing_m
    corners = posts[faces]
    low, high = corners.min(1), corners.max(1)
    for row, col in (
        (y, x) for y in range(0, heightmap.rows - 1, _BLOCK) for x in range(0, heightmap.cols - 1, _BLOCK)
    ):
        part = heights[row : row + _BLOCK + 1, col : col + _BLOCK + 1]
        last = np.array(part.shape[::-1]) - 1
        land_m = [np.nanmin(part, initial=np.inf), np.nanmax(part, initial=-np.inf)]
        x, y = col * east + np.array([0, last[0]]) * east, (heightmap.rows - 1 - row - np.array([last[1], 0])) * north
        box = np.stack([x, y, land_m], -1)
        if land_m[0] > land_m[1] or not boxes_in_picture(camera, size, 1e-3, box[:1].copy(), box[1:].copy())[0]:
            continue
        away_m = np.linalg.norm(np.clip(camera.eye, *box) - camera.eye)
        if not camera.is_orthographic and camera.focal_px(size[1]) * max(east, north) < _LARGE_PX * away_m:
            continue
        here = ((high >= [col, row]) & (low <= last + [col, row])).all(1)
        at = np.meshgrid(*(np.arange(PLACES * n + 1) / PLACES for n in last))
        fine = bilinear(part, *at)
        measure = _pixels(camera, heightmap, size, (col, row), PLACES)
        found = check_mesh(fine, (posts - [col, row]) * PLACES, tops_m, faces[here], measure)
        yield replace(found, place=(found.place[0] / PLACES + col, found.place[1] / PLACES + row))
