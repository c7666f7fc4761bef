"""`check` of quantized-mesh: tiles of other tools, against the error that viewers assume."""

import gzip
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from commands import refused
from maps import rough
from test_tiling import write_map

pytest.importorskip("pyproj")
pytest.importorskip("rasterio")

LEVEL, COL, ROW, POSTS = 8, 266, 193, 65  # one tile of level 8, and a map whose posts are a grid of it
WIDTH = 180 / 2**LEVEL
STEP = WIDTH / (POSTS - 1)
DECLARED_M = 77067.34 / 2**LEVEL


def encoded(shares, heights_m, faces, wide=False):
    """A tile as its specification says: zigzag differences, and indices that count back from the newest vertex."""
    low, high = float(np.float32(heights_m.min())), float(np.nextafter(np.float32(heights_m.max()), np.float32(1e9)))
    columns = [*shares.T, (heights_m - low) / (high - low)]
    steps = [np.diff(np.rint(each * 32767).astype(int), prepend=0) for each in columns]
    vertices = np.concatenate([(step << 1) ^ (step >> 31) for step in steps]).astype("<u2").tobytes()
    codes, newest = [], 0
    for index in faces.ravel().tolist():
        codes.append(newest - index)
        newest += index == newest
    kind = "<u4" if wide else "<u2"
    head = struct.pack("<3d2f7dI", *[0.0] * 3, low, high, *[0.0] * 7, len(shares))
    data = head + vertices
    data += b"\0" * (-len(data) % np.dtype(kind).itemsize)
    modulus = 2 ** (8 * np.dtype(kind).itemsize)
    return data + struct.pack("<I", len(faces)) + (np.array(codes) % modulus).astype(kind).tobytes()


def tile_of(heights, step):
    """Vertices at every `step`-th post, from the south-west, and faces in the order of first use."""
    at = np.arange(0, POSTS, step)
    col, row = (each.ravel() for each in np.meshgrid(at, at))
    n = len(at)
    number = np.arange(n * n).reshape(n, n)
    a, b, c, d = (number[i : n - 1 + i, j : n - 1 + j].ravel() for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([c, b, d], -1)])
    return np.stack([col, row], -1) / (POSTS - 1), heights[POSTS - 1 - row, col].astype(float), faces


@pytest.fixture
def dem(folder):
    heights = rough(POSTS, POSTS, 2, 300).astype("f4")
    north_west = (COL * WIDTH - 180 - STEP / 2, (ROW + 1) * WIDTH - 90 + STEP / 2)
    return write_map("dem", heights, ("EPSG:4326", (*north_west, STEP, STEP))), heights


def write(data, scheme="tms", row=ROW, **head):
    path = Path("q") / str(LEVEL) / str(COL) / f"{row}.terrain"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    (Path("q") / "layer.json").write_text(json.dumps({"scheme": scheme, "projection": "EPSG:4326"} | head))


def found(run, dem):
    status, out, err = run("check", "q", "--map", dem, "--json", "-")
    assert err == "" or status == 1
    (tile,) = json.loads(out)["tiles"]
    return status, tile


def test_every_post_is_exact_but_for_curvature_and_quantisation(run, dem):
    dem, heights = dem
    shares, heights_m, faces = tile_of(heights, 1)
    write(encoded(shares, heights_m, faces))
    status, tile = found(run, dem)
    assert (status, tile["triangles"]) == (0, 2 * (POSTS - 1) ** 2)
    assert tile["posts"] >= (POSTS - 2) ** 2  # posts of the rim may lie beside it, by rounding
    assert tile["declared_m"] == pytest.approx(DECLARED_M, rel=1e-6)
    # heights have steps of relief / 32767, places too: WIDTH / 32767 is 1 / 512 of a cell
    steepest_m = max(np.abs(np.diff(heights, axis=i)).max() for i in (0, 1))
    assert tile["posts_m"] <= np.ptp(heights) / 32767 + 2 * steepest_m / 512 + 0.3


def test_the_error_of_a_wrong_vertex_is_found_in_all_ways_to_store_it(run, dem):
    dem, heights = dem
    shares, heights_m, faces = tile_of(heights, 1)
    heights_m[20 * POSTS + 30] += 500
    data = encoded(shares, heights_m, faces)
    other = 2**LEVEL - 1 - ROW
    for scheme, row, stored in (("tms", ROW, data), ("tms", ROW, gzip.compress(data)), ("slippyMap", other, data)):
        for old in Path().glob("q/*/*/*.terrain"):
            old.unlink()
        write(stored, scheme, row)
        status, tile = found(run, dem)
        assert status == 1 and tile["lies"] and tile["posts_m"] == pytest.approx(500, abs=3)


def test_coarse_tiles_have_the_error_of_their_triangles(run, dem):
    dem, heights = dem
    shares, heights_m, faces = tile_of(heights, 16)
    write(encoded(shares, heights_m, faces))
    true_m = found(run, dem)[1]["posts_m"]
    assert true_m > 30
    order = np.random.default_rng(0).permutation(len(shares))  # some tools store vertices in any order: codes wrap
    back = np.argsort(order)
    write(encoded(shares[order], heights_m[order], back[faces]))
    assert found(run, dem)[1]["posts_m"] == pytest.approx(true_m, rel=1e-6)


def test_damaged_tiles_get_one_line(run, dem):
    dem, heights = dem
    data = encoded(*tile_of(heights, 16))
    for broken in (data[:50], data[:-8], data[:88] + data[90:]):
        write(broken)
        refused(run("check", "q", "--map", dem), 1, "damaged")
    write(data, projection="EPSG:3857")
    refused(run("check", "q", "--map", dem), 1, "only in EPSG:4326")
