"""Stores: records equal the whole map's tables bit for bit, for all sources, shards and interruptions."""

import hashlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import refused, spawn
from hostile import N, vrt
from maps import rough
from rasters import spaced, write_raster

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.error import ErrorTables
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.climate import look_of
from terrain_gl.readers import Reading
from terrain_gl.readers.windows import open_windows
from terrain_gl.shade.picture import UNLIT
from terrain_gl.terrain import Terrain

pytest.importorskip("zarr")
from terrain_gl.store import MissingTileError, StoredMap, build, scheduling
from terrain_gl.store.build import BuildJournal
from terrain_gl.store.format import Arrays, pyramid_of, read_about, shape_of

SMALL = {"tile": 16, "shard": 64}
EVERYTHING = np.s_[:, :]


def arrays_of(path):
    return Arrays(path, pyramid_of(read_about(path)))


def whole(arrays, name, level):
    rows, cols = shape_of(arrays.pyramid, name, level)
    return arrays.read(name, level, (slice(0, rows), slice(0, cols)))


def digest(path):
    """Names and bytes of all files of a store, but for the time at which its source was written."""
    files = sorted(file for file in Path(path).rglob("*") if file.is_file())
    return {str(file.relative_to(path)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def write_tiff(path, heights, west=0.0, north=1000.0, **more):
    write_raster(path, heights, **{"grid": spaced(10, west, north), "crs": "EPSG:32632"} | more)


# --- What is stored ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(130, 257), (129, 65), (64, 64), (2, 90)])
def test_records_are_those_of_the_whole_map(ctx, tmp_path, shape):
    heights = rough(*shape, seed=shape[0])
    arrays = arrays_of_built(heights, tmp_path / "s")
    tables = ErrorTables(Terrain(ctx, Heightmap(heights, 2.0)))
    for level in range(1, arrays.pyramid.top + 1):
        nodes, ranges = tables.read_nodes(level), tables.read_ranges(level)
        expected = nodes.view("<u4")
        np.testing.assert_array_equal(whole(arrays, "errors", level), expected)
        np.testing.assert_array_equal(np.moveaxis(whole(arrays, "ranges", level), 0, -1), ranges["heights"])


def arrays_of_built(heights, path, **options):
    build(heights, path, spacing_m=2.0, **SMALL | options)
    return arrays_of(path)


def test_a_lattice_has_every_other_post_and_the_last(tmp_path):
    heights = rough(100, 150)
    arrays = arrays_of_built(heights, tmp_path / "s")
    for level in range(arrays.pyramid.top + 1):
        rows, cols = (
            np.minimum(np.arange(n) << level, last)
            for n, last in zip(arrays.pyramid.posts(level), (99, 149), strict=True)
        )
        np.testing.assert_array_equal(whole(arrays, "heights", level), heights[np.ix_(rows, cols)])


def test_other_programs_find_the_levels(tmp_path):
    import zarr

    build(rough(70, 90), tmp_path / "s", **SMALL)
    group = zarr.open_group(tmp_path / "s", mode="r")
    layout = group.attrs["multiscales"]["layout"]
    assert [entry["asset"] for entry in layout] == [f"heights/{level}" for level in range(len(layout))]
    assert all(entry["asset"] in group for entry in layout)


# --- Sources ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_and_arrays_alike(tmp_path):
    heights = rough(150, 200)
    write_tiff(tmp_path / "whole.tif", heights, tiled=True, blockxsize=64, blockysize=64)
    for row, col in ((0, 0), (0, 1), (1, 0), (1, 1)):
        part = heights[80 * row : 80 * row + 80, 90 * col : 90 * col + 110]  # they overlap
        write_tiff(tmp_path / f"{row}{col}.tif", part, 900.0 * col, 1000.0 - 800.0 * row)
    build(tmp_path / "whole.tif", tmp_path / "a", **SMALL)
    build([tmp_path / f"{at}.tif" for at in ("11", "00", "01", "10")], tmp_path / "b", **SMALL)
    build(heights, tmp_path / "c", spacing_m=10.0, **SMALL)
    first = read_about(tmp_path / "a")
    assert first["spacing_m"] == [10.0, 10.0] and first["georeference"]["transform"][2] == 0.0
    for other in ("b", "c"):
        about = read_about(tmp_path / other)
        assert all(about[key] == first[key] for key in ("rows", "cols", "sha256", "range_m", "spacing_m"))
    assert read_about(tmp_path / "b")["georeference"] == first["georeference"]
    mine, others = digest(tmp_path / "a"), digest(tmp_path / "c")
    del mine["zarr.json"], others["zarr.json"]
    assert mine == others


class Ramp:
    """A map that is computed when it is read."""

    shape, spacing_m, identity = (90, 140), 3.0, "ramp"

    def __getitem__(self, window):
        rows, cols = (np.arange(s.stop, dtype=np.float32)[s] for s in window)
        return rows[:, None] * cols


RAMP = np.linspace(0, 1, 300 * 280).reshape(300, 280)
WAVES = np.add.outer(np.sin(np.arange(300) / 9), np.cos(np.arange(280) / 11))
ALIKE = {  # values of a file without a scale, and options
    "land": (RAMP * 140, {}),
    "too steep": (WAVES * 40, {}),
    "too high": (RAMP * 4000, {}),
    "not metres": ((RAMP * 65535).astype("u2"), {}),
    "not metres, but spaced": ((RAMP * 65535).astype("u2"), {"spacing_m": 30.0}),
    "moon": (RAMP * 19_000 - 9_000, {"spacing_m": 100.0}),
    "moon, scaled": (RAMP * 19_000 - 9_000, {"spacing_m": 100.0, "z_scale": 1.0}),
}


@pytest.mark.parametrize("kind", ALIKE)
def test_a_file_and_its_store_have_the_same_spacing_and_look(tmp_path, kind):
    values, told = ALIKE[kind]
    np.save(tmp_path / "a.npy", values if values.dtype == np.uint16 else values.astype(np.float32))
    mine = Heightmap.open(tmp_path / "a.npy", **told)
    reading = Reading(z_scale=told.get("z_scale"))
    build(tmp_path / "a.npy", tmp_path / "s", told.get("spacing_m"), reading, tile=64, shard=256)
    stored = StoredMap(tmp_path / "s")
    for name in ("spacing_m", "range_m", "assumes_spacing", "of_earth"):
        assert getattr(stored, name) == getattr(mine, name), name
    assert look_of(stored) == look_of(mine)
    np.testing.assert_array_equal(stored.part(slice(0, 300), slice(0, 280)), mine.heights)


def test_an_array_and_its_store_have_the_same_look(tmp_path):
    for name, lift_m in (("earth", 0), ("moon", 12_000)):
        heights = rough(40, 50) + np.float32(lift_m)
        build(heights, tmp_path / name, spacing_m=30.0, **SMALL)
        stored = StoredMap(tmp_path / name)
        assert stored.of_earth == Heightmap(heights).of_earth == (name == "earth")
        assert look_of(stored) == look_of(Heightmap(heights, 30.0))


def test_other_options_make_another_store(tmp_path):
    np.save(tmp_path / "a.npy", rough(40, 50))
    build(tmp_path / "a.npy", tmp_path / "s", reading=Reading(nodata=np.nan), **SMALL)
    build(tmp_path / "a.npy", tmp_path / "s", reading=Reading(nodata=np.nan), **SMALL)
    with pytest.raises(TerrainError, match="another map"):
        build(tmp_path / "a.npy", tmp_path / "s", reading=Reading(z_scale=2.0), **SMALL)


def test_a_mosaic_whose_source_has_changed_makes_another_store(tmp_path):
    pytest.importorskip("rasterio")
    (tmp_path / "m.vrt").write_text(vrt("a.tif", 'relativeToVRT="1"'))
    for seed in (1, 2):
        write_tiff(tmp_path / "a.tif", rough(N, N, seed=seed))
        os.utime(tmp_path / "a.tif", (seed, seed))
        if seed == 1:
            build(tmp_path / "m.vrt", tmp_path / "s", **SMALL)
            build(tmp_path / "m.vrt", tmp_path / "s", **SMALL)
    with pytest.raises(TerrainError, match="another map or a changed one"):
        build(tmp_path / "m.vrt", tmp_path / "s", **SMALL)


@pytest.mark.slow
def test_an_object_with_an_identity_is_read_by_other_processes(tmp_path):
    build(Ramp(), tmp_path / "s", workers=2, **SMALL)
    build(Ramp()[:90, :140], tmp_path / "t", spacing_m=3.0, **SMALL)
    assert read_about(tmp_path / "s")["sha256"] == read_about(tmp_path / "t")["sha256"]


def test_a_file_is_read_by_windows_as_a_whole_would_be(tmp_path):
    heights = rough(90, 70)
    write_tiff(tmp_path / "up.tif", np.round(heights).astype("i2")[::-1], grid=(10, 0, 0, 0, 10, 0), nodata=-7)
    np.save(tmp_path / "whole.npy", heights)
    for name in ("up.tif", "whole.npy"):
        read = open_windows([tmp_path / name]).read(slice(10, 50), slice(20, 60))
        np.testing.assert_array_equal(read, Heightmap.open(tmp_path / name).heights[10:50, 20:60])


def test_files_in_two_zones_are_no_mosaic(tmp_path):
    """The same numbers in the next zone of UTM are another place; ETRS89 and WGS 84 are the same within a metre."""
    pytest.importorskip("pyproj")
    heights = rough(64, 64)
    for name, west, crs in (("a", 500_000.0, 32632), ("b", 500_640.0, 32633), ("c", 500_640.0, 25832)):
        write_tiff(tmp_path / f"{name}.tif", heights, west=west, north=5.2e6, crs=f"EPSG:{crs}")
    with pytest.raises(TerrainError, match="b.tif: has another coordinate system than"):
        build([tmp_path / "a.tif", tmp_path / "b.tif"], tmp_path / "s", **SMALL)
    assert not (tmp_path / "s").exists()
    build([tmp_path / "a.tif", tmp_path / "c.tif"], tmp_path / "s", **SMALL)


@pytest.mark.slow
def test_lazy_arrays_are_never_whole_in_memory(tmp_path):
    dask = pytest.importorskip("dask.array")
    xarray = pytest.importorskip("xarray")
    heights = rough(70, 90)
    largest = 0

    class Lazy:
        shape, spacing_m = heights.shape, (3.0, 4.0)

        def __getitem__(self, window):
            nonlocal largest
            largest = max(largest, heights[window].size)
            return heights[window]

    y = np.arange(70)[::-1] * 4.0
    lazy = xarray.DataArray(dask.from_array(heights, 50), dims=("y", "x"), coords={"y": y, "x": np.arange(90) * 3.0})
    for name, source in (("a", Lazy()), ("b", dask.from_array(heights, 50)), ("c", lazy), ("d", lazy[::-1])):
        about = build(source, tmp_path / name, **SMALL)
        assert about["sha256"] == read_about(tmp_path / "a")["sha256"], name
    assert read_about(tmp_path / "a")["spacing_m"] == [3.0, 4.0] == read_about(tmp_path / "d")["spacing_m"]
    assert largest <= 64 * 64


def test_voids_may_get_one_height(tmp_path):
    heights = rough(40, 50)
    heights[30, 20] = np.nan
    about = build(heights, tmp_path / "t", fill_m=-5.0)
    assert about["filled_voids"] == 1 and about["voids"] == 0
    assert arrays_of(tmp_path / "t").read("heights", 0, (slice(30, 31), slice(20, 21))) == -5.0


def test_a_store_that_is_opened_as_a_file_says_how_to_open_it(tmp_path):
    build(rough(20, 30), tmp_path / "land.zarr", **SMALL)
    with pytest.raises(TerrainError, match="land.zarr: is a store.*terrain_gl.store.StoredMap"):
        Heightmap.open(tmp_path / "land.zarr")


# --- Interruptions and faults -----------------------------------------------------------------------------------------

BUILD = """
import sys
from terrain_gl.basics import exceptions
from terrain_gl.store import build
try:
    build(sys.argv[1], sys.argv[2], tile=16, shard=64, workers=int(sys.argv[3]))
except exceptions.TerrainError as error:
    sys.exit(str(error))
"""


def building(output, workers=1, **settings):
    command = [sys.executable, "-c", BUILD, "dem.npy", output, str(workers)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True, **settings)


@pytest.fixture
def undisturbed(folder, once):
    """Files of a store of dem.npy that nothing disturbed."""
    shutil.copytree(once, folder, dirs_exist_ok=True)  # with the time at which dem.npy was written
    return digest("undisturbed")


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """The folder of dem.npy and a store of it."""
    folder = tmp_path_factory.mktemp("once")
    heights = rough(160, 200)
    heights[30:75, 40:90] = np.nan  # in four shards: tasks of every kind
    np.save(folder / "dem.npy", heights)
    build(folder / "dem.npy", folder / "undisturbed", **SMALL)
    return folder


def killed_at_work(run, done):
    """Kill a build a moment after it has finished a further task; the number of finished tasks, or None if it ended."""
    while run.poll() is None:
        if (now := finished_tasks("s")) > done:
            time.sleep(0.01 * random.Random(done).random())
            os.killpg(run.pid, signal.SIGKILL)
            run.wait()
            return now
        time.sleep(0.001)
    return None


def finished_tasks(store):
    journal = Path(store, ".build/done")
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


@pytest.mark.slow
def test_killed_at_any_moment_it_goes_on_to_the_same_bytes(undisturbed):
    done = 0
    for workers in (1, 2):
        done = killed_at_work(building("s", workers=workers), done)
        assert done
    run = building("s")
    assert run.wait(120) == 0, run.stderr.read()
    assert digest("s") == undisturbed


@pytest.mark.slow
def test_a_build_that_was_cut_off_leaves_nothing_behind(undisturbed, monkeypatch):
    """As if killed after any write: of shards, of the journal, of the store's metadata."""
    writes = 0

    def counted(write):
        def written(*args, **settings):
            nonlocal writes
            writes += 1
            write(*args, **settings)
            if writes % 7 == 0:  # a task has fewer
                if Path("s/.build").is_dir():
                    Path("s/heights/0/c/9.partial").write_bytes(b"cut")
                raise KeyboardInterrupt

        return written

    monkeypatch.setattr(Arrays, "write", counted(Arrays.write))
    monkeypatch.setattr(BuildJournal, "add", counted(BuildJournal.add))
    monkeypatch.setattr(shutil, "rmtree", counted(shutil.rmtree))
    runs = 0
    while runs < 100:
        runs += 1
        try:
            build("dem.npy", "s", **SMALL)
            break
        except KeyboardInterrupt:
            continue
    assert 5 < runs < 100
    assert digest("s") == undisturbed


@pytest.mark.slow
def test_two_processes_write_the_same_bytes(undisturbed):
    run = building("s", workers=2)
    assert run.communicate(timeout=120) == (None, "") and run.returncode == 0
    assert digest("s") == undisturbed


@pytest.mark.slow
def test_a_cluster_writes_the_same_bytes_though_a_worker_dies(undisturbed):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        victim = cluster.workers[0].pid
        started = time.monotonic()

        def progress(_):
            nonlocal victim
            if victim and time.monotonic() - started > 1:
                os.kill(victim, signal.SIGKILL)
                victim = None

        build("dem.npy", "s", address=cluster.scheduler_address, progress=progress, **SMALL)
        assert victim is None
    assert digest("s") == undisturbed


@pytest.mark.slow
def test_a_full_disk_is_one_line_and_can_be_continued(undisturbed):
    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))

    run = building("s", preexec_fn=small_files)
    assert run.wait(120) == 1
    told = run.stderr.read()
    assert told.count("\n") == 1 and "disk is full" in told and "again" in told
    with pytest.raises(TerrainError, match="not a finished store"):
        read_about("s")
    build("dem.npy", "s", **SMALL)
    assert digest("s") == undisturbed


