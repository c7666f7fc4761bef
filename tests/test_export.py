"""Mesh files: read back by parsers of their own, they hold the surface that was drawn, every number exact."""

import json
import struct

import numpy as np
import pytest
from maps import MAPS

from terrain_gl import Camera, Renderer, TerrainError, UsageError
from terrain_gl.files.export import FORMATS, make_mesh, write_mesh
from terrain_gl.mesh import vertex_heights

SMALL = ("odd", "holes", "two", "cliff", "long", "offset")
VIEW = Camera((1340, 1566, 119), (5380, -50, 19), 100.0)  # of "odd", close above the ground


@pytest.fixture(params=[*SMALL, "middles"])
def drawn(request, ctx):
    """Give a renderer that has drawn all of a small map; with a budget also vertices in the middles of cells."""
    budget = request.param == "middles"
    heightmap = MAPS["odd" if budget else request.param]()
    renderer = Renderer(heightmap, (320, 180), ctx=ctx)
    if budget:
        renderer.draw(VIEW, triangles=5000, cull=False, method="quadtree")
    else:
        renderer.draw(Camera.default(heightmap), 2.0, cull=False)
    assert (renderer.triangles() % 1).any() or not budget
    yield renderer
    renderer.release()


def saved(renderer, path, weld=False):
    """Write the drawn mesh and read it back: world positions (n, 3) and faces (m, 3)."""
    mesh = make_mesh(renderer.triangles(), renderer.terrain.filled, renderer.heightmap.spacing_m, weld)
    write_mesh(path, mesh)
    assert [each.name for each in path.parent.iterdir()] == [path.name]
    return READERS[path.suffix](path.read_bytes())


def read_ply(data):
    header, _, body = data.partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    n, m = (int(line.split()[2]) for line in lines if line.startswith("element"))
    assert [line for line in lines if line.startswith("property")] == [
        *(f"property double {axis}" for axis in "xyz"),
        "property list uchar uint vertex_indices",
    ]
    places = np.frombuffer(body, "<f8", 3 * n).reshape(n, 3)
    faces = np.frombuffer(body, [("n", "u1"), ("at", "<u4", 3)], m, 24 * n)
    assert len(body) == 24 * n + 13 * m and (faces["n"] == 3).all()
    return places, faces["at"]


def read_obj(data):
    lines = [line.split() for line in data.decode("ascii").splitlines()]
    places = np.array([line[1:] for line in lines if line[0] == "v"], "f8")
    return places, np.array([line[1:] for line in lines if line[0] == "f"], "i8") - 1


