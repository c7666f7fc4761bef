"""`tiles`: no tile declares less than its error, rims are closed or covered, and a build continues."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import refused
from maps import holes, rough
from rasters import write_raster

import terrain_gl as tg
from terrain_gl.files import tiling
from terrain_gl.files.tile_system import TileSystem
from terrain_gl.files.tilesets import _tiles
from terrain_gl.image import read_image
from terrain_gl.store import StoredMap, build

pyproj = pytest.importorskip("pyproj")
rasterio = pytest.importorskip("rasterio")
pytest.importorskip("pydelatin")

UTM = "EPSG:32633", (500000, 5000000, 90, 90)
DEGREES = "EPSG:4326", (7.0, 46.0, 1 / 1200, 1 / 1200)
MAPS = {
    "projected": (rough(65, 65), UTM),
    "degrees": (rough(70, 118, 1, 500), DEGREES),
    "voids": (holes(), UTM),
    "placeless": (rough(40, 90, 3), None),
    "sea": (np.zeros((65, 65)), DEGREES),
}


@pytest.fixture(autouse=True)
def small_tiles(monkeypatch):
    monkeypatch.setattr(tiling, "SIDE", 16)


def write_map(name, heights, place):
    """A file of heights in a coordinate system; returns its name."""
    if place is None:
        np.save(f"{name}.npy", heights)
        return f"{name}.npy"
    crs, (west, north, wide, high) = place
    return write_raster(f"{name}.tif", heights.astype("f4"), (wide, 0, west, 0, -high, north), crs, nodata=np.nan)


def make(run, name, *words):
    """Tiles of a map of `MAPS`; returns the map's name and the numbers of the command."""
    dem = write_map(name, *MAPS[name])
    words = words if MAPS[name][1] else (*words, "--spacing", 10)
    status, out, err = run("tiles", dem, "-o", "t", "--json", "-", *words)
    assert status == 0, err
    return dem, json.loads(out), err


@pytest.mark.parametrize("name", [name for name in MAPS if name != "placeless"])
def test_no_tile_declares_less_than_its_error(run, folder, name):
    dem, told, err = make(run, name, "--max-error-m", 0.5)
    assert err == "" and told["max_error_m"]["finest"] <= 0.5
    status, out, err = run("check", "t", "--map", dem, "--json", "-")
    found = json.loads(out)
    assert (status, err, found["lying"]) == (0, "", 0) and len(found["tiles"]) == told["tiles"]
    ratios = [tile["declared_m"] / tile["posts_m"] for tile in found["tiles"] if tile["posts_m"] > 0.1]
    assert not ratios or np.median(ratios) <= 1.05
    root = json.loads(Path("t/tileset.json").read_text())["root"]
    assert told["max_error_m"]["coarsest"] == root["geometricError"] >= root["extras"]["error_posts_m"]
    assert root["extras"]["error_surface_m"] >= root["extras"]["error_posts_m"]
    assert root["extras"]["skirt_m"] >= 0.5 * 2 ** (told["levels"] - 1)  # also on level sea: see docs/tiles.md


def test_a_map_without_a_place_has_local_tiles(run, folder):
    dem, told, err = make(run, "placeless", "--max-error-m", 1)
    assert "--local" in err and "gdal_translate" in err and told["is_local"]
    found = json.loads(run("check", "t", "--map", dem, "--spacing", 10, "--json", "-")[1])
    assert found["lying"] == 0 and {tile["declared_m"] / tile["posts_m"] for tile in found["tiles"]} == {1.0}
    whole = [tile for tile in found["tiles"] if tile["name"] == "3-0-0.glb"]
    assert whole[0]["posts"] == 40 * 90


def test_tiles_that_declare_too_little_are_refused(run, folder):
    dem, _, _ = make(run, "projected")
    file = Path("t/tileset.json")
    tileset = json.loads(file.read_text())
    waiting = [tileset["root"]]
    while waiting:
        tile = waiting.pop()
        tile["geometricError"] *= 0.4
        waiting += tile.get("children", [])
    file.write_text(json.dumps(tileset))
    status, _, err = run("check", "t", "--map", dem)
    assert status == 1 and "21 of 21 tiles declare less than their error" in err


def profiles(system, places, faces):
    """Columns and rows, heights of a tile's vertices, and which are vertices of land or only of skirts."""
    posts, tops_m = system.to_map(places)
    a, b, c = np.moveaxis(posts[faces], 1, 0)
    flat = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    of_land = np.zeros(len(posts), bool)
    of_land[faces[flat > 1e-3]] = True
    return posts, tops_m, of_land


def along(tile, axis, line, of_skirt):
    """Places along a line of posts and heights of the vertices of a tile's rim, or of its skirt."""
    posts, tops_m, of_land = tile
    here = (np.abs(posts[:, axis] - line) < 0.01) & (of_land != of_skirt)
    order = np.argsort(posts[here, 1 - axis])
    return posts[here, 1 - axis][order], tops_m[here][order]


