"""Where a mesh is torn: gaps, and vertices on an edge that does not have them (T-junctions)."""

from dataclasses import dataclass

import numpy as np

_NEAR = 1e-6  # cells: a vertex so close to an edge lies on it


@dataclass(frozen=True)
class Seams:
    """The edges of a mesh that belong to one triangle alone, without those on the map's rim or beyond it."""

    gaps: float  # their length in cells; a T-junction has such edges, too
    t_junctions: int  # vertices inside an edge that does not have them
    largest_crack_m: float  # largest difference in height between such a vertex and its edge


def find_seams(posts: np.ndarray, tops_m: np.ndarray, faces: np.ndarray, shape: tuple[int, int]) -> Seams:
    """Find the seams of a mesh whose vertices are shared.

    Parameters
    ----------
    posts
        (n, 2) columns and rows of the vertices.
    tops_m
        (n,) their heights.
    faces
        (m, 3) indices of vertices; no triangle is vertical.
    shape
        Rows and columns of the map.
    """
    key, count = _edges(faces, len(posts))
    alone = key[count == 1]
    a, b = alone // max(len(posts), 1), alone % max(len(posts), 1)
    last = np.array(shape[::-1]) - 1.0
    beyond = ((posts[a] <= _NEAR) & (posts[b] <= _NEAR)) | ((posts[a] >= last - _NEAR) & (posts[b] >= last - _NEAR))
    a, b = a[~beyond.any(1)], b[~beyond.any(1)]
    lengths = np.linalg.norm(posts[b] - posts[a], axis=1)
    rim = np.unique(np.concatenate([a, b]))
    rim = rim[np.argsort(posts[rim, 0], kind="stable")]
    columns = posts[rim, 0]
    low, high = np.sort(np.stack([posts[a, 0], posts[b, 0]]), axis=0)
    first = np.searchsorted(columns, low - _NEAR)
    many = np.searchsorted(columns, high + _NEAR, "right") - first
    torn: set[int] = set()
    crack_m = 0.0
    for start in range(0, len(a), 256):  # each edge with the vertices of its columns
        part = slice(start, start + 256)
        edge = np.repeat(np.arange(len(a))[part], many[part])
        within = np.arange(len(edge)) - np.repeat(np.cumsum(many[part]) - many[part], many[part])
        vertex = rim[first[edge] + within]
        along, away = posts[b[edge]] - posts[a[edge]], posts[vertex] - posts[a[edge]]
        square = np.maximum((along**2).sum(1), _NEAR**2)
        t = (along * away).sum(1) / square
        distance = np.abs(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / np.sqrt(square)
        inside = (t > 0) & (t < 1) & (distance < _NEAR) & (vertex != a[edge]) & (vertex != b[edge])
        inside &= np.minimum(t, 1 - t) * np.sqrt(square) > _NEAR
        at_m = tops_m[a[edge]] + t * (tops_m[b[edge]] - tops_m[a[edge]])
        torn |= set(vertex[inside].tolist())
        crack_m = max(crack_m, float(np.abs(at_m - tops_m[vertex])[inside].max(initial=0.0)))
    return Seams(float(lengths.sum()), len(torn), crack_m)


def is_closed(faces: np.ndarray, vertices: int) -> bool:
    """Whether each edge belongs to two triangles, as those of a solid do."""
    return bool((_edges(faces, vertices)[1] == 2).all())


def _edges(faces: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the edges, and how many triangles each belongs to."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), 1)
    return np.unique(ends @ [vertices, 1], return_counts=True)
