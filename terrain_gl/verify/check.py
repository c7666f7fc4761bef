"""The exact error of any triangle mesh against a heightmap.

The truth is bilinear in each cell of the map; a triangle is a plane. In the part of a triangle over one cell, the error

    d(u, v) = twist · u · v + a plane       u, v from 0 to 1, from the cell's north-western post

has no maximum inside, so it is largest on the part's border. Along a line of the map's grid, d is linear. Along an edge
of the triangle, d is a parabola. So the largest error is at one of these places:

    posts      inside the triangles
    pieces     edges of triangles, cut at the lines of the grid: both ends of each piece, and the top of its parabola

The mean square is an integral over each part. Green's theorem makes it a sum over the part's border:

    ∬ d² du dv = ∮ F dv,    F(u, v) = ∫ d(s, v)² ds from 0 to u = u · (a² + a·d + d²) / 3,    a = d(0, v)

F is 0 on a cell's western side, and dv is 0 on its northern and southern sides. So only the pieces of edges and the
eastern sides of cells count. On these, F is a polynomial, which Gauss's rule integrates exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

_PART = 1 << 16  # places that are computed at a time: their arrays fit into the processor's cache
_NEAR = 1e-9  # cells: a post so close to a triangle's edge counts as inside
_SLIVER = 1e-3  # cells: in narrower triangles F would lose digits, so that edges stand for the triangle
_THREE = [(0.5 - np.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + np.sqrt(0.15), 5 / 18)]  # exact up to degree 5
_TWO = [(0.5 - np.sqrt(1 / 12), 0.5), (0.5 + np.sqrt(1 / 12), 0.5)]  # exact up to degree 3
Measure = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class MeshError:
    """The difference in height between a mesh and a heightmap, in metres or in the unit of `measure`."""

    posts: float  # largest error at posts
    posts_rms: float  # root mean square over the posts that the mesh covers
    surface: float  # largest error over the bilinear surface, posts included
    surface_rms: float  # root mean square over the covered surface, in metres; each cell has the same weight
    place: tuple[float, float]  # column and row of the largest error over the surface
    covered: float  # share of the cells' area that the mesh covers
    posts_covered: float  # share of the posts that the mesh covers
    overlap: float  # area that is covered more than once, as a share of the cells' area
    of_posts: np.ndarray  # (rows, cols) error of each post; NaN where there is no triangle or no height


def check_mesh(
    heights: np.ndarray, posts: np.ndarray, tops_m: np.ndarray, faces: np.ndarray, measure: Measure | None = None
) -> MeshError:
    """Compare a mesh with a heightmap.

    A cell with a void corner has no truth, so it is left out. Triangles that are vertical, as walls and skirts, and
    land beyond the map's rim are left out, too.

    Parameters
    ----------
    heights
        (rows, cols) metres, NaN for voids.
    posts
        (n, 2) columns and rows of the vertices; any numbers.
    tops_m
        (n,) heights of the vertices in metres.
    faces
        (m, 3) indices of vertices.
    measure
        Turns (columns, rows, true heights, heights of the mesh) into errors; without it, errors are in metres.
    """
    total = _Total(np.ascontiguousarray(heights), measure)
    corners = np.concatenate([np.asarray(posts, np.float64).T, np.asarray(tops_m, np.float64)[None]])
    of_corner = np.ascontiguousarray(faces.T)
    a, b, c = (corners[:2].take(each, 1) for each in of_corner)
    spans = (np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c)).sum(0)
    for part in _slices(8 + spans, 2 * _PART):
        total.add(np.stack([corners.take(each[part], 1) for each in of_corner]))
    return total.result()


def _slices(work: np.ndarray, limit: float) -> Iterator[slice]:
    """Slices of a list whose work is about `limit` each."""
    ends = np.searchsorted(np.cumsum(work), np.arange(limit, work.sum() + limit, limit))
    cuts = np.unique(np.clip([0, *ends, len(work)], 0, len(work)))
    for first, end in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        yield slice(first, end)


def _ranges(first: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All whole numbers of ranges, and the number of the range that each is in."""
    which = np.repeat(np.arange(len(first)), count)
    return which, np.arange(len(which)) + (first - np.cumsum(count) + count)[which]


