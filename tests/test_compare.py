"""Comparisons: equal triangles, no difference of the truth from itself, curves, triangles for one pixel."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import parse
from maps import rough

import terrain_gl as tg
from terrain_gl.cli import main
from terrain_gl.cli.compare import caption, in_lines, uneven_text
from terrain_gl.cli.scene import CommandScene
from terrain_gl.comparison import compare as comparing
from terrain_gl.comparison import curves
from terrain_gl.comparison.clipmap import Rings
from terrain_gl.comparison.compare import (
    COMPARED,
    MethodResult,
    Truth,
    best_pictured,
    entry_of,
    likeness_of,
    truth_of,
)
from terrain_gl.comparison.curves import EQUAL, curve, fewest
from terrain_gl.comparison.own_surface import drawn_heights
from terrain_gl.comparison.study import Study, study
from terrain_gl.files.views import standard_view
from terrain_gl.image import read_image
from terrain_gl.renderer.options import FrameOptions

SIZE = (160, 90)
TRIANGLES = 1500


def cliffs(n=128):
    y, x = np.mgrid[:n, :n]
    steps = np.floor((rough(n, n, 3, 60.0) + 0.1 * x) / 12.0) * 12.0
    return tg.Heightmap((steps + rough(n, n, 9, 4.0)).astype("f4"), 10.0, "cliffs")


@pytest.fixture(scope="module")
def heightmap():
    return cliffs()


@pytest.fixture
def renderer(ctx, heightmap):
    return tg.Renderer(heightmap, SIZE, ctx=ctx)


@pytest.fixture
def camera(heightmap):
    return standard_view(heightmap, "ridge")


@pytest.mark.slow
def test_the_truth_is_at_no_distance_of_itself_and_the_dense_mesh_close(renderer, camera):
    truth = truth_of(renderer, camera, fine=2)
    entry = entry_of(renderer, camera, truth, "truth", fine=2)
    assert entry.stats["image_rmse"] == 0 and entry.stats["flip"] in (0.0, None)
    assert (entry.stats["skyline_px"], entry.stats["max_skyline_px"]) == (0, 0)
    dense = entry_of(renderer, camera, truth, "full", fine=2)
    coarse = entry_of(renderer, camera, truth, "sat", fine=2, triangles=TRIANGLES // 2)
    assert entry.stats["max_error_posts_px"] == dense.stats["max_error_posts_px"] == 0
    assert np.nanmax(entry.error_px) < 0.3 * np.nanmax(dense.error_px)  # cells are cut in four
    assert entry.stats["triangles"] == dense.stats["triangles"] == truth.stats["triangles"]
    assert 0 < dense.stats["image_rmse"] < 0.5 * coarse.stats["image_rmse"]  # diagonals alone
    assert 0.05 < truth.sky.mean() < 0.95


def test_finer_meshes_are_nearer_to_the_truth(renderer, camera):
    truth = truth_of(renderer, camera, fine=2)
    entries = [entry_of(renderer, camera, truth, "sat", 2, triangles=n) for n in (300, 1500, 7500)]
    for key in ("rms_error_px", "image_rmse", "flip", "skyline_px"):
        values = [entry.stats[key] for entry in entries]
        assert values == sorted(values, reverse=True) and values[-1] < 0.7 * values[0], key


@pytest.mark.slow
def test_study_draws_all_methods_with_as_many_triangles(renderer, camera):
    done = []
    found = study(renderer, camera, TRIANGLES, with_curves=True, fine=2, progress=done.append)
    assert [entry.method for entry in found.entries] == list(COMPARED)
    for entry in found.entries:
        assert abs(entry.stats["triangles"] / TRIANGLES - 1) <= EQUAL, entry.method
        assert entry.image.shape == (90, 160, 3) and entry.error_px.shape == (90, 160)
        assert np.nanmax(entry.error_px) <= entry.stats["max_error_px"] * (1 + 1e-6)
    assert done == sorted(done) and done[-1] == 1.0
    record = json.loads(json.dumps(found.record()))
    assert [stats["method"] for stats in record["methods"]] == list(COMPARED)
    assert len(record["ideal"]) == len(record["curves"]["sat"]) >= 6
    for label, cells, best in found.table():
        assert len(cells) == len(best) == len(COMPARED) and label


@pytest.mark.slow
@pytest.mark.parametrize("triangles", [100_000, 3000])
def test_more_triangles_than_a_method_can_draw_are_asked_of_none(ctx, triangles):
    heightmap = tg.Heightmap(rough(65, 65, 3, 30.0), 10.0)
    camera = tg.Camera.default(heightmap)
    r = tg.Renderer(heightmap, (96, 64), ctx=ctx)
    found, most = study(r, camera, triangles, fine=1), r.choose(camera, method="full")["triangles"]
    r.release()
    assert found.triangles == found.record()["triangles"] == pytest.approx(min(triangles, most), rel=EQUAL)
    for entry in found.entries:
        assert abs(entry.stats["triangles"] / found.triangles - 1) <= EQUAL and not found.uneven()


def test_a_line_names_the_methods_with_other_numbers_of_triangles():
    entries = [
        MethodResult(method, {"triangles": n}, None, None)
        for method, n in zip(COMPARED, (2884, 3003, 3180), strict=True)
    ]
    found = Study(None, entries, triangles=3000)
    assert uneven_text(found) == "\n\nnot equal to 3,000 triangles: Geometry clipmaps -4 %, Summed-area tables +6 %"
    found.entries = entries[1:2]
    assert uneven_text(found) == ""


@pytest.mark.slow
def test_study_of_a_certified_error_says_what_the_others_need(renderer, camera):
    found = study(renderer, camera, TRIANGLES, max_error_px=2.0, fine=1)
    own = found.needed["sat"]
    assert own["max_error_px"] <= own["certified_max_error_px"] <= 2.0
    assert found.entries[-1].stats["triangles"] == own["triangles"]
    for method, stats in found.needed.items():
        assert stats is None or stats["max_error_px"] <= 2.0, method
    assert found.table()[-1].label == "triangles to be within 2 px"


def test_fewest_finds_the_threshold(renderer, camera, monkeypatch):
    asked = []

    def measured(renderer, camera, method, triangles):
        asked.append(triangles)
        return {"triangles": triangles, "max_error_px": 3000.0 / triangles}

    monkeypatch.setattr(curves, "measured", measured)
    assert 3000 <= fewest(renderer, camera, "sat", 1.0, 500, 100_000)["triangles"] <= 3000 * 1.02
    assert 3000 <= fewest(renderer, camera, "sat", 1.0, 40_000, 100_000)["triangles"] <= 3000 * 1.02
    assert fewest(renderer, camera, "sat", 1.0, 500, 2_500) is None
    assert max(asked) <= 80_000


def test_a_baseline_shaded_from_its_own_mesh(renderer, camera):
    """Coarse rings are shaded differently from the map; rings with every post give exactly the map's picture."""
    truth = truth_of(renderer, camera, fine=1)
    coarse, every_post = Rings(33, finest=1), Rings(8 * 128 + 1, finest=0)
    for parameters, differs in ((coarse, True), (every_post, False)):
        drawing = {"method": "clipmap", "parameters": parameters}
        (by_map, of_map), (by_mesh, of_mesh) = (
            likeness_of(renderer, camera, truth, 1, from_mesh=from_mesh, **drawing) for from_mesh in (False, True)
        )
        assert np.array_equal(by_map, by_mesh) != differs
        assert of_mesh["image_rmse"] > of_map["image_rmse"] or not differs
        assert of_mesh["skyline_px"] == of_map["skyline_px"], "the mesh is the same"
    again, _ = likeness_of(renderer, camera, truth, 1, **drawing)
    assert np.array_equal(again, by_map), "afterwards pictures are shaded from the map"


