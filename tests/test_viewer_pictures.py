"""The triangles in the pictures of docs/viewer.md are those of today's program."""

import importlib.util
import json
from pathlib import Path

import pytest

import terrain_gl as tg
from terrain_gl.files.maps import open_map

DOCS = Path(__file__).parent.parent / "docs"

_specification = importlib.util.spec_from_file_location("viewer_pictures", DOCS / "viewer_pictures.py")
pictures = importlib.util.module_from_spec(_specification)
_specification.loader.exec_module(pictures)


def camera_of(record):
    return tg.Camera(**{name: tuple(value) if isinstance(value, list) else value for name, value in record.items()})


def options_of(record):
    named = {name: tuple(value) if isinstance(value, list) else value for name, value in record.items()}
    return named | ({"chosen_for": camera_of(record["chosen_for"])} if "chosen_for" in record else {})


def test_the_triangles_are_those_of_today(ctx):
    """All pictures before the stroke: if they differ, draw all again by docs/viewer_pictures.py."""
    stated = json.loads((DOCS / pictures.NUMBERS).read_text())
    assert list(stated) == list(pictures.SCENES)
    assert [name for name, sides in stated.items() if sides[0]["edited"]] == ["sculpt"]
    heightmap, _ = open_map(pictures.MAP)
    with tg.Renderer(heightmap, pictures.SIZE, ctx=ctx) as renderer:
        for name, sides in stated.items():
            for side in sides:
                if not side["edited"]:
                    today = renderer.choose(camera_of(side["camera"]), **options_of(side["options"]))["triangles"]
                    assert today == pytest.approx(side["triangles"], rel=1e-3), name
