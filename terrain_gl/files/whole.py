"""The whole map as few triangles: a mesh by `pydelatin`, whose error is then checked.

pydelatin inserts the post with the largest error into a Delaunay triangulation, until no error is above the tolerance
(Garland and Heckbert 1995, "Fast polygonal approximation of terrains and height fields"). It looks at posts alone, and
in float32. So `verify.check` measures each mesh again. Between posts the surface is bilinear, and any mesh of posts is
off there, even a mesh of every post: by at most |twist| / 4 of a cell, with the mean square twist² / 90.
"""

from typing import NamedTuple

import numpy as np

from ..basics.exceptions import NotInstalledError, UsageError
from ..basics.limits import is_too_large
from ..heightmap import Heightmap
from ..terrain.filling import fill_voids
from ..verify.check import MeshError, check_mesh

_SLACKS = 1, 4, 16, 64  # meshes that are tried before every post becomes a vertex: digits below the tolerance


class WholeMesh(NamedTuple):
    """A mesh of a whole map. Its vertices are posts."""

    posts: np.ndarray  # (n, 2) columns and rows of the vertices
    faces: np.ndarray  # (m, 3) indices of vertices, counter-clockwise from above
    filled: np.ndarray  # (rows, cols) float32 metres: the map with voids filled
    error: MeshError
    of_every_post: tuple[float, float]  # largest and root mean square error over the surface of a mesh of every post

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3, 2) columns and rows of the corners."""
        return self.posts[self.faces].astype(np.float64)

    def checked(self, heightmap: Heightmap, posts: np.ndarray, tops_m: np.ndarray, faces: np.ndarray) -> "WholeMesh":
        """The same with the triangles that were made of it."""
        heights = heightmap.part(slice(0, heightmap.rows), slice(0, heightmap.cols))
        return self._replace(posts=posts, faces=faces, error=check_mesh(heights, posts, tops_m, faces))

    @property
    def stats(self) -> dict[str, float]:
        """The numbers of docs/stats.md."""
        largest_m, rms_m = self.of_every_post
        return {
            "triangles": len(self.faces),
            "max_error_posts_m": self.error.posts,
            "rms_error_posts_m": self.error.posts_rms,
            "max_error_surface_m": self.error.surface,
            "rms_error_surface_m": self.error.surface_rms,
            "every_post_max_error_surface_m": largest_m,
            "every_post_rms_error_surface_m": rms_m,
        }


def whole_mesh(heightmap: Heightmap, max_error_m: float) -> WholeMesh:
    """A mesh whose height is within `max_error_m` metres of the map's at all posts. Over voids it has no bound.

    Raises
    ------
    NotInstalledError, UsageError
        pydelatin is not installed; the map is too large to be held in memory.
    """
    rows, cols = heightmap.rows, heightmap.cols
    if is_too_large(rows, cols):
        raise UsageError(f"{heightmap.name}: has {cols} x {rows} posts, too many for memory: give --between")
    heights = heightmap.part(slice(0, rows), slice(0, cols))
    filled = fill_voids(heights)
    digit_m = float(np.spacing(filled.max() - filled.min()))  # of pydelatin's heights
    for slack in _SLACKS:
        posts, faces = delaunay(filled, max(0.0, max_error_m - slack * digit_m))
        error = check_mesh(heights, posts, filled[posts[:, 1], posts[:, 0]], faces)
        if error.posts <= max_error_m:
            break
    else:
        posts, faces = _every_post(rows, cols)
        error = check_mesh(heights, posts, filled[posts[:, 1], posts[:, 0]], faces)
    return WholeMesh(posts, faces, filled, error, _error_of_every_post(heights))


def delaunay(filled: np.ndarray, tolerance_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces by pydelatin. Heights are above the map's base, so that float32 is more exact."""
    try:
        from pydelatin import Delatin
    except ImportError as error:
        raise NotInstalledError("a mesh of the whole map without --between, or its tiles", "mesh", error) from None
    mesh = Delatin(filled - filled.min(), max_error=tolerance_m)
    col, up = mesh.vertices[:, :2].astype(np.int64).T
    return np.stack([col, len(filled) - 1 - up], -1), mesh.triangles  # its rows count from the south


def _every_post(rows: int, cols: int) -> tuple[np.ndarray, np.ndarray]:
    """Two triangles a cell."""
    number = np.arange(rows * cols, dtype="u4").reshape(rows, cols)
    nw, ne, sw, se = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    faces = np.stack([nw, sw, se, nw, se, ne], -1).reshape(-1, 3)
    return np.stack([number % cols, number // cols], -1).reshape(-1, 2).astype(np.int64), faces


def _error_of_every_post(heights: np.ndarray) -> tuple[float, float]:
    """Largest and root mean square error over the surface of a mesh of every post, with any diagonals."""
    tall = heights.astype(np.float64)
    twist = np.abs(tall[:-1, :-1] - tall[:-1, 1:] - tall[1:, :-1] + tall[1:, 1:])
    twist = twist[np.isfinite(twist)]
    if not len(twist):
        return 0.0, 0.0
    return float(twist.max()) / 4, float(np.sqrt(np.square(twist).mean() / 90))