def test_drawn_heights_are_those_of_the_mesh(ctx):
    """Voids stay voids; where the mesh has a vertex on a post, its height is the drawn one."""
    heights = cliffs(70).heights.copy()
    heights[20:25, 30:40] = np.nan
    r = tg.Renderer(tg.Heightmap(heights, 10.0), SIZE, ctx=ctx)
    camera, drawing = tg.Camera.default(r.heightmap), {"method": "clipmap", "parameters": Rings(13, finest=1)}
    drawn = drawn_heights(r, camera, **drawing)
    r.choose(camera, cull=False, **drawing)
    expected = r.inspector.drawn_heights()
    on_mesh = expected != r.terrain.filled  # no vertex, or one at the true height
    on_mesh &= ~np.isnan(heights)
    assert on_mesh.sum() > 100 and np.abs(drawn - expected)[on_mesh].max() < 1e-4
    assert np.array_equal(np.isnan(drawn), np.isnan(heights))


def test_the_picture_of_a_baseline_is_that_of_its_best_parameters(renderer, camera):
    """Two settings with equally many triangles: their order does not matter, and the worse one is not chosen."""
    truth = truth_of(renderer, camera, fine=1)
    tried = [{"parameters": Rings(13, finest=2)}, {"parameters": Rings(8 * 128 + 1, finest=0)}]
    for order in (tried, tried[::-1]):
        assert best_pictured(renderer, camera, truth, "clipmap", order) == tried[1]
    entry = entry_of(renderer, camera, truth, "clipmap", 1, pictured=tried[1], **tried[0])
    assert (entry.stats["parameters"]["ring"], entry.stats["picture_parameters"]["ring"]) == (13, 1025)
    assert (
        entry.stats["image_rmse"]
        == likeness_of(renderer, camera, truth, 1, method="clipmap", **tried[1])[1]["image_rmse"]
    )


