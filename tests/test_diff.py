"""Comparing pictures: `terrain-gl diff`, `shot --against` and `measure --fail-above`."""

import json

import numpy as np
import pytest
from commands import SIZE, refused, small_map

from terrain_gl.comparison.difference import OTHER_DRIVER, Tolerance, differ
from terrain_gl.comparison.likeness import flip, rmse
from terrain_gl.image import read_image, write_image

LOOK = (*SIZE, "--style", "normals", "--eye", "50,-40,90", "--target", "45,35,10")


@pytest.fixture(autouse=True)
def dem(folder):
    return small_map()


def noise(dtype=np.uint8, channels=3, size=(40, 60)):
    values = np.random.default_rng(5).random((*size, channels))
    return values.astype(dtype) if np.dtype(dtype).kind == "f" else (values * 200).astype(dtype)


def written(*pictures):
    for name, picture in zip("ab", pictures, strict=True):
        write_image(f"{name}.png", picture)
    return "a.png", "b.png"


# --- Numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype, step", [(np.uint8, 1), (np.uint16, 257), (np.float32, 1 / 255)])
def test_a_step_is_a_255th(dtype, step):
    one = noise(dtype)
    other = one.copy()
    other[7, 9, 1] += dtype(3 * step)
    found = differ(one, other, Tolerance(3.001))
    assert found.largest == pytest.approx(3, rel=1e-5) and found.worst == (9, 7) and found.is_within
    assert found.rmse == pytest.approx(3 / 255 / np.sqrt(one.size), rel=1e-5)
    assert not differ(one, other, Tolerance(2.999)).is_within


def test_a_difference_does_not_wrap_around():
    assert differ(noise() * 0, noise() * 0 + 255).largest == 255


def test_the_tolerance_is_inclusive_and_the_share_counts_pixels():
    one = noise()
    other = one.copy()
    other[:2, 0] += 5  # two pixels, three channels each
    share = 2 / (40 * 60)
    assert differ(one, other, Tolerance(5)).share == 0 and differ(one, other, Tolerance(4)).share == share
    assert differ(one, other, Tolerance(4, share)).is_within
    assert not differ(one, other, Tolerance(4, 0.9 * share)).is_within


def test_rmse_and_flip_are_those_of_compare():
    one, other = noise(), np.roll(noise(), 1, 1)
    found = differ(one, other)
    assert (found.rmse, found.flip) == pytest.approx((rmse(one, other), flip(one, other)), rel=1e-6)
    assert differ(one, one) == differ(one, one.copy()) and differ(one, one).flip == 0


def test_alpha_counts_as_a_difference():
    one = noise(channels=4)
    other = one.copy()
    other[3, 3, 3] += 9
    assert differ(one, other).largest == 9


# --- diff -------------------------------------------------------------------------------------------------------------


def test_diff_of_equal_pictures(run):
    status, out, err = run("diff", *written(noise(), noise()))
    assert (status, err) == (0, "") and "within the tolerance" in out


def test_diff_beyond_the_tolerance(run):
    other = noise()
    other[12, 34] += 20
    names = written(noise(), other)
    status, out, err = run("diff", *names, "-o", "d.png", "--json", "-")
    told = json.loads(out)
    assert (status, err) == (1, "") and not told["within"]
    assert (told["largest"], told["worst"]) == (20, [34, 12]) and told["share"] == 1 / other[..., 0].size
    seen = read_image("d.png")
    assert seen[12, 34].tolist() == [160] * 3 and np.count_nonzero(seen) == 3
    assert run("diff", *names, "--tolerance", "20")[0] == 0
    assert run("diff", *names, "--share", "0.001")[0] == 0


@pytest.mark.parametrize(
    "other, said",
    [
        (noise(size=(40, 61)), "61 x 40 pixels"),
        (noise(channels=4), "4 channels"),
        (noise(np.uint16), "uint8"),
    ],
)
def test_pictures_of_two_kinds_are_refused(run, other, said):
    if other.dtype == np.uint16:
        write_image("b.exr", noise(np.float32))
        write_image("a.png", noise())
        refused(run("diff", "a.png", "b.exr"), 1, said, "float32")
        return
    refused(run("diff", *written(noise(), other), "-o", "d.png"), 1, said)
    refused(run("diff", "a.png", "none.png"), 1, "none.png")


