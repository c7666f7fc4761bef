"""Ctrl-C, termination and closed pipes: commands end quietly, and leave no half-written file."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from commands import refused, small_map


@pytest.fixture(autouse=True)
def dem(folder):
    """Give the name of a small map with a hill, and nothing else in the folder to work in."""
    return small_map()


# --- Interruptions ----------------------------------------------------------------------------------------------------


def test_interrupt_is_quiet(dem, run, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("terrain_gl.cli.measure.open_scene", interrupt)
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


# while moderngl deletes a buffer
IN_A_DELETION = """
import moderngl
class Buffer(moderngl.Buffer):
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        super().__del__()
moderngl.Buffer = Buffer
"""


def interrupted(when, *words):
    """Status and outputs of a command that gets a signal as soon as `when` is true."""
    listening = "signal.signal(signal.SIGINT, signal.default_int_handler)"  # shells let background jobs ignore Ctrl-C
    command = [sys.executable, "-c", INTERRUPTED.format(listening + when), *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
@pytest.mark.parametrize("name, status", [("SIGINT", 130), ("SIGTERM", 143)])
def test_signals_wait_until_moderngl_has_made_a_shader(dem, name, status):
    """Moderngl calls Python from C there, and crashes if Python raises an exception."""
    assert interrupted(IN_A_SHADER.format(f"signal.{name}"), "measure", dem) == (status, "", "")


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
def test_signals_wait_until_an_object_is_deleted(dem):
    """Python prints exceptions of `__del__`, and goes on."""
    assert interrupted(IN_A_DELETION, "measure", dem) == (130, "", "")


@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
@pytest.mark.parametrize("module", ["terrain_gl.cli.measure", "numpy", "moderngl", "OpenImageIO"])
def test_interrupt_of_an_import_is_quiet(dem, module):
    assert interrupted(IN_AN_IMPORT.format(module), "measure", dem) == (130, "", "")


def test_memory_runs_out(dem, run, monkeypatch):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr("terrain_gl.cli.measure.open_scene", fail)
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


def test_full_standard_output(dem):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "terrain_gl", "info", dem]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr.splitlines()[0] == "terrain-gl: standard output: No space left on device"
