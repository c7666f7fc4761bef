"""Types for editors: a wrong option in a user's script is found before it runs."""

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl.renderer.options import FrameOptions, OtherOptions

pytest.importorskip("mypy", reason="the extra [dev] is not installed")
SCRIPT = """
import terrain_gl as tg

terrain = tg.Heightmap([[0.0, 1.0], [2.0, 3.0]], 30.0)
with tg.Renderer(terrain, size=(64, 36)) as renderer:
    evening: tg.RenderOptions = {{"sun": (265.0, 12.0), "haze": 2.0}}
    frame = renderer.render(tg.Camera.default(terrain), 1.0, {})
    triangles: int = frame.stats["{}"]
"""


def test_the_types_are_those_of_the_options():
    hints = get_type_hints(FrameOptions)
    assert get_type_hints(tg.RenderOptions) == {option.name: hints[option.name] for option in fields(FrameOptions)}
    assert get_type_hints(tg.RenderOptions).keys() - get_type_hints(OtherOptions).keys() == {"max_error_px"}


def test_mypy_of_two_scripts(tmp_path):
    right, wrong = tmp_path / "right.py", tmp_path / "wrong.py"
    right.write_text(SCRIPT.format('style="lod", triangles=500', "triangles"), encoding="utf-8")
    wrong.write_text(SCRIPT.format('sun="noon", sytle="lod"', "triangle"), encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--follow-imports=silent", f"--cache-dir={tmp_path / 'cache'}"]
    done = subprocess.run([*command, right, wrong], capture_output=True, text=True, cwd=Path(tg.__path__[0]).parent)
    errors = "\n".join(line for line in done.stdout.splitlines() if "error:" in line)
    assert "right.py" not in errors, done.stdout
    for text in ('"sun" to "render"', '"sytle"', '"triangle"'):
        assert text in errors, done.stdout


def test_stats_have_their_types():
    """Every number of a frame is declared."""
    with tg.Renderer(tg.Heightmap(rough(33, 40), 10.0), (32, 18)) as renderer:
        camera = tg.Camera.default(renderer.heightmap)
        for options in ({"style": "cracks"}, {"triangles": 200}):
            stats = renderer.render(camera, **options).stats
            assert stats.keys() <= get_type_hints(tg.Stats).keys()


PAGE = (Path(tg.__path__[0]).parent / "docs" / "api.md").read_text("utf-8")
EXAMPLES = re.findall("```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("code", EXAMPLES)
def test_examples_of_the_page(code, folder):
    exec(compile(code, "docs/api.md", "exec"), {})


def test_every_public_name_has_an_example():
    examples = PAGE[PAGE.index("## One example each") :]
    assert [name for name in tg.__all__ if f"tg.{name}" not in examples] == []
