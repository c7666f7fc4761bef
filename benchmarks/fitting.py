"""How much smaller the error would be if vertices were fitted to the surface around them, instead of lying on it.

We take the triangles that are drawn for a budget. Each vertex gets the height that minimises the sum of the squared
screen errors of all posts in the picture (weighted least squares over the whole mesh, by conjugate gradients). No
scheme that computes heights in advance, or node by node, can do better with this mesh.

Run: python benchmarks/fitting.py MAP [--spacing M ...] [--view NAME] [--budgets N,N,...]    (needs scipy)
"""

import argparse
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import cg

from terrain_gl.camera import Camera, screen_shift_px
from terrain_gl.cli import options
from terrain_gl.cli.records import DrawOptions, told
from terrain_gl.cli.scene import make_renderer, open_scene
from terrain_gl.mesh import vertex_heights
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import near_plane_m


def posts_in(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Posts in each triangle: which triangle, the posts' columns and rows (n, 2), and their three weights (n, 3)."""
    low, high = triangles.min(1), triangles.max(1)
    found = []
    for size in np.unique(high - low, axis=0):  # sides are powers of two, so there are few sizes
        same = np.flatnonzero((high - low == size).all(1))
        across, along = (np.arange(int(side) + 1) for side in size)
        offsets = np.stack(np.meshgrid(across, along), -1).reshape(-1, 2)
        for part in np.array_split(same, max(1, len(same) * len(offsets) >> 21)):
            corners = triangles[part].astype(np.float64)
            posts = np.ceil(low[part, None]).astype(np.int64) + offsets
            a, b, c = (corners[:, None, i] for i in range(3))
            parts = np.stack(
                [_cross(b - posts, c - posts), _cross(c - posts, a - posts), _cross(a - posts, b - posts)], -1
            )
            area = parts.sum(-1, keepdims=True)
            inside = ((parts * np.sign(area) >= 0) & (area != 0)).all(-1)
            triangle, i = np.nonzero(inside)
            found.append((part[triangle], posts[triangle, i], (parts / np.where(area, area, 1))[triangle, i]))
    which, posts, weights = (np.concatenate(columns) for columns in zip(*found, strict=True))
    _, first = np.unique(posts[:, 1] << 20 | posts[:, 0], return_index=True)  # on an edge, either triangle serves
    return which[first], posts[first], weights[first]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class Mesh(NamedTuple):
    """The mesh as equations: `drawn_by` times the vertices' heights gives the drawn heights of the posts in view."""

    drawn_by: csr_array  # (posts, vertices)
    vertices: np.ndarray  # the vertices' true heights
    points: np.ndarray  # the posts in world metres
    px_per_m: np.ndarray  # pixels for a metre of error at each post


def drawn_mesh(renderer: Renderer, camera: Camera, near_m: float) -> Mesh:
    """The equations of the last frame's triangles."""
    heightmap, truth = renderer.heightmap, renderer.terrain.filled.astype(np.float64)
    triangles = renderer.triangles()
    which, posts, weights = posts_in(triangles)
    vertices, of_corner = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    x, y = posts.T
    east, north = heightmap.spacing_m
    points = np.stack([x * east, (heightmap.rows - 1 - y) * north, truth[y, x]], -1)
    tiny = 1e-6
    px, seen = screen_shift_px(camera, renderer.size, points, np.full(len(points), tiny), near_m)
    seen &= np.isfinite(heightmap.heights[y, x])
    count = int(seen.sum())
    entries = weights[seen].ravel(), of_corner.reshape(-1, 3)[which[seen]].ravel(), np.arange(0, 3 * count + 1, 3)
    drawn_by = csr_array(entries, shape=(count, len(vertices)))
    return Mesh(drawn_by, vertex_heights(truth, vertices), points[seen], px[seen] / tiny)


def fit(mesh: Mesh) -> np.ndarray:
    """The heights of vertices that minimise the sum of squared pixels."""
    weights = np.square(mesh.px_per_m)
    normal = mesh.drawn_by.T @ diags_array(weights) @ mesh.drawn_by
    normal = (normal + diags_array(np.full(len(mesh.vertices), 1e-6 * normal.diagonal().mean()))).tocsr()
    residual = mesh.drawn_by.T @ (weights * (mesh.points[:, 2] - mesh.drawn_by @ mesh.vertices))
    moved, _ = cg(normal, residual, rtol=1e-6, maxiter=500, M=diags_array(1 / normal.diagonal()))
    return mesh.vertices + moved


def errors_px(mesh: Mesh, heights: np.ndarray, camera: Camera, size: tuple[int, int], near_m: float) -> np.ndarray:
    """Screen error of every post with vertices at `heights`."""
    return screen_shift_px(camera, size, mesh.points, mesh.drawn_by @ heights - mesh.points[:, 2], near_m)[0]


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_map(parser)
options.add_rendering(parser)
parser.add_argument("--budgets", metavar="N,N,...", default="20000,100000", help="numbers of triangles")
args = parser.parse_args()
asked = told(DrawOptions, args)
scene = open_scene(asked)
near_m = near_plane_m(scene.heightmap, asked.frame.near_m)

print(f"{'triangles':>10}{'rms px':>9}{'fitted':>9}{'ratio':>7}{'max px':>9}{'fitted':>9}")
with make_renderer(scene, asked) as renderer:
    for budget in map(int, args.budgets.split(",")):
        stats = renderer.draw(scene.camera, triangles=budget, method="quadtree")
        mesh = drawn_mesh(renderer, scene.camera, near_m)
        both = [errors_px(mesh, z, scene.camera, asked.camera.size, near_m) for z in (mesh.vertices, fit(mesh))]
        rms, most = ([float(of(e)) for e in both] for of in (lambda e: np.sqrt(np.square(e).mean()), np.max))
        line = f"{stats['triangles']:10,}{rms[0]:9.4f}{rms[1]:9.4f}{rms[0] / rms[1]:7.2f}{most[0]:9.3f}{most[1]:9.3f}"
        print(line, flush=True)