@pytest.mark.parametrize("name", ["projected", "degrees"])
def test_rims_are_closed_or_covered_by_skirts(run, folder, name):
    """Where tiles of any levels meet, the higher rim's skirt reaches down to the lower rim."""
    dem, _, _ = make(run, name)
    heightmap = tg.Heightmap.open(dem)
    system = TileSystem(heightmap)
    tiles = {}
    for file, _, places, faces in _tiles(Path("t/tileset.json"), np.eye(4)):
        tiles[tuple(map(int, file[:-4].split("-")))] = profiles(system, places, faces)
    cracks_m, met, closed = [], 0, []
    last = heightmap.cols - 1, heightmap.rows - 1
    for (level_a, *at_a), a in tiles.items():
        for (level_b, *at_b), b in tiles.items():
            for axis in (0, 1):
                ends = [(16 << level) * (at[1 - axis] + i) for level, at, i in ((level_a, at_a, 1), (level_b, at_b, 0))]
                spans = [
                    ((16 << level) * at[axis], (16 << level) * (at[axis] + 1))
                    for level, at in ((level_a, at_a), (level_b, at_b))
                ]
                low, high = max(s[0] for s in spans), min(*(s[1] for s in spans), last[1 - axis])
                if ends[0] != ends[1] or ends[0] >= last[axis] or low >= high:
                    continue
                met += 1
                posts = np.arange(low, high + 1)
                tops_m = [np.interp(posts, *along(tile, axis, ends[0], False)) for tile in (a, b)]
                bottoms_m = [np.interp(posts, *along(tile, axis, ends[0], True)) for tile in (a, b)]
                higher = np.where(tops_m[0] > tops_m[1], bottoms_m[0], bottoms_m[1])
                assert (higher <= np.minimum(*tops_m)).all(), (level_a, at_a, level_b, at_b)
                between_m = np.abs(tops_m[0] - tops_m[1]).max()
                (closed if level_a == level_b else cracks_m).append(between_m)
    assert met > 40 and max(closed) < 0.01 and max(cracks_m) > 1, "without skirts there would be cracks"


@pytest.mark.slow
@pytest.mark.parametrize("rough_rim", [True, False])
def test_rims_have_no_triangles_thinner_than_a_pixel(run, folder, monkeypatch, rough_rim):
    """A plain with a rock beside the rim of two tiles: rims have all posts. Renderers may leave slivers out."""
    monkeypatch.setattr(tiling, "SIDE", 128)
    if not rough_rim:
        monkeypatch.setattr(tiling, "_ROUGH", 0)
    heights = np.zeros((257, 257))
    heights[15, 127] = heights[127, 15] = 20
    np.save("plain.npy", heights)
    assert run("tiles", "plain.npy", "-o", "t", "--spacing", 1, "--max-error-m", 2)[0] == 0
    thinnest = 1.0  # in cells of the tile's lattice
    for file, _, places, faces in _tiles(Path("t/tileset.json"), np.eye(4)):
        corners = places[faces] / 2 ** int(file[0])
        sides = corners[:, [1, 2, 0], :2] - corners[..., :2]
        area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
        thinnest = min(thinnest, (area / np.linalg.norm(sides, axis=2).max(1))[area > 0.5].min())  # without skirts
    assert thinnest > 0.05 if rough_rim else thinnest < 0.02


@pytest.mark.slow
def test_the_curved_ground_counts(run, folder):
    """Sea over 96 km: the finest tiles are within 2 m of the curved ground; local tiles are flat."""
    dem = write_map("wide", np.zeros((65, 65)), (UTM[0], (500000, 5000000, 1500, 1500)))
    told = json.loads(run("tiles", dem, "-o", "t", "--max-error-m", 2, "--json", "-")[1])
    flat = json.loads(run("tiles", dem, "-o", "f", "--max-error-m", 2, "--local", "--json", "-")[1])
    assert 0 == flat["max_error_m"]["finest"] < told["max_error_m"]["finest"] <= 2
    assert flat["max_error_m"]["coarsest"] == 0 and told["max_error_m"]["coarsest"] > 2
    assert told["triangles"] > flat["triangles"]
    tiles = json.loads(run("check", "t", "--map", dem, "--json", "-")[1])["tiles"]
    assert not any(tile["lies"] for tile in tiles)
    for tile in tiles:  # dividing triangles for the check leaves no gaps, where posts would not be measured
        side = 16 << int(tile["name"][0])
        assert tile["posts"] >= (side - 1) ** 2


