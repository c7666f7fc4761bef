"""The first picture makes and loads only what it needs, and once; later renderers of a context compile no program."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from maps import island, rough

import terrain_gl as tg
from terrain_gl import cli
from terrain_gl.gpu import gl, passes, selftest, shaders
from terrain_gl.gpu.context import create_context

MOST_PROGRAMS, ON_GPUS = 28, 30  # GPUs sum lines in strips, by two more kernels
MOST_BYTES = 741_787  # half of what 49 programs had
STAGES = ("vertex", "tess_control", "tess_evaluation", "geometry", "fragment")


@pytest.fixture
def compiled(monkeypatch):
    """The texts of all programs that are compiled; no driver counts as tried."""
    found = []
    compute, program = shaders.compute, shaders.program

    def noted_compute(ctx, path, defines):
        found.append((path, shaders.source(path, defines)))
        return compute(ctx, path, defines)

    def noted_program(ctx, *, defines, **how):
        paths = [how[stage] for stage in STAGES if how.get(stage)]
        found.append((" ".join(paths), "".join(shaders.source(path, defines) for path in paths)))
        return program(ctx, defines=defines, **how)

    monkeypatch.setattr(shaders, "compute", noted_compute)
    monkeypatch.setattr(shaders, "program", noted_program)
    monkeypatch.setattr(selftest, "_passed", set())
    return found


def picture(ctx=None):
    """A lit picture of a map with all levels, with sky, rims and far land."""
    heightmap = tg.Heightmap(rough(257, 257), 30.0)
    renderer = tg.Renderer(heightmap, (160, 90), **({"ctx": ctx} if ctx else {}))
    return renderer, renderer.render(tg.Camera.default(heightmap), style="shaded").image


@pytest.mark.slow
def test_the_first_lit_picture_compiles_few_programs_each_once(compiled):
    renderer, _ = picture()
    with renderer.session:
        most = MOST_PROGRAMS if gl.wants_few_groups(renderer.ctx) else ON_GPUS
    renderer.release()
    print(len(compiled), "programs,", sum(len(text) for _, text in compiled), "bytes")
    assert len(set(compiled)) == len(compiled), "no program is compiled twice"
    assert 20 < len(compiled) <= most
    assert sum(len(text) for _, text in compiled) <= MOST_BYTES


@pytest.mark.slow
def test_a_map_without_water_has_no_code_for_it(compiled):
    """Software renderers run that code for every pixel. Voids are marked, too, but need none of it."""
    holed = rough(129, 129)
    holed[40:60, 40:60] = np.nan
    for heightmap, has_water in ((tg.Heightmap(holed, 30.0), False), (tg.Heightmap(island(), 30.0), True)):
        compiled.clear()
        with tg.Renderer(heightmap, (160, 90)) as renderer:
            renderer.render(tg.Camera.default(heightmap), style="shaded")
        texts = [text for path, text in compiled if "shade/shaded.frag" in path]
        assert texts and {"#define WATER 0" not in text for text in texts} == {has_water}


@pytest.mark.slow
def test_renderers_in_one_context_share_their_programs(compiled):
    ctx = create_context()
    with ctx:
        first, image = picture(ctx)
        compiled.clear()
        second, same = picture(ctx)
        assert compiled == [] and (image == same).all()
        first.release()
        np.testing.assert_array_equal(second.render(tg.Camera.default(second.heightmap), style="shaded").image, image)
        second.release()
        assert not passes._compiled.get(ctx)
        third, again = picture(ctx)
        assert compiled and (again == image).all(), "all programs were released with the last renderer"
        third.release()
    ctx.release()


def test_the_first_lit_picture_makes_each_table_once(monkeypatch):
    made = Counter()
    reserve = gl.reserve

    def noted(ctx, size, what):
        made[what] += "table" in what
        return reserve(ctx, size, what)

    monkeypatch.setattr(gl, "reserve", noted)
    renderer, _ = picture()
    assert set(made.values()) == {0, 1} and sum(made.values()) == 10, made
    renderer.render(tg.Camera.default(renderer.heightmap), style="shaded", sun=(90, 20))
    assert made["a table of sunlight"] == 2, "the old table stays until there is a new one"
    renderer.release()


SHOT = """
import sys
from terrain_gl import cli
status = cli.main(sys.argv[1:])
print(*(name for name in sys.modules if name.partition(".")[0] in ("terrain_gl", "rasterio", "pyproj", "glfw")))
sys.exit(status)
"""


def test_a_picture_of_an_image_loads_no_other_commands_and_no_gdal(tmp_path):
    path = str(tmp_path / "land.png")
    assert cli.main(["generate", path, "--size", "33x33"]) == 0
    words = ["shot", path, "-o", str(tmp_path / "p.png"), "--size", "32x18", "--style", "lambert"]
    run = subprocess.run([sys.executable, "-c", SHOT, *words], capture_output=True, text=True)
    loaded = set(run.stdout.split("\n")[-2].split())
    assert run.returncode == 0 and "terrain_gl.cli.shot" in loaded, run.stderr
    others = {f"terrain_gl.cli.{name}" for name in ("view", "build", "compare", "tiles", "mesh")}
    assert not loaded & (others | {"rasterio", "pyproj", "glfw"})