def test_not_a_number_is_no_picture(run):
    """OpenImageIO's own comparison calls NaN equal to anything."""
    pictures = noise(np.float32), noise(np.float32)
    pictures[1][0, 0, 0] = np.nan
    for name, picture in zip("ab", pictures, strict=True):
        write_image(f"{name}.exr", picture)
    refused(run("diff", "a.exr", "b.exr"), 1, "b.exr", "not finite")


def test_diff_refuses_wrong_use(run):
    names = written(noise(), noise())
    refused(run("diff", *names, "-o", "a.png"), 2, "is also an input")
    refused(run("diff", *names, "-o", "d.jpg"), 2, "must end in .png")
    refused(run("diff", *names, "--tolerance", "-1"), 2, "from 0")
    refused(run("diff", *names, "--share", "2"), 2, "from 0 to 1")


# --- shot --against, measure --fail-above -----------------------------------------------------------------------------


def test_shot_against_its_own_picture(run, folder):
    assert run("shot", "dem.npy", "-o", "golden.png", *LOOK)[0] == 0
    status, out, err = run("shot", "dem.npy", "-o", "b.png", *LOOK, "--against", "golden.png", "--tolerance", "0")
    assert (status, err) == (0, "") and "equal within" in out and not (folder / "b-difference.png").exists()


def test_shot_names_the_patch_of_a_changed_hill(run, folder):
    run("shot", "dem.npy", "-o", "golden.png", *LOOK)
    heights = np.load("dem.npy")
    heights[28:34, 40:46] += 15
    np.save("dem.npy", heights)
    words = ("shot", "dem.npy", "-o", "b.png", *LOOK, "--against", "golden.png")
    status, out, err = run(*words, "--json", "-")
    told = json.loads(out)["against"]
    assert (status, err, told["within"]) == (1, "", False) and read_image(told["picture"]).max() == 255
    patch = told["patch"]
    (col, row), side = patch["corner"], patch["side"]
    assert col <= 48 and col + side >= 38 and row <= 36 and row + side >= 26, "the patch is not at the change"
    assert 0 <= patch["certified_px"] <= 1
    assert "drawn at most" in run(*words)[1]
    assert run(*words, "--share", "1")[0] == 0


def test_shot_against_refuses_what_it_cannot_compare(run):
    write_image("golden.png", noise())
    refused(run("shot", "dem.npy", "-o", "b.png", *LOOK, "--against", "golden.png"), 1, "draw with --size 60x40")
    refused(run("shot", "dem.npy", "-o", "golden.png", *LOOK, "--against", "golden.png"), 2, "is compared with")
    write_image("golden.exr", noise(np.float32))
    refused(run("shot", "dem.npy", "-o", "b.png", *LOOK, "--against", "golden.exr"), 1, "8-bit")


def test_measure_fails_above(run, folder):
    words = ("measure", "dem.npy", *SIZE, "--max-error", "2", "--json", "m.json", "--fail-above")
    assert run(*words, "2")[0] == 0
    achieved = json.loads((folder / "m.json").read_text())["max_error_px"]
    assert achieved > 0.1
    status, out, err = run(*words, f"{0.9 * achieved:.6f}")
    assert status == 1 and err.count("\n") == 1 and "--fail-above" in err and "achieved" in out
    of_rms = json.loads((folder / "m.json").read_text())["rms_error_px"]
    assert of_rms < 0.9 * achieved and run(*words, f"{0.9 * achieved:.6f}", "--metric", "rms")[0] == 0


def test_the_tolerance_for_other_drivers_allows_few_pixels():
    one = noise()
    other = one.copy()
    other[:2, 0] += 9
    assert differ(one, other, OTHER_DRIVER).is_within
    other[2, 0] += 9
    assert not differ(one, other, OTHER_DRIVER).is_within