def test_voids_are_cut_out(run, folder):
    make(run, "voids", "--local")
    heights = holes().astype("f4")
    void = np.isnan(heights)
    system = TileSystem(tg.Heightmap(heights, 90.0), None)
    land = ~(void[1:, 1:] | void[1:, :-1] | void[:-1, 1:] | void[:-1, :-1])
    area = 0.0
    for file, _, places, faces in _tiles(Path("t/tileset.json"), np.eye(4)):
        posts, _ = system.to_map(places)
        corners = posts[faces]
        turn = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        if file.startswith("0-"):
            area += np.abs(turn).sum() / 2
            middles = np.floor(corners[np.abs(turn) > 1e-3].mean(1)).astype(int)
            assert land[middles[:, 1], middles[:, 0]].all()
    assert area == pytest.approx(land.sum(), rel=1e-5)


def test_an_interrupted_build_continues(run, folder, monkeypatch):
    dem, _, _ = make(run, "projected")
    made, real = [], tiling.Tiling.make

    def failing(self, key, picture):
        if len(made) == 9:
            raise KeyboardInterrupt
        made.append(key)
        return real(self, key, picture)

    monkeypatch.setattr(tiling.Tiling, "make", failing)
    assert run("tiles", dem, "-o", "u")[0] == 130 and not Path("u").exists()
    monkeypatch.setattr(tiling.Tiling, "make", lambda self, key, picture: made.append(key) or real(self, key, picture))
    assert run("tiles", dem, "-o", "u")[0] == 0 and len(made) == len(set(made)) == 21
    files = {path.name: path.read_bytes() for path in Path("t").iterdir()}
    assert files == {path.name: path.read_bytes() for path in Path("u").iterdir()}
    assert sorted(path.name for path in Path().iterdir()) == ["projected.tif", "t", "u"]


def test_other_options_begin_anew(run, folder, monkeypatch):
    dem = write_map("projected", *MAPS["projected"])
    real = tiling.Tiling.make
    made = []
    monkeypatch.setattr(tiling, "_tree", lambda *_: 1 / 0)
    for error in (1, 1, 2):
        monkeypatch.setattr(
            tiling.Tiling, "make", lambda self, key, picture: made.append(key) or real(self, key, picture)
        )
        with pytest.raises(ZeroDivisionError):
            run("tiles", dem, "-o", "t", "--max-error-m", error)
    assert len(made) == 2 * 21


@pytest.mark.slow
def test_a_store_is_read_part_by_part_and_has_the_same_tiles(run, folder, monkeypatch):
    pytest.importorskip("zarr")
    monkeypatch.setattr("terrain_gl.files.tilesets._BLOCK", 32)
    dem = write_map("voids", *MAPS["voids"])
    assert run("tiles", dem, "-o", "t")[0] == 0
    build(dem, "dem.zarr", tile=16, shard=32)
    most, real = [0], StoredMap.part

    def part(self, rows, cols, level=0):
        most[0] = max(most[0], (rows.stop - rows.start) * (cols.stop - cols.start))
        return real(self, rows, cols, level)

    monkeypatch.setattr(StoredMap, "part", part)
    assert run("tiles", "dem.zarr", "-o", "u")[0] == 0 and 0 < most[0] <= 33**2
    for path in Path("t").iterdir():
        assert path.read_bytes() == (Path("u") / path.name).read_bytes(), path
    refused(run("tiles", "dem.zarr", "-o", "v", "--spacing", 3), 2, "its own scales")


def test_what_cannot_be_tiled_gets_one_line(run, folder, monkeypatch):
    dem = write_map("projected", *MAPS["projected"])
    Path("there").mkdir()
    refused(run("tiles", dem, "-o", "there"), 1, "exists already")
    refused(run("tiles", dem, "-o", "none/t"), 1, "make it first")
    refused(run("tiles", dem, "-o", dem), 2, "also an input")
    refused(run("tiles", "none.tif", "-o", "t"), 1, "neither a file")
    moon = write_map("moon", MAPS["projected"][0], ("+proj=longlat +R=1737400", DEGREES[1]))
    status, _, err = run("tiles", moon, "-o", "t")
    assert status == 1 and "another planet" in err and "--local" in err
    assert run("tiles", moon, "-o", "t", "--local")[0] == 0


