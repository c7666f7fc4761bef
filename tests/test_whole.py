"""Meshes of whole maps: within the tolerance at every post, with the error between posts beside it, and closed."""

import builtins
import json

import numpy as np
import pytest
from commands import refused
from maps import MAPS, rough
from test_export import edges, read_ply, read_stl

from terrain_gl.basics.exceptions import NotInstalledError, UsageError
from terrain_gl.files import whole
from terrain_gl.files.maps import open_map
from terrain_gl.files.whole import whole_mesh
from terrain_gl.heightmap import Heightmap


def errors_m(heights, mesh):
    """The largest error at posts, and at 20 x 20 places in each cell, by a search for the triangle over each place."""
    interpolate = pytest.importorskip("scipy.interpolate")
    spatial = pytest.importorskip("scipy.spatial")
    rows, cols = heights.shape
    # Delaunay triangulations of the same vertices differ, so the mesh's own triangles are searched by their middles
    tree = spatial.cKDTree(mesh.triangles.mean(1))
    x, y = (
        a.ravel()
        for a in np.meshgrid(
            np.linspace(0, cols - 1, 20 * (cols - 1) + 1), np.linspace(0, rows - 1, 20 * (rows - 1) + 1)
        )
    )
    truth = interpolate.RegularGridInterpolator((range(rows), range(cols)), heights.astype(float))(np.stack([y, x], -1))
    drawn = np.full(len(x), np.nan)
    near = tree.query(np.stack([x, y], -1), min(40, len(mesh.faces)))[1]
    for each in np.atleast_2d(near.T):
        corners = mesh.triangles[each]
        a, b, c = np.moveaxis(corners, 1, 0)
        weights = np.linalg.solve(np.stack([b - a, c - a], -1), (np.stack([x, y], -1) - a)[..., None])[..., 0]
        inside = np.isnan(drawn) & (weights.min(-1) >= -1e-9) & (weights.sum(-1) <= 1 + 1e-9)
        tops = mesh.filled[corners[..., 1].astype(int), corners[..., 0].astype(int)].astype(float)
        at = tops[:, 0] + weights[:, 0] * (tops[:, 1] - tops[:, 0]) + weights[:, 1] * (tops[:, 2] - tops[:, 0])
        drawn = np.where(inside, at, drawn)
    assert np.isnan(drawn).mean() < 0.02  # thin triangles, whose middles are far
    error = np.abs(drawn - truth)
    at_post = (x == np.rint(x)) & (y == np.rint(y))
    return np.nanmax(error[at_post]), np.nanmax(error)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.005, 0.05])
def test_errors_are_those_of_a_search(share):
    heights = rough(33, 41)
    asked = float(share * np.ptp(heights))
    mesh = whole_mesh(Heightmap(heights), asked)
    at_posts, anywhere = errors_m(heights, mesh)
    assert at_posts <= mesh.error.posts + 1e-6 and mesh.error.posts <= asked
    assert 0.9 * mesh.error.surface <= anywhere <= mesh.error.surface + 1e-6
    assert mesh.error.covered == pytest.approx(1) and mesh.error.overlap < 1e-9


@pytest.mark.parametrize("name", MAPS)
def test_all_posts_are_within_the_tolerance(name):
    heightmap = MAPS[name]()
    low, high = heightmap.range_m
    for asked in (max(0.01 * (high - low), 1e-6), 1e-6):
        mesh = whole_mesh(heightmap, asked)
        assert mesh.error.posts <= asked and mesh.error.posts_covered == 1
        a, b, c = np.moveaxis(mesh.triangles, 1, 0)
        turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        assert (turn < 0).all() and -turn.sum() == 2 * (heightmap.rows - 1) * (heightmap.cols - 1)


