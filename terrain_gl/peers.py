"""Other programs beside ours on one map: triangulations within metres of it, and a dense picture of it.

Their meshes are put to one test that knows nothing of how they were made, `largest_error_m`. Every peer is optional
(pip install 'terrain-gl[bench]'); those that are not there are named.

- pydelatin: a Delaunay mesh refined where it is worst (Garland, Heckbert 1995). It holds its promise.
- pymartini: right-angled triangles, halved (Evans, Kirkpatrick, Townsend 2001). It looks at the midpoints of their
  longest edges only, so that its true error is above the one asked for.
- pyvista: VTK, drawing every post.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from .camera import Camera
from .heightmap import Heightmap
from .mesh import captured_triangles
from .renderer import Renderer
from .terrain import fill_voids

SHARES = (0.003, 0.01, 0.03)  # tolerances, as shares of the relief
CHUNK = 1 << 17  # triangles that are compared with the map at a time


class Peer(NamedTuple):
    """A way to triangulate a map.

    Attributes
    ----------
    remesh
        From metres to a mesh: what is to be done for every new tolerance, and timed.
    triangles
        From that mesh to (n, 3, 2) columns and rows of posts.
    """

    remesh: Callable[[float], Any]
    triangles: Callable[[Any], np.ndarray]


def square_of(heightmap: Heightmap, posts: int = 1025) -> Heightmap:
    """The middle of a map as everyone can take it: without voids, 2^n + 1 posts a side, at most `posts`."""
    side = 1 << (min(posts, heightmap.rows, heightmap.cols) - 1).bit_length() - 1
    row, col = (heightmap.rows - 1 - side) // 2, (heightmap.cols - 1 - side) // 2
    filled = fill_voids(heightmap.heights)[row : row + side + 1, col : col + side + 1]
    return Heightmap(filled, heightmap.spacing_m, heightmap.name)


def compare(heightmap: Heightmap, size: tuple[int, int], backend: str = "auto", repeats: int = 3) -> dict[str, Any]:
    """Everything of this module for the middle of a map: `compare_meshes` and `compare_frames` in one dict."""
    square = square_of(heightmap)
    low, high = square.range_m
    with Renderer(square, size, backend) as renderer:
        meshes = compare_meshes(renderer, [share * (high - low) for share in SHARES], repeats)
        frames = compare_frames(renderer, repeats)
    absent = meshes["absent"] + frames["absent"]
    return {"posts": square.heights.size} | meshes | frames | {"absent": absent}


def compare_meshes(renderer: Renderer, tolerances_m: Sequence[float], repeats: int = 3) -> dict[str, Any]:
    """Triangulate a map of `square_of` within each tolerance, by everyone there is.

    Returns
    -------
    dict
        `meshes`, an object for each tolerance and program, and `absent`, a line for each that is not there:
        docs/stats.md.
    """
    heights = renderer.heightmap.heights
    ours, peers, absent = _ours(renderer), {}, []
    for name, make in (("pydelatin", _delatin), ("pymartini", _martini)):
        try:
            peers[name] = make(heights)
        except ImportError as error:
            absent.append(f"{name} is left out: {error}")
    meshes = []
    for tolerance_m in tolerances_m:
        own = _mesh("terrain-gl", ours, heights, tolerance_m, repeats)
        others = [_mesh(name, peer, heights, tolerance_m, repeats) for name, peer in peers.items()]
        meshes += [own, *(mesh | _beside(renderer, own, mesh) for mesh in others)]
    return {"meshes": meshes, "absent": absent}


def _mesh(name: str, peer: Peer, heights: np.ndarray, tolerance_m: float, repeats: int) -> dict[str, Any]:
    """What a program makes of a tolerance, and what its mesh truly achieves."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        made = peer.remesh(tolerance_m)
        times.append(1e3 * (time.perf_counter() - started))
    triangles = peer.triangles(made)
    true_m = largest_error_m(triangles, heights)
    errors = {"requested_max_error_m": tolerance_m, "max_error_m": true_m}
    return {"name": name} | errors | {"triangles": len(triangles), "ms": median(times)}


def _beside(renderer: Renderer, own: dict[str, Any], mesh: dict[str, Any]) -> dict[str, float]:
    """Ours at the error that the other's mesh truly has, and how many times longer the other takes."""
    same = renderer.levels.select_everywhere(mesh["max_error_m"]).triangles
    return {
        "our_triangles": same,
        "our_triangles_to_its": same / mesh["triangles"],
        "its_ms_to_ours": mesh["ms"] / own["ms"],
    }


# --- The programs -----------------------------------------------------------------------------------------------------


def _ours(renderer: Renderer) -> Peer:
    def remesh(metres: float) -> Any:
        selection = renderer.levels.select_everywhere(metres)
        renderer.ctx.finish()
        return selection

    return Peer(remesh, lambda selection: captured_triangles(selection)[0])


def _delatin(heights: np.ndarray) -> Peer:
    from pydelatin import Delatin

    def triangles(mesh: Any) -> np.ndarray:
        posts = mesh.vertices[:, :2].astype(np.int32)
        posts[:, 1] = len(heights) - 1 - posts[:, 1]  # its rows run north
        return posts[mesh.triangles]

    return Peer(lambda metres: Delatin(heights, max_error=metres), triangles)


