"""Other programs beside ours: the test that meshes are put to, meshes within metres, and peers that are not there."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from maps import MAPS, rough

from terrain_gl import peers
from terrain_gl.exceptions import UsageError
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.terrain import fill_voids

posts = st.tuples(st.integers(0, 12), st.integers(0, 9))


def dense(rows, cols):
    """Two triangles a cell."""
    y, x = np.mgrid[: rows - 1, : cols - 1].reshape(2, -1)
    a, b, c, d = (np.stack([x + i, y + j], -1) for j in (0, 1) for i in (0, 1))
    return np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])


@given(st.lists(st.tuples(posts, posts, posts), min_size=1, max_size=8))
def test_posts_under_triangles_are_those_that_a_search_finds(triangles):
    corners, x, y = peers._posts_under(np.array(triangles, np.int64))
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
    assert peers.largest_error_m(dense(17, 23), heights) == 0
    y, x = np.mgrid[:9, :9]
    valley = np.abs(x - 4.0)
    corners = np.array([[[0, 0], [0, 8], [8, 8]], [[8, 0], [8, 8], [0, 0]]])  # either way round
    assert peers.largest_error_m(corners, valley) == 4
    assert peers.largest_error_m(corners, 3.0 * x + 2 * y) == 0


def test_a_mesh_that_misses_a_post_has_no_error_bound():
    triangles = dense(17, 23)
    around = (triangles == [5, 7]).all(-1).any(1)
    assert around.sum() == 6
    assert peers.largest_error_m(triangles[~around], rough(17, 23)) == np.inf


@pytest.mark.parametrize("name", MAPS)
def test_metres_promised_are_metres_kept(name):
    heightmap = MAPS[name]()
    filled = Heightmap(fill_voids(heightmap.heights), heightmap.spacing_m)
    relief = filled.range_m[1] - filled.range_m[0]
    with Renderer(filled, (16, 16)) as renderer:
        for share in (0.004, 0.1):
            asked = max(share * relief, 1e-3)
            triangles, stats = renderer.triangulate(asked)
            achieved = peers.largest_error_m(triangles, filled.heights)
            assert achieved <= stats["certified_max_error_m"] <= stats["requested_max_error_m"] == asked
            assert stats["triangles"] == len(triangles) <= 2 * (filled.rows - 1) * (filled.cols - 1)


def test_no_metres_are_refused():
    with Renderer(Heightmap(rough(9, 9)), (16, 16)) as renderer, pytest.raises(UsageError, match="more than 0"):
        renderer.triangulate(0.0)


def test_the_middle_square_is_one_that_all_take():
    heights = rough(40, 70)
    heights[15:20, 30:33] = np.nan
    square = peers.square_of(Heightmap(heights, (3.0, 4.0)))
    assert square.heights.shape == (33, 33) and square.voids == 0 and square.spacing_m == (3.0, 4.0)
    known = ~np.isnan(heights[3:36, 18:51])
    assert (square.heights[known] == heights[3:36, 18:51][known]).all()


@pytest.mark.parametrize("name", ["pydelatin", "pymartini"])
def test_the_ruler_reads_a_peers_mesh_right_way_up(name):
    pytest.importorskip(name)
    heights = rough(33, 33, relief=60.0)
    make = {"pydelatin": peers._delatin, "pymartini": peers._martini}[name]
    peer = make(heights)
    assert peers.largest_error_m(peer.triangles(peer.remesh(1e-3)), heights) <= 2e-3
    assert len(peer.triangles(peer.remesh(5.0))) < 2 * 32 * 32


def test_peers_that_are_not_there_are_named(monkeypatch):
    for module in ("pydelatin", "pymartini", "pyvista"):
        monkeypatch.setitem(sys.modules, module, None)
    found = peers.compare(Heightmap(rough(40, 40)), (32, 18), repeats=1)
    assert [line.split()[0] for line in found["absent"]] == ["pydelatin", "pymartini", "pyvista"]
    assert {mesh["name"] for mesh in found["meshes"]} == {"terrain-gl"}
    assert [frame["name"] for frame in found["frames"]] == ["terrain-gl sat", "terrain-gl full"]


def test_peers_that_are_there_stand_beside():
    for module in ("pydelatin", "pymartini"):
        pytest.importorskip(module)
    found = peers.compare(Heightmap(rough(80, 70)), (32, 18), repeats=1)
    for mesh in found["meshes"]:
        if mesh["name"] != "terrain-gl":
            assert mesh["our_triangles_to_its"] == mesh["our_triangles"] / mesh["triangles"]
        if mesh["name"] != "pymartini":  # it does not hold what it is asked for
            assert mesh["max_error_m"] <= mesh["requested_max_error_m"] * (1 + 1e-6)
