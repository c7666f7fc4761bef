"""The numbers in README's film are those of today's program."""

import importlib.util
import json
import os
from itertools import islice
from pathlib import Path

import pytest

import terrain_gl as tg

DOCS = Path(__file__).parent.parent / "docs"
FOLDER = os.environ.get("TERRAIN_GL_DEM")

_specification = importlib.util.spec_from_file_location("first_film", DOCS / "first_film.py")
film = importlib.util.module_from_spec(_specification)
_specification.loader.exec_module(film)


def test_the_film_is_small_and_keeps_its_promise():
    numbers = json.loads((DOCS / "first-film.json").read_text())
    assert len(numbers) == film.FRAMES and (DOCS / "first-film.webp").stat().st_size <= 3e6
    assert all(each["max_error_px"] <= each["certified_max_error_px"] <= film.TOLERANCE_PX for each in numbers)


@pytest.mark.skipif(not FOLDER, reason="TERRAIN_GL_DEM, the folder of real maps, is not set")
def test_the_triangles_are_those_of_today(ctx):
    numbers = json.loads((DOCS / "first-film.json").read_text())
    land = tg.Heightmap.open(Path(FOLDER) / film.MAP)
    with tg.Renderer(land, film.SIZE, ctx=ctx) as renderer:
        for camera, known in islice(zip(film.cameras(land), numbers, strict=True), 0, film.FRAMES, film.FRAMES // 2):
            drawn = renderer.draw(camera, film.TOLERANCE_PX, style="normals")
            assert drawn["triangles"] == pytest.approx(known["triangles"], rel=1e-3)
