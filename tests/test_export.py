"""Mesh files: read by independent parsers, they contain exactly the surface that was drawn."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from maps import MAPS

from terrain_gl import Camera, Heightmap, Renderer, TerrainError, UsageError
from terrain_gl.files.export import make_mesh, write_mesh
from terrain_gl.image import png_bytes
from terrain_gl.mesh import vertex_heights
from terrain_gl.readers.georeference import Georeference, Grid
from terrain_gl.readers.place import Place
from terrain_gl.shade.picture import UNLIT

SMALL = ("odd", "holes", "two", "cliff", "long", "offset")
VIEW = Camera((1340, 1566, 119), (5380, -50, 19), 100.0)  # of "odd", close above the ground


@pytest.fixture(scope="module", params=[*SMALL, "middles"])
def drawn(request, session_context):
    """Give a renderer that has drawn all of a small map; with a budget also vertices in the middles of cells."""
    budget = request.param == "middles"
    heightmap = MAPS["odd" if budget else request.param]()
    with session_context as ctx, Renderer(heightmap, (320, 180), ctx=ctx) as renderer:
        if budget:
            renderer.draw(VIEW, triangles=5000, cull=False, style=UNLIT)
        else:
            renderer.draw(Camera.default(heightmap), 2.0, cull=False, style=UNLIT)
        assert (renderer.triangles() % 1).any() or not budget
        yield renderer


def saved(renderer, path, weld=True):
    """Write the drawn mesh and read it back: world positions (n, 3) and faces (m, 3)."""
    mesh = make_mesh(renderer.triangles(), renderer.terrain.filled, renderer.heightmap.spacing_m, weld)
    write_mesh(path, mesh)
    assert [each.name for each in path.parent.iterdir()] == [path.name]
    return READERS[path.suffix](path.read_bytes())[:2]


def read_ply(data):
    header, _, body = data.partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    n, m = (int(line.split()[2]) for line in lines if line.startswith("element"))
    assert [line for line in lines if line.startswith("property")] == [
        *(f"property double {axis}" for axis in "xyz"),
        *(f"property float {name}" for name in ("nx", "ny", "nz", "s", "t")),
        "property list uchar uint vertex_indices",
    ]
    vertices = np.frombuffer(body, [("place", "<f8", 3), ("normal", "<f4", 3), ("st", "<f4", 2)], n)
    faces = np.frombuffer(body, [("n", "u1"), ("at", "<u4", 3)], m, 44 * n)
    assert len(body) == 44 * n + 13 * m and (faces["n"] == 3).all()
    return vertices["place"], faces["at"], vertices["normal"], vertices["st"] * [1, -1] + [0, 1]


def read_obj(data):
    lines = [line.split() for line in data.decode("ascii").splitlines()]
    places, texture, normals = (np.array([line[1:] for line in lines if line[0] == k], "f8") for k in ("v", "vt", "vn"))
    corners = [[corner.split("/") for corner in line[1:]] for line in lines if line[0] == "f"]
    assert all(len(set(corner)) == 1 for face in corners for corner in face)
    faces = np.array(corners, "i8")[..., 0] - 1
    return places, faces, normals, texture * [1, -1] + [0, 1]


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
    stored, normals, texture = (arrays[primitive["attributes"][k]] for k in ("POSITION", "NORMAL", "TEXCOORD_0"))
    accessor = gltf["accessors"][primitive["attributes"]["POSITION"]]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)), abs=1e-6)
    assert accessor["min"] == stored.min(0).tolist() and accessor["max"] == stored.max(0).tolist()
    node = gltf["nodes"][gltf["scenes"][gltf["scene"]]["nodes"][0]]
    x, up, south = (stored.astype("f8") * node["scale"] + node["translation"]).T
    nx, ny, nz = (normals / node["scale"]).T  # the inverse transposed
    normals = np.stack([nx, -nz, ny], -1) / np.sqrt(nx**2 + ny**2 + nz**2)[:, None]
    return np.stack([x, -south, up], -1), arrays[primitive["indices"]].reshape(-1, 3), normals, texture


def glb_array(gltf, accessor, body):
    view = gltf["bufferViews"][accessor["bufferView"]]
    dtype = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
    width = {"VEC3": 3, "VEC2": 2, "SCALAR": 1}[accessor["type"]]
    count = width * accessor["count"]
    assert view["byteOffset"] % 4 == 0 and view["byteLength"] == 4 * count
    return np.frombuffer(body, dtype, count, view["byteOffset"]).reshape(-1, width)


READERS = {".ply": read_ply, ".obj": read_obj, ".glb": read_glb}


def posts_of(places, heightmap):
    """Columns and rows of world places, which must be exact multiples of 1/64 of the spacing, but for the last bit."""
    east, north = heightmap.spacing_m
    col, row = np.rint(64 * places[:, 0] / east) / 64, heightmap.rows - 1 - np.rint(64 * places[:, 1] / north) / 64
    np.testing.assert_allclose(places[:, 0], col * east, rtol=1e-14, atol=0)
    farthest = heightmap.rows * north  # a glTF node adds its translation: the sum's last bit is the whole extent's
    np.testing.assert_allclose(places[:, 1], (heightmap.rows - 1 - row) * north, rtol=0, atol=4e-16 * farthest)
    return np.stack([col, row], -1)


def edges(faces):
    """Directed edges (3 m, 2) of faces."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def rounding_m(ending, heights_m):
    """Half of a float32's last bit above the base of a .glb, which is no further off than twice the relief; else that
    of 15 digits, and of the float64 sum of base and height."""
    relief_m = max(np.ptp(heights_m), 1e-6 * np.abs(heights_m).max())
    return 1e-14 * np.abs(heights_m).max() + (2.0**-24 * 4 * relief_m if ending == ".glb" else 0.0)


