"""Values that mark voids although the file does not say so."""

import numpy as np
import pytest
from test_kinds import COLS, METRES, ROWS, image, raster

from terrain_gl.files.maps import sample
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers import Reading
from terrain_gl.readers.windows import open_windows

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")

VOID = np.zeros((ROWS, COLS), bool)
VOID[20:, 3:9] = True
LAND = METRES  # 100 to 820
FLOATS = (-9999, -99999, -999, -32768, -32767, -3.4028234663852886e38, -3.40282306e38, 3.4e38, 1e20, 9.96921e36, -1e30)
MARKS = [
    *(("f4", mark) for mark in (*FLOATS, 1.70141e38, 9999, 32767, 65535, -10000, -999999, -2147483648)),
    *(("f8", mark) for mark in (-9999.0, -1.7976931348623157e308, 1e20)),
    *(("i2", mark) for mark in (-9999, -32767, 32767, 9999)),
    *(("u2", mark) for mark in (65535, 65534, 32767, 9999)),
    *(("i4", mark) for mark in (-9999, -2147483648, 2147483647)),
    ("u4", 4294967295),
]


def with_voids(dtype, mark, land=LAND):
    return np.where(VOID, mark, land.astype(dtype)).astype(dtype)


@pytest.mark.parametrize(("dtype", "mark"), MARKS)
def test_marks_that_no_file_declares_are_voids_with_a_line(tmp_path, dtype, mark):
    raster(tmp_path / "a.tif", with_voids(dtype, mark))
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert np.array_equal(np.isnan(terrain.heights), VOID)
    np.testing.assert_array_equal(terrain.heights[~VOID], LAND[~VOID])
    told = [note for note in terrain.notes if f"{VOID.sum()} posts have exactly" in note]
    assert all("100 to 820 m" in note and "--nodata none" in note for note in told)
    assert len(told) == (abs(mark) < 1e300)  # beyond float32 it is infinite, which always marks voids


@pytest.mark.parametrize("mark", [-9999, 32767])
def test_a_single_post_is_a_mark_too_and_both_ends_may_have_some(tmp_path, mark):
    heights = LAND.copy()
    heights[5, 7] = mark
    heights[0, 2:4] = -32768, -32767
    np.save(tmp_path / "a.npy", heights)
    terrain = Heightmap.open(tmp_path / "a.npy")
    assert terrain.voids == 3 and terrain.range_m == (100, 820) and len(terrain.notes) >= 3


@pytest.mark.parametrize("options", [{"nodata": float("nan")}, {"nodata": 5}])
def test_a_value_that_the_user_gives_ends_the_search(tmp_path, options):
    np.save(tmp_path / "a.npy", with_voids("f4", -9999))
    terrain = Heightmap.open(tmp_path / "a.npy", spacing_m=30, **options)
    assert terrain.range_m == (-9999, 820) and terrain.voids == 0 and terrain.notes == ()
    np.save(tmp_path / "b.npy", with_voids("i2", -32768))
    assert Heightmap.open(tmp_path / "b.npy", **options).voids == (options["nodata"] == 5) * VOID.sum()


def test_marks_are_found_in_the_units_of_the_file_and_before_its_scale_is_guessed(tmp_path):
    raster(tmp_path / "a.tif", with_voids("i2", -9999, LAND * 10), scale=0.1)
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert terrain.voids == VOID.sum() and "exactly -9999," in terrain.notes[0]
    image(tmp_path / "a.png", with_voids("u2", 65535))
    terrain = Heightmap.open(tmp_path / "a.png")
    assert terrain.range_m == (100, 820) and terrain.scales == (1, 0)


HEIGHTS = {
    "a tower": np.where(VOID, 1e4 + METRES, METRES),
    "a sea": np.maximum(METRES - 300, 0),
    "a deep sea": METRES * 30 - 9999,
    "16 bits": np.linspace(0, 65535, METRES.size).reshape(METRES.shape),
    "8 bits": np.linspace(0, 255, METRES.size).reshape(METRES.shape),
    "black and white": np.where(VOID, 65535, 0),
    "up to 9999": METRES * 10 + 9999 - 8200,
    "flat": 0 * METRES - 9999,
}


@pytest.mark.parametrize("name", HEIGHTS)
def test_heights_are_no_marks(tmp_path, name):
    np.save(tmp_path / "a.npy", HEIGHTS[name].astype("f4"))
    terrain = Heightmap.open(tmp_path / "a.npy", spacing_m=30, z_scale=1)
    assert terrain.voids == 0 and terrain.notes == ()


@pytest.mark.parametrize("mark", [0, -1234, 5000])
def test_other_values_far_from_all_heights_only_get_a_line(tmp_path, mark):
    raster(tmp_path / "a.tif", with_voids("f4", mark, LAND + 1000))
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert terrain.voids == 0 and len(terrain.notes) == 1
    assert f"{VOID.sum()} posts have exactly {mark}," in terrain.notes[0] and f"--nodata {mark}" in terrain.notes[0]
    assert Heightmap.open(tmp_path / "a.tif", nodata=mark).voids == VOID.sum()


def test_the_command_line_refuses_the_guess_with_none(tmp_path, run):
    np.save(tmp_path / "a.npy", with_voids("f4", -9999))
    code, out, err = run("info", str(tmp_path / "a.npy"), "--spacing", "30")
    assert code == 0 and "100 to 820 m" in out and err.count("\n") == 1 and "--nodata none" in err
    code, out, err = run("info", str(tmp_path / "a.npy"), "--spacing", "30", "--nodata", "none")
    assert code == 0 and "-9999 to 820 m" in out and err == ""


def test_files_that_are_read_by_windows_agree_on_marks(tmp_path):
    """The mark of one file counts in all: another may have too few of them to be sure."""
    west, east = with_voids("f4", -9999)[:, :20], with_voids("f4", -9999)[:, 20:]
    east[:] = np.where(LAND[:, 20:] > 700, -9999, east - 10150)  # by itself, this file has no gap
    for name, part, x in (("west.tif", west, 0), ("east.tif", east, 20)):
        raster(tmp_path / name, part, grid=(30, 0, 5e5 + 30 * x, 0, -30, 5e6))
    windows = open_windows([tmp_path / "east.tif", tmp_path / "west.tif"])
    voids = np.isnan(windows.read(slice(0, ROWS), slice(0, COLS)))
    assert np.array_equal(voids, np.concatenate([west, east], 1) == -9999) and len(windows.notes) == 1
    few, _ = sample(tmp_path / "west.tif", Reading())
    assert few.voids == (west == -9999).sum() and few.notes