def test_a_store_of_another_map_is_kept(undisturbed):
    np.save("dem.npy", rough(160, 200, seed=5))
    with pytest.raises(TerrainError, match="another map"):
        build("dem.npy", "undisturbed", **SMALL)
    assert digest("undisturbed") == undisturbed
    Path("other").mkdir()
    Path("other/file").write_text("mine")
    with pytest.raises(TerrainError, match="holds something else"):
        build("dem.npy", "other", **SMALL)


@pytest.mark.parametrize("harm", ["change", "cut", "remove"])
def test_a_damaged_tile_is_missing_and_named(undisturbed, harm):
    shard = Path("undisturbed/heights/0/c/1/2")
    data = bytearray(shard.read_bytes())
    if harm == "remove":
        shard.unlink()
    elif harm == "cut":
        shard.write_bytes(data[: len(data) // 2])
    else:
        data[5] ^= 1  # in its first tile
        shard.write_bytes(data)
    arrays = arrays_of("undisturbed")
    with pytest.raises(MissingTileError, match="heights/0, rows 64 to 79, columns 128 to 143"):
        arrays.read("heights", 0, (slice(64, 80), slice(128, 144)))
    arrays.read("heights", 0, (slice(0, 64), slice(0, 200)))
    if harm == "change":
        arrays.read("heights", 0, (slice(64, 80), slice(144, 160)))


@pytest.mark.slow
def test_the_command_builds_and_tells(folder, monkeypatch, run):
    np.save("dem.npy", rough(60, 80))
    done = spawn("build", "dem.npy", "-o", "s", "--spacing", "5")
    assert (done.returncode, done.stderr) == (0, "") and "80 x 60 posts" in done.stdout
    refused(run("build", "none.tif", "-o", "t"), 1, "none.tif")
    monkeypatch.setattr(scheduling, "CONNECT", "1s")
    refused(run("build", "dem.npy", "-o", "t", "--scheduler", "tcp://127.0.0.1:9"), 1, "no Dask scheduler", "start one")
    told = spawn("build", "dem.npy", "-o", "t", "--scheduler", "nonsense://x").stderr
    assert "nonsense" in told and " at 0x" not in told


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(2, 20_000), (17_000, 5)])
def test_thin_maps_are_drawn(tmp_path, ctx, shape):
    """They have few posts, but more along one side than a map in memory may have."""
    along = np.arange(max(shape)).reshape([-1 if n == max(shape) else 1 for n in shape])
    build(100 * np.sin(along / 300) + np.zeros(shape, "f4"), tmp_path / "thin", spacing_m=30.0)
    thin = StoredMap(tmp_path / "thin")
    with tg.Renderer(thin, (80, 45), ctx=ctx) as renderer:
        renderer.render(tg.Camera.default(thin.coarse()), style=UNLIT)
        found = renderer.measure()
    assert found["complete"] and found["holes"] == 0 and found["posts_measured"] > 1000
    assert found["max_error_px"] <= found["certified_max_error_px"] <= 1


