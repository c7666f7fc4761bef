"""Tile sets: a tile that declares less than its error is named; triangles sag below the curved ground."""

import json
import struct

import numpy as np
import pytest
from commands import refused
from maps import rough
from rasters import spaced, write_raster
from test_checking import gltf

pyproj = pytest.importorskip("pyproj")
pytest.importorskip("rasterio")

SPACING_M = 90.0
N = 65


@pytest.fixture
def dem(folder):
    """A map in UTM."""
    return write_raster("dem.tif", rough(N, N), spaced(SPACING_M))


def tile(heights, step, b3dm=False):
    """The map's every `step`-th post as a tile, and its transformation; float32 around its middle."""
    y, x = np.mgrid[0:N:step, 0:N:step]
    to_lonlat = pyproj.Transformer.from_crs("EPSG:32633", "EPSG:4979", always_xy=True)
    lon, lat = to_lonlat.transform(500000 + (x + 0.5) * SPACING_M, 5000000 - (y + 0.5) * SPACING_M)
    to_earth = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    at = np.stack(to_earth.transform(lon, lat, heights[::step, ::step].astype(float)), -1).reshape(-1, 3)
    middle = at.mean(0)
    number = np.arange(x.size).reshape(x.shape)
    nw, ne, sw, se = (number[i : i - 1 or None, j : j - 1 or None].ravel() for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack([nw, sw, se], -1), np.stack([nw, se, ne], -1)])
    near = at - middle - ([100.0, 0, 0] if not b3dm else 0)  # the node of `gltf` moves by 100 to the east
    data = gltf(np.stack([near[:, 0], near[:, 2], -near[:, 1]], -1).astype("<f4"), faces, {})
    if b3dm:
        features = json.dumps({"BATCH_LENGTH": 0, "RTC_CENTER": [-100.0, 0.0, 0.0]}).encode()
        data = (
            struct.pack("<4s6I", b"b3dm", 1, 28 + len(features) + len(data), len(features), 0, 0, 0) + features + data
        )
    matrix = np.eye(4)
    matrix[:3, 3] = middle
    return data, matrix.T.ravel().tolist()


def write_tiles(folder, heights, declared, b3dm=False):
    """A coarse tile with a finer child."""
    node = None
    for name, step in (("fine", 2), ("coarse", 8)):
        data, matrix = tile(heights, step, b3dm)
        ending = "b3dm" if b3dm else "glb"
        (folder / f"{name}.{ending}").write_bytes(data)
        inner = [] if node is None else [node]
        node = {"geometricError": declared[name], "content": {"uri": f"{name}.{ending}"}, "transform": matrix}
        node |= (
            {
                "children": [
                    {
                        "geometricError": 0,
                        "children": inner,
                        "transform": np.linalg.inv(np.array(matrix).reshape(4, 4)).ravel().tolist(),
                    }
                ]
            }
            if inner
            else {}
        )
    (folder / "tileset.json").write_text(json.dumps({"asset": {"version": "1.1"}, "geometricError": 999, "root": node}))


