"""Cut voids out of a mesh. The triangles that remain are parts of the drawn triangles, so the surface is the same.

A cell with a void corner is left out, as in pictures with holes. A triangle that covers both such cells and others is
cut along the lines of the lattice that bound them:

    lines      columns and rows at which cells over the triangle change between land and void
    edges      each edge is cut by the lines of both its triangles, so that no vertex lies on an uncut edge
    pieces     lines cut a triangle into convex polygons, one in each box between lines; those over voids are dropped
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_LEAST = 1e-9  # cells: polygons of less area are rounding errors; vertices nearer to a lattice line are put on it
Lines = tuple[np.ndarray, np.ndarray]  # columns and rows
_NO_LINES = np.zeros(0), np.zeros(0)


class Cut(NamedTuple):
    """The remaining part of a mesh."""

    posts: np.ndarray  # (n, 2) float64 columns and rows of the vertices; those of the uncut mesh come first
    faces: np.ndarray  # (m, 3) indices of vertices
    heights_m: np.ndarray  # (n,) float64 heights of the vertices


def cut_voids(posts: np.ndarray, faces: np.ndarray, heights_m: np.ndarray, void: np.ndarray) -> Cut:
    """The part of a mesh over cells without a void corner. Its vertices are shared; `void` is (rows, cols) of posts."""
    cells = void[:-1, :-1] | void[:-1, 1:] | void[1:, :-1] | void[1:, 1:]
    corners = posts[faces]
    low = np.floor(corners.min(1)).astype(np.int64)
    high = np.ceil(corners.max(1)).astype(np.int64)
    missing = _count(cells, low, high)
    whole = missing == 0
    cutter = _Cutter(posts, heights_m)
    cut: list[tuple[np.ndarray, _Pieces]] = []
    for i in np.flatnonzero(~whole & (missing < (high - low).prod(1))):
        pieces = _Pieces.of(corners[i], cells[low[i, 1] : high[i, 1], low[i, 0] : high[i, 0]], low[i])
        if not pieces.voids.any():
            whole[i] = True
        elif not pieces.voids.all():
            cutter.add_lines(faces[i], pieces.lines)
            cut.append((faces[i], pieces))
    cutter.cut_edges()
    beside = whole & cutter.has_cut_edge(faces)
    for face in faces[beside]:
        cutter.split(face, _Pieces(_NO_LINES, np.zeros((1, 1), bool)))
    for face, pieces in cut:
        cutter.split(face, pieces)
    return cutter.result(faces[whole & ~beside])


def _count(cells: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(m,) number of cells in each box of columns and rows."""
    sums = np.pad(cells.cumsum(0, dtype=np.int64).cumsum(1), ((1, 0), (1, 0)))
    (west, north), (east, south) = low.T, high.T
    count: np.ndarray = sums[south, east] - sums[north, east] - sums[south, west] + sums[north, west]
    return count


class _Pieces(NamedTuple):
    """The pieces of a triangle: the lines that cut it, and which boxes (rows, columns) between them are voids."""

    lines: Lines
    voids: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray, cells: np.ndarray, low: np.ndarray) -> _Pieces:
        """The pieces of a triangle; `cells` are those of its bounding box, which begins at the post `low`."""
        covered = _covered(corners - low, cells.shape)
        of_void = cells & covered
        changes_x = (of_void[:, 1:] != of_void[:, :-1]) & covered[:, 1:] & covered[:, :-1]
        changes_y = (of_void[1:] != of_void[:-1]) & covered[1:] & covered[:-1]
        cols, rows = 1 + np.flatnonzero(changes_x.any(0)), 1 + np.flatnonzero(changes_y.any(1))
        if not len(cols) + len(rows):
            return cls(_NO_LINES, np.array([[of_void.any()]]))
        within = np.add.reduceat(np.add.reduceat(of_void, np.append(0, rows), 0, int), np.append(0, cols), 1)
        return cls(((cols + low[0]).astype(float), (rows + low[1]).astype(float)), within > 0)