@pytest.mark.parametrize("ending", READERS)
def test_vertices_stand_on_posts_at_their_heights(drawn, ending, tmp_path):
    places, faces = saved(drawn, tmp_path / f"mesh{ending}", weld=False)
    posts = posts_of(places, drawn.heightmap)
    drawn_m, true_m = (vertex_heights(heights, posts) for heights in (drawn.terrain.filled, drawn.heightmap.heights))
    np.testing.assert_allclose(places[:, 2], drawn_m, rtol=0, atol=rounding_m(ending, drawn_m))
    solid = ~np.isnan(true_m)
    np.testing.assert_allclose(places[solid, 2], true_m[solid], rtol=0, atol=rounding_m(ending, drawn_m))
    on_post = (posts % 1 == 0).all(1)
    assert np.array_equal(places[on_post, 2].astype("f4"), drawn_m[on_post].astype("f4"))
    assert np.array_equal(faces.ravel(), np.arange(3 * len(faces))), "each triangle has its own vertices"
    assert np.array_equal(posts.reshape(-1, 3, 2), drawn.triangles())


@pytest.fixture(scope="module", params=[(8848.0, 0.004), (-3000.0, 0.0005), (400.0, 300.0)])
def cut(request, session_context):
    """Give a renderer that has drawn a map far above zero, flat or not, and has cut its cells."""
    base, relief = request.param
    heights = base + relief * np.random.default_rng(1).random((17, 21))
    camera = Camera((10.0, 8.0, base + 2 * relief + 0.2), (10.0, 9.0, base), 60.0)
    with session_context as ctx, Renderer(Heightmap(heights.astype("f4"), 1.0), (320, 180), ctx=ctx) as renderer:
        renderer.draw(camera, 0.05 if relief > 1 else 2e-4, near_m=0.01, cull=False, style=UNLIT)
        assert (renderer.triangles() % 1).any()
        yield renderer


@pytest.mark.parametrize("ending", READERS)
def test_vertices_between_posts_of_high_land_are_not_rounded_to_its_height(cut, ending, tmp_path):
    """A float32 above zero is up to 0.0005 m off at 8,848 m: more than the certificate."""
    places, _ = saved(cut, tmp_path / f"mesh{ending}")
    true_m = vertex_heights(cut.heightmap.heights.astype("f8"), posts_of(places, cut.heightmap))
    assert np.abs(places[:, 2] - true_m).max() <= rounding_m(ending, true_m)


@pytest.mark.slow
def test_a_solid_of_high_land_is_rounded_to_its_own_size(cut, tmp_path):
    mesh = make_mesh(cut.triangles(), cut.terrain.filled, cut.heightmap.spacing_m)
    write_mesh(tmp_path / "m.stl", mesh)
    corners, _ = read_stl(tmp_path / "m.stl")
    mm_per_m = mesh.print_mm / max(cut.heightmap.extent_m)
    found = corners.reshape(-1, 3)
    world = mesh.world(slice(None))
    top = (world - world.min(0)) * mm_per_m + [0, 0, 0.02 * mesh.print_mm]
    last_bit = 2.0**-24 * top.max()
    numbered = {tuple(each) for each in top.astype("f4").tolist()}
    assert {tuple(each) for each in found.tolist() if each[2] > 0} == numbered
    assert np.abs(top.astype("f4") - top).max() <= last_bit


