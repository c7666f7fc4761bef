"""Fixtures shared by all tests: one OpenGL context for the session, real elevation data, strict floating point."""

import compileall
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from drivers import DRIVERS, environment
from hypothesis import HealthCheck, settings
from maps import rough

from terrain_gl import cli
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu.context import create_context
from terrain_gl.heightmap import Heightmap

np.seterr(all="raise")
settings.register_profile(
    "terrain", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
settings.load_profile("terrain")


def pytest_addoption(parser):
    parser.addoption("--regenerate", action="store_true", help="write reference pictures anew instead of comparing")
    parser.addoption("--driver", choices=DRIVERS, help="run the shaders in another way")
    parser.addoption("--all", action="store_true", help="run all cases of tests that are sampled")


def pytest_configure(config):
    """Select the driver: Mesa reads these variables when the first context is made."""
    try:
        os.environ.update(environment(config.getoption("--driver")))
    except LookupError as error:
        pytest.exit(str(error), returncode=4)
    # Of workers and of processes that tests start: they share the cores, and threads of OpenBLAS spin while they wait
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if sys.dont_write_bytecode and not hasattr(config, "workerinput"):
        # PYTHONDONTWRITEBYTECODE is set: else each of the hundreds of processes that tests start compiles all modules
        compileall.compile_dir(Path(cli.__file__).parents[1], quiet=2)


def pytest_collection_modifyitems(config, items):
    """Begin with the longest tests, and leave out cases of `sampled(n, cover)`, unless `--all` asks for them."""
    items.sort(key=lambda item: item.get_closest_marker("longest") is None)
    if config.getoption("--all"):
        return
    tests = {}
    for item in items:
        tests.setdefault((item.path, item.originalname), []).append(item)
    left_out = {item for cases in tests.values() for item in not_sampled(cases)}
    config.hook.pytest_deselected(items=sorted(left_out, key=items.index))
    items[:] = [item for item in items if item not in left_out]


def not_sampled(cases):
    """Cases that are neither one in n, nor the first with a value of a parameter of `cover`."""
    marker = cases[0].get_closest_marker("sampled")
    if marker is None:
        return []
    every, cover = marker.args
    kept, found = set(), set()
    for i, case in enumerate(cases):
        values = {(name, str(case.callspec.params[name])) for name in cover.split()}
        if i % every == 0 or not values <= found:
            kept.add(case)
            found |= values
    return [case for case in cases if case not in kept]


@pytest.fixture
def sample(request):
    """Give a function that takes every n-th of some cases, others for each case of the test; all with `--all`."""

    def sample(cases, every):
        first = sum(request.node.callspec.indices.values()) % every
        return cases if request.config.getoption("--all") else cases[first::every]

    return sample


@pytest.fixture
def regenerate(request):
    return request.config.getoption("--regenerate")


@pytest.fixture(scope="session")
def session_context(request):
    """EGL, or OSMesa where there is no EGL. What tests drop is released after them."""
    try:
        context = create_context("egl")
    except TerrainError:
        context = create_context("osmesa")
    asked, used = request.config.getoption("--driver"), context.info["GL_RENDERER"]
    assert not asked or used.startswith("zink" if asked == "zink" else "llvmpipe"), f"{used} draws, not {asked}"
    context.gc_mode = "context_gc"
    return context


@pytest.fixture
def ctx(session_context):
    """Give the session's context, current and free of OpenGL errors before and after the test."""
    with session_context as context:
        assert context.error == "GL_NO_ERROR"
        yield context
    with session_context as context:  # the test may have left another one current
        while context.objects:  # `Context.gc` fails at those that are released already
            dropped = context.objects.popleft()
            if hasattr(dropped, "release"):
                dropped.release()
        assert context.error == "GL_NO_ERROR"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Give an empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capsys):
    """Give a function that runs the command line here: status, standard output, standard error."""

    def run(*words):
        status = cli.main([str(word) for word in words])
        return status, *capsys.readouterr()

    return run


@pytest.fixture(scope="session")
def hills(tmp_path_factory):
    """A map in memory, and its store, which no test may change."""
    pytest.importorskip("zarr")
    from terrain_gl.store import build

    heights, path = rough(200, 261, relief=60), tmp_path_factory.mktemp("store") / "s"
    build(heights, path, tile=16, shard=64, spacing_m=2.0)
    return Heightmap(heights, 2.0), path


@pytest.fixture
def store(hills, folder):
    """The store of `hills`, in the working folder, where it may be changed."""
    shutil.copytree(hills[1], "s")
    return "s"


@pytest.fixture
def alone(monkeypatch):
    """Nothing is loaded while a mesh is chosen."""
    select = "terrain_gl.pages.streaming.Streaming.select"
    monkeypatch.setattr(select, lambda _, choose, camera, goal: (choose(camera), {}))


@pytest.fixture(scope="session")
def dem():
    """Folder of real elevation maps, named by TERRAIN_GL_DEM."""
    folder = os.environ.get("TERRAIN_GL_DEM")
    if not folder:
        pytest.skip("TERRAIN_GL_DEM does not name a folder of elevation maps")
    return Path(folder)