def _covered(corners: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Cells that overlap a triangle: no edge of the triangle has the cell on its outer side (Gottschalk 1996)."""
    row, col = np.indices(shape)
    covered = np.ones(shape, bool)
    turn = np.sign(_cross(corners[1] - corners[0], corners[2] - corners[0]))
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        dx, dy = turn * (b - a)
        covered &= dx * (row + (dx > 0) - a[1]) - dy * (col + (dy < 0) - a[0]) > 0
    return covered


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    result: np.ndarray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


class _Cutter:
    """Collects vertices and faces. Vertices on an edge are made once, for both its triangles."""

    def __init__(self, posts: np.ndarray, heights_m: np.ndarray) -> None:
        self._places: list[tuple[float, float]] = []  # places and heights of new vertices
        self._new_m: list[float] = []
        self._old = posts.astype(np.float64)
        self._old_m = heights_m.astype(np.float64)
        self._lines_of: dict[tuple[int, int], list[Lines]] = {}
        self._on_edge: dict[tuple[int, int], list[int]] = {}
        self._faces: list[tuple[int, int, int]] = []

    def add_lines(self, face: np.ndarray, lines: Lines) -> None:
        """Cut the edges of a face by lines."""
        for a, b in _edges(face):
            self._lines_of.setdefault((min(a, b), max(a, b)), []).append(lines)

    def cut_edges(self) -> None:
        """Make the vertices where lines cross edges; the first is nearest to the edge's end with the lower index."""
        for (a, b), of_faces in self._lines_of.items():
            start, step = self._old[a], self._old[b] - self._old[a]
            found: dict[tuple[float, float], float] = {}
            for axis in (0, 1):
                lines = np.unique(np.concatenate([lines[axis] for lines in of_faces]))
                share = (lines - start[axis]) / step[axis] if step[axis] else np.zeros(0)
                for t in share[(share > 0) & (share < 1)]:
                    at = start + t * step
                    nearest = np.rint(at)
                    x, y = np.where(np.abs(at - nearest) < _LEAST, nearest, at).tolist()
                    found.setdefault((x, y), float(t))
            in_order = sorted(found.items(), key=lambda each: each[1])
            rise_m = self._old_m[b] - self._old_m[a]
            self._on_edge[a, b] = [self._vertex(at, self._old_m[a] + t * rise_m) for at, t in in_order]

    def has_cut_edge(self, faces: np.ndarray) -> np.ndarray:
        """For each face whether one of its edges has a vertex between its ends, (m,) bool."""
        n = len(self._old)
        cut = np.array([a * n + b for (a, b), on in self._on_edge.items() if on], np.int64)
        ends = np.sort(faces.astype(np.int64)[:, [[0, 1], [1, 2], [2, 0]]], -1)
        return np.asarray(np.isin(ends @ [n, 1], cut).any(1))

    def split(self, face: np.ndarray, pieces: _Pieces) -> None:
        """Add the parts of a face that are outside voids.

        The lines of `pieces` divide the plane into boxes. A part is the intersection of the face with one of the boxes.
        """
        cols, rows = pieces.lines
        rim = [number for a, b in _edges(face) for number in (a, *self._between(a, b))]
        numbers = np.array(rim + self._inside(face, cols, rows))
        at = np.array([self._place(number) for number in numbers])
        box = [np.concatenate([[-np.inf], lines, [np.inf]]) for lines in (cols, rows)]
        turn = float(np.sign(_cross(*(self._old[face[1:]] - self._old[face[0]]))))
        for row, col in np.argwhere(~pieces.voids):
            low, high = (np.array([box[0][col + i], box[1][row + i]]) for i in (0, 1))
            within = ((at >= low) & (at <= high)).all(1)
            if within.sum() >= 3:
                self._fill(numbers[within], at[within], turn)

    def result(self, others: np.ndarray) -> Cut:
        """The mesh, with faces that were not cut."""
        places = np.array(self._places).reshape(-1, 2)
        faces = np.concatenate([others, np.array(self._faces, others.dtype).reshape(-1, 3)])
        return Cut(np.concatenate([self._old, places]), faces, np.concatenate([self._old_m, self._new_m]))

    def _fill(self, numbers: np.ndarray, at: np.ndarray, turn: float) -> None:
        """Fill a convex polygon with triangles. Its corners are in any order; three may be on one line."""
        middle = at.mean(0)
        around = np.argsort(turn * np.arctan2(*(at - middle).T[::-1]))
        numbers, at = numbers[around], at[around]
        ahead = np.roll(at, -1, 0)
        if turn * _cross(at - middle, ahead - middle).sum() < _LEAST:
            return
        for first in range(len(at)):
            others = np.roll(np.arange(len(at)), -first)
            fan = np.stack([np.full(len(at) - 2, first), others[1:-1], others[2:]], -1)
            if (turn * _cross(at[fan[:, 1]] - at[first], at[fan[:, 2]] - at[first]) > _LEAST).all():
                self._faces += [tuple(three) for three in numbers[fan].tolist()]
                return
        centre = self._vertex(tuple(middle), float(np.mean([self._height_m(number) for number in numbers])))
        self._faces += [(centre, a, b) for a, b in zip(numbers.tolist(), np.roll(numbers, -1).tolist(), strict=True)]

    def _inside(self, face: np.ndarray, cols: np.ndarray, rows: np.ndarray) -> list[int]:
        """New vertices where lines cross inside a face."""
        at = np.stack(np.meshgrid(cols, rows), -1).reshape(-1, 2)
        a, b, c = self._old[face]
        area = _cross(b - a, c - a)
        shares = np.stack([_cross(c - b, at - b), _cross(a - c, at - c), _cross(b - a, at - a)], -1) / area
        inside = (shares > 0).all(1)
        heights_m = shares[inside] @ self._old_m[face]
        return [self._vertex(place, height) for place, height in zip(at[inside], heights_m, strict=True)]

    def _between(self, a: int, b: int) -> list[int]:
        on = self._on_edge.get((min(a, b), max(a, b)), [])
        return on if a < b else on[::-1]

    def _vertex(self, place: tuple[float, float] | np.ndarray, height_m: float) -> int:
        self._places.append((float(place[0]), float(place[1])))
        self._new_m.append(float(height_m))
        return len(self._old) + len(self._places) - 1

    def _place(self, number: int) -> tuple[float, float] | np.ndarray:
        n = len(self._old)
        return self._old[number] if number < n else self._places[number - n]

    def _height_m(self, number: int) -> float:
        n = len(self._old)
        return float(self._old_m[number]) if number < n else self._new_m[number - n]


def _edges(face: np.ndarray) -> list[tuple[int, int]]:
    a, b, c = face.tolist()
    return [(a, b), (b, c), (c, a)]