def test_count_is_that_of_the_stats(drawn, tmp_path):
    _, faces = saved(drawn, tmp_path / "mesh.ply")
    assert len(faces) == drawn.measure()["triangles"]


@pytest.mark.parametrize("ending", READERS)
def test_welded_mesh_is_the_map_once(drawn, ending, tmp_path):
    """Triangles are counter-clockwise, their areas sum to the map's, and each inner edge occurs once each way."""
    places, faces = saved(drawn, tmp_path / f"mesh{ending}")
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
    places, faces = saved(drawn, tmp_path / "a" / "mesh.ply", weld=False)
    welded, welded_faces = saved(drawn, tmp_path / "b" / "mesh.ply")
    assert np.array_equal(places[faces], welded[welded_faces])


def test_progress_ends_at_one(drawn, tmp_path):
    told = []
    mesh = make_mesh(drawn.triangles(), drawn.terrain.filled, drawn.heightmap.spacing_m)
    write_mesh(tmp_path / "mesh.obj", mesh, told.append)
    assert told == sorted(told) and told[-1] == 1.0


TRIANGLE = np.array([[[0, 0], [0, 1], [1, 1]]])


def test_unknown_format(tmp_path):
    with pytest.raises(UsageError, match=r"must end in one of \.ply, \.glb, \.obj, \.stl"):
        write_mesh(tmp_path / "mesh.fbx", make_mesh(TRIANGLE, np.zeros((2, 2), "f4"), (1.0, 1.0)))


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
    monkeypatch.setattr("terrain_gl.files.mesh_formats.GLB_LIMIT", 100)
    with pytest.raises(TerrainError, match="more than a .glb file holds"):
        write_mesh(tmp_path / "mesh.glb", make_mesh(TRIANGLE, np.zeros((2, 2), "f4"), (1.0, 1.0)))
    assert not list(tmp_path.iterdir())


# --- Normals, texture, origin -----------------------------------------------------------------------------------------


def plane(spacing=(20.0, 30.0), rise=(0.5, -0.25)):
    """A plane that rises east and north, and a few triangles on it."""
    y, x = np.mgrid[0:9, 0:13]
    heights = (rise[0] * spacing[0] * x + rise[1] * spacing[1] * (8 - y)).astype("f4")
    triangles = np.array([[[0, 0], [0, 8], [12, 8]], [[0, 0], [12, 8], [12, 0]], [[5, 2], [5, 3], [6.5, 3]]], "f4")
    return triangles, heights, spacing


@pytest.mark.parametrize("ending", READERS)
def test_normals_and_texture_places(ending, tmp_path):
    write_mesh(tmp_path / f"m{ending}", make_mesh(*plane()))
    places, _, normals, texture = READERS[ending]((tmp_path / f"m{ending}").read_bytes())
    expected = np.array([-0.5, 0.25, 1]) / np.linalg.norm([-0.5, 0.25, 1])
    assert normals == pytest.approx(np.broadcast_to(expected, normals.shape), abs=1e-6)
    col, row = places[:, 0] / 20, 8 - places[:, 1] / 30
    assert texture == pytest.approx(np.stack([(col + 0.5) / 13, (row + 0.5) / 9], -1), abs=1e-6)


@pytest.mark.parametrize("ending", READERS)
def test_normals_of_a_map_are_those_of_the_land(drawn, ending, tmp_path):
    """Slopes come from the next posts on both sides, and all normals point upwards."""
    mesh = make_mesh(drawn.triangles(), drawn.terrain.filled, drawn.heightmap.spacing_m)
    write_mesh(tmp_path / f"m{ending}", mesh)
    places, _, normals, _ = READERS[ending]((tmp_path / f"m{ending}").read_bytes())
    posts = posts_of(places, drawn.heightmap)
    whole = (posts == np.floor(posts)).all(1)
    col, row = posts[whole].astype(int).T
    north, east = (
        np.gradient(drawn.terrain.filled.astype("f8"), drawn.heightmap.spacing_m[1 - a], axis=a) for a in (0, 1)
    )
    expected = np.stack([-east[row, col], north[row, col], np.ones(len(row))], -1)
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert normals[whole] == pytest.approx(expected, abs=2e-5) and (normals[:, 2] > 0).all()


PICTURE = png_bytes(np.arange(9 * 13 * 3, dtype="u1").reshape(9, 13, 3))


def textured():
    return replace(make_mesh(*plane()), texture=PICTURE)


