"""Binding numbers: those in the source are those that the driver reports, and names reach their blocks."""

import re
from pathlib import Path

import moderngl
import numpy as np
import pytest

from terrain_gl.gpu import bindings, shaders

ROOT = Path(str(shaders.root()))
COMPUTE = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.comp"))
PACKAGE = Path(bindings.__file__).parents[1]
LITERAL = re.compile(r"bind_to_(?:storage_buffer|uniform_block|image)\(\s*\d|\.use\(\s*\d")


@pytest.mark.parametrize("path", COMPUTE)
def test_places_read_from_the_source_are_the_drivers(ctx, path):
    shader = shaders.compute(ctx, path)
    places = bindings.places(path)
    for name in shader:
        member = shader[name]
        if isinstance(member, moderngl.StorageBlock):
            assert (places[name].kind, places[name].number) == ("storage block", member.binding)
        elif isinstance(member, moderngl.UniformBlock):
            assert (places[name].kind, places[name].number) == ("uniform block", member.binding)
        elif name in places and places[name].kind == "sampler":
            assert places[name].number == member.value
    shader.release()


def test_images_say_whether_shaders_read_and_write_them():
    place = bindings.places("horizon/sweep.comp")["u_horizon"]
    assert place == bindings.Binding("image", 0, False, True)
    assert bindings.places("sat/query.comp")["Boxes"] == bindings.Binding("storage block", 1, True, False)


def test_a_macro_for_the_type_is_a_sampler_still():
    assert bindings.places("shade/seen.glsl")["u_depth"].kind == "sampler"


def test_bound_buffers_reach_the_shader(ctx, tmp_path, monkeypatch):
    (tmp_path / "twice.comp").write_text(
        "layout(local_size_x = 1) in;\n"
        "layout(std430, binding = 5) writeonly buffer Out { float out_[]; };\n"
        "layout(std430, binding = 2) readonly buffer In { float in_[]; };\n"
        "layout(std140, binding = 3) uniform Factor { float u_factor; };\n"
        "layout(r32f, binding = 1) uniform writeonly image2D u_image;\n"
        "void main() { out_[0] = in_[0] * u_factor; imageStore(u_image, ivec2(0), vec4(in_[0])); }\n"
    )
    monkeypatch.setattr(shaders, "root", lambda: tmp_path)
    out, in_, factor = (
        ctx.buffer(bytes(4)),
        ctx.buffer(np.float32(3).tobytes()),
        ctx.buffer(np.full(4, 7, "f4").tobytes()),
    )
    image = ctx.texture((1, 1), 1, dtype="f4")
    shader = shaders.compute(ctx, "twice.comp")
    bindings.bind("twice.comp", Out=out, In=in_, Factor=factor, u_image=image)
    shader.run()
    ctx.memory_barrier()
    assert np.frombuffer(out.read(), "f4") == 21 and np.frombuffer(image.read(), "f4") == 3


def test_a_name_that_the_shader_does_not_declare_is_refused(ctx):
    with pytest.raises(
        shaders.ShaderError, match=r"sat/query\.comp has no binding for Answers; it declares Words, Boxes"
    ):
        bindings.bind("sat/query.comp", Answers=ctx.buffer(reserve=4))


def test_python_states_no_binding_number():
    found = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if LITERAL.search(path.read_text(encoding="utf-8"))
    }
    assert found == set()
