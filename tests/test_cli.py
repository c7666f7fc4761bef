"""The command line as a user sees it: every subcommand, its help, its texts and its numbers."""

import json
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import SIZE, parse, refused, small_map, spawn

import terrain_gl as tg
from terrain_gl import cli
from terrain_gl.cli.scene import open_scene
from terrain_gl.files.export import FORMATS
from terrain_gl.files.maps import bundled, find_bundled
from terrain_gl.files.views import standard_view
from terrain_gl.image import read_image

COMMANDS = ("info", "shot", "view", "measure", "mesh", "check", "bench", "generate", "fly", "diff", "cache", "tiles")
FRAME_KEYS = {
    "voids",
    *("method", "metric", "triangles", "patches", "splits", "certified_max_error_px", "requested_max_error_px"),
    *("width", "height", "gl_renderer", "backend", "ms", "ms_clock", "gpu_bytes", "map", "requested_triangles"),
    *("lambda", "curvature_radius_m", "patches_hidden", "certified_metric"),
}
POSE_KEYS = {"eye", "target", "fov_deg", "projection", "K", "R", "t", "sun"}
MEASURED_KEYS = (
    FRAME_KEYS
    | POSE_KEYS
    | {*("max_error_px", "rms_error_px", "max_error_posts_px", "posts_measured", "land_measured", "holes")}
    | {"rounding_px"}
)
BYTES_KEYS = {"heights", "sat", "error", "shade", "total"}


@pytest.fixture(autouse=True)
def dem(folder):
    """Give the name of a small map with a hill, and nothing else in the folder to work in."""
    return small_map()


# --- Help and words ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_a_worked_example(run, command):
    status, out, err = run(command, "--help")
    example = re.search(r"^example: terrain-gl (.*)$", out, re.MULTILINE)
    assert (status, err) == (0, "") and example
    given = cli.parser().parse_args(shlex.split(example[1]))
    assert given.run.__module__ == f"terrain_gl.cli.{command}" and parse(*shlex.split(example[1]))


def test_top_level(run):
    status, out, _ = run("--help")
    assert status == 0 and all(command in out for command in COMMANDS)
    assert run("--version") == (0, f"terrain-gl {tg.__version__}\n", "")
    refused(run(), 2, "COMMAND")
    refused(run("fly_me"), 2, "fly_me", "neither a command nor a map", "did you mean fly?")
    refused(run("shto", "dem.npy"), 2, "did you mean shot?")
    refused(run("Alpin"), 2, "did you mean alpine?")
    refused(run("xyzzy"), 2, "commands are info")