def test_a_glb_holds_its_texture(tmp_path):
    write_mesh(tmp_path / "m.glb", textured())
    data = (tmp_path / "m.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    gltf = json.loads(data[20 : 20 + length])
    view = gltf["bufferViews"][gltf["images"][0]["bufferView"]]
    start = 28 + length + view["byteOffset"]
    assert data[start : start + view["byteLength"]] == PICTURE and len(data) % 4 == 0
    assert gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    assert gltf["extensionsUsed"] == ["KHR_materials_unlit"] and [each.name for each in tmp_path.iterdir()] == ["m.glb"]


def test_ply_and_obj_have_their_texture_beside_them(tmp_path):
    write_mesh(tmp_path / "m.ply", textured())
    assert b"comment TextureFile m.png\n" in (tmp_path / "m.ply").read_bytes()
    assert (tmp_path / "m.png").read_bytes() == PICTURE
    write_mesh(tmp_path / "n.obj", textured())
    assert (tmp_path / "n.png").read_bytes() == PICTURE and "map_Kd n.png" in (tmp_path / "n.mtl").read_text()
    assert "mtllib n.mtl\nusemtl land\n" in (tmp_path / "n.obj").read_text()
    with pytest.raises(UsageError, match="has no texture"):
        write_mesh(tmp_path / "m.stl", textured())
    assert not (tmp_path / "m.stl").exists()


@pytest.mark.parametrize("ending", READERS)
def test_the_origin_is_recorded(ending, tmp_path):
    """With the numbers in the file, a vertex's metres become its coordinates on the ground."""
    place = Place(Georeference(Grid(0.5, 0, 400_000.25, 0, -0.75, 5_000_000.0), "EPSG:32632", (13, 9)), (20.0, 30.0))
    write_mesh(tmp_path / f"m{ending}", make_mesh(*plane(), place=place))
    data = (tmp_path / f"m{ending}").read_bytes()
    if ending == ".glb":
        told = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])["asset"]["extras"]
        crs, origin, scale = told["crs"], told["origin"], told["scale"]
    else:
        lines = [line.split() for line in data[:1000].decode("latin-1").splitlines()]
        told = {line[1]: line[2:] for line in lines if line[:1] in (["comment"], ["#"])}
        crs, origin, scale = told["crs"][0], *(list(map(float, told[k])) for k in ("origin", "scale"))
    places, *_ = READERS[ending](data)
    assert crs == "EPSG:32632"
    for x, y, _ in places:
        assert (origin[0] + scale[0] * x, origin[1] + scale[1] * y) == pytest.approx(place.to_map(x, y), rel=1e-12)


# --- A solid to print -------------------------------------------------------------------------------------------------


def read_stl(path):
    """(n, 3, 3) corners and (n, 3) normals."""
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0]
    assert len(data) == 84 + 50 * count
    triangles = np.frombuffer(data, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("zero", "<u2")], count, 84)
    return triangles["corners"].astype("f8"), triangles["normal"]


@pytest.mark.parametrize("weld", [True, False])
def test_an_stl_is_a_closed_solid_of_the_asked_size(drawn, tmp_path, weld):
    mesh = make_mesh(drawn.triangles(), drawn.terrain.filled, drawn.heightmap.spacing_m, weld)
    write_mesh(tmp_path / "m.stl", replace(mesh, print_mm=80.0))
    corners, normals = read_stl(tmp_path / "m.stl")
    names = {corner: i for i, corner in enumerate(sorted(set(map(tuple, corners.reshape(-1, 3)))))}
    faces = np.array([names[tuple(corner)] for corner in corners.reshape(-1, 3)]).reshape(-1, 3)
    one_way = edges(faces)
    key, reverse = one_way @ [len(names), 1], one_way @ [1, len(names)]
    assert np.array_equal(np.sort(key), np.sort(reverse)), "each edge has its reverse"
    a, b, c = np.moveaxis(corners, 1, 0)
    outward = np.cross(b - a, c - a)
    assert (np.einsum("ni,ni->n", outward, normals) >= 0).all()
    low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
    assert low == pytest.approx([0, 0, 0]) and max(high[:2]) == pytest.approx(80)
    volume = np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6
    scale = 80 / max(drawn.heightmap.extent_m)
    world = replace(mesh, posts=drawn.triangles().reshape(-1, 2)).world(slice(None))[:, 2].reshape(-1, 3)
    flat = np.abs(outward[: len(mesh.faces), 2]) / 2
    expected = (flat * ((world.mean(1) - world.min()) * scale + 0.02 * 80)).sum()
    assert volume == pytest.approx(expected, rel=1e-4)
