"""The byte order of files without a header."""

import numpy as np
import pytest

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers import Reading
from terrain_gl.readers.windows import open_windows

Y, X = np.mgrid[0:48, 0:48]
LANDS = {
    "hill": 9000 * np.exp(-((X - 20) ** 2 + (Y - 30) ** 2) / 300) + 40 * np.sin(X / 3),
    "full range": 65535 * (X + Y) / 94,
    "rough": 20000 + 3000 * np.random.default_rng(1).random((48, 48)).cumsum(1),
}
SCALES = {"spacing_m": 30, "z_scale": 1}


@pytest.mark.parametrize("name", LANDS)
@pytest.mark.parametrize(("kind", "ending"), [("u2", "r16"), ("f4", "r32")])
@pytest.mark.parametrize("order", ["little", "big"])
def test_the_smoother_order_is_taken_and_said(tmp_path, name, kind, ending, order):
    values = LANDS[name].clip(0, 65535).astype(kind)
    values.astype({"little": "<", "big": ">"}[order] + kind).tofile(tmp_path / f"a.{ending}")
    terrain = Heightmap.open(tmp_path / f"a.{ending}", **SCALES)
    np.testing.assert_array_equal(terrain.heights, values)
    assert sum("--byte-order little" in note for note in terrain.notes) == (order == "big")


@pytest.mark.parametrize("order", ["little", "big"])
def test_the_order_that_the_user_gives_counts(tmp_path, run, order):
    values = LANDS["hill"].astype("u2")
    values.astype("<u2").tofile(tmp_path / "a.r16")
    wanted = values if order == "little" else values.byteswap()
    path = tmp_path / "a.r16"
    terrain = Heightmap.open(path, byte_order=order, **SCALES)
    np.testing.assert_array_equal(terrain.heights, wanted)
    assert terrain.notes == () and terrain.opened["byte_order"] == order
    windows = open_windows([path], Reading(byte_order=order, z_scale=1.0, nodata=float("nan")))
    np.testing.assert_array_equal(windows.read(slice(0, 48), slice(0, 48)), wanted)
    code, out, err = run("info", str(path), "--spacing", "30", "--z-scale", "1", "--byte-order", order)
    assert code == 0 and err == "" and f"{wanted.min()} to {wanted.max()} m" in out


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("mark", [None, -9999])
def test_heights_on_both_sides_of_0_are_signed(tmp_path, order, mark):
    values = (LANDS["hill"] - 3000).astype("i2")
    if mark:
        values[5:9, 5:20] = mark
    values.astype({"little": "<i2", "big": ">i2"}[order]).tofile(tmp_path / "a.r16")
    terrain = Heightmap.open(tmp_path / "a.r16", **SCALES, nodata=mark)
    np.testing.assert_array_equal(terrain.heights, np.where(values == (mark or 1e9), np.nan, values))
    assert sum("signed numbers" in note for note in terrain.notes) == 1


def test_noise_and_bytes_stay_little(tmp_path):
    np.random.default_rng(2).integers(0, 65536, (64, 64), "u2").tofile(tmp_path / "noise.r16")
    (LANDS["hill"] / 100).astype("u2").tofile(tmp_path / "low.r16")
    for name in ("noise.r16", "low.r16"):
        assert Heightmap.open(tmp_path / name, **SCALES).notes == ()
    assert Heightmap.open(tmp_path / "low.r16", **SCALES).range_m[1] <= 90


def test_another_order_is_a_wrong_use(tmp_path):
    with pytest.raises(UsageError, match="byte order must be one of little, big"):
        Heightmap.open(tmp_path / "a.r16", byte_order="middle")
