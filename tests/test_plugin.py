"""The pytest plugin, used by pytest in a folder of its own."""

import configparser
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import small_map

import terrain_gl.comparison.golden  # noqa: F401 - loaded here once, because pytester forgets what its runs load
from terrain_gl.image import read_image, write_png

pytest_plugins = ["pytester"]
TEST = """
import terrain_gl as tg

def test_hill(terrain_picture):
    view = tg.Camera(eye=(50, -40, 90), target=(45, 35, 10))
    frame = terrain_picture("dem.npy", view, size=(64, 40), style="normals")
    assert frame.stats["certified_max_error_px"] <= 1
"""


@pytest.fixture
def project(pytester):
    """Give a function that runs pytest on a test of a hill."""
    small_map()
    pytester.makepyfile(test_maps=TEST)
    return lambda *words: pytester.runpytest_inprocess(
        "-p", "terrain_gl.pytest_plugin", "-p", "no:cacheprovider", *words
    )


def files():
    return sorted(path.as_posix() for path in Path().rglob("*.png"))


def test_a_golden_picture_is_made_then_compared(project):
    project().stdout.fnmatch_lines(["*there is no golden picture*--regenerate-terrain*"])
    assert files() == []
    project("--regenerate-terrain").assert_outcomes(passed=1)
    assert files() == ["golden/test_maps-test_hill.png"]
    assert read_image("golden/test_maps-test_hill.png").shape == (40, 64, 3)
    project().assert_outcomes(passed=1)


def test_a_changed_map_is_caught(project):
    project("--regenerate-terrain").assert_outcomes(passed=1)
    heights = np.load("dem.npy")
    heights[28:34, 40:46] += 15
    np.save("dem.npy", heights)
    done = project()
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(
        ["*of the pixels differ by more than 1 of 255*", "*difference*-difference.png", "*driver*"]
    )
    seen = read_image("terrain-failures/test_maps-test_hill-difference.png")
    assert seen.max() == 255 and (seen == 0).mean() > 0.3, "the difference is where the map changed"
    project("--regenerate-terrain", "--terrain-failures", "f").assert_outcomes(passed=1)
    project().assert_outcomes(passed=1)


PICTURE = """
import numpy as np

def test_plain(terrain_picture):
    terrain_picture.compare(np.full((40, 64, 4), 7, np.uint8))
"""


def test_few_pixels_may_differ(project, pytester):
    pytester.makepyfile(test_maps=PICTURE)
    golden = np.full((40, 64, 3), 7, np.uint8)
    Path("golden").mkdir()
    for pixels, outcome in ((0, "passed"), (2, "passed"), (3, "failed")):  # 2 of 2,560 pixels are 0.08 %
        golden[0, :pixels] = 70
        write_png("golden/test_maps-test_plain.png", golden)
        project().assert_outcomes(**{outcome: 1})


def test_a_golden_picture_of_another_size_is_no_crash(project, pytester):
    pytester.makepyfile(test_maps=PICTURE)
    Path("golden").mkdir()
    write_png("golden/test_maps-test_plain.png", np.zeros((9, 9, 3), np.uint8))
    project().stdout.fnmatch_lines(["*64 x 40 pixels*9 x 9 pixels*"])


def test_any_picture_and_several_in_a_test(project, pytester):
    pytester.makepyfile(
        test_maps="""
        import numpy as np, pytest

        @pytest.mark.parametrize("value", [1, "a b/c"])
        def test_two(terrain_picture, value):
            picture = np.full((4, 4, 4), 7, np.uint8)
            terrain_picture.compare(picture)
            terrain_picture.compare(picture, "second")
            with pytest.raises(Exception, match="name="):
                terrain_picture.compare(picture)
        """
    )
    project("--regenerate-terrain").assert_outcomes(passed=2)
    names = {Path(name).name for name in files()}
    assert names == {f"test_maps-test_two_{value}{n}.png" for value in ("1", "a_b_c") for n in ("", "_-second")}
    project().assert_outcomes(passed=2)


def test_a_gpu_is_skipped_with_the_reason(project, monkeypatch):
    monkeypatch.setattr("terrain_gl.gpu.gl.SOFTWARE", ("none",))
    done = project("-rs")
    done.assert_outcomes(skipped=1)
    done.stdout.fnmatch_lines(["*golden pictures are of software OpenGL*"])


def test_the_plugin_loads_nothing_until_it_is_used():
    code = "import sys, terrain_gl.pytest_plugin; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "moderngl", "OpenImageIO"} & set(loaded) and "pytest" in loaded


def test_pytest_finds_the_plugin():
    config = configparser.ConfigParser()
    config.read(Path(__file__).parents[1] / "setup.cfg")
    assert (
        re.search(r"^(\S+) = \1$", config["options.entry_points"]["pytest11"], re.MULTILINE)[1]
        == "terrain_gl.pytest_plugin"
    )
