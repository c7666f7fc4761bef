"""Heightmaps written and read again, voids included; no half-written files."""

import numpy as np
import pytest
from maps import holes, rough

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.files import writers
from terrain_gl.heightmap import Heightmap


@pytest.mark.parametrize("suffix", writers.FORMATS)
@pytest.mark.parametrize("name", ["rough", "holes", "integer", "deep"])
def test_what_is_written_is_read_again(tmp_path, suffix, name):
    heights = {
        "rough": rough(70, 91),
        "holes": holes(90),
        "integer": np.rint(rough(50, 60, relief=4000.0)),
        "deep": rough(33, 20) - 10994,
    }[name]
    heightmap = Heightmap(heights, (30.0, 25.0))
    opening = writers.write_heightmap(tmp_path / f"map{suffix}", heightmap)
    again = Heightmap.open(tmp_path / f"map{suffix}", **opening)
    assert again.spacing_m == (30.0, 25.0) and again.voids == heightmap.voids
    if suffix != ".png" or name == "integer":
        assert np.array_equal(again.heights, heightmap.heights, equal_nan=True)
    else:
        step = opening["z_scale"]
        assert step <= 5 * (heightmap.range_m[1] - opening["z_offset_m"]) / writers.MOST_STEPS
        error = np.nanmax(np.abs(again.heights.astype("f8") - heightmap.heights))
        assert error <= 0.5 * step + 1e-7 * np.nanmax(np.abs(heightmap.heights))


def test_options_are_those_of_the_commands(tmp_path):
    heights = holes(40)
    opening = writers.write_heightmap(tmp_path / "map.png", Heightmap(heights, (30.0, 25.0)))
    words = writers.as_options(opening).split()
    assert words[:2] == ["--spacing", "30,25"] and words[-2:] == ["--nodata", "65535"]
    assert float(words[3]) == opening["z_scale"] and float(words[5]) == opening["z_offset_m"]


def test_a_file_of_several_bands_has_all_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(writers, "BAND_POSTS", 500)
    writers.write_heightmap(tmp_path / "map.tif", Heightmap(rough(64, 50)))
    assert np.array_equal(Heightmap.open(tmp_path / "map.tif", spacing_m=1.0).heights, rough(64, 50))


@pytest.mark.parametrize("suffix", writers.FORMATS)
def test_a_file_that_fails_leaves_the_old_one(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"map{suffix}"
    writers.write_heightmap(path, Heightmap(rough(20, 20)))
    before = path.read_bytes()
    monkeypatch.setattr("OpenImageIO.ImageOutput.write_scanlines", lambda *_: False)
    with pytest.raises(TerrainError, match="cannot write"):
        writers.write_heightmap(path, Heightmap(rough(30, 30)))
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(UsageError, match=r"\.png, \.tif"):
        writers.write_heightmap(tmp_path / "map.jpg", Heightmap(rough(9, 9)))
