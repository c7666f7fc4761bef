"""Every example runs alone, without a window, and writes a picture that is not blank."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from terrain_gl.image import read_image

FOLDER = Path(__file__).parent.parent / "examples"
EXAMPLES = sorted(FOLDER.glob("[01]*.py"))


def test_there_is_one_for_each_stage():
    stages = [path.stem for path in EXAMPLES]
    line = ["01_heightmap", "02_sat", "03_error", "04_lod", "05_mesh", "06_picture", "07_light"]
    assert stages == [*line, "08_budget", "09_clipmap", "10_tessellated", "11_the_method", "12_in_your_scene"]
    assert len(EXAMPLES[0].read_text().splitlines()) < 40
    assert all(f"examples/{path.name}" in (FOLDER / "README.md").read_text() for path in EXAMPLES)


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
