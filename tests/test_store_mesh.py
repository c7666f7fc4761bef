"""Budgets and meshes of stores: as many triangles as asked for, and files with the triangles that are drawn."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import refused
from hostile import cut_heights
from maps import MAPS
from ring_scenes import check_covered_once, clipmap_of, doubled_areas, triangles_of

from terrain_gl.camera import Camera
from terrain_gl.files.views import standard_view
from terrain_gl.mesh import vertex_heights
from terrain_gl.reference import bilinear_heights
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import UNLIT

pytest.importorskip("zarr")
from terrain_gl.store.opened import StoredMap

SIZE = (160, 90)


# --- Budgets ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("view", ["valley", pytest.param("default", marks=pytest.mark.slow)])
def test_a_budget_of_a_store_is_spent_about_as_well_as_that_of_the_whole_map(hills, view):
    whole, path = hills
    camera = standard_view(whole, view)
    with Renderer(whole, SIZE) as one, Renderer(StoredMap(path), SIZE) as other:
        for budget in (300, 3000):
            for renderer in (one, other):
                renderer.draw(camera, triangles=budget, style=UNLIT)
            best, found = one.measure(), other.measure()
            assert found["complete"] and found["within_tolerance"] == 1
            assert 0.9 * best["triangles"] <= found["triangles"] <= budget == found["requested_triangles"]
            assert found["max_error_px"] <= found["certified_max_error_px"]
            assert found["rms_error_px"] <= 1.15 * best["rms_error_px"]


def test_a_budget_loads_no_more_than_it_can_use(hills):
    whole, path = hills
    camera = standard_view(whole, "default")
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        few, many = (renderer.draw(camera, triangles=n, style=UNLIT)["tiles_resident"] for n in (900, 6000))
        assert len(renderer.terrain.roots) < few < many


def test_a_budget_whose_tiles_have_no_room_says_so(hills):
    whole, path = hills
    stored = StoredMap(path)
    stored.gpu_bytes = 300 << 10
    with Renderer(stored, SIZE) as renderer:
        renderer.draw(standard_view(whole, "default"), triangles=6000, style=UNLIT)
        stats = renderer.measure()
        assert not stats["complete"] and "no room" in stats["tiles_missing"][0]["reason"]
        assert stats["within_tolerance"] < 1 and stats["max_error_px"] <= stats["certified_max_error_px"]


@pytest.mark.slow
def test_a_flight_that_does_not_wait_keeps_to_its_budget(hills):
    whole, path = hills
    with Renderer(StoredMap(path), SIZE) as renderer:
        renderer.streaming.waits = False
        for x in np.linspace(100, 300, 6):
            stats = renderer.draw(Camera((x, 50, whole.range_m[1] + 40), (x, 300, 0)), triangles=2000, style=UNLIT)
            assert stats["triangles"] <= 2000
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"]


# --- The whole map ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["odd", "cliff", "two"])
def test_the_clipmap_covers_a_whole_map_within_metres(ctx, name):
    scene = clipmap_of(ctx, MAPS[name]())
    low, high = scene.heightmap.range_m
    for share in (0.1, 0.003):
        asked_m = max(share * (high - low), 0.01)
        selection = scene.levels.select_everywhere(asked_m)
        drawn = triangles_of(selection)
        check_covered_once(drawn, scene.heightmap)
        assert selection.certified_px <= asked_m
        assert largest_error_m(scene.heightmap, drawn["post"].astype(float)) <= selection.certified_px


def largest_error_m(heightmap, corners, filled=None):
    """Largest vertical distance from the truth at places at random in triangles with vertices on the truth."""
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 16)
    drawn = vertex_heights(heightmap.heights if filled is None else filled, corners).astype(float) @ weights.T
    places = np.einsum("nk,tki->tni", weights, corners)
    truth = bilinear_heights(heightmap.heights.astype(float), places[..., 0], places[..., 1])
    return float(np.abs(drawn - truth).max())


def test_a_whole_store_within_metres(hills):
    whole, path = hills
    with Renderer(StoredMap(path), SIZE) as renderer, renderer.session:
        for asked_m in (6.0, 0.5):
            corners, stats = renderer.inspector.triangulate(asked_m)
            assert stats["complete"] and stats["certified_max_error_m"] <= asked_m == stats["requested_max_error_m"]
            found_m = largest_error_m(whole, corners.astype(float), renderer.terrain.filled)
            assert found_m <= stats["certified_max_error_m"] + 1e-4
            assert abs(doubled_areas(corners.astype(float)).sum()) == 2 * (whole.rows - 1) * (whole.cols - 1)


# --- The command line -------------------------------------------------------------------------------------------------


def vertices_of(path):
    """Positions in a PLY file of `mesh`."""
    head, _, body = Path(path).read_bytes().partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    record = np.dtype([("at", "<f8", 3), ("normal", "<f4", 3), ("texture", "<f4", 2)])
    return np.frombuffer(body, record, count)["at"]


@pytest.mark.slow
def test_mesh_writes_the_whole_store_and_its_views(store, run, hills):
    whole, _ = hills
    for words in (
        ("--max-error-m", 2),
        ("--max-error-m", 2, "--between"),
        ("--view", "valley", "--max-error", 2),
        ("--view", "valley", "--triangles", 900),
    ):
        status, out, err = run("mesh", store, "-o", "m.ply", "--size", "96x64", *words, "--json", "-")
        stats = json.loads(out)
        assert (status, err) == (0, "") and stats.get("complete", words == ("--max-error-m", 2))
        x, y, z = vertices_of("m.ply").T
        truth = bilinear_heights(whole.heights.astype(float), x / 2, whole.rows - 1 - y / 2)
        assert np.abs(z - truth).max() <= (2 if "--max-error-m" in words else np.ptp(whole.range_m))
        assert stats.get("method", "sat") == "sat" and stats["triangles"] <= 900 or "--triangles" not in words
    assert run("mesh", store, "-o", "m.glb", "--texture", 64, "--max-error-m", 6)[0] == 0


def test_a_method_that_would_have_no_effect_is_refused(store, run):
    refused(run("mesh", store, "-o", "land.glb", "--method", "full"), 2, "by the method sat, not by full")
    for_view = run("mesh", store, "-o", "land.glb", "--max-error-m", "2", "--method", "sat")
    refused(for_view, 2, "leave out", "--method")


def test_a_mesh_of_a_damaged_store_is_written_with_the_bound_that_holds(store, run):
    cut_heights(store)
    status, out, err = run("mesh", store, "-o", "m.ply", "--max-error-m", 0.01, "--between", "--json", "n.json")
    stats = json.loads(Path("n.json").read_text())
    assert status == 1 and err.count("\n") == 1 and "not complete" in err and " m;" in err
    assert stats["certified_max_error_m"] > 0.01 and Path("m.ply").exists()


def test_measure_takes_a_budget_of_a_store(store, run):
    status, out, _ = run("measure", store, "--size", "96x64", "--triangles", 700, "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats["triangles"] <= 700 and stats["max_error_px"] <= stats["certified_max_error_px"]


def test_a_budget_below_the_coarsest_mesh_is_drawn_and_told(store, run):
    status, out, _ = run("measure", store, "--size", "96x64", "--view", "valley", "--triangles", 2)
    assert status == 0 and "2 triangles, fewer than the coarsest mesh of this view has" in out