@pytest.mark.parametrize("command", COMMANDS)
def test_help_fits_a_screen(run, monkeypatch, command):
    """24 to 40 lines of 80 characters, and the rest in the full help; commands with few options need fewer lines."""
    monkeypatch.setenv("COLUMNS", "80")
    _, short, _ = run(command, "--help")
    status, full, err = run(command, "--help-all")
    lines = sum(-(-max(len(line), 1) // 80) for line in short.splitlines())
    assert lines <= 40 and (lines >= 24 or command in ("info", "generate", "diff", "cache", "tiles")), short
    assert (status, err) == (0, "") and "--help-all" in short
    assert set(re.findall("--[a-z-]+", short)) <= set(re.findall("--[a-z-]+", full))
    assert ("-o OUT" in full) == ("-o OUT" in short)
    if command not in ("generate", "diff", "cache"):
        assert "--nodata V" in full and "--nodata" not in short
    assert re.findall("^example: .*", short, re.MULTILINE) == re.findall("^example: .*", full, re.MULTILINE)


def test_the_help_of_a_command_is_its_own(run):
    """No group stands twice, and defaults and options are those of the command."""
    for command in COMMANDS:
        titles = re.findall(r"^([a-z][a-z ]*):$", run(command, "--help-all")[1], re.MULTILINE)
        assert len(titles) == len(set(titles)) and "positional arguments" not in titles
    full = {command: " ".join(run(command, "--help-all")[1].split()) for command in ("view", "mesh", "measure", "shot")}
    assert "the last window's" in full["view"] and "screen error (default: 1)" not in full["view"]
    assert "screen error (default: 1)" in full["shot"] and "screen error (default: 1)" not in full["mesh"]
    assert "--sun" in full["shot"] and "--sun" not in full["measure"] and "--exaggeration" in full["measure"]
    assert parse("measure", "m", "--sun", "90,10").frame.sun == (90, 10)


@pytest.mark.parametrize("word", ["dem.npy", "alpine", "folder/none", "none.tif", "with space"])
def test_a_map_alone_is_viewed(folder, monkeypatch, word):
    """A file, a bundled name, and whatever looks like a file; a command's name stays that of the command."""
    (folder / "with space").touch()
    (folder / "shot").touch()
    seen = []
    monkeypatch.setattr("terrain_gl.cli.view.run", lambda asked: seen.append(asked) or 0)
    assert cli.main([word, "--eye", "-5,0,2"]) == 0
    assert (seen[0].map.name, seen[0].camera.eye) == (word, (-5.0, 0.0, 2.0))
    assert cli.main(["shot", "--help"]) == 0 and len(seen) == 1


@pytest.mark.parametrize("eye", ["-5,0,2", "-.5,-1e3,2", "5,-0,2"])
def test_negative_numbers_need_no_equals_sign(eye):
    expected = tuple(map(float, eye.split(",")))
    for words in (("--eye", eye), (f"--eye={eye}",)):
        assert parse("measure", "m", *words).camera.eye == expected


def test_negative_numbers_elsewhere():
    asked = parse("measure", "--z-offset", "-1e2", "--nodata", "-32768", "--sun", "-90,-5", "m")
    read = asked.map.reading
    assert (read.z_offset_m, read.nodata, asked.light.sun, asked.map.name) == (-100, -32768, (-90, -5), "m")
    assert parse("info", "--", "-5,0.tif").map.name == "-5,0.tif"


def test_module_is_the_command():
    done = spawn("--version")
    assert (done.returncode, done.stdout) == (0, f"terrain-gl {tg.__version__}\n")


@pytest.fixture
def without_gui(tmp_path):
    """Environment of a process, and of those that it starts, in which the packages of the extra [gui] are missing."""
    for name in ("glfw", "imgui_bundle"):
        (tmp_path / f"{name}.py").write_text(f"raise ModuleNotFoundError(\"No module named '{name}'\")\n")
    return {"PYTHONPATH": str(tmp_path)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "made"),
    [(("shot", "-o", "p.png"), "p.png"), (("mesh", "-o", "m.ply"), "m.ply"), (("measure",), None)],
    ids=lambda words: words and words[0],
)
def test_only_a_window_needs_the_extra_gui(dem, without_gui, words, made):
    done = spawn(words[0], dem, "--size", "32x24", *words[1:], env=without_gui)
    assert done.returncode == 0, done.stderr
    assert made is None or Path(made).stat().st_size


@pytest.mark.parametrize("words", [("view",), ("shot", "-o", "p.png", "--backend", "glfw")], ids=["view", "backend"])
def test_a_window_without_the_extra_gui_gives_one_line(dem, without_gui, words):
    done = spawn(words[0], dem, *words[1:], env=without_gui)
    refused(done, 1, "a window needs the extra [gui]", "pip install 'terrain-gl[gui]'")
    assert not Path("p.png").exists()


# --- Maps and views ---------------------------------------------------------------------------------------------------


def scene(*words):
    return open_scene(parse("measure", *words))


@pytest.mark.parametrize("name", bundled())
def test_bundled_map_has_its_scales_and_view(name):
    known = bundled()[name]
    seen = scene(name)
    assert seen.heightmap.spacing_m == (known.spacing_m, known.spacing_m) and seen.heightmap.name == name
    assert (seen.camera, seen.frame.sun) == (known.camera, known.sun)
    top = np.iinfo("u2").max * known.z_scale + known.z_offset_m
    assert known.z_offset_m <= seen.heightmap.range_m[0] < seen.heightmap.range_m[1] <= top


def test_copy_of_a_bundled_map_is_that_map(folder):
    known = bundled()["canyon"]
    (folder / "heightmaps").mkdir()
    shutil.copy(known.path, "heightmaps/other.png")
    assert find_bundled("heightmaps/other.png") == known
    assert scene("heightmaps/other.png").camera == known.camera


def test_options_come_before_what_is_bundled():
    seen = scene("canyon", "--spacing", "10,20")
    assert seen.heightmap.spacing_m == (10, 20)
    assert seen.heightmap.range_m == scene("canyon").heightmap.range_m
    assert seen.camera == standard_view(seen.heightmap)
    seen = scene("canyon", "--fov", "30", "--target", "0,0,0", "--sun", "10,20")
    known = bundled()["canyon"].camera
    assert (seen.camera.eye, seen.camera.target, seen.camera.fov_deg) == (known.eye, (0, 0, 0), 30)
    assert seen.frame.sun == (10, 20)


def test_a_file_comes_before_a_bundled_name(dem, folder):
    shutil.copy(dem, "alpine")
    assert scene("alpine").heightmap.cols == 97


def test_view_hands_its_options_on(dem, run, monkeypatch):
    calls = []
    monkeypatch.setattr("terrain_gl.viewer.run", lambda *args, **named: calls.append((args, named)) or {"triangles": 7})
    options = ["--eye", "-9,0,50", "--max-error", 3, "--style", "lod", "--sun", "90,10", "--fresh", "--json", "-"]
    status, out, _ = run("view", dem, *SIZE, *options)
    assert status == 0 and json.loads(out) == {"map": str(dem), "triangles": 7}
    (opener,), named = calls[0]
    opened = opener(lambda part: None)
    assert opened.heightmap.cols == 97 and opened.camera.eye == (-9, 0, 50) and opened.sun == (90, 10)
    assert opened.camera_given
    assert callable(named.pop("line_of"))
    window = {"size": (96, 64), "name": "dem.npy", "backend": "auto", "fresh": True, "panel": None}
    window |= {"ui_scale": None, "lecture": None}
    assert named == window | {"max_error_px": 3, "style": "lod"}
    assert run("view")[0] == 0
    (opener,), named = calls[1]
    opened = opener(lambda part: None)
    assert opened.camera == bundled()["alpine"].camera and opened.key == "alpine" and not opened.camera_given
    assert callable(named.pop("line_of"))
    assert named == {
        "size": None,
        "name": "alpine",
        "backend": "auto",
        "fresh": False,
        "panel": None,
        "ui_scale": None,
        "lecture": None,
    }  # the other values as they were last time


# --- Commands ---------------------------------------------------------------------------------------------------------


def test_info(dem, run):
    status, out, _ = run("info", dem, "--spacing", "10,20", "--json", "-")
    found = json.loads(out)
    assert status == 0 and [probe["name"] for probe in found["backends"]] == ["egl", "osmesa", "glfw"]
    assert all(probe["works"] or probe["reason"] for probe in found["backends"])
    about = found["map"]
    heights = np.load(dem)
    assert (about["cols"], about["rows"], about["spacing_m"], about["extent_m"]) == (97, 65, [10, 20], [960, 1280])
    assert about["range_m"] == [float(heights.min()), float(heights.max())] and about["voids"] == 0
    assert about["bytes"] == heights.nbytes
    status, out, _ = run("info", dem)
    assert status == 0 and "97 x 65" in out and "egl" in out
    assert "alpine, canyon" in run("info")[1]


def test_shot_is_what_the_api_draws(dem, run):
    status, out, _ = run("shot", dem, "-o", "out.png", *SIZE, "--json", "out.json")
    assert status == 0 and out.startswith("out.png: 96x64, ")
    stats = json.loads(Path("out.json").read_text())
    assert stats.keys() >= FRAME_KEYS and stats["gpu_bytes"].keys() == BYTES_KEYS
    assert stats["ms"].keys() >= {"sat", "error", "lod", "draw", "frame"}
    heightmap = tg.Heightmap.open(dem)
    with tg.Renderer(heightmap, (96, 64)) as renderer:
        image = renderer.render(standard_view(heightmap)).image
    assert np.array_equal(read_image("out.png"), image)


def test_shot_repeats_exactly(dem, run):
    for name in ("a.png", "b.png"):
        assert run("shot", dem, "-o", name, *SIZE)[0] == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


@pytest.mark.slow
def test_measure_keeps_to_a_budget(dem, run):
    asked = ("measure", dem, *SIZE, "--triangles", 200)
    status, out, _ = run(*asked, "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats.keys() == MEASURED_KEYS
    assert 0.97 * 200 <= stats["triangles"] <= 200 == stats["requested_triangles"] and stats["lambda"] > 0
    assert stats["requested_max_error_px"] is None and stats["holes"] == 0
    assert stats["max_error_px"] <= stats["certified_max_error_px"]
    assert "200 triangles, worth" in run(*asked)[1]
    assert "more than this view needs" in run("measure", dem, *SIZE, "--triangles", 10**7)[1]


@pytest.mark.parametrize("more", [("--max-error", 1), ("--method", "full")], ids=str)
def test_a_budget_excludes_other_wishes(dem, run, more):
    status, _, error = run("measure", dem, "--triangles", 200, *more)
    assert status == 2 and error.count("\n") == 1 and "triangles" in error


@pytest.mark.parametrize("metric", ["max", "rms"])
@pytest.mark.parametrize("tolerance", [0.5, 2])
def test_measure_finds_at_most_the_certified_error(dem, run, metric, tolerance):
    status, out, _ = run("measure", dem, *SIZE, "--max-error", tolerance, "--metric", metric, "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats.keys() == MEASURED_KEYS
    achieved = stats["max_error_px" if metric == "max" else "rms_error_px"]
    assert achieved <= stats["certified_max_error_px"] <= tolerance == stats["requested_max_error_px"]
    assert stats["posts_measured"] > 1000 and stats["holes"] == 0
    assert (stats["width"], stats["height"], stats["method"], stats["metric"]) == (96, 64, "sat", metric)


def test_measure_for_people(dem, run):
    status, out, err = run("measure", dem, *SIZE, "--method", "full")
    assert (status, err) == (0, "") and "posts alone  max 0 px" in out and "holes        0" in out


FLAGS = [("--no-weld",), ("--weld",), ("--cull",), ("--no-weld", "--cull"), ()]


@pytest.mark.parametrize("ending, flags", zip(FORMATS, FLAGS, strict=True))
def test_mesh(dem, run, ending, flags):
    view = ("--eye", "20,-30,40", "--target", "60,60,0", "--fov", 20)
    status, out, _ = run("mesh", dem, "-o", f"m{ending}", *SIZE, *view, *flags, "--json", "m.json")
    stats = json.loads(Path("m.json").read_text())
    assert status == 0 and stats.keys() >= FRAME_KEYS and os.path.getsize(f"m{ending}") > 12 * stats["vertices"]
    assert out.startswith(f"m{ending}: {stats['triangles']:,} triangles, {stats['vertices']:,} vertices")
    assert (stats["vertices"] == 3 * stats["triangles"]) == ("--no-weld" in flags)
    assert stats["method"] == "sat"
    heightmap = tg.Heightmap.open(dem)
    with tg.Renderer(heightmap, (96, 64)) as renderer:
        camera = tg.Camera((20, -30, 40), (60, 60, 0), 20)
        everything = renderer.choose(camera, cull=False)["triangles"]
    assert (stats["triangles"] < everything) == ("--cull" in flags)


def test_a_mesh_without_a_view_is_the_whole_map(dem, run):
    """By default within 0.5 % of the relief; a camera, or an error in pixels, asks for a view."""
    relief = float(np.ptp(np.load(dem)))
    stats = json.loads(run("mesh", dem, "-o", "m.ply", "--json", "-")[1])
    assert stats["requested_max_error_m"] == pytest.approx(0.005 * relief) and "method" not in stats
    assert 0 < stats["max_error_posts_m"] <= stats["requested_max_error_m"]
    between = json.loads(run("mesh", dem, "-o", "m.ply", "--between", "--json", "-")[1])
    assert between["certified_max_error_m"] <= between["requested_max_error_m"] == stats["requested_max_error_m"]
    for view in (("--max-error", 3), ("--view", "high"), ("--triangles", 500), ("--method", "sat")):
        stats = json.loads(run("mesh", dem, "-o", "m.ply", *SIZE, *view, "--json", "-")[1])
        assert "requested_max_error_m" not in stats and stats["method"] == "sat"


def test_a_mesh_with_the_rendered_look(dem, run):
    """North up, lit: the hill's sunny side is brighter, and the picture has no sky at its edges."""
    assert run("mesh", dem, "-o", "m.ply", "--texture", 388, "--style", "lambert", "--sun", "90,30")[0] == 0
    look = read_image("m.png")
    assert look.shape == (260, 388, 3)
    top_x, top_y = 50.5 * 4, 30.5 * 4
    sunny, shady = (look[int(top_y), int(top_x + dx)].mean() for dx in (36, -36))
    assert sunny > shady + 40
    for axis in (0, 1):
        assert np.ptp(look.take([0, 3], axis).astype(int), axis=axis).max() <= 3
    refused(run("mesh", dem, "-o", "m.stl", "--texture"), 2, "has no texture")
    assert run("mesh", dem, "-o", "m.stl", "--print-mm", 70)[0] == 0


def test_mesh_draws_a_bar_on_a_terminal_alone(dem, run, monkeypatch):
    assert run("mesh", dem, "-o", "m.ply")[2] == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr("time.monotonic", iter(range(10**6)).__next__)
    drawn = run("mesh", dem, "-o", "m.ply")[2]
    assert drawn.startswith("\rwriting [   ") and "writing [####" in drawn


@pytest.mark.slow
def test_bench(dem, run):
    np.save("other.npy", np.load(dem)[:, :60])
    status, out, _ = run("bench", dem, "other.npy", *SIZE, "--frames", 2, "--json", "-")
    both = json.loads(out)
    assert status == 0 and [each["map"] for each in both] == [dem, "other.npy"]
    for stats in both:
        stages = {"open", "first_picture", "upload", "sat", "numpy", "error", "lod", "draw", "frame", "python"}
        assert stats.keys() >= FRAME_KEYS | {"dense", "ratio", "posts"} and stats["ms"].keys() >= stages
        assert stats["dense"]["triangles"] > stats["triangles"] and stats["dense"]["ms"].keys() >= {"draw", "frame"}
        timed = [ms for name, ms in stats["ms"].items() if name != "python"]  # an estimate, and almost 0 here
        assert all(value > 0 for value in [*timed, *stats["ratio"].values()])
        assert 0 <= stats["ms"]["python"] < stats["ms"]["frame"] < stats["ms"]["first_picture"]


def test_bench_for_people(dem, run):
    status, out, _ = run("bench", dem, *SIZE, "--frames", 1)
    assert status == 0 and all(f"\n{stage} ms " in out for stage in ("open", "sat", "numpy", "error", "frame"))


def test_mesh_within_metres_needs_no_view(dem, run):
    status, out, _ = run("mesh", dem, "-o", "m.ply", "--max-error-m", "2.5", "--eye", "9,9,99", "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats["max_error_posts_m"] <= stats["requested_max_error_m"] == 2.5
    assert f"element face {stats['triangles']}\n".encode() in Path("m.ply").read_bytes()[:500]


def test_bench_of_strokes(dem, run):
    status, out, _ = run("bench", dem, *SIZE, "--frames", 1, "--strokes", "--json", "-")
    strokes = json.loads(out)[0]["strokes"]
    assert status == 0 and set(strokes["ms"]) == {"median", "most", "middle", "rebuild"}
    assert strokes["ratio"]["most"] == strokes["ms"]["most"] / strokes["ms"]["rebuild"]
    assert 0 < strokes["ms"]["median"] <= strokes["ms"]["most"]


def test_bench_of_a_flight(dem, run):
    status, out, _ = run("bench", dem, *SIZE, "--frames", 1, "--flight", 12, "--json", "-")
    flown = json.loads(out)[0]["flight"]
    assert status == 0 and (flown["frames"], flown["dabs"]) == (12, 2)
    assert 0 < flown["ms"]["median"] <= flown["ms"]["p99_9"] <= flown["ms"]["most"]
    assert flown["p99_9_to_median"] == flown["ms"]["p99_9"] / flown["ms"]["median"]


def test_scripts_may_say_a_seed_wherever_something_is_drawn(run, dem):
    assert run("shot", dem, "-o", "a.png", "--size", "64x48", "--seed", 3)[0] == 0