def read_glb(data):
    magic, version, total = struct.unpack_from("<4sII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    length, kind = struct.unpack_from("<I4s", data, 12)
    gltf = json.loads(data[20 : 20 + length])
    binary_length, binary = struct.unpack_from("<I4s", data, 20 + length)
    assert (kind, binary) == (b"JSON", b"BIN\0") and length % 4 == binary_length % 4 == 0
    body = data[28 + length :]
    assert gltf["buffers"] == [{"byteLength": len(body)}] and len(body) == binary_length
    arrays = [glb_array(gltf, accessor, body) for accessor in gltf["accessors"]]
    primitive = gltf["meshes"][gltf["nodes"][0]["mesh"]]["primitives"][0]
    stored = arrays[primitive["attributes"]["POSITION"]]
    accessor = gltf["accessors"][primitive["attributes"]["POSITION"]]
    assert accessor["min"] == stored.min(0).tolist() and accessor["max"] == stored.max(0).tolist()
    node = gltf["nodes"][gltf["scenes"][gltf["scene"]]["nodes"][0]]
    x, up, south = (stored.astype("f8") * node["scale"] + node["translation"]).T
    return np.stack([x, -south, up], -1), arrays[primitive["indices"]].reshape(-1, 3)


def glb_array(gltf, accessor, body):
    view = gltf["bufferViews"][accessor["bufferView"]]
    dtype = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
    width = {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
    count = width * accessor["count"]
    assert view["byteOffset"] % 4 == 0 and view["byteLength"] == 4 * count
    return np.frombuffer(body, dtype, count, view["byteOffset"]).reshape(-1, width)


READERS = {".ply": read_ply, ".obj": read_obj, ".glb": read_glb}


def posts_of(places, heightmap):
    """Columns and rows of world places, which must lie on 64ths between posts to the last bit but one."""
    east, north = heightmap.spacing_m
    col, row = np.rint(64 * places[:, 0] / east) / 64, heightmap.rows - 1 - np.rint(64 * places[:, 1] / north) / 64
    np.testing.assert_allclose(places[:, 0], col * east, rtol=1e-14, atol=0)
    farthest = heightmap.rows * north  # a glTF node adds its translation, whose last bit is that of the whole extent
    np.testing.assert_allclose(places[:, 1], (heightmap.rows - 1 - row) * north, rtol=0, atol=4e-16 * farthest)
    return np.stack([col, row], -1)


def edges(faces):
    """Directed edges (3 m, 2) of faces."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


@pytest.mark.parametrize("ending", FORMATS)
def test_vertices_stand_on_posts_at_their_heights(drawn, ending, tmp_path):
    places, faces = saved(drawn, tmp_path / f"mesh{ending}")
    posts = posts_of(places, drawn.heightmap)
    assert np.array_equal(places[:, 2].astype("f4"), vertex_heights(drawn.terrain.filled, posts))
    true_m = vertex_heights(drawn.heightmap.heights, posts)
    solid = ~np.isnan(true_m)
    assert np.array_equal(true_m[solid], places[solid, 2].astype("f4"))
    assert np.array_equal(faces.ravel(), np.arange(3 * len(faces))), "each triangle has its own vertices"
    assert np.array_equal(posts.reshape(-1, 3, 2), drawn.triangles())


def test_count_is_that_of_the_stats(drawn, tmp_path):
    _, faces = saved(drawn, tmp_path / "mesh.ply")
    assert len(faces) == drawn.measure()["triangles"]


@pytest.mark.parametrize("ending", FORMATS)
def test_welded_mesh_is_the_map_once(drawn, ending, tmp_path):
    """Counter-clockwise triangles whose areas sum to the map's, and whose inner edges all have their reverse once."""
    places, faces = saved(drawn, tmp_path / f"mesh{ending}", weld=True)
    col, row = posts_of(places, drawn.heightmap).T
    assert len(np.unique(row * 2**16 + col)) == len(places), "a place is one vertex"
    corners = np.stack([col, -row], -1)[faces]
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    area = ax * by - ay * bx
    assert (area > 0).all()
    assert area.sum() == 2 * (drawn.heightmap.cols - 1) * (drawn.heightmap.rows - 1)
    one_way = edges(faces.astype("i8"))
    key, reverse = one_way @ [len(places), 1], one_way @ [1, len(places)]
    assert len(np.unique(key)) == len(key), "an edge is used once in each direction"
    alone = one_way[~np.isin(key, reverse)]
    rim = [c[alone] == end for c, end in ((col, 0), (row, 0), (col, drawn.heightmap.cols - 1))]
    rim.append(row[alone] == drawn.heightmap.rows - 1)
    assert np.any([side.all(1) for side in rim], 0).all(), "an edge without a partner lies on the map's rim"


def test_welding_keeps_every_triangle(drawn, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    places, faces = saved(drawn, tmp_path / "a" / "mesh.ply")
    welded, welded_faces = saved(drawn, tmp_path / "b" / "mesh.ply", weld=True)
    assert np.array_equal(places[faces], welded[welded_faces])


def test_progress_ends_at_one(drawn, tmp_path):
    told = []
    mesh = make_mesh(drawn.triangles(), drawn.terrain.filled, drawn.heightmap.spacing_m)
    write_mesh(tmp_path / "mesh.obj", mesh, told.append)
    assert told == sorted(told) and told[-1] == 1.0


TRIANGLE = np.array([[[0, 0], [0, 1], [1, 1]]])


def test_unknown_format(tmp_path):
    with pytest.raises(UsageError, match=r"must end in one of \.ply, \.glb, \.obj"):
        write_mesh(tmp_path / "mesh.stl", make_mesh(TRIANGLE, np.zeros((2, 2), "f4"), (1.0, 1.0)))


def test_failure_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "mesh.ply"
    path.write_text("old")
    mesh = make_mesh(TRIANGLE, np.zeros((2, 2), "f4"), (1.0, 1.0))

    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_mesh(path, mesh, stop)
    assert path.read_text() == "old" and len(list(tmp_path.iterdir())) == 1


def test_too_many_triangles_for_glb(tmp_path, monkeypatch):
    monkeypatch.setattr("terrain_gl.files.export.GLB_LIMIT", 100)
    with pytest.raises(TerrainError, match="more than a .glb file holds"):
        write_mesh(tmp_path / "mesh.glb", make_mesh(TRIANGLE, np.zeros((2, 2), "f4"), (1.0, 1.0)))
    assert not list(tmp_path.iterdir())