@pytest.mark.parametrize("steep", [1, 60])
def test_an_array_without_a_spacing_is_built_as_a_file_is(tmp_path, steep):
    y, x = np.mgrid[:300, :300]
    heights = (steep * np.sin(x / 9) * np.cos(y / 11) * 4).astype("f4")
    np.save(tmp_path / "a.npy", heights)
    told = {"file": [], "array": []}
    for name, source in (("file", tmp_path / "a.npy"), ("array", heights)):
        build(source, tmp_path / name, tell=told[name].append)
    spacings = {StoredMap(tmp_path / name).spacing_m for name in told}
    assert spacings == {Heightmap.of(heights).spacing_m} and (spacings == {(1.0, 1.0)}) == (steep == 1)
    assert [len(lines) for lines in told.values()] == [int(steep > 1)] * 2
    assert all("is chosen; give --spacing" in line for lines in told.values() for line in lines)
    build(heights, tmp_path / "given", spacing_m=1.0, tell=pytest.fail)


def test_a_lazy_array_without_a_spacing_gets_a_line_and_is_not_computed_for_it(tmp_path):
    class Lazy:
        shape, dtype, read = (300, 300), np.dtype("f4"), 0

        def __getitem__(self, window):
            Lazy.read += 1
            return np.zeros((300, 300), "f4")[window]

    told = []
    about = build(Lazy(), tmp_path / "s", tell=told.append)
    assert len(told) == 1 and "1 m apart; give spacing_m" in told[0] and about["spacing_m"] == [1.0, 1.0]
    reads, Lazy.read = Lazy.read, 0
    build(Lazy(), tmp_path / "t", spacing_m=1.0, tell=pytest.fail)
    assert reads == Lazy.read
