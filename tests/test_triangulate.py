"""Meshes with a tolerance in metres: the certified error is checked at every post and in between, in numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import MAPS, rough

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.heightmap import Heightmap
from terrain_gl.mesh import vertex_heights
from terrain_gl.renderer import Renderer
from terrain_gl.terrain.filling import fill_voids

CHUNK = 2**16  # triangles at a time
posts = st.tuples(st.integers(0, 12), st.integers(0, 9))


def dense(rows, cols):
    """Two triangles a cell."""
    y, x = np.mgrid[: rows - 1, : cols - 1].reshape(2, -1)
    a, b, c, d = (np.stack([x + i, y + j], -1) for j in (0, 1) for i in (0, 1))
    return np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])


def largest_error_m(triangles: np.ndarray, heights: np.ndarray) -> float:
    """Largest difference in height between a mesh on posts and all posts of a map, in float64; Inf if a post is missed.

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
        most = (b[:, 0] - a[:, 0]) * (row - a[:, 1]) + rise * a[:, 0]  # rise · x is at most this number
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


@given(st.lists(st.tuples(posts, posts, posts), min_size=1, max_size=8))
def test_posts_under_triangles_are_those_that_a_search_finds(triangles):
    corners, x, y = _posts_under(np.array(triangles, np.int64))
    found = sorted(zip(x.tolist(), y.tolist(), strict=True))
    searched = []
    for a, b, c in triangles:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if area:
            for p in np.ndindex(13, 10):
                sides = [
                    (v[0] - u[0]) * (p[1] - u[1]) - (p[0] - u[0]) * (v[1] - u[1]) for u, v in ((a, b), (b, c), (c, a))
                ]
                if min(s * np.sign(area) for s in sides) >= 0:
                    searched.append(p)
    assert found == sorted(searched)


def test_error_of_the_whole_map_is_none_and_of_one_plane_is_its_bend():
    heights = rough(17, 23).astype("f8")
    assert largest_error_m(dense(17, 23), heights) == 0
    y, x = np.mgrid[:9, :9]
    valley = np.abs(x - 4.0)
    corners = np.array([[[0, 0], [0, 8], [8, 8]], [[8, 0], [8, 8], [0, 0]]])  # either way round
    assert largest_error_m(corners, valley) == 4
    assert largest_error_m(corners, 3.0 * x + 2 * y) == 0


def test_a_mesh_that_misses_a_post_has_no_error_bound():
    triangles = dense(17, 23)
    around = (triangles == [5, 7]).all(-1).any(1)
    assert around.sum() == 6
    assert largest_error_m(triangles[~around], rough(17, 23)) == np.inf


def between_m(triangles: np.ndarray, heights: np.ndarray, rng: np.random.Generator) -> float:
    """Largest difference in height between a mesh and the bilinear land, at many places of each triangle."""
    weights = np.concatenate([np.eye(3), 0.5 - 0.5 * np.eye(3), rng.dirichlet(np.ones(3), 12)])
    truth = vertex_heights(heights, triangles).astype(np.float64)  # at the corners
    largest = 0.0
    for weight in weights:
        places = np.einsum("i,nij->nj", weight, triangles.astype(np.float64))
        low = np.minimum(np.floor(places).astype(int), np.array(heights.shape[::-1]) - 2)
        (u, v), (x, y) = (places - low).T, low.T
        a, b, c, d = (heights[y + j, x + i].astype(np.float64) for j in (0, 1) for i in (0, 1))
        land = (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v
        largest = max(largest, float(np.abs(truth @ weight - land).max()))
    return largest


SLOW = pytest.param("checkerboard", marks=pytest.mark.slow)


@pytest.mark.parametrize("name", [SLOW if name == "checkerboard" else name for name in MAPS])
def test_certified_metres_hold_everywhere(name):
    """The bound holds on the whole surface, and the triangles cover the map once."""
    heightmap = MAPS[name]()
    filled = Heightmap(fill_voids(heightmap.heights), heightmap.spacing_m)
    relief = filled.range_m[1] - filled.range_m[0]
    with Renderer(filled, (16, 16)) as renderer:
        for share in (0.03, 0.1):
            asked = max(share * relief, 1e-3)
            triangles, stats = renderer.inspector.triangulate(asked)
            achieved = between_m(triangles, filled.heights, np.random.default_rng(1))
            rounding = 1e-12 * np.abs(filled.heights).max()  # of the places and sums here
            assert achieved - rounding <= stats["certified_max_error_m"] <= stats["requested_max_error_m"] == asked
            a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
            assert np.abs(_cross(b - a, c - a)).sum() == 2 * (filled.rows - 1) * (filled.cols - 1)
            assert stats["triangles"] == len(triangles)


def test_a_cell_is_cut_where_two_triangles_stray_between_its_posts():
    """A twist of 8 m: two triangles are 2 m off between the posts, although all posts are exact."""
    heights = np.zeros((9, 9), "f4")
    heights[4, 4] = 8.0
    with Renderer(Heightmap(heights), (16, 16)) as renderer:
        for asked, cut in ((2.1, False), (1.9, True), (0.4, True)):
            triangles, stats = renderer.inspector.triangulate(asked)
            assert between_m(triangles, heights, np.random.default_rng(2)) <= stats["certified_max_error_m"] <= asked
            assert (triangles % 1 != 0).any() == cut


def test_no_metres_are_refused():
    with Renderer(Heightmap(rough(9, 9)), (16, 16)) as renderer, pytest.raises(UsageError, match="more than 0"):
        renderer.inspector.triangulate(0.0)


def test_more_triangles_than_a_capture_holds_are_refused():
    """A checkerboard needs 512 triangles in each cell; without the refusal, the driver would end the process."""
    board = np.indices((385, 385)).sum(0) % 2 * 9.0
    with Renderer(Heightmap(board), (16, 16)) as renderer, pytest.raises(TerrainError, match="allow a larger error"):
        renderer.inspector.triangulate(0.01)


def test_cells_are_cut_only_so_finely_and_the_bound_says_so():
    board = np.indices((9, 9)).sum(0) % 2 * 900.0
    with Renderer(Heightmap(board), (16, 16)) as renderer:
        triangles, stats = renderer.inspector.triangulate(0.04)
        achieved = between_m(triangles, board.astype("f4"), np.random.default_rng(1))
    assert stats["requested_max_error_m"] < 0.1 < achieved <= stats["certified_max_error_m"] < 9