def files_of(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def writing(*words):
    """A process that writes tiles, in a session of its own."""
    command = [sys.executable, "-m", "terrain_gl", "tiles", *words, "-o", "u", "--workers", "2"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)


@pytest.mark.slow
def test_a_store_has_the_texture_of_its_raster(run, folder):
    """From straight above, two triangles would be exact enough; their tile has no detail for light and colours."""
    pytest.importorskip("zarr")
    y, x = np.mgrid[0:129, 0:129]
    dem = write_map("hills", 400 * np.sin(x / 4) * np.cos(y / 5), UTM)
    build(dem, "hills.zarr", tile=16, shard=64)
    pictures = []
    for name in (dem, "hills.zarr"):
        assert run("tiles", name, "-o", f"{name}.t", "--texture", 129, "--max-error-m", 50)[0] == 0
        pictures.append(glb_parts(f"{name}.t/3-0-0.glb")[2].astype(float).mean(2))
    assert np.corrcoef(pictures[0].ravel(), pictures[1].ravel())[0, 1] > 0.9


@pytest.mark.slow
def test_workers_write_the_same_bytes_though_all_are_killed(run, folder, monkeypatch):
    monkeypatch.setattr(tiling, "SIDE", 256)  # as in workers
    dem = write_map("many", rough(600, 520, 2, 300), UTM)
    how = "--texture", "200", "--max-error-m", "1.5"
    assert run("tiles", dem, "-o", "t", *how)[0] == 0 and len(files_of("t")) == 9 + 4 + 1 + 1
    process = writing(dem, *how)
    while process.poll() is None and len(list(Path().glob(".u.partial/*.glb"))) < 3:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not Path("u").exists()
    written = {path: path.stat().st_mtime_ns for path in Path(".u.partial").glob("*.glb")}
    assert 3 <= len(written) < 14
    process = writing(dem, *how)
    assert process.communicate()[1] == "" and process.returncode == 0
    assert files_of("u") == files_of("t")
    same = [path for path, ns in written.items() if (Path("u") / path.name).stat().st_mtime_ns == ns]
    assert len(same) >= len(written) - 1  # a tile whose record was not written is made again


def test_a_cluster_writes_the_same_bytes(run, folder):
    """Its workers are threads that get their tasks by TCP; `--workers` tests other processes."""
    distributed = pytest.importorskip("distributed")
    dem = write_map("projected", *MAPS["projected"])
    assert run("tiles", dem, "-o", "t")[0] == 0
    how = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "protocol": "tcp", "memory_limit": None}
    with distributed.LocalCluster(**how, host="127.0.0.1", dashboard_address=None) as cluster:
        assert run("tiles", dem, "-o", "u", "--scheduler", cluster.scheduler_address)[0] == 0
        done = [each.state.executed_count for each in cluster.workers.values()]
    assert sum(done) == 21 and files_of("u") == files_of("t")


def glb_parts(path):
    """The JSON of a .glb, its vertices' attributes, and its picture."""
    data = Path(path).read_bytes()
    size = int.from_bytes(data[12:16], "little")
    head, body = json.loads(data[20 : 20 + size]), data[28 + size :]
    views = [body[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in head["bufferViews"]]
    places, _, at = (np.frombuffer(view, "<f4").reshape(-1, n) for view, n in zip(views, (3, 3, 2), strict=False))
    Path("picture.jpg").write_bytes(views[-1])
    return places, at, read_image("picture.jpg")


def test_a_texture_lies_where_the_look_from_above_has_it(run, folder):
    """At the vertices of all tiles, the colours of the tile's picture are those of the picture of the whole map."""
    heights = MAPS["projected"][0]
    dem = write_map("projected", heights, UTM)
    look = "--texture", 260, "--look", "tint"
    assert run("tiles", dem, "-o", "t", "--local", *look)[0] == 0
    assert run("mesh", dem, "-o", "m.ply", *look)[0] == 0
    whole = read_image("m.png").astype(float)
    for path in Path("t").glob("*.glb"):
        places, at, picture = glb_parts(path)
        assert at.min() >= 0 and at.max() <= 1
        tile = json.loads(Path("t/tileset.json").read_text())["root"]
        matrix = np.eye(4)
        waiting = [(tile, matrix)]
        while waiting:
            tile, above = waiting.pop()
            world = above @ np.array(tile["transform"]).reshape(4, 4).T
            waiting += [(child, world) for child in tile.get("children", [])]
            if tile["content"]["uri"] == path.name:
                east, _, south = places.T
                placed = np.stack([east, -south, places[:, 1]], -1) @ world[:3, :3].T + world[:3, 3]
        on_whole = np.stack([placed[:, 0] / 90 + 0.5, 65 - placed[:, 1] / 90 - 0.5], -1) / 65
        x, y = np.minimum((at * picture.shape[1::-1]).astype(int), np.array(picture.shape[1::-1]) - 1).T
        i, j = np.minimum((on_whole * 260).astype(int), 259).T
        assert np.abs(picture[y, x] - whole[j, i]).mean() < 6, path
    assert (Path("t") / "2-0-0.glb").stat().st_size > (Path("t") / "0-0-0.glb").stat().st_size
    before = files_of("t")
    assert run("tiles", dem, "-o", "p", "--local")[0] == 0
    assert json.loads(before["tileset.json"]) == json.loads(files_of("p")["tileset.json"])  # no error depends on it
