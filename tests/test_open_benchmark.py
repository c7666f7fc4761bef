"""The open benchmark: its verifier finds what is wrong with a mesh, and its entries keep what they promise."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks" / "open"
sys.path.insert(0, str(FOLDER))

import run as benchmark  # noqa: E402
import verify  # noqa: E402

FLIGHT = {
    "spacing_m": [10, 10],
    "size": [320, 180],
    "tolerance_px": 1.0,
    "cameras": [{"eye": [20.0 + 15 * i, -200.0, 250.0], "target": [320, 320, 0], "fov_deg": 50} for i in range(3)],
}


@pytest.fixture(scope="module")
def heights():
    x, y = np.meshgrid(np.linspace(0, 3, 65), np.linspace(0, 3, 65))
    return 60 * np.sin(3 * x) * np.cos(2 * y) + np.random.default_rng(1).normal(0, 3, (65, 65))


def figures(entry, heights, folder, **changes):
    benchmark.dump(entry, FLIGHT | changes, heights, folder)
    return verify.verify(folder)


@pytest.mark.parametrize(
    "entry", ["every_post", "bisection", "roam", "geomipmap", "cdlod", "pydelatin", "sat", "clipmap", "tessellated"]
)
def test_entries_keep_what_they_promise(entry, heights, tmp_path):
    if entry == "pydelatin":
        pytest.importorskip("pydelatin")
    frames = figures(entry, heights, tmp_path)
    assert all(frame["uncovered_posts"] == 0 and frame["triangles"] > 100 for frame in frames)
    if entry not in (
        "clipmap",
        "tessellated",
    ):  # their rings have T-junctions by design, without a difference in height
        assert all(frame["largest_crack_m"] < 1e-6 for frame in frames)
    if entry in ("every_post", "roam", "pydelatin", "sat"):
        assert all(frame["max_posts_px"] <= 1 for frame in frames)
    if entry == "sat":
        assert all(0 < frame["max_px"] <= 1 for frame in frames)


def test_without_nested_errors_the_tolerance_is_not_kept(heights, tmp_path):
    """The mechanism of roam: bisection looks at the same vertices, but not at those below them."""
    frames = figures("bisection", heights, tmp_path)
    assert max(frame["max_posts_px"] for frame in frames) > 1


def test_without_moving_vertices_levels_of_cdlod_do_not_meet(heights, tmp_path, monkeypatch):
    cdlod = pytest.importorskip("entries.cdlod")
    monkeypatch.setattr(cdlod, "GRID", 4)
    assert max(frame["largest_crack_m"] for frame in figures("cdlod", heights, tmp_path, tolerance_px=20.0)) < 1e-6
    monkeypatch.setattr(cdlod._View, "moved_share", lambda self, distance_m, level: 0 * distance_m)
    assert max(frame["largest_crack_m"] for frame in figures("cdlod", heights, tmp_path, tolerance_px=20.0)) > 0.1


def test_moved_rims_of_geomipmaps_close_cracks_and_break_the_tolerance(heights, tmp_path, monkeypatch):
    """Errors are counted for whole grids: without moved rims all posts are within the tolerance, but levels gape."""
    geomipmap = pytest.importorskip("entries.geomipmap")
    monkeypatch.setattr(geomipmap, "BLOCK", 8)
    smooth = heights.copy()
    smooth[:, 32:] = smooth[:, [32]]
    moved = figures("geomipmap", smooth, tmp_path, tolerance_px=4.0)
    assert max(frame["largest_crack_m"] for frame in moved) < 1e-6
    monkeypatch.setattr(geomipmap, "_move_rims", lambda row, col, steps: None)
    gaping = figures("geomipmap", smooth, tmp_path, tolerance_px=4.0)
    assert max(frame["largest_crack_m"] for frame in gaping) > 0.1
    assert max(frame["max_posts_px"] for frame in gaping) <= 4 < max(frame["max_posts_px"] for frame in moved)


def test_the_verifier_sees_a_wrong_vertex_a_hole_and_a_jump(heights, tmp_path):
    good = figures("every_post", heights, tmp_path)
    file = tmp_path / "0001.npz"
    with np.load(file) as dump:
        vertices, triangles = dump["vertices"].copy(), dump["triangles"]
    view = verify.View(FLIGHT["cameras"][1], FLIGHT["size"])
    moved = 32 * 65 + 32
    shift_px = view.shift_px(vertices[[moved]], vertices[[moved], 2] + 7)[0]
    vertices[moved, 2] += 7
    np.savez(file, vertices=vertices, triangles=triangles)
    wrong = verify.verify(tmp_path)
    assert wrong[1]["max_posts_px"] == pytest.approx(shift_px) and good[1]["max_posts_px"] == 0
    assert wrong[1]["max_jump_px"] == pytest.approx(shift_px, rel=0.05) and good[1]["max_jump_px"] == 0
    np.savez(file, vertices=vertices, triangles=triangles[(triangles != moved).all(1)])
    assert verify.verify(tmp_path)[1]["uncovered_posts"] == 1


def test_a_mesh_without_land_is_not_within_the_tolerance(heights, tmp_path):
    frames = figures("every_post", heights, tmp_path)
    for file in tmp_path.glob("*.npz"):
        with np.load(file) as dump:
            np.savez(file, vertices=dump["vertices"] - [0, 1e5, 0], triangles=dump["triangles"])
    beside = verify.verify(tmp_path)
    rows = [benchmark.summary("x", "x", FLIGHT, each, [None] * 3) for each in (frames, beside)]
    assert [row["kept_posts"] for row in rows] == [1, 0] and rows[1]["max_posts"] == 0
    assert beside[1]["mean_jump_px"] == 0 < rows[1]["uncovered"]


@pytest.mark.parametrize(
    "wrong, line",
    [
        (lambda v, t: (v, t + 1), "a triangle names a vertex that is missing"),
        (lambda v, t: (v[:, :2], t), "expected (n, 3) and (m, 3)"),
        (lambda v, t: (np.where(v[:, :1] > 100, np.nan, v), t), "a vertex is not finite"),
        (None, "No such file"),
    ],
)
def test_wrong_frames_get_one_line(heights, tmp_path, wrong, line):
    figures("every_post", heights, tmp_path)
    file = tmp_path / "0001.npz"
    with np.load(file) as dump:
        vertices, triangles = dump["vertices"].copy(), dump["triangles"].copy()
    file.unlink()
    if wrong:
        vertices, triangles = wrong(vertices, triangles)
        np.savez(file, vertices=vertices, triangles=triangles)
    with pytest.raises(SystemExit, match=f"0001.npz: .*{re.escape(line)}"):
        verify.verify(tmp_path)


def test_entries_that_are_none_get_one_line(heights, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["run.py", "everypost"])
    with pytest.raises(SystemExit):
        benchmark.main()
    assert "everypost: there is no such entry" in capsys.readouterr().err
    monkeypatch.delattr(pytest.importorskip("entries.every_post"), "meshes")
    with pytest.raises(SystemExit, match="every_post: has no function meshes"):
        benchmark.dump("every_post", FLIGHT, heights, tmp_path)


def test_pixels_are_those_of_the_program(heights, tmp_path):
    """The verifier's camera is a second one. Both give the same errors for the same mesh."""
    import terrain_gl as tg

    frames = figures("bisection", heights, tmp_path)
    heightmap = tg.Heightmap(heights.astype("f4"), 10.0)
    for i, camera in enumerate(FLIGHT["cameras"]):
        with np.load(tmp_path / f"{i:04}.npz") as dump:
            mesh = dump["vertices"], dump["triangles"].astype(np.int64)
        seen = tg.Camera(tuple(camera["eye"]), tuple(camera["target"]), camera["fov_deg"])
        found = tg.check(mesh, heightmap, seen, tuple(FLIGHT["size"])).error_px
        assert found.surface == pytest.approx(frames[i]["max_px"], rel=1e-5)


