"""Input files are never overwritten, and a clone runs without installation."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hostile import vrt
from rasters import spaced, write_raster

from terrain_gl import cli
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.replacing import replacing
from terrain_gl.basics.resources import FOLDERS, folder

SIZE = ("--size", "64x48")


@pytest.fixture(autouse=True)
def work(folder):
    """Give an empty folder to work in."""
    return folder


@pytest.fixture
def refused(capsys):
    """Give a function that asserts that a command line ends in one line of wrong use."""

    def refused(*words):
        status = cli.main([str(word) for word in words])
        out, err = capsys.readouterr()
        assert (status, out, err.count("\n")) == (2, "", 1), err
        return err

    return refused


@pytest.fixture
def clone(work):
    """Copy the package, its shaders and its maps, as a clone holds them."""
    for source in (folder("glsl").parent / "terrain_gl", *map(folder, FOLDERS)):
        shutil.copytree(source, work / "clone" / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    return work / "clone"


def run(clone, *words):
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=clone, capture_output=True, text=True, timeout=120)


@pytest.mark.slow
def test_a_clone_finds_its_own_shaders_and_maps(clone):
    """Without an installation, and though another copy is installed."""
    told = run(clone, "-c", "import terrain_gl.gpu.shaders as s; print(s.root())")
    assert Path(told.stdout.strip()) == clone / "glsl", told.stderr
    done = run(clone, "-m", "terrain_gl", "shot", "alpine-30m", "-o", "a.png", *SIZE, "--style", "normals")
    assert done.returncode == 0 and (clone / "a.png").exists(), done.stderr
    shutil.rmtree(clone / "glsl" / "lod")
    done = run(clone, "-m", "terrain_gl", "shot", "alpine", "-o", "b.png", *SIZE)
    assert done.returncode == 1 and "glsl/lod/" in done.stderr


@pytest.mark.parametrize("words", ["shot alpine", "shot canyon", "shot alpine.lnk", "generate"])
def test_bundled_maps_are_no_output(clone, words):
    (clone / "alpine.lnk").symlink_to(clone / "heightmaps" / "alpine.png")
    before = {path: path.read_bytes() for path in (clone / "heightmaps").iterdir() if path.is_file()}
    name, *map_ = words.split()
    output = ("-o", "heightmaps/alpine.png", *SIZE) if map_ else ("heightmaps/alpine.png", "--size", "64")
    done = run(clone, "-m", "terrain_gl", name, *map_, *output)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert before == {path: path.read_bytes() for path in before}


def test_no_writer_writes_over_a_bundled_map():
    alpine = folder("heightmaps") / "alpine.png"
    before = alpine.stat()
    with pytest.raises(TerrainError, match="comes with terrain-gl"), replacing(alpine) as beside:
        raise TerrainError(f"{beside} was given")
    assert alpine.stat() == before


def test_the_sources_of_a_mosaic_are_no_output(refused):
    write_raster("tile.tif", np.eye(64, dtype="f4"), spaced(2, 0, 0), None)
    Path("mosaic.vrt").write_text(vrt("tile.tif", 'relativeToVRT="1"'))
    before = Path("tile.tif").read_bytes()
    assert "tile.tif: is also an input" in refused("shot", "mosaic.vrt", "-o", "tile.tif", *SIZE)
    os.symlink("tile.tif", "link.tif")
    assert "is also an input" in refused("shot", "mosaic.vrt", "-o", "link.tif", *SIZE)
    assert Path("tile.tif").read_bytes() == before
