"""Damaged stores: each damage is found and mended, to the bytes of an undisturbed build. Builds at once end well."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import refused
from maps import rough
from test_store import SMALL, digest, write_tiff

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.locks import lock, locked
from terrain_gl.readers import windows

pytest.importorskip("zarr")
from terrain_gl.store import StoredMap, build, check, tasks

HEIGHTS = "heights/0/c/1/2"  # a shard with voids
COARSE = "errors/5/c/0/0"  # a shard that is gathered from all tasks


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """The folder of dem.npy, which has voids, a store of it, and a store of another map."""
    folder = tmp_path_factory.mktemp("once")
    heights = rough(100, 150)
    heights[30:75, 40:140] = np.nan
    np.save(folder / "dem.npy", heights)
    np.save(folder / "other.npy", rough(100, 150, seed=5))
    for name in ("dem", "other"):
        build(folder / f"{name}.npy", folder / f"{name}.zarr", **SMALL)
    assert not check(folder / "dem.zarr").damage
    return folder


@pytest.fixture
def store(folder, once):
    shutil.copytree(once, folder, dirs_exist_ok=True)
    return Path("dem.zarr")


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path, at=5):
    data = bytearray(path.read_bytes())
    data[at] ^= 16
    path.write_bytes(data)


def swap(one, other):
    shutil.move(one, "kept")
    shutil.move(other, one)
    shutil.move("kept", other)


def say(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def describe(store, **changes):
    path = store / "zarr.json"
    document = json.loads(path.read_text())
    about = document["attributes"]["terrain_gl"]
    for key, value in changes.items():
        if value is None:
            del about[key]
        about |= {key: value} if value is not None else {}
    path.write_text(json.dumps(document, indent=2))


def into_folder(path):
    path.unlink()
    path.mkdir()


DAMAGE = {
    "a file is cut": lambda s: cut(s / HEIGHTS),
    "a file is gone": lambda s: (s / HEIGHTS).unlink(),
    "a file is empty": lambda s: (s / HEIGHTS).write_bytes(b""),
    "a bit of a tile": lambda s: flip(s / HEIGHTS),
    "a bit of a tile's index": lambda s: flip(s / HEIGHTS, -9),
    "more bytes": lambda s: (s / HEIGHTS).write_bytes((s / HEIGHTS).read_bytes() + b"more"),
    "two files swapped": lambda s: swap(s / HEIGHTS, s / "heights/0/c/1/1"),
    "a file of another store": lambda s: shutil.copy(s.with_name("other.zarr") / HEIGHTS, s / HEIGHTS),
    "a file became a folder": lambda s: into_folder(s / HEIGHTS),
    "a coarse level's heights": lambda s: flip(s / "heights/3/c/0/0"),
    "a level is gone": lambda s: shutil.rmtree(s / "heights/2"),
    "errors": lambda s: flip(s / "errors/1/c/1/2"),
    "errors of a coarse level": lambda s: (s / COARSE).unlink(),
    "ranges": lambda s: cut(s / "ranges/2/c/0/0/1"),
    "marks": lambda s: (s / "marks/0/c/0/0").unlink(),
    "the description is gone": lambda s: (s / "zarr.json").unlink(),
    "the description is cut": lambda s: cut(s / "zarr.json"),
    "the spacing is another one": lambda s: describe(s, spacing_m=[2.0, 1.0]),
    "an older version": lambda s: describe(s, format=3),
    "a hash is missing": lambda s: describe(s, checks_sha256=None),
    "the hash of the description is missing": lambda s: describe(s, description_sha256=None),
    "an array's description is gone": lambda s: (s / "errors/2/zarr.json").unlink(),
    "an array's description is changed": lambda s: say(s / "heights/1/zarr.json", "float32", "float64"),
    "a group's description is changed": lambda s: say(s / "heights/zarr.json", "{}", '{"a": 1}'),
    "checksums": lambda s: flip(s / "checks/c/0"),
    "the checksums are gone": lambda s: shutil.rmtree(s / "checks"),
    "a file more": lambda s: (s / "heights/note.txt").write_text("mine"),
    "an unfinished file": lambda s: (s / "heights/0/c/9.partial").write_bytes(b"cut"),
    "a link to nothing": lambda s: (s / "zarr.json.bak").symlink_to("nowhere"),
}


# one damage in three in the quick tests
KINDS = [pytest.param(kind, marks=[pytest.mark.slow] * (i % 3 > 0)) for i, kind in enumerate(DAMAGE)]


@pytest.mark.parametrize("damage", KINDS)
def test_damage_is_found_and_mended(store, run, damage):
    clean = digest(store)
    DAMAGE[damage](store)
    status, listed, told = run("build", "--check", store)
    assert status == 1 and listed and told.count("\n") == 1 and "build MAP -o dem.zarr --mend" in told
    with pytest.raises(TerrainError, match=r"dem.zarr: .*--mend"):
        build("dem.npy", store, **SMALL)
    build("dem.npy", store, mends=True, **SMALL)
    assert digest(store) == clean


@pytest.mark.slow
def test_all_of_it_at_once(store):
    clean = digest(store)
    for damage in DAMAGE.values():
        try:
            damage(store)
        except (OSError, IndexError, KeyError, ValueError, AssertionError):
            continue  # what it harms is gone
    build("dem.npy", store, mends=True, **SMALL)
    left = [each.file for each in check(store).damage]
    assert set(left) <= {"zarr.json.bak", "note.txt"}
    build("dem.npy", store, mends=True, **SMALL)
    assert digest(store) == clean


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_found_and_mended(store):
    clean = digest(store)
    (store / HEIGHTS).chmod(0)
    assert [each.file for each in check(store).damage] == [HEIGHTS]
    build("dem.npy", store, mends=True, **SMALL)
    assert digest(store) == clean


@pytest.mark.slow
def test_errors_are_measured_again_only_where_they_are_damaged(store, monkeypatch):
    measured = []
    measure = tasks.measure
    monkeypatch.setattr(tasks, "measure", lambda job, task: measured.append(task.at) or measure(job, task))
    flip(store / HEIGHTS)
    build("dem.npy", store, mends=True, **SMALL)
    assert measured == []
    flip(store / "errors/1/c/1/2")
    build("dem.npy", store, mends=True, **SMALL)
    assert measured == [(1, 2)]


def test_mending_that_is_killed_goes_on(store, monkeypatch):
    clean = digest(store)
    flip(store / HEIGHTS)
    flip(store / "errors/1/c/1/2")

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(tasks, "measure", killed)
        with pytest.raises(KeyboardInterrupt):
            build("dem.npy", store, mends=True, **SMALL)
    assert "not ended" in check(store).damage[0].reason
    build("dem.npy", store, **SMALL)
    assert digest(store) == clean


def test_a_store_is_mended_from_its_own_map_alone(store):
    flip(store / HEIGHTS)
    harmed = digest(store)
    with pytest.raises(TerrainError, match="another map"):
        build("other.npy", store, mends=True, **SMALL)
    assert digest(store) == harmed
    times = os.stat("dem.npy").st_atime_ns, os.stat("dem.npy").st_mtime_ns
    np.save("dem.npy", np.load("other.npy"))
    os.utime("dem.npy", ns=times)  # with the size and the time of the file that was built
    with pytest.raises(TerrainError, match="other heights than before"):
        build("dem.npy", store, mends=True, **SMALL)
    Path("mine").mkdir()
    Path("mine/file").write_text("mine")
    with pytest.raises(TerrainError, match="is not a store"):
        build("dem.npy", "mine", mends=True, **SMALL)
    assert digest("mine")


def test_a_tile_that_is_missing_says_how_to_mend_it(store):
    flip(store / HEIGHTS)
    with pytest.raises(TerrainError, match="heights/0, rows .* checksum .* build MAP -o dem.zarr --mend"):
        StoredMap(store).lattice_heights(0, slice(64, 100), slice(128, 150))
    (store / "checks/c/0").unlink()
    with pytest.raises(TerrainError, match="--mend"):
        StoredMap(store)


def test_check_stands_alone(store, run):
    assert run("build", "--check", store)[:2] == (0, "dem.zarr: whole\n")
    refused(run("build", "--check", store, "--fill", "3"), 2, "--check")
    refused(run("build", "dem.npy", "--check", store), 2, "--check")
    refused(run("build", "dem.npy"), 2, "-o STORE")
    refused(run("build", "dem.npy", "-o", "none.zarr", "--mend"), 1, "none.zarr", "is not a store")
    assert not Path("none.zarr").exists()


# --- Several at once, and a store that is there already ---------------------------------------------------------------


@pytest.mark.slow
def test_pairs_of_builds_at_once(folder, pytestconfig):
    np.save("dem.npy", rough(100, 150))
    words = [sys.executable, "-m", "terrain_gl", "build", "dem.npy", "-o"]
    for pair in range(0, 10, 1 if pytestconfig.getoption("--all") else 3):
        runs = []
        for delay in (0.0, 0.05 * pair):
            time.sleep(delay)
            runs.append(
                subprocess.Popen([*words, f"s{pair}"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            )
        for run in runs:
            assert run.wait(120) == 0, run.stderr.read()
        assert digest(f"s{pair}") == digest("s0")
    assert not check("s0").damage


@pytest.mark.slow
def test_a_build_waits_for_another_one_and_says_so(store):
    words = [sys.executable, "-m", "terrain_gl", "build", "dem.npy", "-o", "new.zarr"]
    with locked("new.zarr"):
        run = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        assert "waits for another build" in run.stderr.readline()
        assert run.poll() is None
    assert run.wait(60) == 0
    assert not check("new.zarr").damage


def test_locks_of_folders(tmp_path):
    folder = tmp_path / "a"
    one, two = (lock(folder, is_shared=True) for _ in range(2))
    with pytest.raises(BlockingIOError):
        lock(folder, waits=False)
    os.close(one)
    os.close(two)
    with locked(folder) as is_alone, locked(folder, waits=False) as is_second:
        assert is_alone and not is_second
    assert not folder.exists()  # it was empty
    (tmp_path / "file").write_text("")
    with pytest.raises(TerrainError, match="file: cannot write"):
        lock(tmp_path / "file")


def test_a_store_that_is_there_opens_without_its_sources(store, monkeypatch):
    monkeypatch.setattr(windows, "open_raster", lambda *_: pytest.fail("a source is read"))
    assert build("dem.npy", store, **SMALL)["voids"]


def test_compressed_tiles_are_sampled_as_fast_as_they_are_read(tmp_path):
    """GDAL's cache had 64 bytes: it decoded each block again for each row of a sample."""
    heights = np.round(rough(1500, 1500)).astype("int16")
    names = [tmp_path / f"{number}.tif" for number in range(4)]
    for number, name in enumerate(names):
        write_tiff(name, heights, west=15000.0 * number, tiled=True, compress="deflate")
    parts = []

    def seconds(do):
        begun = time.process_time()
        do()
        return time.process_time() - begun

    whole = seconds(lambda: [windows.RasterFile(str(name)).read(slice(0, 1500), slice(0, 1500)) for name in names])
    assert seconds(lambda: windows.open_windows(names, progress=parts.append)) < 5 * whole
    assert parts == [0.25, 0.5, 0.75, 1.0]
