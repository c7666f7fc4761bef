"""Every example runs alone, without a window, and writes a picture that is not blank."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from terrain_gl.image import read_image

FOLDER = Path(__file__).parent.parent / "examples"
EXAMPLES = sorted(FOLDER.glob("[01]*.py"))


def test_there_is_one_for_each_stage():
    stages = [path.stem for path in EXAMPLES]
    line = ["01_heightmap", "02_sat", "03_error", "04_lod", "05_mesh", "06_picture", "07_light"]
    more = ["08_budget", "09_clipmap", "10_tessellated", "11_the_method", "12_in_your_scene", "13_cameras", "14_served"]
    assert stages == line + more
    assert len(EXAMPLES[0].read_text().splitlines()) < 40
    assert all(f"examples/{path.name}" in (FOLDER / "README.md").read_text() for path in EXAMPLES)


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example, tmp_path):
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, str(example), "picture.png", "canyon-15m"]
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.endswith("wrote picture.png\n")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]
    pixels = read_image(tmp_path / "picture.png")
    assert pixels.shape[0] >= 500 and pixels.shape[1] >= 500
    assert pixels[..., :3].std() > 10


@pytest.mark.slow
def test_the_data_set_of_cameras(tmp_path):
    command = [sys.executable, str(FOLDER / "13_cameras.py"), "picture.png", "canyon-15m", "set"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    names = {f"{number:03d}.{ending}" for number in range(20) for ending in ("png", "npz")}
    assert {path.name for path in (tmp_path / "set").iterdir()} == names | {"cameras.json"}
    cameras = json.loads((tmp_path / "set" / "cameras.json").read_text())
    for number in (0, 13):
        with np.load(tmp_path / "set" / f"{number:03d}.npz") as facts:
            land = np.argwhere(facts["kind"] == 1)[::50]
            places, depth = facts["places"][tuple(land.T)], facts["depth"][tuple(land.T)]
        pose = {name: np.array(value) for name, value in cameras[number].items()}
        seen = pose["K"] @ (pose["R"] @ places.T + pose["t"][:, None])  # OpenCV's formula
        assert np.abs(seen[2] - depth).max() < 1e-3 * depth.max()
        assert np.abs(seen[:2] / seen[2] - land.T[::-1]).max() < 1.0  # a sample is within its pixel
