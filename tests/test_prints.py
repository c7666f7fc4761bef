"""Solids for a printer: neighbouring tiles that stand on one base and meet, and the level sea of --water."""

import struct
from pathlib import Path

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl.files.export import make_mesh, with_whole_rim
from terrain_gl.files.mesh_formats import rim_of
from terrain_gl.mesh import vertex_heights

pytest.importorskip("rasterio")


def land(low=300.0, high=900.0, shape=(65, 129)):
    y, x = np.mgrid[: shape[0], : shape[1]]
    wave = np.sin(x / 9) * np.cos(y / 7) + x / 60
    return (low + (high - low) * (wave - wave.min()) / np.ptp(wave)).astype(np.float32)


def write(path, heights, west=500000.0):
    write_raster(path, heights, spaced(20.0, west))


def corners(path):
    """(n, 3, 3) float32 millimetres of the triangles of a binary STL."""
    data = Path(path).read_bytes()
    assert len(data) == 84 + 50 * struct.unpack("<I", data[80:84])[0]
    record = np.dtype([("normal", "<3f4"), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
    return np.frombuffer(data[84:], record)["corners"]


def check_closed(triangles):
    """Each edge of a closed surface belongs to two triangles, in opposite directions."""
    points, number = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = number.reshape(-1, 3)
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forward = np.sort(edges @ [len(points), 1])
    assert len(np.unique(forward)) == len(forward)
    np.testing.assert_array_equal(forward, np.sort(edges @ [1, len(points)]))


def volume(triangles):
    a, b, c = np.moveaxis(triangles.astype(float), 1, 0)
    return float((a * np.cross(b, c)).sum()) / 6


@pytest.mark.parametrize("tall", [1.0, 2.0])
def test_neighbouring_tiles_meet(run, folder, tall):
    z = land()
    write("west.tif", z[:, :65])
    write("east.tif", z[:, 64:], 501280)
    profiles = []
    for name, x in (("west", 100.0), ("east", 0.0)):
        more = ("--exaggeration", f"{tall:g}", "--base-m", "250", "--print-mm", "100", "--max-error-m", "8")
        code, _, told = run("mesh", f"{name}.tif", "-o", f"{name}.stl", *more)
        assert code == 0, told
        solid = corners(f"{name}.stl")
        check_closed(solid)
        points = np.unique(solid.reshape(-1, 3), axis=0)
        rim = points[(np.abs(points[:, 0] - x) < 1e-6) & (points[:, 2] > 0)]
        profiles.append(rim[np.argsort(rim[:, 1])][:, 1:])
    assert profiles[0].shape == profiles[1].shape == (65, 2)
    assert np.abs(profiles[0] - profiles[1]).max() < 1e-3  # millimetres: a micrometre
    expected = tall * (z[::-1, 64] - 250) * 100 / 1280
    np.testing.assert_allclose(profiles[0][:, 1], expected, atol=1e-4)


def test_a_whole_rim_keeps_the_surface_within_twice_the_error():
    """Two triangles over a map: the rim becomes its posts, and the inside moves by no more than the rim."""
    heights = land(shape=(17, 33))
    square = np.array([[[0, 16], [32, 16], [32, 0]], [[0, 16], [32, 0], [0, 0]]], float)
    mesh = with_whole_rim(make_mesh(square, heights, (20.0, 20.0)))
    rim = np.unique(rim_of(mesh.faces.astype(np.int64)))
    on_rim = {(x, y) for x in range(33) for y in range(17) if x in (0, 32) or y in (0, 16)}
    assert {tuple(map(int, post)) for post in mesh.posts[rim]} == on_rim
    a, b, c = np.moveaxis(mesh.posts[mesh.faces], 1, 0)
    across = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (across < 0).all() and -across.sum() / 2 == 16 * 32  # no fold and no gap; rows count down
    np.testing.assert_array_equal(mesh.tops_m(slice(None)), vertex_heights(heights, mesh.posts))


def test_a_base_above_the_land_is_refused(run, folder):
    write("a.tif", land())
    assert "below the lowest height, 300 m, got 400" in run("mesh", "a.tif", "-o", "a.stl", "--base-m", "400")[2]
    assert "--base-m is for the solid" in run("mesh", "a.tif", "-o", "a.ply", "--base-m", "100")[2]


@pytest.mark.parametrize("ending", ["stl", "ply", "obj"])
def test_water_is_a_level_sea(run, folder, ending):
    heights = land(-120, 260, (65, 81))
    write("coast.tif", heights)
    assert run("mesh", "coast.tif", "-o", f"bed.{ending}", "--max-error-m", "1")[0] == 0
    code, _, told = run("mesh", "coast.tif", "-o", f"sea.{ending}", "--max-error-m", "1", "--water", "0")
    assert code == 0, told
    assert Path(f"bed.{ending}").read_bytes() != Path(f"sea.{ending}").read_bytes()
    if ending == "stl":
        solid = corners("sea.stl")
        check_closed(solid)
        scale = 150 / 1600
        top = solid.reshape(-1, 3)[:, 2]
        assert top.min() == 0 and top.max() == pytest.approx(3 + 260 * scale, rel=1e-5)
        sea = np.maximum(heights.astype(float), 0)
        cells = (sea[1:, 1:] + sea[1:, :-1] + sea[:-1, 1:] + sea[:-1, :-1]).sum() / 4 * 400
        land_mm3 = (cells + 3 / scale * 80 * 64 * 400) * scale**3
        assert volume(solid) == pytest.approx(land_mm3, abs=1.0 * 1600 * 1280 * scale**3)  # within 1 m everywhere
    elif ending == "obj":
        up = np.array(
            [line.split()[3] for line in Path("sea.obj").read_text().splitlines() if line.startswith("v ")], float
        )
        assert up.min() == 0 and up.max() == pytest.approx(260, abs=1)  # the peak need not be a vertex


def test_water_below_the_land_gets_a_line(run, folder):
    write("a.tif", land())
    assert (
        "without effect, because the lowest height is 300 m" in run("mesh", "a.tif", "-o", "a.ply", "--water", "3")[2]
    )


def test_a_sea_for_a_store_is_refused(run, folder):
    pytest.importorskip("zarr")
    write("a.tif", land())
    assert run("build", "a.tif", "-o", "a.zarr")[0] == 0
    assert "--no-cache" in run("mesh", "a.zarr", "-o", "a.ply", "--water", "500")[2]


@pytest.mark.slow
def test_a_texture_shows_the_water(run, folder):
    write("a.tif", land(-120, 260, (65, 81)))
    for name, water in (("dry", ()), ("wet", ("--water", "0"))):
        assert run("mesh", "a.tif", "-o", f"{name}.ply", "--texture", "64", *water)[0] == 0
    assert Path("dry.png").read_bytes() != Path("wet.png").read_bytes()
