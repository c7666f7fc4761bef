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
from terrain_gl.renderer.frame import WholeMapMesh
from terrain_gl.renderer.options import FrameOptions, OtherOptions

pytest.importorskip("mypy", reason="the extra [dev] is not installed")
SCRIPT = """
import terrain_gl as tg

terrain = tg.Heightmap([[0.0, 1.0], [2.0, 3.0]], 30.0)
with tg.Renderer(terrain, size=(64, 36)) as renderer:
    evening: tg.RenderOptions = {{"sun": (265.0, 12.0), "haze": 2.0}}
    camera = tg.Camera.default(terrain)
    frame = renderer.render(camera, 1.0, {options})
    triangles: int = frame.stats["{key}"]
    patches: int = renderer.draw(camera, 1.0, {options})["{drawn}"]
    method: str = renderer.choose(camera, 1.0, {options})["{chosen}"]
    holes: int = renderer.measure()["{measured}"]
    _, whole = renderer.inspector.triangulate(1.0)
    splits: int = whole["{whole}"]
"""
KEYS = ("triangles", "patches", "method", "holes", "splits")


def script(options, words):
    return SCRIPT.format(
        options=options, **dict(zip(("key", "drawn", "chosen", "measured", "whole"), words, strict=True))
    )


def test_the_types_are_those_of_the_options():
    hints = get_type_hints(FrameOptions)
    assert get_type_hints(tg.RenderOptions) == {option.name: hints[option.name] for option in fields(FrameOptions)}
    assert get_type_hints(tg.RenderOptions).keys() - get_type_hints(OtherOptions).keys() == {"max_error_px"}


@pytest.mark.slow
def test_mypy_of_two_scripts(tmp_path):
    right, wrong = tmp_path / "right.py", tmp_path / "wrong.py"
    right.write_text(script('style="lod", triangles=500', KEYS), encoding="utf-8")
    wrong.write_text(script('sun="noon", sytle="lod"', [f"{key}_" for key in KEYS]), encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--follow-imports=silent", f"--cache-dir={tmp_path / 'cache'}"]
    done = subprocess.run([*command, right, wrong], capture_output=True, text=True, cwd=Path(tg.__path__[0]).parent)
    errors = "\n".join(line for line in done.stdout.splitlines() if "error:" in line)
    assert "right.py" not in errors, done.stdout
    for method in ("render", "draw", "choose"):
        assert f'"sun" to "{method}"' in errors and f'argument "sytle" for "{method}"' in errors, done.stdout
    for key, of in zip(KEYS, ("Stats", "Stats", "Stats", "Measured", "WholeMapMesh"), strict=True):
        assert f'"{of}" has no key "{key}_"' in errors, done.stdout


def test_stats_have_their_types():
    """Every number of a frame is declared."""
    with tg.Renderer(tg.Heightmap(rough(33, 40), 10.0), (32, 18)) as renderer:
        camera = tg.Camera.default(renderer.heightmap)
        for options in ({"style": "cracks"}, {"triangles": 200}):
            for stats in (renderer.render(camera, **options).stats, renderer.choose(camera, **options)):
                assert stats.keys() <= get_type_hints(tg.Stats).keys()
            renderer.draw(camera, **options)
            assert renderer.measure().keys() <= get_type_hints(tg.Measured).keys()
        whole = renderer.inspector.triangulate(1.0)[1]
        assert whole.keys() <= get_type_hints(WholeMapMesh).keys()


PAGE = (Path(tg.__path__[0]).parent / "docs" / "api.md").read_text("utf-8")
EXAMPLES = re.findall("```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("code", EXAMPLES)
def test_examples_of_the_page(code, folder):
    exec(compile(code, "docs/api.md", "exec"), {})


def test_every_public_name_has_an_example():
    examples = PAGE[PAGE.index("## One example each") :]
    assert [name for name in tg.__all__ if f"tg.{name}" not in examples] == []