def test_curves_fall(renderer, camera):
    """No price gives some of the counts: around 500 triangles, the count changes in steps of a hundred."""
    budgets = [500, 1500, 3000, 7500]
    points = curve(renderer, camera, ["sat"], budgets)["sat"]
    errors = [point["rms_error_px"] for point in points]
    assert errors == sorted(errors, reverse=True)
    assert 400 < points[0]["triangles"] <= 500
    assert [point["triangles"] for point in points[1:]] == pytest.approx(budgets[1:], rel=0.03)


def test_inset_is_where_pictures_differ_and_the_sky_begins():
    truth = np.zeros((100, 200, 3), np.uint8)
    sky = np.zeros((100, 200))
    sky[:40] = 1
    picture = truth.copy()
    picture[80:90, 20:60] = 200  # more, but far from the skyline
    picture[42:48, 150:170] = 200
    rows, cols = comparing.inset_of(Truth(truth, sky, {}), [picture])
    assert (rows.stop - rows.start, cols.stop - cols.start) == (24, 48)
    assert rows.start < 40 and rows.stop >= 48 and cols.start <= 150 and cols.stop >= 170
    rows, cols = comparing.inset_of(Truth(truth, np.zeros((100, 200)), {}), [picture])
    assert rows.start <= 80 and rows.stop >= 90 and cols.start <= 20 and cols.stop >= 60


# --- the command ------------------------------------------------------------------------------------------------------


@pytest.fixture
def command(tmp_path, heightmap):
    np.save(tmp_path / "cliffs.npy", heightmap.heights[:65, :65])
    size = ["--size", "160x90", "--supersample", "1", "--spacing", "10", "--view", "ridge"]
    return ["compare", str(tmp_path / "cliffs.npy"), "-o", str(tmp_path / "figure.png"), *size]


