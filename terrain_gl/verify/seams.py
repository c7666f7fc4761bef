"""Where a mesh is torn: gaps, and vertices on an edge that does not have them (T-junctions)."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

_NEAR = 1e-6  # cells: a vertex so close to an edge lies on it
_SLACK = 1e-3  # cells: a vertex so close to an edge is looked at
_PART = 1 << 20  # pairs that are looked at at a time


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
    rim = rim[((posts[rim] >= -_NEAR) & (posts[rim] <= last + _NEAR)).all(1)]
    torn: set[int] = set()
    crack_m = 0.0
    for edge, vertex in _near(posts, a, b, rim, last):
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


def _near(
    posts: np.ndarray, a: np.ndarray, b: np.ndarray, rim: np.ndarray, last: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of edges from `a` to `b` and vertices of `rim`, in parts: at least all that are near each other.

    An edge is cut into strips, one cell wide, along the axis along which it is longer. Vertices are sorted by strips,
    and across in each strip. So those near a piece of an edge are neighbours in this order.
    """
    longer = np.abs(posts[b] - posts[a]).argmax(1)
    for axis in (0, 1):
        across = 1 - axis
        wide = last[across] + 8.0  # numbers for each strip
        keys = np.floor(posts[rim, axis]) * wide + posts[rim, across]
        order = np.argsort(keys)
        edges = np.flatnonzero(longer == axis)
        turned = posts[a[edges], axis] > posts[b[edges], axis]
        start, end = posts[np.where(turned, b[edges], a[edges])], posts[np.where(turned, a[edges], b[edges])]
        first, final = (np.clip(np.floor(x[:, axis]), -1, last[axis] + 1).astype(np.int64) for x in (start, end))
        count = final - first + 1
        which, strip = _ranges(first, count)
        step = (end - start)[which]
        slope = step[:, across] / np.where(step[:, axis] == 0, 1.0, step[:, axis])
        at = np.clip([strip, strip + 1], start[which, axis], end[which, axis])
        ends = np.sort(start[which, across] + (at - start[which, axis]) * slope, axis=0)
        low, high = strip * wide + np.clip(ends, -2.0, last[across] + 2.0) + [[-_SLACK], [_SLACK]]
        begin = np.searchsorted(keys[order], low)
        many = np.searchsorted(keys[order], high, "right") - begin
        cuts = np.searchsorted(np.cumsum(many), np.arange(_PART, many.sum() + _PART, _PART), "right")
        for one, two in pairwise([0, *cuts.tolist(), len(many)]):
            piece, vertex = _ranges(begin[one:two], many[one:two])
            yield edges[which[one:two][piece]], rim[order[vertex]]


def _ranges(first: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All whole numbers of ranges, after the number of the range that each is in."""
    which = np.repeat(np.arange(len(first)), count)
    return which, np.arange(len(which)) + (first - np.cumsum(count) + count)[which]


def is_closed(faces: np.ndarray, vertices: int) -> bool:
    """Whether each edge belongs to two triangles, as those of a solid do."""
    return bool((_edges(faces, vertices)[1] == 2).all())


def _edges(faces: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the edges, and how many triangles each belongs to."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), 1)
    return np.unique(ends @ [vertices, 1], return_counts=True)
