"""Programs of public reports of people who use terrain-gl in their own: TERRAIN_GL_CASES, folders 50 to 65.

Each program runs in a copy of its folder, and prints what its README calls right. Programs that only show what was
missing run up to there; then the test asks in today's way.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import terrain_gl as tg
from terrain_gl.renderer.facts import KINDS

FOLDER = os.environ.get("TERRAIN_GL_CASES")
pytestmark = [
    pytest.mark.skipif(not FOLDER, reason="TERRAIN_GL_CASES does not name the folder of cases"),
    pytest.mark.slow,
]


@pytest.fixture
def case(folder, request):
    """Copy the case with the number in the test's name to an empty folder, and work there; gives its program."""
    found = next(Path(FOLDER).glob(f"{request.function.__name__[5:7]}_*"), None)
    if found is None:
        pytest.skip("TERRAIN_GL_CASES has no such case")
    for path in found.iterdir():
        shutil.copyfile(path, folder / path.name)
    return (folder / "try.py").read_text("utf-8")


def printed(case):
    """The lines that the program prints."""
    alone = {name: value for name, value in os.environ.items() if name != "CI"}  # with CI, pytest prints failures twice
    done = subprocess.run([sys.executable, "try.py"], capture_output=True, text=True, timeout=280, env=alone)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def names_before(case, text):
    """The names that the program has before a line that begins with a text."""
    names = {}
    exec(compile(case[: case.index(f"\n{text}")], "try.py", "exec"), names)
    return names


def test_50_every_thread_gets_the_right_picture(case):
    lines = printed(case)
    assert len(lines) == 6 and all(line.endswith(": right") for line in lines[:5]), lines
    assert lines[5].endswith("True True True")


def test_51_a_context_stays_current(case):
    before, after, again, inside = printed(case)
    right = "([0, 255, 0, 255], 'GL_NO_ERROR')"
    assert right in before and after.startswith(f"after Renderer(...).render() {right}") and right in inside
    assert again.endswith("True")


def test_53_a_tower_of_another_program_meets_the_land(case):
    for line in printed(case)[1:]:
        assert abs(int(line.split()[-1]) - 2555) <= 2, line


def test_54_each_test_has_a_golden_picture(case):
    written, compared, failed = printed(case)
    assert "8 passed" in written and "golden pictures: 8" in written and "8 passed" in compared
    assert failed.startswith("two failures name 2 pictures, files on disk: 2")


def test_55_a_failure_leaves_the_drawn_picture(case):
    for line in printed(case):
        assert "1 failed" in line and "'test_a-test_view.png'" in line


def test_56_depths_are_those_of_the_picture(case):
    names = names_before(case.replace("edge=", "surroundings="), "print")
    with tg.Renderer(names["hm"], size=(names["W"], names["H"])) as renderer:
        frame = renderer.render(names["cam"], 0.25, water_m=600.0)
        depth, kind, normals = frame.depth, frame.kind, frame.normals
        dry = renderer.render(names["cam"], 0.25).kind
    water, to_water = kind == KINDS.index("water"), names["to_water"]
    assert names["wet"].mean() > 0.3 and (water[names["wet"]]).mean() > 0.99
    near = water & (to_water < 2e4)  # beyond, the Earth's curvature counts
    assert np.quantile(np.abs(depth[near] - to_water[near]), 0.98) < 2.0 and (normals[water] == [0, 0, 1]).all()
    plain = np.isinf(names["dry"]) & (names["plain"] != names["sky"]).any(-1)
    assert (dry[plain] == KINDS.index("surroundings")).mean() > 0.98


def test_57_water_is_one_surface(case):
    rim, specks = printed(case)
    assert int(re.search(r"step (\d+)", rim)[1]) <= 2 and ": 0.00% of the pixels" in specks


def test_58_what_is_dropped_is_freed(case):
    found = {}
    for line in printed(case):
        if made := re.fullmatch(r"(with|dropped|View).* (\d+) (\d+) MiB", line):
            found[made[1], int(made[2])] = int(made[3])
    assert found["with", 20] - found["with", 10] < 20 and found["dropped", 20] - found["dropped", 0] < 40
    if ("View", 8) in found:
        assert found["View", 8] - found["View", 4] < 40


def test_59_a_calibrated_camera_sees_the_right_depth(case):
    names = names_before(case, "def report")
    K = np.array([[names["fx"], 0, names["cx"]], [0, names["fy"], names["cy"]], [0, 0, 1]])
    size = names["W"], names["H"]
    camera = tg.Camera.from_opencv(K, names["R"], -names["R"] @ names["eye"], size)
    with tg.Renderer(names["hm"], size=size) as renderer:
        depth = renderer.render(camera, 0.25, surroundings="none", curvature="off").depth[names["vs"], names["us"]]
    both = np.isfinite(depth) & np.isfinite(names["z"])
    off = np.abs(depth[both] - names["z"][both])
    assert len(off) > 100 and np.median(off) <= 0.5


def test_60_a_place_and_lines_of_sight(case):
    names = names_before(case, "with tg.Renderer(hm, size=(W, H))")
    hm, camera = names["hm"], names["cam"]
    with tg.Renderer(hm, size=(names["W"], names["H"])) as renderer:
        renderer.render(camera, 0.25, curvature="off")
        place = renderer.place_at(300, 250)
    u, v = (
        (300.5 - names["W"] / 2) / camera.focal_px(names["H"]),
        (250.5 - names["H"] / 2) / camera.focal_px(names["H"]),
    )
    ray = u * camera.axes[0] - v * camera.axes[1] + camera.axes[2]
    along = np.array(names["eye"]) + np.linspace(1, 12000, 400_000)[:, None] * ray
    hit = along[np.argmax(along[:, 2] < hm.height_at(along[:, 0], along[:, 1]))]
    assert np.linalg.norm(np.subtract(place[:3], hit)) < 2.0
    rng = np.random.default_rng(3)
    ends = rng.uniform(200, 7400, (100, 2, 2))
    places = np.concatenate([ends, hm.height_at(ends[..., 0], ends[..., 1])[..., None] + 2], -1)
    seen = hm.sees(places[:, 0], places[:, 1], curvature="off").seen
    for (a, b), found in zip(places, seen, strict=True):
        line = a + np.linspace(0, 1, 4000)[1:-1, None] * (b - a)
        assert found == (line[:, 2] > hm.height_at(line[:, 0], line[:, 1])).all()


def test_61_a_callers_state_changes_nothing(case):
    lines = printed(case)
    assert len(lines) == 6
    for line in lines:
        assert " 0.0% of the pixels differ, mean   0.0; measure: 0." in line and line.endswith("holes 0"), line


def test_63_flights_have_poses_and_depths(case):
    poses, shot, exr = printed(case)
    for key in ("target", "fov_deg", "sun", "K", "R", "t", "time_s"):
        assert f"'{key}'" in poses
    assert shot.endswith("True") and exr


def test_65_a_map_after_a_store(case):
    *_, last = printed(case)
    assert last.startswith("pixels that differ: 0%, 0%")