def _martini(heights: np.ndarray) -> Peer:
    from pymartini import Martini

    tile = Martini(len(heights)).create_tile(heights)

    def triangles(mesh: Any) -> np.ndarray:
        vertices, faces = (np.asarray(part) for part in mesh)
        return vertices.reshape(-1, 2).astype(np.int32)[faces.reshape(-1, 3)]

    return Peer(lambda metres: tile.get_mesh(max_error=metres), triangles)


# --- Frames -----------------------------------------------------------------------------------------------------------


def compare_frames(renderer: Renderer, repeats: int = 3) -> dict[str, Any]:
    """Our frame at one pixel, ours of every post, and VTK's of every post, from `Camera.default`.

    Returns
    -------
    dict
        `frames`, an object each, and `absent` as in `compare_meshes`.
    """
    camera = Camera.default(renderer.heightmap)
    frames = []
    for method in ("sat", "full"):
        stats = [renderer.render(camera, method=method).stats for _ in range(repeats + 1)][1:]
        ms = median(each["ms"]["frame"] for each in stats)
        frames.append({"name": f"terrain-gl {method}", "triangles": stats[-1]["triangles"], "ms": ms})
    try:
        import pyvista  # noqa: F401, to be told here, in one line, if it is missing

        # in a process of its own: VTK ends the EGL display, and with it all contexts of this one
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            frames.append(pool.submit(_vtk_frame, renderer.heightmap, camera, renderer.size, repeats).result())
    except (ImportError, RuntimeError) as error:
        return {"frames": frames, "absent": [f"pyvista is left out: {error}"]}
    frames[-1]["its_ms_to_ours"] = frames[-1]["ms"] / frames[0]["ms"]
    return {"frames": frames, "absent": []}


def _vtk_frame(heightmap: Heightmap, camera: Camera, size: tuple[int, int], repeats: int) -> dict[str, Any]:
    """Every post drawn by VTK and the picture read back."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it complains of a missing display, then does without
    (rows, cols), (east, north) = heightmap.heights.shape, heightmap.spacing_m
    x, y = np.meshgrid(np.arange(cols) * east, np.arange(rows)[::-1] * north)
    surface = pyvista.StructuredGrid(x, y, heightmap.heights.astype(np.float64)).extract_surface(algorithm=None)
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
    plotter.add_mesh(surface)
    plotter.camera_position = [camera.eye, camera.target, (0, 0, 1)]
    plotter.camera.view_angle = camera.fov_deg
    times = []
    for _ in range(repeats + 1):  # the first one sends the mesh to the GPU
        started = time.perf_counter()
        plotter.render()
        plotter.screenshot(None, return_img=True)
        times.append(1e3 * (time.perf_counter() - started))
    plotter.close()
    return {"name": "pyvista", "triangles": 2 * (rows - 1) * (cols - 1), "ms": median(times[1:])}


# --- The test ---------------------------------------------------------------------------------------------------------


def largest_error_m(triangles: np.ndarray, heights: np.ndarray) -> float:
    """Largest difference in height between a mesh on posts and all posts of a map, in float64; Inf if it misses one.

    Parameters
    ----------
    triangles
        (n, 3, 2) columns and rows of posts, either way round.
    heights
        (rows, cols) metres.
    """
    largest, covered = 0.0, np.zeros(heights.shape, bool)
    for first in range(0, len(triangles), CHUNK):
        corners, x, y = _posts_under(triangles[first : first + CHUNK].astype(np.int64))
        errors = _plane_m(corners, x, y, heights) - heights[y, x]
        largest = max(largest, float(np.abs(errors).max(initial=0.0)))
        covered[y, x] = True
    return largest if covered.all() else np.inf


def _posts_under(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Posts that triangles (n, 3, 2) cover, edges included: for each its triangle's corners, column and row.

    Row by row: the edge from a to b has the triangle on its left if (b − a) × (p − a) ≥ 0, which bounds p's column
    from one side by a quotient of integers.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    area = _cross(b - a, c - a)
    corners = np.where((area < 0)[:, None, None], corners[:, ::-1], corners)[area != 0]
    top, bottom = corners[..., 1].min(1), corners[..., 1].max(1)
    which, row = _ranges(top, bottom - top + 1)
    low = np.full(len(row), np.iinfo(np.int64).min)
    high = np.full(len(row), np.iinfo(np.int64).max)
    for k in range(3):
        a, b = corners[which, k], corners[which, (k + 1) % 3]
        rise = b[:, 1] - a[:, 1]
        most = (b[:, 0] - a[:, 0]) * (row - a[:, 1]) + rise * a[:, 0]  # rise · x is at most this
        quotient = most // np.where(rise == 0, 1, rise)
        high = np.where(rise > 0, np.minimum(high, quotient), high)
        low = np.where(rise < 0, np.maximum(low, -(most // np.where(rise == 0, 1, -rise))), low)
    line, x = _ranges(low, np.maximum(high - low + 1, 0))
    return corners[which[line]], x, row[line]


def _ranges(first: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All numbers of the ranges that begin at `first`, and which range each is of."""
    which = np.repeat(np.arange(len(first)), count)
    start = np.cumsum(count) - count
    return which, np.arange(len(which)) - start[which] + first[which]


def _plane_m(corners: np.ndarray, x: np.ndarray, y: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Height of triangles' planes at places; weights are integers, exact."""
    away = corners - np.stack([x, y], -1)[:, None]
    weights = np.stack([_cross(away[:, (k + 1) % 3], away[:, (k + 2) % 3]) for k in range(3)], -1)
    at_corners = heights[corners[..., 1], corners[..., 0]].astype(np.float64)
    return (weights * at_corners).sum(-1) / weights.sum(-1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
