"""Meshes without voids: no triangle lies over a void, all other land is there, and it is the drawn surface."""

import numpy as np
import pytest
from maps import MAPS, rough
from test_export import edges, read_ply, read_stl

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.files import cutting
from terrain_gl.files.export import make_mesh
from terrain_gl.files.mesh_formats import FORMATS


def scattered():
    """Small and large voids, one of them in a corner, one a line that is a post wide."""
    heights = rough(60, 90, 2)
    heights[np.random.default_rng(2).random(heights.shape) < 0.004] = np.nan
    heights[20:33, 40:70] = heights[:9, :12] = heights[50, 10:60] = np.nan
    return Heightmap(heights, (10.0, 14.0))


@pytest.fixture(params=["holes", "scattered", "of a view"])
def drawn(request, ctx):
    """Triangles, filled heights and the map; those of the view have vertices between posts."""
    heightmap = MAPS["holes"]() if request.param == "holes" else scattered()
    with Renderer(heightmap, (160, 90), ctx=ctx) as r:
        if request.param == "of a view":
            camera = r.heightmap.extent_m[0] / 2, -200.0, 400.0
            r.draw(Camera(camera, (camera[0], 300.0, 0.0)), triangles=900, cull=False)
            return r.triangles(), r.terrain.filled, heightmap
        low, high = heightmap.range_m
        return r.inspector.triangulate(0.05 * (high - low))[0], r.terrain.filled, heightmap


def cut(drawn, weld=True):
    triangles, filled, heightmap = drawn
    return make_mesh(triangles, filled, heightmap.spacing_m, weld, void=np.isnan(heightmap.heights))


def void_cells(heightmap):
    void = np.isnan(heightmap.heights)
    return void[1:, 1:] | void[:-1, 1:] | void[1:, :-1] | void[:-1, :-1]


def areas(mesh):
    """Twice the area of each face in cells, positive if it is seen from above."""
    a, b, c = np.moveaxis(mesh.posts[mesh.faces], 1, 0)
    return (b - a)[:, 1] * (c - a)[:, 0] - (b - a)[:, 0] * (c - a)[:, 1]


def test_triangles_cover_the_cells_with_data_once_and_no_others(drawn):
    mesh, cells = cut(drawn), void_cells(drawn[2])
    assert (areas(mesh) > 0).all()
    assert areas(mesh).sum() == pytest.approx(2 * (~cells).sum(), abs=1e-6)
    corners = mesh.posts[mesh.faces]
    for weights in np.random.default_rng(0).dirichlet((1, 1, 1), 20):  # places in each face
        col, row = np.floor(np.einsum("i,mik->mk", weights, corners)).astype(int).T
        assert not cells[row, col].any()


def test_neighbours_share_whole_edges(drawn, monkeypatch):
    """Each edge without a partner is on the rim of a void or of the map, so along the lattice."""

    def alone(mesh):
        one_way = edges(mesh.faces.astype("i8"))
        key, reverse = one_way @ [len(mesh.posts), 1], one_way @ [1, len(mesh.posts)]
        assert len(np.unique(key)) == len(key)
        return mesh.posts[one_way[~np.isin(key, reverse)]]

    def rim(cells):
        """How many edges of cells lie between data and a void, or the outside of the map."""
        around = np.pad(cells, 1, constant_values=True)
        return (around[1:] != around[:-1]).sum() + (around[:, 1:] != around[:, :-1]).sum()

    ends = alone(cut(drawn))
    lengths = np.abs(ends[:, 1] - ends[:, 0])
    assert (lengths.min(1) == 0).all()
    assert lengths.sum() == pytest.approx(rim(void_cells(drawn[2])))
    monkeypatch.setattr(cutting._Cutter, "has_cut_edge", lambda self, faces: np.zeros(len(faces), bool))
    assert len(alone(cut(drawn))) > len(ends), "triangles beside cut ones have no vertices on their edges"


def test_the_surface_is_the_drawn_one(drawn):
    mesh = cut(drawn)
    triangles, filled, heightmap = drawn
    whole = make_mesh(triangles, filled, heightmap.spacing_m)
    a, b, c = np.moveaxis(whole.posts[whole.faces], 1, 0)
    a_m, b_m, c_m = whole.tops_m(slice(None))[whole.faces].T
    doubled = areas(whole)
    for place, height_m in list(zip(mesh.posts, mesh.vertices_m, strict=True))[::7]:
        of_a, of_b, of_c = (
            ((v - u)[:, 1] * (place - u)[:, 0] - (v - u)[:, 0] * (place - u)[:, 1]) / doubled
            for u, v in ((b, c), (c, a), (a, b))
        )
        under = np.flatnonzero((np.stack([of_a, of_b, of_c]) > -1e-9).all(0))
        at_m = of_a * a_m + of_b * b_m + of_c * c_m
        assert len(under) and at_m[under] == pytest.approx(height_m, abs=1e-3)


def test_without_welding_each_triangle_has_its_own_vertices(drawn):
    welded, apart = cut(drawn), cut(drawn, weld=False)
    assert np.array_equal(apart.faces.ravel(), np.arange(3 * len(welded.faces)))
    assert np.array_equal(apart.posts[apart.faces], welded.posts[welded.faces])
    assert np.array_equal(apart.vertices_m[apart.faces], welded.vertices_m[welded.faces])


@pytest.mark.parametrize("ending", FORMATS)
def test_the_command_leaves_voids_out(folder, run, ending):
    heightmap = scattered()
    np.save(folder / "map.npy", heightmap.heights)
    shared = "mesh", "map.npy", "--spacing", "10,14", "-o"
    assert run(*shared, f"fill{ending}")[0] == run(*shared, f"hole{ending}", "--voids", "hole")[0] == 0
    if ending == ".stl":
        corners, _ = read_stl(folder / "hole.stl")
        a, b, c = np.moveaxis(corners, 1, 0)
        top = np.cross(b - a, c - a)[:, 2]
        scale = 150 / max(heightmap.extent_m)
        assert top[top > 0].sum() / 2 == pytest.approx((~void_cells(heightmap)).sum() * 140 * scale**2, rel=1e-4)
        names = {corner: i for i, corner in enumerate(sorted(set(map(tuple, corners.reshape(-1, 3)))))}
        faces = np.array([names[tuple(corner)] for corner in corners.reshape(-1, 3)]).reshape(-1, 3)
        one_way = edges(faces)
        assert np.array_equal(np.sort(one_way @ [len(names), 1]), np.sort(one_way @ [1, len(names)]))
    elif ending == ".ply":
        (hole, hole_faces, *_), (fill, fill_faces, *_) = (
            read_ply((folder / f"{name}.ply").read_bytes()) for name in ("hole", "fill")
        )
        shares = [
            np.abs(np.linalg.det(np.diff(places[faces][..., :2], axis=1))).sum()
            for places, faces in ((hole, hole_faces), (fill, fill_faces))
        ]
        assert shares[0] / shares[1] == pytest.approx(1 - void_cells(heightmap).mean())
    else:
        assert (folder / f"hole{ending}").read_bytes() != (folder / f"fill{ending}").read_bytes()


def test_a_map_of_voids_has_no_mesh(folder, run):
    heights = np.full((9, 9), np.nan, "f4")
    heights[::2, ::2] = 1.0
    np.save(folder / "map.npy", heights)
    code, _, error = run("mesh", "map.npy", "--spacing", "1", "--voids", "hole", "-o", "m.ply")
    assert code == 1 and "no triangles without voids" in error and not (folder / "m.ply").exists()
