"""The open benchmark: its verifier finds what is wrong with a mesh, and its entries keep what they promise."""

import json
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
    "entry", ["every_post", "bisection", "roam", "cdlod", "pydelatin", "sat", "clipmap", "tessellated"]
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