@pytest.mark.parametrize("b3dm", [False, True])
def test_tiles_are_measured_and_lies_are_named(dem, run, folder, b3dm):
    heights = rough(N, N)
    (folder / "tiles").mkdir()
    write_tiles(folder / "tiles", heights, {"fine": 1e3, "coarse": 1e3}, b3dm)
    status, out, err = run("check", "tiles", "--map", dem, "--json", "-")
    assert (status, err) == (0, "")
    found = {each["name"].partition(".")[0]: each for each in json.loads(out)["tiles"]}
    for name, step in (("fine", 2), ("coarse", 8)):
        y, x = np.mgrid[0:N, 0:N]
        r, c = np.minimum(y // step, (N - 1) // step - 1), np.minimum(x // step, (N - 1) // step - 1)
        u, v = x / step - c, y / step - r
        few = heights[::step, ::step].astype(float)
        nw, ne, sw, se = few[r, c], few[r, c + 1], few[r + 1, c], few[r + 1, c + 1]
        plane = np.where(v >= u, nw + v * (sw - nw) + u * (se - sw), nw + u * (ne - nw) + v * (se - ne))
        expected = np.abs(plane - heights).max()
        assert found[name]["posts_m"] == pytest.approx(expected, abs=0.03)
        assert found[name]["posts"] >= (N - 2) ** 2 and found[name]["surface_m"] >= found[name]["posts_m"]
    held = {name: 1.02 * each["posts_m"] for name, each in found.items()}
    write_tiles(folder / "tiles", heights, held, b3dm)
    status, out, _ = run("check", "tiles", "--map", dem)
    assert status == 0 and "1 to 1.05                2" in out
    write_tiles(folder / "tiles", heights, held | {"coarse": 0.4 * held["coarse"]}, b3dm)
    status, out, err = run("check", "tiles/tileset.json", "--map", dem)
    assert status == 1 and "1 of 2 tiles declare less" in err and "coarse" in err


def test_long_triangles_sag_below_the_curved_ground(run, folder, monkeypatch):
    """Two triangles over 300 km of sea: exact at their corners, and about 3.5 km too low in the middle."""
    monkeypatch.setattr("test_tilesets.SPACING_M", 3300.0)
    write_raster("sea.tif", np.zeros((N, N), "f4"), spaced(3300))
    (folder / "tiles").mkdir()
    data, matrix = tile(np.zeros((N, N)), N - 1)
    (folder / "tiles" / "a.glb").write_bytes(data)
    root = {"geometricError": 1e4, "content": {"uri": "a.glb"}, "transform": matrix}
    (folder / "tiles" / "tileset.json").write_text(json.dumps({"root": root}))
    found = json.loads(run("check", "tiles", "--map", "sea.tif", "--json", "-")[1])["tiles"][0]
    assert found["posts_m"] == pytest.approx((64 * 3300) ** 2 * 2 / 4 / 2 / 6.37e6, rel=0.05)


def test_tile_sets_that_cannot_be_read_get_one_line(dem, run, folder):
    refused(run("check", "none", "--map", dem), 1, "none: there is no such file or folder")
    (folder / "none").write_text("")
    refused(run("check", "none", "--map", dem), 2, "must end in")
    (folder / "tiles").mkdir()
    np.save("here.npy", np.zeros((N, N)))  # a map without a place: the file that is missing is named all the same
    for heightmap in (dem, "here.npy"):
        refused(run("check", "tiles", "--map", heightmap), 1, "tileset.json", "No such file")
    (folder / "tiles" / "tileset.json").write_text("[")
    refused(run("check", "tiles", "--map", "here.npy"), 1, "tileset.json", "damaged")
    (folder / "tiles" / "tileset.json").write_text('{"asset": {"extras": {"is_local": true}}, "root": {}}')
    refused(run("check", "tiles", "--map", "here.npy"), 1, "no tile lies on here.npy")
    for root in ({"implicitTiling": {}}, {"content": {"uri": "../x.glb"}}, {"content": {"uri": "x.glb"}}, []):
        (folder / "tiles" / "tileset.json").write_text(json.dumps({"root": root}))
        refused(run("check", "tiles", "--map", dem), 1)


def in_system(crs, heights, step=1):
    """The map's every `step`-th post in a coordinate system, by pyproj, and the faces between them."""
    y, x = np.mgrid[0:N:step, 0:N:step]
    at = 500000 + (x + 0.5) * SPACING_M, 5000000 - (y + 0.5) * SPACING_M, heights[::step, ::step].astype(float)
    to_lonlat = pyproj.Transformer.from_crs("EPSG:32633", "EPSG:4979", always_xy=True)
    at = pyproj.Transformer.from_crs("EPSG:4979", crs, always_xy=True).transform(*to_lonlat.transform(*at))
    number = np.arange(x.size).reshape(x.shape)
    nw, ne, sw, se = (number[i : i - 1 or None, j : j - 1 or None].ravel() for i in (0, 1) for j in (0, 1))
    return np.stack(at, -1).reshape(-1, 3), np.concatenate([np.stack([nw, sw, se], -1), np.stack([nw, se, ne], -1)])


def write_obj(name, places, faces):
    lines = ["v {:.12f} {:.12f} {:.12f}".format(*place) for place in places]
    lines += ["f {} {} {}".format(*(face + 1)) for face in faces]
    with open(name, "w") as file:
        file.write("\n".join(lines))


@pytest.mark.parametrize("crs", ["EPSG:32633", "EPSG:3035", "EPSG:32632", "EPSG:4978"])
def test_a_mesh_in_any_system_is_placed_by_pyproj(dem, run, folder, crs):
    """Every post is a vertex, half a metre too high; one is 7 m too high, and is found."""
    heights = rough(N, N)
    raised = heights.astype(float) + 0.5
    raised[20, 30] += 6.5
    places, faces = in_system(crs, raised)
    origin = np.floor(places.mean(0))
    write_obj("m.obj", places - origin, faces)
    words = "check", "m.obj", "--map", dem, "--origin", ",".join(map(str, origin))
    status, out, err = run(*words, "--crs", crs, "--json", "-")
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert found["max_error_posts_m"] == pytest.approx(7, abs=1e-3)
    assert found["place_m"] == pytest.approx([30 * SPACING_M, (N - 1 - 20) * SPACING_M], abs=1e-3)
    assert found["covered"] == pytest.approx(1, abs=1e-4) and found["flipped"] == found["t_junctions"] == 0
    refused(run(*words), 1, "beside the map", "--crs")
    refused(run(*words, "--crs", "EPSG:32650"), 1, "m")


def test_between_its_vertices_a_mesh_is_flat_in_its_own_system(run, folder, monkeypatch):
    """Two triangles over 300 km of sea: in metres from the Earth's middle, they are 3.5 km too low in between."""
    monkeypatch.setattr("test_tilesets.SPACING_M", 3300.0)
    sea = np.zeros((N, N), "f4")
    write_raster("sea.tif", sea, spaced(3300))
    for crs, expected in (("EPSG:4978", (64 * 3300) ** 2 * 2 / 4 / 2 / 6.37e6), ("EPSG:32633", 0.0)):
        write_obj("m.obj", *in_system(crs, sea, N - 1))
        found = json.loads(run("check", "m.obj", "--map", "sea.tif", "--crs", crs, "--json", "-")[1])
        assert found["max_error_posts_m"] == pytest.approx(expected, rel=0.05, abs=1e-6)
    assert found["triangles"] == 2


def test_tiles_in_another_system(dem, run, folder):
    heights = rough(N, N)
    places, faces = in_system("EPSG:3035", heights + 0.5)
    middle = np.floor(places.mean(0))
    x, y, z = (places - middle - [100, 0, 0]).T  # the node of `gltf` moves by 100 to the east
    (folder / "tiles").mkdir()
    (folder / "tiles" / "a.glb").write_bytes(gltf(np.stack([x, z, -y], -1).astype("<f4"), faces, {}))
    matrix = np.eye(4)
    matrix[:3, 3] = middle
    root = {"geometricError": 0.51, "content": {"uri": "a.glb"}, "transform": matrix.T.ravel().tolist()}
    (folder / "tiles" / "tileset.json").write_text(json.dumps({"root": root}))
    words = "check", "tiles", "--map", dem, "--json", "-"
    status, out, _ = run(*words, "--crs", "EPSG:3035")
    found = json.loads(out)["tiles"][0]
    assert status == 0 and found["posts_m"] == pytest.approx(0.5, abs=5e-3) and found["posts"] >= (N - 2) ** 2
    refused(run(*words), 1, "no tile lies on")
    refused(run(*words, "--crs", "EPSG:3035", "--origin", "1,2,3"), 2, "not for a tile set")


def test_systems_that_cannot_be_used_get_one_line(dem, run, folder):
    write_obj("m.obj", *in_system("EPSG:32633", rough(N, N)))
    np.save("flat.npy", rough(N, N))
    refused(run("check", "m.obj", "--map", dem, "--crs", "EPSG:4326"), 1, "in degrees")
    refused(run("check", "m.obj", "--map", dem, "--crs", "EPSG:1"), 1, "no coordinate system that PROJ knows")
    refused(run("check", "m.obj", "--map", "flat.npy", "--crs", "EPSG:32633"), 1, "does not say where it lies")
    refused(run("check", "m.obj", "--map", dem, "--crs", "ESRI:104903"), 1)
    refused(run("check", "m.obj", "--map", dem, "--crs", "IAU_2015:30110"), 1, "another planet")
