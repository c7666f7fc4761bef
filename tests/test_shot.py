"""`terrain-gl shot` of any size: a picture written in pieces equals the same picture drawn at once."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl import cli
from terrain_gl.camera.pieces import cut
from terrain_gl.cli import shot
from terrain_gl.files.views import standard_view
from terrain_gl.gpu import gl
from terrain_gl.image import FORMATS, read_image, write_image
from terrain_gl.renderer import renderer

SIZE = (150, 83)
OUTLIERS = 0.002  # as in test_pieces.py: edges that snap to another sample


@pytest.fixture(autouse=True)
def folder(folder):
    np.save("map.npy", rough(97, 130, 3))


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(renderer, "cut", lambda size, fine: cut(size, fine, 64))
    monkeypatch.setattr(shot, "LARGEST", 64)


def shoot(output, size=SIZE, *words):
    return cli.main(["shot", "map.npy", "-o", output, "--size", f"{size[0]}x{size[1]}", *words])


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FORMATS)
def test_pieces_that_are_written_as_they_come(small_pieces, suffix):
    heightmap = tg.Heightmap.open("map.npy")
    with tg.Renderer(heightmap, (64, 64)) as r:
        exact = FORMATS[suffix] == "float"
        write_image(f"expected{suffix}", r.render(standard_view(heightmap), size=SIZE, exact=exact).image)
    assert shoot(f"a{suffix}") == 0
    assert np.array_equal(read_image(f"a{suffix}"), read_image(f"expected{suffix}"))
    assert sorted(os.listdir()) == [f"a{suffix}", f"expected{suffix}", "map.npy"]


def test_pieces_show_no_seams(small_pieces):
    heightmap = tg.Heightmap.open("map.npy")
    with tg.Renderer(heightmap, SIZE) as r:
        whole = r.render(standard_view(heightmap)).image
    assert shoot("a.png") == 0
    differs = np.abs(read_image("a.png").astype(int) - whole).max(-1) > 1
    assert differs.mean() <= OUTLIERS


def test_stats_are_of_the_whole(small_pieces, capsys):
    assert shoot("a.png", SIZE, "--json", "a.json") == 0
    with open("a.json") as file:
        stats = json.load(file)
    heightmap = tg.Heightmap.open("map.npy")
    with tg.Renderer(heightmap, SIZE) as r:
        whole = r.render(standard_view(heightmap)).stats
    same = ("triangles", "patches", "splits", "certified_max_error_px", "width", "height", "method", "metric")
    assert {key: stats[key] for key in same} == {key: whole[key] for key in same}
    pose = {"eye", "target", "fov_deg", "projection", "K", "R", "t", "sun"}
    assert stats.keys() == whole.keys() | {"map"} | pose and stats["ms"]["frame"] >= stats["ms"]["draw"] > 0
    assert "150x83" in capsys.readouterr().out


def test_beyond_what_the_gpu_draws(ctx):
    """The picture is wider than any viewport."""
    size = (gl.limits(ctx)["viewport_size"] + 1000, 3)
    with pytest.raises(tg.UsageError, match="picture size"):
        tg.Renderer(tg.Heightmap.open("map.npy"), size, ctx=ctx)
    assert shoot("a.png", size, "--max-error", "50") == 0
    assert read_image("a.png").shape == (3, size[0], 4)


@pytest.mark.parametrize("size", ["70000x70000", "999999999x999999999"])
def test_too_many_pixels(capsys, size):
    assert cli.main(["shot", "map.npy", "-o", "a.png", "--size", size]) == 2
    assert "pixels" in capsys.readouterr().err and os.listdir() == ["map.npy"]


def test_no_room_for_it(monkeypatch, capsys):
    free = type("Usage", (), {"free": 100})
    monkeypatch.setattr("shutil.disk_usage", lambda _: free)
    assert shoot("a.png") == 1
    assert "No space left" in capsys.readouterr().err and os.listdir() == ["map.npy"]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_picture():
    """Four times the rows need less than half of the memory that these rows would take."""
    peak = "import resource, sys; from terrain_gl import cli; cli.main(sys.argv[1:])"
    peak += "; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    used = []
    for rows in (2048, 8192):
        words = ["shot", "map.npy", "-o", "a.png", "--size", f"2000x{rows}", "--max-error", "100", "--style", "depth"]
        done = subprocess.run([sys.executable, "-c", peak, *words], capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        used.append(int(done.stdout.split()[-1]) * 1024)
    assert used[1] - used[0] < 0.5 * 4 * 2000 * (8192 - 2048)


def test_a_map_too_large_for_light_is_refused_before_its_tables_are_built(monkeypatch, run):
    def build(*_, **__):
        raise AssertionError("tables are built")

    monkeypatch.setattr("terrain_gl.renderer.gpu_resources.ErrorTables", build)
    monkeypatch.setattr("terrain_gl.gpu.gl.storage_block_bytes", lambda _: 100_000)  # lobes of 130 x 97 posts: 112,320
    status, out, err = run("shot", "map.npy", "-o", "a.png", "--size", "64x36")
    assert (status, out) == (1, "") and err.count("\n") == 1 and "map.npy: needs light, whose tables of lobes" in err
    assert "--style lambert" in err and os.listdir() == ["map.npy"]
    with pytest.raises(AssertionError, match="tables are built"):
        run("shot", "map.npy", "-o", "a.png", "--size", "64x36", "--style", "lambert")
