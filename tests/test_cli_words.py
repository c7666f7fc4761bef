"""Unusual names and values on the command line: nothing hangs, nothing is ignored, errors are one line."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.film.record import Recorder
from terrain_gl.image import read_image
from terrain_gl.light.laid import MOST_PIXELS, read_ground

SIZE = ("--size", "64x48")


@pytest.fixture(autouse=True)
def dem(folder):
    """Give the name of a small map, and nothing else in the folder to work in."""
    np.save("dem.npy", np.add.outer(np.arange(33.0), np.arange(49.0)))
    return "dem.npy"


def spawn(*words, **settings):
    """Run the command line in a process of its own."""
    command = [sys.executable, "-m", "terrain_gl", *words]
    return subprocess.run(command, capture_output=True, timeout=120, **settings)


def refused(result, status, *texts):
    """Assert that a run ended with `status` and one line on standard error that holds the texts."""
    code, out, err = result if isinstance(result, tuple) else (result.returncode, result.stdout, result.stderr)
    err = err.decode() if isinstance(err, bytes) else err
    assert code == status and not out, err
    assert err.startswith("terrain-gl") and err.count("\n") == 1, err
    assert all(text in err for text in texts), err


# --- Names ------------------------------------------------------------------------------------------------------------

ESCAPE = "a\x1b]0;title\x07\x1b[31m.npy"


def test_no_escape_in_a_name_reaches_the_terminal(run, dem):
    refused(run("info", ESCAPE), 1, "\\x1b[31m")
    refused(run("shot", dem, "-o", "a.png", ESCAPE), 2, "\\x1b[31m")
    os.rename(dem, ESCAPE)
    status, out, err = run("info", ESCAPE)
    assert status == 0 and "\\x1b" in out and not set("\x1b\x07") & set(out + err)
    status, out, err = run("shot", ESCAPE, "-o", ESCAPE + ".png", *SIZE)
    assert status == 0 and not set("\x1b\x07") & set(out + err)


def test_an_output_whose_name_is_not_utf_8(dem):
    refused(spawn(b"shot", dem.encode(), b"-o", b"\xff.png", b"--size", b"64x48"), 1, "not valid UTF-8")
    assert os.listdir() == [dem]


@pytest.mark.parametrize("ending", ["jpg", "tif", "exr"])
def test_no_kind_of_picture_has_a_name_that_is_not_utf_8(run, dem, ending):
    refused(run("shot", dem, "-o", os.fsdecode(b"\xff." + ending.encode()), *SIZE), 1, "not valid UTF-8")
    assert os.listdir() == [dem]


@pytest.mark.parametrize("command", [("mesh", b"\xff.ply"), ("fly", b"\xff.gif"), ("generate", b"\xff.png")])
def test_other_outputs_whose_names_are_not_utf_8(run, dem, command):
    name, output = command[0], os.fsdecode(command[1])
    refused(run(name, output) if name == "generate" else run(name, dem, "-o", output), 1, "not valid UTF-8")
    assert os.listdir() == [dem]


def test_a_map_without_a_name(run):
    refused(run("info", ""), 1, "neither a file nor a bundled map")
    refused(run("view", ""), 1, "neither a file nor a bundled map")


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_an_output_of_few_characters(dem, encoding):
    os.rename(dem, "ž→.npy")
    done = spawn("info", "ž→.npy", env=os.environ | {"PYTHONIOENCODING": encoding})
    assert done.returncode == 0 and b"\\u2192.npy" in done.stdout and not done.stderr


@pytest.mark.slow
def test_a_name_that_looks_like_mathematics(run, dem):
    pytest.importorskip("matplotlib", reason="the [compare] extra is not installed")
    os.rename(dem, r"$\frac{$.npy")
    status, _, err = run("compare", r"$\frac{$.npy", "-o", "f.png", *SIZE, "--triangles", 500, "--supersample", 1)
    assert (status, err) == (0, "") and read_image("f.png").std() > 10


# --- Values -----------------------------------------------------------------------------------------------------------


def test_a_number_beyond_the_limit_is_told_the_limit(run, dem):
    refused(run("shot", dem, "-o", "a.png", "--max-error", "1e11"), 2, "at most 1e+09")


@pytest.mark.parametrize("more", [("--triangles", 5), ("--max-error", 2)])
def test_metres_everywhere_exclude_pixels(run, dem, more):
    refused(run("mesh", dem, "-o", "a.ply", "--max-error-m", 1, *more), 2, "--max-error-m", "leave out")


def test_a_figure_of_towers(run, dem):
    pytest.importorskip("matplotlib", reason="the [compare] extra is not installed")
    refused(run("compare", dem, "-o", "a.png", "--size", "3x1000"), 2, "--size")


@pytest.mark.parametrize("grid", [(0, 0, 0, 0, 0, 0), (np.nan, 0, 0, 0, -1, 0), (1e9, 0, 0, 0, -1e9, 0)])
def test_a_grid_that_is_of_no_use_is_noted(run, grid):
    rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
    profile = {"driver": "GTiff", "width": 9, "height": 9, "count": 1, "dtype": "float32"}
    with rasterio.open("bad.tif", "w", **profile) as out:
        out.write(np.eye(9, dtype="f4"), 1)
    tags = f"<GeoTransform>{grid[2]}, {grid[0]}, 0, {grid[5]}, 0, {grid[4]}</GeoTransform>"
    Path("bad.tif.aux.xml").write_text(f"<PAMDataset>{tags}</PAMDataset>")
    status, out, err = run("info", "bad.tif")
    assert status == 0 and "1 m east" in out
    assert err.count("\n") == 1 and "bad.tif" in err and "--spacing" in err
    assert run("info", "bad.tif", "--spacing", 5)[2] == ""


# --- Files that never end ---------------------------------------------------------------------------------------------


COMMANDS = """
import contextlib, io, json, sys
from terrain_gl import cli
for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.main(words)
    print(json.dumps([status, out.getvalue(), err.getvalue()]), flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pipe", "/dev/zero", "folder"])
def test_only_files_are_read(dem, kind):
    """All commands run in one other process, which is ended if it waits for a pipe."""
    os.mkfifo("pipe")
    os.mkdir("folder")
    drawing = [("fly", "--path"), ("shot", "--material"), ("shot", "--sky")]
    words = [["info", kind], *([command, dem, "-o", "a.png", option, kind] for command, option in drawing)]
    command = [sys.executable, "-c", COMMANDS, json.dumps(words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(told) == len(words), done.stderr
    for (command, *_), (status, out, err) in zip(words, told, strict=True):
        says = "is a folder: name a heightmap file" if (command, kind) == ("info", "folder") else "is not a file"
        refused((status, out, err), 1, kind, says)


def test_a_path_of_gigabytes_is_not_read(dem):
    with open("path.json", "wb") as file:
        file.truncate(1 << 35)
    refused(spawn("fly", dem, "-o", "a.gif", "--path", "path.json"), 1, "path.json")


# --- Memory -----------------------------------------------------------------------------------------------------------

PEAK = """
import resource, sys
from terrain_gl.light.laid import read_ground
read_ground("empty.png")
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
read_ground(sys.argv[1], None, int(sys.argv[2]))
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) >> 10)
"""


def picture(name, rows, cols, dtype="uint8"):
    """Write a picture of one colour, row by row."""
    spec = oiio.ImageSpec(cols, rows, 3, dtype)
    out = oiio.ImageOutput.create(name)
    assert out.open(name, spec)
    band = np.full((64, cols, 3), np.iinfo(dtype).max // 2, dtype)
    for row in range(0, rows, 64):
        assert out.write_scanlines(row, min(rows, row + 64), 0, band[: min(64, rows - row)])
    out.close()


@pytest.mark.slow
@pytest.mark.parametrize("name, dtype", [("a.jpg", "uint8"), ("a.png", "uint16")])
def test_a_large_picture_of_the_ground_takes_little_memory(name, dtype):
    picture("empty.png", 8, 8)
    picture(name, 4096, 4096, dtype)
    done = subprocess.run([sys.executable, "-c", PEAK, name, "1024"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) < 120  # MiB; whole, as float64, it takes 400


def test_the_ground_is_reduced_to_what_is_used():
    colours = np.random.default_rng(5).random((50, 70, 3)).astype("f4")
    out = oiio.ImageOutput.create("a.exr")
    assert out.open("a.exr", oiio.ImageSpec(70, 50, 3, "float")) and out.write_image(colours)
    out.close()
    np.testing.assert_allclose(read_ground("a.exr"), colours, atol=1e-3)
    reduced = read_ground("a.exr", None, 24)  # squares of 3 pixels; 2 rows and 1 column are left over
    assert reduced.shape == (17, 24, 3)
    np.testing.assert_allclose(reduced[0, 0], colours[:3, :3].mean((0, 1)), atol=1e-3)
    np.testing.assert_allclose(reduced[16, 23], colours[48:, 69:].mean((0, 1)), atol=1e-3)


def test_a_picture_of_too_many_pixels_is_refused_unread():
    side = 23200
    assert 0 < side * side - MOST_PIXELS < 0.01 * MOST_PIXELS
    out = oiio.ImageOutput.create("a.tif")
    spec = oiio.ImageSpec(side, side, 1, "uint8")
    spec.attribute("compression", "packbits")
    assert out.open("a.tif", spec)
    band = np.zeros((1000, side, 1), "u1")
    for row in range(0, side, len(band)):
        assert out.write_scanlines(row, min(row + len(band), side), 0, band[: side - row])
    out.close()
    started = time.perf_counter()
    with pytest.raises(TerrainError, match="23200 x 23200 pixels, more than"):
        read_ground("a.tif")
    assert time.perf_counter() - started < 5


# --- Ends -------------------------------------------------------------------------------------------------------------


def hear_signals():
    """A child of `nohup` ignores SIGHUP."""
    for name in ("SIGHUP", "SIGQUIT", "SIGINT", "SIGTERM"):
        signal.signal(getattr(signal, name), signal.SIG_DFL)


@pytest.mark.slow
@pytest.mark.parametrize(
    "first, second",
    [("SIGHUP", None), ("SIGTERM", None), ("SIGTERM", "SIGTERM"), ("SIGHUP", "SIGTERM"), ("SIGINT", "SIGTERM")],
)
def test_signals_leave_no_file_behind(dem, first, second):
    """Not even a second signal that arrives while the first cleans up."""
    command = [sys.executable, "-m", "terrain_gl", "fly", dem, "-o", "film.gif", "--size", "64x64", "--seconds", "900"]
    flying = subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=hear_signals)
    while not list(Path().glob(".film-*")):
        assert flying.poll() is None
        time.sleep(0.05)
    flying.send_signal(getattr(signal, first))
    if second:
        time.sleep(0.002)
        flying.send_signal(getattr(signal, second))
    status = flying.wait(60)
    # a second signal may also end the process after it has cleaned up; shells report 128 + its number then, too
    ends = [128 + getattr(signal, name) for name in (first, second) if name]
    assert status in ends or (second and status == -getattr(signal, second))
    said = flying.stderr.read()
    assert b"Traceback" not in said and (second or said == b"")
    assert os.listdir() == [dem]


def test_two_recordings_do_not_share_a_folder():
    frame = np.zeros((8, 8, 3), "u1")
    with Recorder("frames/") as one:
        with pytest.raises(TerrainError, match="another recording"):
            Recorder("frames/")
        assert one.append(frame)
    assert os.listdir("frames") == ["frame-00001.png"]
    with pytest.raises(TerrainError, match="holds frames already"):
        Recorder("frames/")
    os.remove("frames/frame-00001.png")
    with Recorder("frames/") as again:
        assert again.append(frame)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["pdf", "png"])
def test_a_figure_on_a_full_disk(dem, ending):
    pytest.importorskip("matplotlib", reason="the [compare] extra is not installed")
    words = ("compare", dem, "-o", f"a.{ending}", *SIZE, "--triangles", "500", "--supersample", "1")
    limit = (20_000, resource.RLIM_INFINITY)
    done = spawn(*words, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
    refused(done, 1, f"a.{ending}", "File too large")
    assert os.listdir() == [dem]
