"""Wrong use, bad maps and outputs that cannot be written: one line, and no file is left."""

import os
import resource
import shlex
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from commands import SIZE, refused, small_map, spawn

from terrain_gl.gpu.context import create_context, probe_backends


@pytest.fixture(autouse=True)
def dem(folder):
    """Give the name of a small map with a hill, and nothing else in the folder to work in."""
    return small_map()


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
    ("--encoding jpeg", "encoding must be one of plain, terrarium"),
    ("--method best", "invalid choice"),
    ("--metric median", "invalid choice"),
    ("--style oil", "invalid choice"),
    ("--backend vulkan", "expected one of auto, egl, osmesa, glfw"),
    ("--json out.png", "two outputs"),
    ("--max 3", "unrecognized"),
    ("--max-eror 3", "did you mean --max-error? (see terrain-gl shot --help)"),
    ("--exagerate=3", "did you mean --exaggeration? (see terrain-gl shot --help)"),
    ("extra", "unrecognized arguments: extra (see terrain-gl shot --help)"),
]


@pytest.mark.parametrize(("words", "text"), WRONG)
def test_wrong_use(dem, folder, run, words, text):
    refused(run("shot", dem, "-o", "out.png", *SIZE, *shlex.split(words)), 2, text)
    assert os.listdir(folder) == [dem]


@pytest.mark.parametrize(
    ("words", "text"),
    [("shot dem.npy -o out.bmp", ".png"), ("mesh dem.npy -o out.fbx", ".ply"), ("mesh dem.npy", "-o/--output")],
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
    names = "alpine, canyon, alpine-30m, canyon-15m"
    refused(run("measure", "alpnie"), 1, f"alpnie: neither a file nor a bundled map ({names})")


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
    """A limit on the size of files imitates a disk that becomes full before the output is complete."""
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


@pytest.mark.slow
def test_too_old_gl(dem, folder):
    if "Mesa" not in create_context().info["GL_VERSION"]:
        pytest.skip("only Mesa can be told to pretend that it is older")
    old = {"MESA_GL_VERSION_OVERRIDE": "4.1"}
    refused(spawn("shot", dem, "-o", "out.png", env=old), 1, "found OpenGL 4.1", "needed 4.3")
    assert os.listdir(folder) == [dem]
    done = spawn("info", dem, env=old)
    assert done.returncode == 0 and "found OpenGL 4.1" in done.stdout and "97 x 65" in done.stdout


@pytest.mark.slow
def test_back_ends_draw_the_same_bytes(dem):
    working = {probe.name for probe in probe_backends() if probe.works}
    if not {"egl", "osmesa"} <= working:
        pytest.skip(f"needs EGL and OSMesa, found {', '.join(working)}")
    for backend in ("egl", "osmesa"):
        assert spawn("shot", dem, "-o", f"{backend}.png", *SIZE, "--backend", backend).returncode == 0
        assert spawn("mesh", dem, "-o", f"{backend}.ply", "--backend", backend).returncode == 0
    for ending in ("png", "ply"):
        assert Path(f"egl.{ending}").read_bytes() == Path(f"osmesa.{ending}").read_bytes()


@pytest.mark.parametrize("command", ["measure", "info"])
def test_the_map_is_no_output(run, dem, command):
    before = Path(dem).read_bytes()
    refused(run(command, dem, "--json", dem), 2, "is also an input")
    assert Path(dem).read_bytes() == before


def test_what_is_read_is_no_output(run, dem):
    refused(run("shot", dem, "--material", "m.png", "-o", "./m.png"), 2, "m.png: is also an input")
    refused(run("fly", dem, "--path", "p.json", "-o", "f/", "--json", "p.json"), 2, "p.json: is also an input")