@pytest.mark.slow
def test_command_writes_a_figure_a_table_and_numbers(tmp_path, command, capsys):
    pytest.importorskip("matplotlib", reason="matplotlib, of the extra [compare], is not installed")
    assert main([*command, "--triangles", "1500", "--curve", "--json", str(tmp_path / "numbers.json")]) == 0
    out = capsys.readouterr().out
    assert "RMS screen error, px" in out and "Quads alone, pruned" in out
    numbers = json.loads((tmp_path / "numbers.json").read_text())
    assert (numbers["baseline_vertices"], numbers["baseline_shading"]) == ("between", "map")
    assert numbers["command"].startswith("terrain-gl compare") and numbers["view"]["fov_deg"] == 45
    assert {stats["method"] for stats in numbers["methods"]} == set(COMPARED)
    for stats in numbers["methods"]:
        assert {"triangles", "max_error_px", "rms_error_px", "image_rmse", "flip", "skyline_px", "ms"} <= set(stats)
    pixels = read_image(tmp_path / "figure.png")
    assert pixels.shape[1] == 2400 and pixels[..., :3].std() > 30
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cliffs.npy", "figure.png", "numbers.json"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "goal"), [(".jpg", "--max-error 4"), (".pdf", "--triangles 300"), (".svg", "--triangles 300")]
)
def test_figures_in_other_formats(tmp_path, command, suffix, goal):
    pytest.importorskip("matplotlib", reason="matplotlib, of the extra [compare], is not installed")
    path = tmp_path / f"figure{suffix}"
    command[3] = str(path)
    assert main([*command, *goal.split()]) == 0
    head = {".jpg": b"\xff\xd8\xff", ".pdf": b"%PDF", ".svg": b"<?xml"}[suffix]
    assert path.read_bytes().startswith(head)


def test_without_matplotlib_one_line_says_what_to_install(command, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(command) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "pip install 'terrain-gl[compare]'" in error


@pytest.mark.parametrize(
    "words, status, message",
    [
        (["-o", "nowhere/figure.png"], 1, "no folder"),
        (["-o", "figure.bmp"], 2, "must end in one of .png"),
        (["--triangles", "0"], 2, "above 0"),
        (["--triangles", "100", "--max-error", "1"], 2, "not allowed with"),
        (["--supersample", "0"], 2, "above 0"),
    ],
)
def test_wrong_use_is_one_line_and_leaves_nothing(folder, command, capsys, words, status, message):
    assert main([*command, *words]) == status
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and message in error
    assert sorted(path.name for path in folder.iterdir()) == ["cliffs.npy"]


def test_a_figure_that_fails_leaves_nothing(tmp_path, command, monkeypatch, capsys):
    pytest.importorskip("matplotlib", reason="matplotlib, of the extra [compare], is not installed")
    write = Path.write_bytes

    def full_disk(path, data):
        write(path, data[: len(data) // 2])
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    assert main([*command, "--triangles", "300", "--json", str(tmp_path / "numbers.json")]) == 1
    assert "No space left" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cliffs.npy"]


def test_command_lines_break_between_options():
    command = (
        "terrain-gl compare land.png --spacing 10 --view valley --eye -5,0,2 --triangles 20000 --curve -o figure.png"
    )
    lines = in_lines(command)
    assert " ".join(line.strip() for line in lines) == command
    assert len(lines) > 1 and all(line.strip().startswith("-") for line in lines[1:])
    assert not any(line.endswith(option) for line in lines for option in ("--view", "--triangles", "-o"))


def test_no_line_of_the_caption_is_wider_than_its_column(tmp_path):
    name = str(tmp_path / ("a_very_long_name_of_a_map_from_a_survey" * 3 + ".npy"))
    heightmap = tg.Heightmap(np.zeros((3, 4)), 1.0, name)
    scene = CommandScene(heightmap, heightmap, tg.Camera((1e7, 1e7, 1e7), (2e7, 3e7, 4e6)), FrameOptions())
    asked = parse("compare", name, "-o", "f.png", "--size", "640x360")
    lines = caption(replace(asked, command_line="terrain-gl compare " + name), scene)
    assert max(map(len, lines)) <= 46 and "".join(lines).startswith(Path(name).name)
