"""The command line as a user meets it: every subcommand, every wrong use, and nothing left behind by a failure."""

import json
import os
import re
import resource
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

import terrain_gl as tg
from terrain_gl import cli
from terrain_gl.cli import options
from terrain_gl.context import create_context, probe_backends
from terrain_gl.export import FORMATS
from terrain_gl.image import read_image
from terrain_gl.maps import bundled, find_bundled

COMMANDS = ("info", "shot", "view", "measure", "mesh", "bench", "generate", "fly")
SIZE = ("--size", "96x64")
FRAME_KEYS = {
    *("method", "metric", "triangles", "patches", "splits", "certified_max_error_px", "requested_max_error_px"),
    *(
        "width",
        "height",
        "gl_renderer",
        "backend",
        "ms",
        "ms_clock",
        "gpu_bytes",
        "map",
        "requested_triangles",
        "lambda",
    ),
}
MEASURED_KEYS = FRAME_KEYS | {"max_error_px", "rms_error_px", "posts_measured", "holes"}
BYTES_KEYS = {"heights", "sat", "error", "shade", "total"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Give an empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def dem(folder):
    """Give the name of a small map with a hill, and nothing else in the folder."""
    y, x = np.mgrid[0:65, 0:97]
    np.save("dem.npy", (40 * np.exp(-((x - 50) ** 2 + (y - 30) ** 2) / 300) + 0.1 * x).astype("f4"))
    return "dem.npy"


@pytest.fixture
def run(capsys):
    """Give a function that runs the command line here: status, standard output, standard error."""

    def run(*words):
        status = cli.main([str(word) for word in words])
        return status, *capsys.readouterr()

    return run


def spawn(*words, **settings):
    """Run the command line in a process of its own."""
    environment = os.environ | settings.pop("env", {})
    command = [sys.executable, "-m", "terrain_gl", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, **settings)


def refused(result, status, *texts):
    """Assert that a run ended with `status` and one line on standard error that holds the texts."""
    code, out, err = result if isinstance(result, tuple) else (result.returncode, result.stdout, result.stderr)
    assert (code, out) == (status, ""), err
    assert err.startswith("terrain-gl") and err.count("\n") == 1, err
    assert all(text in err for text in texts), err


def parse(*words):
    return cli.parser().parse_args(cli.join_negative(words))


# --- Help and words ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_a_worked_example(run, command):
    status, out, err = run(command, "--help")
    example = re.search(r"^example: terrain-gl (.*)$", out, re.MULTILINE)
    assert (status, err) == (0, "") and example
    args = parse(*shlex.split(example[1]))
    assert args.run.__module__ == f"terrain_gl.cli.{command}"


def test_top_level(run):
    status, out, _ = run("--help")
    assert status == 0 and all(command in out for command in COMMANDS)
    assert run("--version") == (0, f"terrain-gl {tg.__version__}\n", "")
    refused(run(), 2, "COMMAND")
    refused(run("fly_me"), 2, "invalid choice")


@pytest.mark.parametrize("eye", ["-5,0,2", "-.5,-1e3,2", "5,-0,2"])
def test_negative_numbers_need_no_equals_sign(eye):
    expected = tuple(map(float, eye.split(",")))
    assert parse("measure", "m", "--eye", eye).eye == parse("measure", "m", f"--eye={eye}").eye == expected


def test_negative_numbers_elsewhere():
    args = parse("measure", "--z-offset", "-1e2", "--nodata", "-32768", "--sun", "-90,-5", "m")
    assert (args.z_offset, args.nodata, args.sun, args.map) == (-100, -32768, (-90, -5), "m")
    assert parse("info", "--", "-5,0.tif").map == "-5,0.tif"


def test_module_is_the_command():
    done = spawn("--version")
    assert (done.returncode, done.stdout) == (0, f"terrain-gl {tg.__version__}\n")


# --- Maps and views ---------------------------------------------------------------------------------------------------


def scene(*words):
    return options.open_scene(parse("measure", *words))


@pytest.mark.parametrize("name", bundled())
def test_bundled_map_has_its_scales_and_view(name):
    known = bundled()[name]
    seen = scene(name)
    assert seen.heightmap.spacing_m == (known.spacing_m, known.spacing_m) and seen.heightmap.name == name
    assert (seen.camera, seen.sun) == (known.camera, known.sun)
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
    assert seen.camera == tg.Camera.default(seen.heightmap)
    seen = scene("canyon", "--fov", "30", "--target", "0,0,0", "--sun", "10,20")
    known = bundled()["canyon"].camera
    assert (seen.camera.eye, seen.camera.target, seen.camera.fov_deg) == (known.eye, (0, 0, 0), 30)
    assert seen.sun == (10, 20)


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
    window = {"size": (96, 64), "name": "dem.npy", "backend": "auto", "fresh": True, "gui": True}
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
        "gui": True,
    }  # the rest as it was last time


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
        image = renderer.render(tg.Camera.default(heightmap)).image
    assert np.array_equal(read_image("out.png"), image)


