"""The first lit picture compiles few programs, each once; later renderers of the same context compile none."""

import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
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