def test_the_runner_prints_a_table_and_our_losses(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "argv", ["run.py", "every_post", "bisection", "--flights", "06-turn", "--frames", "2"])
    monkeypatch.setattr(sys, "argv", [*sys.argv, "--json", str(tmp_path / "all.json")])
    benchmark.main()
    out = capsys.readouterr().out
    assert "| every_post | 1 |" in out and "Where sat loses:" not in out, "sat did not run"
    rows = json.loads((tmp_path / "all.json").read_text())
    ours = rows[0] | {"entry": "sat", "kept": 1.0}
    assert rows[1]["max_posts"] > 1 or rows[1]["triangles"] < ours["triangles"]
    assert any("bisection" in line for line in benchmark.losses([ours | {"mean": 9.0}, rows[1]]))
    benchmark.print_losses([ours | {"mean": 2 * rows[1]["mean"], "max_jump": 0.0}, rows[1] | {"kept_posts": 0.5}])
    assert capsys.readouterr().out.splitlines()[-1] == "| bisection | 0 | 0 | 1: 0.50 | 0 |"
    assert benchmark.losses([ours]) == []


def test_all_flights_have_a_map(dem):
    flights = benchmark.flights()
    assert len(flights) == 10
    for flight in flights.values():
        heights = benchmark.heights_of(flight)
        assert np.isfinite(heights).all() and heights.shape[0] == heights.shape[1]
        assert (len(heights) - 1) & (len(heights) - 2) == 0, "2^n + 1 posts"