@pytest.mark.parametrize("style", options.STYLES)
def test_shot_repeats_exactly(dem, run, style):
    for name in ("a.png", "b.png"):
        assert run("shot", dem, "-o", name, *SIZE, "--style", style)[0] == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


def test_measure_keeps_to_a_budget(dem, run):
    asked = ("measure", dem, *SIZE, "--triangles", 200)
    status, out, _ = run(*asked, "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats.keys() == MEASURED_KEYS
    assert 0.97 * 200 <= stats["triangles"] <= 200 == stats["requested_triangles"] and stats["lambda"] > 0
    assert stats["requested_max_error_px"] is None and stats["holes"] == 0
    assert stats["max_error_px"] <= stats["certified_max_error_px"]
    assert "200 triangles, worth" in run(*asked)[1]
    assert "more than this view has use for" in run("measure", dem, *SIZE, "--triangles", 10**7)[1]


@pytest.mark.parametrize("more", [("--max-error", 1), ("--method", "full")], ids=str)
def test_a_budget_excludes_other_wishes(dem, run, more):
    status, _, error = run("measure", dem, "--triangles", 200, *more)
    assert status == 2 and error.count("\n") == 1 and "triangles" in error


@pytest.mark.parametrize("metric", ["max", "rms"])
@pytest.mark.parametrize("tolerance", [0.5, 2])
def test_measure_holds_what_is_promised(dem, run, metric, tolerance):
    status, out, _ = run("measure", dem, *SIZE, "--max-error", tolerance, "--metric", metric, "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats.keys() == MEASURED_KEYS
    achieved = stats["max_error_px" if metric == "max" else "rms_error_px"]
    assert achieved <= stats["certified_max_error_px"] <= tolerance == stats["requested_max_error_px"]
    assert stats["posts_measured"] > 1000 and stats["holes"] == 0
    assert (stats["width"], stats["height"], stats["method"], stats["metric"]) == (96, 64, "sat", metric)


def test_measure_for_people(dem, run):
    status, out, err = run("measure", dem, *SIZE, "--method", "full")
    assert (status, err) == (0, "") and "achieved  max 0 px" in out and "holes     0" in out


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("flags", [(), ("--weld",), ("--cull",), ("--weld", "--cull")])
def test_mesh(dem, run, ending, flags):
    view = ("--eye", "20,-30,40", "--target", "60,60,0", "--fov", 20)
    status, out, _ = run("mesh", dem, "-o", f"m{ending}", *SIZE, *view, *flags, "--json", "m.json")
    stats = json.loads(Path("m.json").read_text())
    assert status == 0 and stats.keys() >= FRAME_KEYS and os.path.getsize(f"m{ending}") > 12 * stats["vertices"]
    assert out.startswith(f"m{ending}: {stats['triangles']:,} triangles, {stats['vertices']:,} vertices")
    assert (stats["vertices"] == 3 * stats["triangles"]) == ("--weld" not in flags)
    heightmap = tg.Heightmap.open(dem)
    with tg.Renderer(heightmap, (96, 64)) as renderer:
        everything = renderer.draw(tg.Camera((20, -30, 40), (60, 60, 0), 20), cull=False)["triangles"]
    assert (stats["triangles"] < everything) == ("--cull" in flags)


def test_mesh_draws_a_bar_on_a_terminal_alone(dem, run, monkeypatch):
    assert run("mesh", dem, "-o", "m.ply")[2] == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr("time.monotonic", iter(range(10**6)).__next__)
    assert "writing [####" in run("mesh", dem, "-o", "m.ply")[2]


def test_bench(dem, run):
    status, out, _ = run("bench", dem, "canyon", *SIZE, "--frames", 2, "--json", "-")
    both = json.loads(out)
    assert status == 0 and [each["map"] for each in both] == [dem, "canyon"]
    for stats in both:
        stages = {"open", "first_picture", "upload", "sat", "numpy", "error", "lod", "draw", "frame", "python"}
        assert stats.keys() >= FRAME_KEYS | {"dense", "ratio", "posts"} and stats["ms"].keys() >= stages
        assert stats["dense"]["triangles"] > stats["triangles"] and stats["dense"]["ms"].keys() >= {"draw", "frame"}
        timed = [ms for name, ms in stats["ms"].items() if name != "python"]  # an estimate, and short here
        assert all(value > 0 for value in [*timed, *stats["ratio"].values()])
        assert 0 <= stats["ms"]["python"] < stats["ms"]["frame"] < stats["ms"]["first_picture"]


def test_bench_for_people(dem, run):
    status, out, _ = run("bench", dem, *SIZE, "--frames", 1)
    assert status == 0 and all(f"\n{stage} ms " in out for stage in ("open", "sat", "numpy", "error", "frame"))


def test_mesh_within_metres_needs_no_view(dem, run):
    status, out, _ = run("mesh", dem, "-o", "m.ply", "--max-error-m", "2.5", "--eye", "9,9,99", "--json", "-")
    stats = json.loads(out)
    assert status == 0 and stats["certified_max_error_m"] <= stats["requested_max_error_m"] == 2.5
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


def test_bench_beside_peers_or_the_names_of_those_missing(dem, run, monkeypatch):
    for module in ("pydelatin", "pymartini", "pyvista"):
        monkeypatch.setitem(sys.modules, module, None)
    status, out, _ = run("bench", dem, *SIZE, "--frames", 1, "--peers")
    assert status == 0 and "frame: terrain-gl sat" in out
    assert all(f"\n{name} is left out: " in out for name in ("pydelatin", "pymartini", "pyvista"))


# --- Wrong use: status 2 ----------------------------------------------------------------------------------------------

WRONG = [
    ("--max-error 0", "positive"),
    ("--max-error -1", "positive"),
    ("--max-error nan", "positive"),
    ("--max-error inf", "positive"),
    ("--eye 1,2,3 --target 1,2,3", "same point 1,2,3"),
    ("--eye 1,2", "metres X,Y,Z"),
    ("--eye 1,2,inf", "metres X,Y,Z"),
    ("--eye 1e300,0,0", "metres X,Y,Z"),
    ("--target x,y,z", "metres X,Y,Z"),
    ("--size 0x64", "at least 1x1"),
    ("--size 64", "at least 1x1"),
    ("--size -6x4", "at least 1x1"),
    ("--fov 0", "between 0.1 and 170"),
    ("--fov 180", "between 0.1 and 170"),
    ("--near 0", "positive"),
    ("--spacing 0", "above 0"),
    ("--spacing 1,2,3", "above 0"),
    ("--spacing -5,3", "above 0"),
    ("--z-scale 0", "other than 0"),
    ("--z-scale nan", "a number"),
    ("--sun 10,95", "from -90 to 90"),
    ("--encoding jpeg", "invalid choice"),
    ("--method best", "invalid choice"),
    ("--metric median", "invalid choice"),
    ("--style oil", "invalid choice"),
    ("--backend vulkan", "expected one of auto, egl, osmesa, glfw"),
    ("--json out.png", "two outputs"),
    ("--max 3", "unrecognized"),
    ("extra", "unrecognized"),
]


@pytest.mark.parametrize(("words", "text"), WRONG)
def test_wrong_use(dem, folder, run, words, text):
    refused(run("shot", dem, "-o", "out.png", *SIZE, *shlex.split(words)), 2, text)
    assert os.listdir(folder) == [dem]


@pytest.mark.parametrize(
    ("words", "text"),
    [("shot dem.npy -o out.bmp", ".png"), ("mesh dem.npy -o out.stl", ".ply"), ("mesh dem.npy", "-o/--output")],
)
def test_wrong_output(dem, folder, run, words, text):
    refused(run(*words.split()), 2, text)
    assert os.listdir(folder) == [dem]


# --- Bad input: status 1 ----------------------------------------------------------------------------------------------


def picture(name, pixels):
    assert oiio.ImageBuf(np.ascontiguousarray(pixels)).write(name)


def broken_png():
    picture("whole.png", np.random.default_rng(0).integers(0, 2**16, (64, 64, 1), "u2"))
    data = Path("whole.png").read_bytes()
    os.remove("whole.png")
    return data[: len(data) // 2]


def absurd_png():
    """A header of 2^31 - 1 by 2^31 - 1 pixels."""
    data = bytearray(broken_png())
    data[16:24] = b"\x7f\xff\xff\xff" * 2
    return bytes(data)


BAD = {
    "missing.png": lambda name: None,
    "empty.tif": lambda name: Path(name).touch(),
    "short.png": lambda name: Path(name).write_bytes(broken_png()),
    "absurd.png": lambda name: Path(name).write_bytes(absurd_png()),
    "random.tif": lambda name: Path(name).write_bytes(np.random.default_rng(0).bytes(5000)),
    "random.hgt": lambda name: Path(name).write_bytes(np.random.default_rng(0).bytes(5001)),
    "text.tif": lambda name: Path(name).write_text("not a picture\n"),
    "folder.png": os.mkdir,
    "nan.npy": lambda name: np.save(name, np.full((5, 5), np.nan)),
    "inf.npy": lambda name: np.save(name, np.full((5, 5), np.inf)),
    "one.npy": lambda name: np.save(name, np.ones((1, 1))),
    "rgb.png": lambda name: picture(name, np.random.default_rng(0).integers(0, 255, (9, 9, 3), "u1")),
    "two lines\n.png": lambda name: None,
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("command", ["info", "shot", "mesh"])
def test_bad_map(folder, run, command, name):
    BAD[name](name)
    before = os.listdir(folder)
    output = {"info": (), "shot": ("-o", "out.png"), "mesh": ("-o", "out.ply")}[command]
    refused(run(command, name, *output, "--json", "out.json"), 1, name.split("\n")[0])
    assert os.listdir(folder) == before


def test_unreadable_map(dem, folder, run):
    os.chmod(dem, 0)
    if os.access(dem, os.R_OK):
        pytest.skip("permissions do not bind this user (root)")
    refused(run("info", dem), 1, dem, "Permission denied")


def test_no_such_name(run):
    refused(run("measure", "alpnie"), 1, "alpnie: neither a file nor a bundled map (alpine, canyon)")


@pytest.mark.parametrize("words", ["shot {} -o no/out.png", "mesh {} -o no/out.ply", "measure {} --json no/out.json"])
def test_no_such_folder(dem, folder, run, words):
    refused(run(*words.format(dem).split()), 1, "no folder no")
    assert os.listdir(folder) == [dem]


def test_failing_json_takes_the_picture_with_it(dem, folder, run):
    refused(run("shot", dem, "-o", "out.png", *SIZE, "--json", f"{'x' * 300}"), 1, "File name too long")
    assert os.listdir(folder) == [dem]


def test_outputs_that_are_no_files(dem, folder, run):
    (folder / "out.png").mkdir()
    refused(run("shot", dem, "-o", "out.png"), 1, "is a folder or a device")
    refused(run("measure", dem, "--json", "/dev/full"), 1, "is a folder or a device")


def test_folder_without_permission(dem, folder, run):
    locked = folder / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("permissions do not bind this user (root)")
    refused(run("shot", dem, "-o", "locked/out.png"), 1, "no permission")


@pytest.mark.parametrize("words", ["shot {} -o out.png --size 256x128", "mesh {} -o out.ply", "mesh {} -o out.obj"])
def test_full_disk(dem, folder, words):
    """A limit on the size of files stands for a disk that is full before the output is whole."""
    limit = (4000, resource.RLIM_INFINITY)
    done = spawn(*words.format(dem).split(), preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
    refused(done, 1, "out.", "File too large")
    assert os.listdir(folder) == [dem]


def test_full_disk_keeps_what_was_there(dem, folder):
    (folder / "out.ply").write_text("precious")
    limit = (4000, resource.RLIM_INFINITY)
    refused(spawn("mesh", dem, "-o", "out.ply", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)), 1)
    assert (folder / "out.ply").read_text() == "precious" and len(os.listdir(folder)) == 2


def test_nothing_to_write(dem, folder, run):
    refused(run("mesh", dem, "-o", "out.ply", "--cull", "--eye", "9,9,99", "--target", "9,9,999"), 1, "no triangles")
    assert os.listdir(folder) == [dem]


# --- OpenGL that is not there -----------------------------------------------------------------------------------------


def test_no_display(dem, folder):
    environment = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}
    done = spawn("shot", dem, "-o", "out.png", "--backend", "glfw", env=environment)
    refused(done, 1, "glfw", "xvfb-run")
    assert os.listdir(folder) == [dem]


def test_too_old_gl(dem, folder):
    if "Mesa" not in create_context().info["GL_VERSION"]:
        pytest.skip("only Mesa can be told to pretend that it is older")
    old = {"MESA_GL_VERSION_OVERRIDE": "4.1"}
    refused(spawn("shot", dem, "-o", "out.png", env=old), 1, "found OpenGL 4.1", "needed 4.3")
    assert os.listdir(folder) == [dem]
    done = spawn("info", dem, env=old)
    assert done.returncode == 0 and "found OpenGL 4.1" in done.stdout and "97 x 65" in done.stdout


def test_back_ends_draw_the_same_bytes(dem):
    working = {probe.name for probe in probe_backends() if probe.works}
    if not {"egl", "osmesa"} <= working:
        pytest.skip(f"needs EGL and OSMesa, found {', '.join(working)}")
    for backend in ("egl", "osmesa"):
        assert spawn("shot", dem, "-o", f"{backend}.png", *SIZE, "--backend", backend).returncode == 0
        assert spawn("mesh", dem, "-o", f"{backend}.ply", "--backend", backend).returncode == 0
    for ending in ("png", "ply"):
        assert Path(f"egl.{ending}").read_bytes() == Path(f"osmesa.{ending}").read_bytes()


# --- Interruptions ----------------------------------------------------------------------------------------------------


def test_interrupt_is_quiet(dem, run, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(options, "open_scene", interrupt)
    assert run("measure", dem) == (130, "", "")


INTERRUPTED = """
import os, signal, sys
{}
from terrain_gl.cli import main
sys.exit(main())
"""
IN_A_SHADER = """
import _moderngl
exec('''
def make_uniform(*about, make=make_uniform):
    import os, signal
    os.kill(os.getpid(), {})
    return make(*about)
''', vars(_moderngl))  # as moderngl's C finds it
"""
IN_AN_IMPORT = """
class Finder:
    def find_spec(self, name, path, target=None):
        if name == {!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
"""


def interrupted(when, *words):
    """Status and outputs of a command that gets a signal at the first moment that `when` describes."""
    listening = "signal.signal(signal.SIGINT, signal.default_int_handler)"  # shells make background jobs deaf
    command = [sys.executable, "-c", INTERRUPTED.format(listening + when), *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
@pytest.mark.parametrize("name, status", [("SIGINT", 130), ("SIGTERM", 143)])
def test_signals_wait_until_moderngl_has_made_a_shader(dem, name, status):
    """Which calls Python from C, and crashes where that raises."""
    assert interrupted(IN_A_SHADER.format(f"signal.{name}"), "measure", dem) == (status, "", "")


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
@pytest.mark.parametrize("module", ["terrain_gl.cli.info", "numpy", "moderngl", "OpenImageIO"])
def test_interrupt_of_an_import_is_quiet(dem, module):
    assert interrupted(IN_AN_IMPORT.format(module), "measure", dem) == (130, "", "")


def test_memory_runs_out(dem, run, monkeypatch):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(options, "open_scene", fail)
    refused(run("measure", dem), 1, "not enough memory")


def test_reader_that_goes_away(dem):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "terrain_gl", "info", dem]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, timeout=60)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, b"")


def test_closed_standard_output(dem):
    command = f"{shlex.quote(sys.executable)} -m terrain_gl measure {shlex.quote(dem)} --size 16x9 >&-"
    done = subprocess.run(["sh", "-c", command], stderr=subprocess.PIPE, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("words, status", [("a.png", 0), ("nowhere/a.png", 1)])
def test_closed_standard_error(dem, words, status):
    command = f"{shlex.quote(sys.executable)} -m terrain_gl shot {shlex.quote(dem)} --size 16x9 -o {words} 2>&-"
    done = subprocess.run(["sh", "-c", command], stdout=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == status and ("a.png" in done.stdout) == Path("a.png").exists() == (status == 0)


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
def test_termination_leaves_no_half_written_file(dem, tmp_path):
    command = [sys.executable, "-m", "terrain_gl", "fly", dem, "-o", "film.gif", "--size", "16x16", "--seconds", "900"]
    flying = subprocess.Popen(command, stderr=subprocess.PIPE)
    while not list(tmp_path.glob(".film-*")):
        assert flying.poll() is None
        time.sleep(0.1)
    flying.terminate()
    assert flying.wait(60) == 143 and flying.stderr.read() == b""
    assert [path.name for path in tmp_path.iterdir()] == [Path(dem).name]


def test_full_standard_output(dem):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "terrain_gl", "info", dem]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr.splitlines()[0] == "terrain-gl: standard output: No space left on device"


@pytest.mark.parametrize("command", ["measure", "info"])
def test_the_map_is_no_output(run, dem, command):
    before = Path(dem).read_bytes()
    refused(run(command, dem, "--json", dem), 2, "is read, too")
    assert Path(dem).read_bytes() == before


def test_what_is_read_is_no_output(run, dem):
    refused(run("shot", dem, "--material", "m.png", "-o", "./m.png"), 2, "m.png: is read, too")
    refused(run("fly", dem, "--path", "p.json", "-o", "f/", "--json", "p.json"), 2, "p.json: is read, too")


def test_scripts_may_say_a_seed_wherever_something_is_drawn(run, dem):
    assert run("shot", dem, "-o", "a.png", "--size", "64x48", "--seed", 3)[0] == 0