def _split(a: np.ndarray, b: np.ndarray, axis: int, last: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut segments at whole numbers of a coordinate, and leave out what is below 0 or above `last`.

    Parameters
    ----------
    a, b
        (k, n) ends of the segments.

    Returns
    -------
    which, start, end
        The segment that each piece is of, and the ends of the pieces.
    """
    low, high = np.minimum(a[axis], b[axis]), np.maximum(a[axis], b[axis])
    first = np.clip(np.floor(low), 0, last).astype(np.int64)
    count = np.maximum(np.clip(np.ceil(high), 0, last).astype(np.int64) - first, 1)
    which, line = _ranges(first, np.where((high < 0) | (low > last), 0, count))
    a, b = a.take(which, 1), b.take(which, 1)
    step = b[axis] - a[axis]
    away = np.where(step == 0, 1.0, step)
    low, high = np.maximum(low[which], line), np.minimum(high[which], np.minimum(line + 1, last))
    begins, ends = np.where(step >= 0, low, high), np.where(step >= 0, high, low)
    t = np.where(step == 0, 0.0, (begins - a[axis]) / away)
    start = a + t * (b - a)
    t = np.where(step == 0, 1.0, (ends - a[axis]) / away)
    end = a + t * (b - a)
    start[axis], end[axis] = begins, ends
    return which, start, end


class _Total:
    """The errors of all triangles so far."""

    def __init__(self, heights: np.ndarray, measure: Measure | None) -> None:
        self.rows, self.cols = heights.shape
        self.heights = heights.reshape(-1)
        self.measure = measure
        self.of_posts = np.full(heights.size, -1.0)
        self.land = np.isfinite(heights)
        corners = self.land[:-1, :-1], self.land[:-1, 1:], self.land[1:, :-1], self.land[1:, 1:]
        self.cells = np.logical_and.reduce(corners).reshape(-1)
        self.has_voids = not self.land.all()
        self.areas = np.zeros(self.cells.size)
        self.squares = 0.0
        self.largest = 0.0
        self.place = (np.nan, np.nan)

    def add(self, corners: np.ndarray) -> None:
        """Add triangles: three arrays of columns, rows and heights, (3 corners, 3 coordinates, n)."""
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        corners = np.where(area < 0, corners[::-1], corners)[:, :, area != 0]  # turn from column to row
        edges = np.roll(corners, -1, 0) - corners
        doubled = edges[0, 0] * edges[1, 1] - edges[1, 0] * edges[0, 1]
        rise = (edges[0, 2] * edges[1, 1] - edges[1, 2] * edges[0, 1]) / doubled  # of the plane, from west to east
        lengths = np.hypot(edges[:, 0], edges[:, 1])
        is_sliver = doubled < _SLIVER * lengths.max(0)
        width = np.where(is_sliver, doubled / (2 * lengths.sum(0)), 0.0)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            self._add_edges(corners[a], corners[b], rise, is_sliver, width)
        self._add_inside(corners, rise, is_sliver)

    def _add_edges(
        self, a: np.ndarray, b: np.ndarray, rise: np.ndarray, is_sliver: np.ndarray, width: np.ndarray
    ) -> None:
        """Add one edge of each triangle. `width` is the area of a sliver for each cell of its edges' lengths."""
        of_edge, start, end = _split(a, b, 0, self.cols - 1)
        of_piece, start, end = _split(start, end, 1, self.rows - 1)
        which = of_edge[of_piece]
        along = (start[0] == end[0]) & (start[0] == np.floor(start[0]))  # a line of the grid: counts as a cell's side
        (col, row), cell = self._cells_of(start, end)
        nw, ne, sw, se = self._corners_of(row * self.cols + col)
        u, v, z = start[0] - col, start[1] - row, start[2]
        du, dv = end[0] - start[0], end[1] - start[1]
        d = _bilinear(nw, ne, sw, se, u, v) - z
        change = _bilinear(nw, ne, sw, se, u + du, v + dv) - end[2] - d
        bend = (nw - ne - sw + se) * du * dv
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            top = 0.5 - change / (2 * bend)
        for s in (0.0, 1.0, np.where((top > 0) & (top < 1), top, 0.0)):
            error_m = d + s * change + bend * s * (s - 1)
            at = start[0] + s * du, start[1] + s * dv
            self._largest(at, self._error(*at, z + s * (end[2] - z), error_m), self.cells[cell])
        slivers, rises = is_sliver[which], rise[which]
        plain = self.cells[cell] & ~slivers & ~along
        of_sliver = np.where(self.cells[cell] & slivers, width[which] * np.hypot(du, dv), 0.0)
        np.add.at(self.areas, cell, np.where(plain, (u + du / 2) * dv, of_sliver))
        for s, weight in _THREE:
            at_m = d + s * change + bend * s * (s - 1)
            east, south = u + s * du, v + s * dv
            west_m = at_m - east * ((ne - nw) * (1 - south) + (se - sw) * south - rises)
            f = east * (west_m**2 + west_m * at_m + at_m**2) / 3 * dv
            self.squares += weight * float(f[plain].sum() + (of_sliver * at_m**2)[of_sliver > 0].sum())

    def _add_inside(self, corners: np.ndarray, rise: np.ndarray, is_sliver: np.ndarray) -> None:
        """Add the posts inside triangles, and the eastern sides of cells inside triangles."""
        order = np.argsort(corners[:, 0], axis=0)
        (ax, _, _), (bx, _, _), (cx, _, _) = a, b, c = np.take_along_axis(corners, order[:, None], 0)
        first = np.ceil(np.maximum(ax - _NEAR, 0)).astype(np.int64)
        count = np.floor(np.minimum(cx + _NEAR, self.cols - 1)).astype(np.int64) - first + 1
        which, line = _ranges(first, np.maximum(count, 0))
        a, b, c = (each.take(which, 1) for each in (a, b, c))
        x = np.clip(line, a[0], c[0])
        is_first = (x <= b[0]) & (b[0] > a[0])
        ends = np.stack([_at(a, c, x), _at(np.where(is_first, a, b), np.where(is_first, b, c), x)])
        turned = ends[0, 1] > ends[1, 1]
        north, south = np.where(turned, ends[::-1], ends)
        for part in _slices(2 + south[1] - north[1], _PART):
            self._add_posts(line[part], north[:, part], south[:, part])
        sides = (line > a[0]) & (line > 0) & ~is_sliver[which]  # a triangle has nothing west of its first line
        north, south, rises = north[:, sides], south[:, sides], rise[which[sides]]
        for part in _slices(2 + south[1] - north[1], _PART):
            self._add_sides(north[:, part], south[:, part], rises[part])

    def _add_posts(self, col: np.ndarray, north: np.ndarray, south: np.ndarray) -> None:
        """Add the posts on lines from north to south."""
        first = np.ceil(np.maximum(north[1] - _NEAR, 0)).astype(np.int64)
        count = np.floor(np.minimum(south[1] + _NEAR, self.rows - 1)).astype(np.int64) - first + 1
        which, row = _ranges(first, np.maximum(count, 0))
        a, b, col = north.take(which, 1), south.take(which, 1), col[which]
        long = b[1] - a[1]
        t = np.where(long > 0, (np.clip(row, a[1], b[1]) - a[1]) / np.where(long > 0, long, 1.0), 0.0)
        z = a[2] * (1 - t) + b[2] * t
        post = row * self.cols + col
        error = self._error(col, row, z, self.heights[post].astype(np.float64) - z)
        is_land = self.land.reshape(-1)[post]
        np.maximum.at(self.of_posts, post[is_land], error[is_land])
        self._largest((col, row), error, is_land)

    def _add_sides(self, north: np.ndarray, south: np.ndarray, rise: np.ndarray) -> None:
        """Add the eastern sides of cells, on lines from north to south: they are a part of the parts' borders."""
        which, start, end = _split(north, south, 1, self.rows - 1)
        col = np.rint(start[0]).astype(np.int64) - 1
        row = np.clip(np.floor((start[1] + end[1]) / 2), 0, self.rows - 2).astype(np.int64)
        cell = row * (self.cols - 1) + col
        is_cell = self.cells[cell]
        nw, ne, sw, se = self._corners_of(row * self.cols + col)
        v, dv = start[1] - row, end[1] - start[1]
        np.add.at(self.areas, cell, np.where(is_cell, dv, 0.0))
        for s, weight in _TWO:
            at = v + s * dv
            d = ne * (1 - at) + se * at - start[2] - s * (end[2] - start[2])
            west_m = d - ((ne - nw) * (1 - at) + (se - sw) * at - rise[which])
            f = (west_m**2 + west_m * d + d**2) / 3 * dv
            self.squares += weight * float(f[is_cell].sum())

    def _cells_of(self, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows of the cells of pieces, and their numbers; beside a void, the cell that is none."""
        most = np.array([[self.cols - 2], [self.rows - 2]])
        at = np.clip(np.floor((start[:2] + end[:2]) / 2), 0, most).astype(np.int64)
        cell = at[1] * (self.cols - 1) + at[0]
        for axis in (0, 1) if self.has_voids else ():
            back = at.copy()
            back[axis] = np.maximum(at[axis] - 1, 0)
            before = back[1] * (self.cols - 1) + back[0]
            on_line = (start[axis] == end[axis]) & (start[axis] == at[axis])
            other = on_line & ~self.cells[cell] & self.cells[before]
            at, cell = np.where(other, back, at), np.where(other, before, cell)
        return at, cell

    def _corners_of(self, post: np.ndarray) -> tuple[np.ndarray, ...]:
        """Heights of cells' corners; `post` is the number of the north-western one."""
        return tuple(self.heights[post + step].astype(np.float64) for step in (0, 1, self.cols, self.cols + 1))

    def _error(self, col: np.ndarray, row: np.ndarray, top_m: np.ndarray, error_m: np.ndarray) -> np.ndarray:
        return np.abs(error_m) if self.measure is None else self.measure(col, row, top_m + error_m, top_m)

    def _largest(self, at: tuple[np.ndarray, np.ndarray], error: np.ndarray, counts: np.ndarray) -> None:
        error = np.where(counts, error, -1.0)
        if len(error) and error[i := int(error.argmax())] >= self.largest:
            self.largest = float(error[i])
            self.place = float(at[0][i]), float(at[1][i])

    def result(self) -> MeshError:
        """The mesh's error."""
        measured = self.of_posts[self.of_posts >= 0]
        areas, cells = self.areas[self.cells], max(int(self.cells.sum()), 1)
        return MeshError(
            float(measured.max(initial=0.0)),
            float(np.sqrt(np.square(measured).mean())) if len(measured) else 0.0,
            self.largest,
            float(np.sqrt(max(self.squares, 0.0) / areas.sum())) if areas.sum() > 0 else 0.0,
            self.place,
            float(np.minimum(areas, 1.0).sum()) / cells,
            len(measured) / max(int(self.land.sum()), 1),
            float(np.maximum(areas - 1.0, 0.0).sum()) / cells,
            np.where(self.of_posts < 0, np.nan, self.of_posts).reshape(self.rows, self.cols),
        )


def _bilinear(
    nw: np.ndarray, ne: np.ndarray, sw: np.ndarray, se: np.ndarray, u: np.ndarray, v: np.ndarray
) -> np.ndarray:
    return (nw * (1 - u) + ne * u) * (1 - v) + (sw * (1 - u) + se * u) * v


def _at(a: np.ndarray, b: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Places of segments at a column."""
    step = b[0] - a[0]
    t = np.clip((x - a[0]) / np.where(step == 0, 1.0, step), 0.0, 1.0)
    return a * (1 - t) + b * t
