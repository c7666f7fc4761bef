"""Stores of large rasters: made at first use, used again, the oldest removed."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import refused
from hostile import vrt
from maps import rough

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import read_image
from terrain_gl.readers import Reading, files_of

pytest.importorskip("zarr")
from terrain_gl.store import cache

SHOT = ("shot", "dem.npy", "-o", "p.png", "--size", "96x54", "--style", "lambert", "--spacing", "5")


@pytest.fixture(autouse=True)
def here(folder, monkeypatch):
    """A small raster that counts as a large one, and a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    monkeypatch.setattr(cache, "PAYS_POSTS", 5000)
    monkeypatch.setattr(cache, "_in_use", [])
    np.save("dem.npy", rough(70, 90))


def let_go():
    """End the use of all stores, as the end of the process does."""
    while cache._in_use:
        os.close(cache._in_use.pop())


@pytest.mark.slow
def test_a_large_raster_is_drawn_from_its_store_which_is_made_once(run, monkeypatch):
    status, _, told = run(*SHOT)
    assert status == 0 and told.count("\n") == 1 and "90 x 70 posts, drawn from a store that is made once" in told
    first = read_image("p.png")
    (entry,) = cache.entries()
    assert entry.is_finished and entry.source == os.path.abspath("dem.npy") and entry.bytes > 10_000
    monkeypatch.setattr(cache, "build", lambda *_, **__: pytest.fail("it is there"))
    status, _, told = run(*SHOT)
    assert status == 0 and "made once" not in told and "drawn from a store in" in told
    np.testing.assert_array_equal(read_image("p.png"), first)
    assert run(*SHOT, "--no-cache")[::2] == (0, "")


def test_its_picture_and_numbers_are_those_of_a_store(run):
    assert run("build", "dem.npy", "-o", "s", "--spacing", "5")[0] == 0
    assert run(*SHOT)[0] == 0
    mine = read_image("p.png")
    assert run("shot", "s", "-o", "q.png", "--size", "96x54", "--style", "lambert")[0] == 0
    np.testing.assert_array_equal(read_image("q.png"), mine)
    found = json.loads(run("measure", "dem.npy", "--spacing", "5", "--size", "96x54", "--json", "-")[1])
    assert found["complete"] and found["max_error_px"] <= found["certified_max_error_px"] and found["map"] == "dem.npy"


@pytest.mark.parametrize("option", [("--method", "full"), ("--style", "error")])
def test_what_a_store_lacks_is_drawn_from_memory_and_said(run, option):
    status, _, told = run(*SHOT, *option)
    assert status == 0 and f"in memory, because of {' '.join(option)}" in told and not cache.entries()


@pytest.mark.slow
def test_the_mesh_of_a_large_raster_is_that_of_its_store_if_its_tiles_have_room(run):
    np.save("dem.npy", rough(300, 400))
    mesh = ("mesh", "dem.npy", "-o", "m.ply", "--spacing", "5", "--max-error-m", "0.5", "--between", "--json", "-")
    status, out, told = run(*mesh)
    stored = json.loads(out)
    assert status == 0 and "drawn from a store" in told
    assert stored["complete"] and stored["certified_max_error_m"] <= 0.5
    held = json.loads(run(*mesh, "--no-cache")[1])
    status, out, told = run(*mesh, "--gpu-memory", "20")
    assert status == 0 and "more tiles than --gpu-memory holds" in told and json.loads(out) == held


def test_another_file_or_option_is_another_store(run):
    keys = {cache.key_of("dem.npy", Reading(), None), cache.key_of("dem.npy", Reading(z_scale=2.0), None)}
    keys |= {cache.key_of("dem.npy", Reading(), 5.0)}
    os.utime("dem.npy", (1, 1))
    assert len(keys | {cache.key_of("dem.npy", Reading(), None)}) == 4


def test_the_mask_of_a_mosaic_is_one_of_its_files(run):
    Path("m.vrt").write_text(vrt("a.tif", 'relativeToVRT="1"'))
    mask = "<MaskBand><VRTRasterBand><SimpleSource><SourceFilename>mask.tif</SourceFilename></SimpleSource>"
    text = Path("m.vrt").read_text().replace("</VRTDataset>", f"{mask}</VRTRasterBand></MaskBand></VRTDataset>")
    Path("m.vrt").write_text(text)
    assert [Path(name).name for name in files_of("m.vrt")] == ["m.vrt", "a.tif", "mask.tif"]


def test_a_source_in_no_file_of_a_disk_is_left_out_of_the_key(run):
    Path("m.vrt").write_text(vrt("/vsizip/tiles.zip/a.tif"))
    assert cache.key_of("m.vrt", Reading(trusted=True), None)


def test_the_oldest_store_that_nobody_uses_is_removed(run):
    for number in range(3):
        np.save(f"{number}.npy", rough(70, 90, seed=number))
        cache.stored(f"{number}.npy", Reading())
        os.utime(cache.folder() / cache.key_of(f"{number}.npy", Reading(), None) / "source.json", (number, number))
    size = cache.entries()[0].bytes
    cache.set_limit(int(1.5 * size))
    assert len(cache.entries()) == 3  # all are in use
    let_go()
    cache.shrink()
    assert [entry.source for entry in cache.entries()] == [os.path.abspath("2.npy")]
    out = run("cache")[1]
    assert "1 stores" in out and "2.npy" in out
    assert json.loads(run("cache", "--limit", "2", "--json", "-")[1])["limit_bytes"] == 2 << 30
    assert "0 stores" in run("cache", "--clear")[1] and not cache.entries()
    refused(run("cache", "--limit", "-1"), 2, "--limit")


def test_without_room_the_raster_is_held_in_memory(run, monkeypatch):
    def full(*_, **__):
        raise TerrainError("the disk is full")

    monkeypatch.setattr(cache, "build", full)
    status, _, told = run(*SHOT)
    assert status == 0 and "the disk is full; dem.npy is held in memory instead" in told
    monkeypatch.setattr("terrain_gl.cli.stores.is_too_large", lambda *_: True)
    status, _, told = run(*SHOT)
    assert status == 1 and told.split("\n")[-2] == "terrain-gl: the disk is full"


def test_an_interrupted_build_is_continued(run, monkeypatch):
    built = sys.modules["terrain_gl.store.build"]

    def interrupted(*args, **more):
        raise KeyboardInterrupt

    finish = built.BuildJournal.finish
    monkeypatch.setattr(built.BuildJournal, "finish", interrupted)
    assert run(*SHOT)[0] == 130
    assert not cache.entries()[0].is_finished
    monkeypatch.setattr(built.BuildJournal, "finish", finish)
    monkeypatch.setattr(built, "perform", lambda *_: pytest.fail("all tasks are done"))
    let_go()
    assert run(*SHOT)[0] == 0 and cache.entries()[0].is_finished
