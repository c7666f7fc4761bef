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
    assert files() == ["terrain-failures/test_maps-test_hill.png"]
    project("--regenerate-terrain").assert_outcomes(passed=1)
    assert files()[0] == "golden/test_maps-test_hill.png"
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
    project().stdout.fnmatch_lines(["*64 x 40 pixels*9 x 9 pixels*", "*drawn *test_maps-test_plain.png*"])
    assert failures() == {"test_maps-test_plain.png": (40, 64, 3), "test_maps-test_plain-golden.png": (9, 9, 3)}


def failures():
    """Names and shapes of the pictures that failures left."""
    root = Path("terrain-failures")
    return {path.relative_to(root).as_posix(): read_image(path).shape for path in root.rglob("*.png")}


def test_a_failure_leaves_all_that_there_is_to_see(project, pytester):
    """Without a golden picture only the drawn one; else all three; and none of an earlier failure."""
    pytester.makepyfile(test_maps=PICTURE)
    project().assert_outcomes(failed=1)
    whole = "test_maps-test_plain"
    shape = (40, 64, 3)
    assert failures() == {f"{whole}.png": shape}
    Path("golden").mkdir()
    write_png(f"golden/{whole}.png", np.full(shape, 90, np.uint8))
    project().assert_outcomes(failed=1)
    assert failures() == {f"{whole}{of}.png": shape for of in ("", "-golden", "-difference")}
    assert (read_image(f"terrain-failures/{whole}-golden.png") == 90).all()
    assert (read_image(f"terrain-failures/{whole}.png") == 7).all()
    Path(f"golden/{whole}.png").unlink()
    project().assert_outcomes(failed=1)
    assert failures() == {f"{whole}.png": shape}


PLAINS = """
import numpy as np, pytest

def plain(value):
    return np.full((4, 4, 4), value, np.uint8)

class TestNorth:
    class TestInner:
        def test_view(self, terrain_picture): terrain_picture.compare(plain(1))
    def test_view(self, terrain_picture): terrain_picture.compare(plain(40))

class TestSouth:
    def test_view(self, terrain_picture): terrain_picture.compare(plain(80))

def test_view(terrain_picture): terrain_picture.compare(plain(120))

@pytest.mark.parametrize("value", ["1", "+1", "a b", "a/b", "a_b", "_", "a%2Fb"])
def test_value(terrain_picture, value): terrain_picture.compare(plain(sum(value.encode()) % 256))

@pytest.mark.parametrize("value", ["x" * 300, "x" * 299 + "y"])
def test_long(terrain_picture, value): terrain_picture.compare(plain(value.count("x") - 100))
"""


@pytest.mark.slow
def test_each_test_has_a_picture_of_its_own(project, pytester):
    pytester.makepyfile(test_maps=PLAINS)
    project("--regenerate-terrain").assert_outcomes(passed=13)
    names = {Path(name).name for name in files()}
    assert len(names) == 13 and max(map(len, names)) < 230
    assert {"test_maps-TestNorth.TestInner.test_view.png", "test_maps-test_value[a%2Fb].png"} <= names
    project().assert_outcomes(passed=13)
    project("-n2", "-p", "xdist").assert_outcomes(passed=13)


def test_names_that_differ_in_case_are_refused(project, pytester):
    """Such files are one file on many systems."""
    pytester.makepyfile(
        test_maps=PICTURE + "\ndef test_PLAIN(terrain_picture):\n    test_plain(terrain_picture)\n",
    )
    done = project("--regenerate-terrain")
    done.assert_outcomes(passed=1, failed=1)
    done.stdout.fnmatch_lines(["*test_maps-test_plain*test_maps-test_PLAIN*rename one of them*"])


def test_a_name_of_another_picture_is_refused(project, pytester):
    """`-difference` would be the file of the difference."""
    pytester.makepyfile(test_maps=PICTURE.replace("np.uint8)", 'np.uint8), "difference"'))
    project("--regenerate-terrain").stdout.fnmatch_lines(["*give it another name*"])


def test_failures_of_two_folders_are_kept_apart(project, pytester):
    for folder in ("a", "b/c"):
        Path(folder).mkdir(parents=True)
        Path(folder, "__init__.py").touch()
        Path(folder, "test_same.py").write_text(PICTURE)
    Path("b/__init__.py").touch()
    project("a", "b").assert_outcomes(failed=2)
    assert set(failures()) == {f"{folder}/test_same-test_plain.png" for folder in ("a", "b/c")}


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
    assert names == {f"test_maps-test_two[{value}]{n}.png" for value in ("1", "a%20b%2Fc") for n in ("", "-second")}
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