def test_rounding_of_the_library_is_no_excuse(monkeypatch):
    """pydelatin compares in float32, so a mesh may be off by a digit more than asked: then a finer one is tried."""
    heights = (8000 + 0.37 * rough(65, 65)).astype("f4")
    tolerances = []
    made = whole.delaunay

    def coarser(filled, tolerance_m):
        tolerances.append(tolerance_m)
        return made(filled, 3.0 if len(tolerances) < 3 else tolerance_m)

    monkeypatch.setattr(whole, "delaunay", coarser)
    mesh = whole_mesh(Heightmap(heights), 1.0)
    assert len(tolerances) == 3 and tolerances == sorted(tolerances, reverse=True) and mesh.error.posts <= 1.0
    monkeypatch.setattr(whole, "delaunay", lambda filled, _: made(filled, 3.0))
    mesh = whole_mesh(Heightmap(heights), 1.0)
    assert mesh.error.posts == 0 and len(mesh.faces) == 2 * 64 * 64
    assert (mesh.error.surface, mesh.error.surface_rms) == pytest.approx(mesh.of_every_post)


@pytest.mark.slow
def test_few_triangles():
    """Delaunay triangles follow the land; 0.5 % of the relief of this map took 374,113 triangles of a quadtree."""
    heightmap, _ = open_map("alpine")
    low, high = heightmap.range_m
    mesh = whole_mesh(heightmap, 0.005 * (high - low))
    assert len(mesh.faces) <= 0.45 * 374113 and mesh.error.posts <= 0.005 * (high - low)


def test_a_map_for_the_library_must_fit_into_memory(monkeypatch, run, folder):
    np.save(folder / "dem.npy", rough(9, 9))
    monkeypatch.setattr(whole, "is_too_large", lambda rows, cols: True)
    with pytest.raises(UsageError, match="--between"):
        whole_mesh(Heightmap(rough(9, 9)), 1.0)
    monkeypatch.setattr("terrain_gl.cli.mesh.is_huge", lambda path, reading: True)
    refused(run("mesh", "dem.npy", "-o", "m.ply"), 2, "--between")


def test_without_the_library_a_line_names_it(monkeypatch, run, folder):
    np.save(folder / "dem.npy", rough(9, 9))
    real = builtins.__import__

    def without(name, *more, **named):
        if name == "pydelatin":
            raise ImportError("No module named 'pydelatin'")
        return real(name, *more, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(NotInstalledError):
        whole_mesh(Heightmap(rough(9, 9)), 1.0)
    refused(run("mesh", "dem.npy", "-o", "m.ply"), 1, "--between", "pip install 'terrain-gl[mesh]'")
    assert run("mesh", "dem.npy", "-o", "m.ply", "--between")[0] == 0


def with_voids():
    heights = rough(60, 90, 2)
    heights[20:33, 40:70] = heights[:9, :12] = np.nan
    return heights


def test_the_numbers_are_those_of_the_file(folder, run):
    """Cutting voids out leaves the surface as it is; the file's own triangles have the errors that are told."""
    heights = with_voids()
    np.save(folder / "map.npy", heights)
    told = {}
    for voids in ("fill", "hole"):
        status, out, _ = run("mesh", "map.npy", "--spacing", 10, "--voids", voids, "-o", f"{voids}.ply", "--json", "-")
        told[voids] = json.loads(out)
        assert status == 0
        places, faces = read_ply((folder / f"{voids}.ply").read_bytes())[:2]
        posts = np.stack([places[:, 0] / 10, 59 - places[:, 1] / 10], -1)
        error = whole.check_mesh(heights, posts, places[:, 2], faces.astype(int))
        for key, value in (("max_error_posts_m", error.posts), ("max_error_surface_m", error.surface)):
            assert told[voids][key] == pytest.approx(value, abs=1e-6)
        assert told[voids]["rms_error_surface_m"] == pytest.approx(error.surface_rms, abs=1e-6)
        assert error.covered == pytest.approx(1)


@pytest.mark.parametrize("voids", ["fill", "hole"])
def test_solids_are_closed(folder, run, voids):
    np.save(folder / "map.npy", with_voids())
    assert run("mesh", "map.npy", "--spacing", 10, "--voids", voids, "-o", "m.stl")[0] == 0
    corners, _ = read_stl(folder / "m.stl")
    names = {corner: i for i, corner in enumerate(sorted(set(map(tuple, corners.reshape(-1, 3)))))}
    one_way = edges(np.array([names[tuple(corner)] for corner in corners.reshape(-1, 3)]).reshape(-1, 3))
    assert np.array_equal(np.sort(one_way @ [len(names), 1]), np.sort(one_way @ [1, len(names)]))
