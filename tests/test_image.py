"""Image files: pixels are read as they were written, and a file is complete or does not exist."""

import os

import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import (
    FORMATS,
    difference,
    linear_from_srgb,
    read_image,
    replacing,
    srgb_from_linear,
    write_image,
    write_png,
    writing_image,
)


@pytest.fixture
def pixels():
    """Odd sizes, every channel different, alpha too."""
    return np.random.default_rng(0).integers(0, 256, (37, 53, 4), dtype=np.uint8)


def test_png_round_trip(tmp_path, pixels):
    for channels in (1, 3, 4):
        write_png(tmp_path / "a.png", pixels[..., :channels])
        assert np.array_equal(read_image(tmp_path / "a.png"), pixels[..., :channels])


def test_two_axes_are_one_channel(tmp_path, pixels):
    write_png(tmp_path / "grey.png", pixels[..., 0])
    assert np.array_equal(read_image(tmp_path / "grey.png")[..., 0], pixels[..., 0])


def test_views_and_flips(tmp_path, pixels):
    write_png(tmp_path / "a.png", pixels[::-1, ::2])
    assert np.array_equal(read_image(tmp_path / "a.png"), pixels[::-1, ::2])


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format(tmp_path, suffix):
    y, x = np.mgrid[:40, :60]
    smooth = np.stack([3 * y, 4 * x, y + 2 * x, np.full_like(x, 255)], -1).astype(np.uint8)
    write_image(tmp_path / f"a{suffix}", smooth)
    back = read_image(tmp_path / f"a{suffix}")
    if FORMATS[suffix] == "float":
        assert back[..., :3] == pytest.approx(linear_from_srgb(smooth[..., :3]), abs=1e-6)
        back = srgb_from_linear(back)
    assert np.abs(back[..., :3].astype(int) - smooth[..., :3]).max() <= (6 if suffix in (".jpg", ".jpeg") else 0)
    assert os.listdir(tmp_path) == [f"a{suffix}"]


def test_floats_are_linear_light(tmp_path):
    write_image(tmp_path / "a.png", np.full((2, 2, 3), 0.5))
    assert np.all(read_image(tmp_path / "a.png") == 188)


def test_srgb_round_trip():
    every = np.arange(256, dtype=np.uint8)
    assert np.array_equal(srgb_from_linear(linear_from_srgb(every)), every)


def test_shapes_are_checked(tmp_path):
    for shape in ((4,), (4, 4, 2), (0, 4, 3), (2, 4, 4, 3)):
        with pytest.raises(ValueError, match="expected"):
            write_image(tmp_path / "a.png", np.zeros(shape, np.uint8))
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(
    "name, reason",
    [
        ("none/a.png", "there is no folder"),
        ("a.xyz", "cannot write .xyz"),
        ("a", "without an ending"),
        ("d.png", "folder"),
    ],
)
def test_bad_names(tmp_path, pixels, name, reason):
    (tmp_path / "d.png").mkdir()
    with pytest.raises(TerrainError, match=reason) as error:
        write_image(tmp_path / name, pixels)
    assert "\n" not in str(error.value) and name in str(error.value)
    assert os.listdir(tmp_path) == ["d.png"]


def test_png_only(tmp_path, pixels):
    with pytest.raises(TerrainError, match=".png"):
        write_png(tmp_path / "a.jpg", pixels)


def test_unwritable_folder(tmp_path, pixels):
    tmp_path.chmod(0o500)
    folder = "/proc" if os.access(tmp_path, os.W_OK) else tmp_path  # root writes everywhere else
    with pytest.raises(TerrainError, match="cannot write"):
        write_png(f"{folder}/a.png", pixels)
    tmp_path.chmod(0o700)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr"])
def test_full_disk(tmp_path, monkeypatch, pixels, suffix):
    """A limit on file size imitates a full disk: writing one byte too many fails with the system's own error."""
    resource = pytest.importorskip("resource")
    import signal

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(TerrainError, match="cannot write: ."):
            write_image(tmp_path / f"a{suffix}", pixels)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert not os.listdir(tmp_path)


def test_a_failure_keeps_what_was_there(tmp_path):
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(RuntimeError), replacing(tmp_path / "a.txt") as beside:
        beside.write_text("new")
        raise RuntimeError
    assert (tmp_path / "a.txt").read_text() == "old" and os.listdir(tmp_path) == ["a.txt"]
    with replacing(tmp_path / "a.txt") as beside:
        beside.write_text("new")
    assert (tmp_path / "a.txt").read_text() == "new" and os.listdir(tmp_path) == ["a.txt"]


def test_unreadable_pictures(tmp_path, pixels):
    write_png(tmp_path / "whole.png", pixels)
    (tmp_path / "half.png").write_bytes((tmp_path / "whole.png").read_bytes()[:2000])
    (tmp_path / "text.png").write_text("not a picture")
    for name in ("half.png", "text.png", "none.png", "."):
        with pytest.raises(TerrainError) as error:
            read_image(tmp_path / name)
        assert "\n" not in str(error.value)


def test_difference(pixels):
    other = pixels.copy()
    other[3, 4, 1] ^= 4
    seen = difference(pixels, other)
    assert seen.shape == (37, 53, 3) and np.all(seen[3, 4] == 32) and np.count_nonzero(seen) == 3
    with pytest.raises(ValueError, match="shape"):
        difference(pixels, other[1:])


@pytest.mark.parametrize("suffix", FORMATS)
def test_rows_as_they_come(tmp_path, pixels, suffix):
    write_image(tmp_path / f"whole{suffix}", pixels)
    with writing_image(tmp_path / f"rows{suffix}", (53, 37)) as write:
        for first in (0, 1, 17, 30):
            write(pixels[first : {0: 1, 1: 17, 17: 30, 30: 37}[first]])
        assert not (tmp_path / f"rows{suffix}").exists()
    assert np.array_equal(read_image(tmp_path / f"rows{suffix}"), read_image(tmp_path / f"whole{suffix}"))


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_picture_with_rows_missing_is_none(tmp_path, pixels, suffix, capfd):
    for error, rows in ((ValueError, 20), (ZeroDivisionError, 20), (ZeroDivisionError, 0)):
        with pytest.raises(error), writing_image(tmp_path / f"a{suffix}", (53, 37)) as write:
            if rows:
                write(pixels[:rows])
            if error is ZeroDivisionError:
                raise ZeroDivisionError
    assert not os.listdir(tmp_path) and capfd.readouterr() == ("", "")
