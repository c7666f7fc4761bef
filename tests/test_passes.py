"""Passes: names that are unknown or missing are errors, and nothing is left from before."""

import re
from pathlib import Path

import moderngl
import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import calls, shaders
from terrain_gl.gpu.passes import ComputePass, Declaration, DrawPass, Feed, State, clear, declarations

SUM = """
layout(local_size_x = 1) in;
layout(std430, binding = 5) writeonly buffer Out { float out_[]; };
layout(std430, binding = 2) readonly buffer In { float in_[]; };
layout(std140, binding = 3) uniform Factor { float u_by; };
layout(binding = 4) uniform sampler2D u_more;
layout(r32f, binding = 1) uniform writeonly image2D u_image;
uniform float u_a, u_b;
uniform vec2 u_pair[2];
void main() {
    out_[0] = in_[0] * u_by + u_a + 10.0 * u_b + u_pair[1].y + textureLod(u_more, vec2(0.5), 0.0).x;
    imageStore(u_image, ivec2(0), vec4(in_[0]));
}
"""


@pytest.fixture
def glsl(tmp_path, monkeypatch):
    """Give a function that writes one shader file into an otherwise empty GLSL folder."""
    monkeypatch.setattr(shaders, "root", lambda: tmp_path)
    return lambda path, text: (tmp_path / path).write_text(text)


def floats(ctx, *values):
    return ctx.buffer(np.array(values, "f4").tobytes())


@pytest.fixture
def summing(ctx, glsl):
    """A pass with a resource of each kind, what it reads, and its uniforms."""
    glsl("sum.comp", SUM)
    more = ctx.texture((2, 1), 1, np.array([1, 3], "f4").tobytes(), dtype="f4")
    more.filter = moderngl.NEAREST, moderngl.NEAREST
    resources = {"Out": floats(ctx, 0), "In": floats(ctx, 3), "Factor": floats(ctx, 7, 0, 0, 0), "u_more": more}
    resources["u_image"] = ctx.texture((1, 1), 1, dtype="f4")
    uniforms = {"a": 0.5, "b": 2.0, "pair": ((0, 0), (0, 100))}
    return ComputePass(ctx, "sum.comp"), resources, uniforms


def summed(ctx, summing):
    summing[0].run((1, 1, 1), *summing[1:])
    ctx.memory_barrier()
    return float(np.frombuffer(summing[1]["Out"].read(), "f4")[0]), summing[1]["u_image"].read()


def test_resources_and_uniforms_reach_the_shader(ctx, summing):
    assert summed(ctx, summing) == (3 * 7 + 0.5 + 20 + 100 + 3, np.float32(3).tobytes())


@pytest.mark.parametrize("name", ["Out", "In", "Factor", "u_more", "u_image"])
def test_a_missing_resource_is_an_error(summing, name):
    kernel, resources, uniforms = summing
    del resources[name]
    with pytest.raises(shaders.ShaderError, match=rf"^glsl/sum\.comp also reads the resources {name}$"):
        kernel.run((1, 1, 1), resources, uniforms)


@pytest.mark.parametrize("name", ["a", "b", "pair"])
def test_a_missing_uniform_is_an_error(summing, name):
    kernel, resources, uniforms = summing
    kernel.run((1, 1, 1), resources, uniforms)  # it must be there also if it was there before
    del uniforms[name]
    with pytest.raises(shaders.ShaderError, match=rf"^glsl/sum\.comp also reads the uniforms {name}$"):
        kernel.run((1, 1, 1), resources, uniforms)


def test_unknown_names_are_errors_and_the_known_ones_are_listed(summing):
    kernel, resources, uniforms = summing
    with pytest.raises(shaders.ShaderError, match="has no resources Inn; it declares Factor, In, Out, u_image, u_more"):
        kernel.run((1, 1, 1), resources | {"Inn": resources["In"]}, uniforms)
    with pytest.raises(shaders.ShaderError, match="has no uniforms c; it declares a, b, pair"):
        kernel.run((1, 1, 1), resources, uniforms | {"c": 1})


def test_names_that_the_text_declares_and_the_program_does_not_use_may_be_given(ctx, glsl):
    glsl(
        "few.comp",
        "layout(local_size_x = 1) in;\nlayout(std430, binding = 0) buffer Out { float out_[]; };\n"
        "layout(binding = 1) uniform sampler2D u_unused;\nuniform float u_idle;\n"
        "#ifdef MORE\nlayout(std430, binding = 7) buffer More { float more_[]; };\n#endif\n"
        "void main() { out_[0] = 4.0; }\n",
    )
    out = floats(ctx, 0)
    texture = ctx.texture((1, 1), 1, dtype="f4")
    ComputePass(ctx, "few.comp").run((1, 1, 1), {"Out": out, "u_unused": texture, "More": out}, {"idle": 1.0})
    ctx.memory_barrier()
    assert np.frombuffer(out.read(), "f4") == 4


@pytest.mark.parametrize("is_same", [True, False])
def test_two_names_of_one_place_need_one_resource(ctx, glsl, is_same):
    glsl(
        "two.comp",
        "layout(local_size_x = 1) in;\nlayout(std430, binding = 0) buffer One { float one[]; };\n"
        "layout(std430, binding = 0) buffer Other { vec2 other[]; };\nvoid main() { one[0] = other[0].y; }\n",
    )
    kernel, one = ComputePass(ctx, "two.comp"), floats(ctx, 1, 2)
    if is_same:
        kernel.run((1, 1, 1), {"One": one, "Other": one})
        return
    with pytest.raises(shaders.ShaderError, match="One and Other have the same binding point"):
        kernel.run((1, 1, 1), {"One": one, "Other": floats(ctx, 1, 2)})


def test_a_uniform_is_written_when_it_changes(ctx, summing):
    """A value that is set already is not written again; any other value is written, and so is the first."""
    kernel, resources, _ = summing
    for a, b, pair in ((0.0, 0.0, 0), (0.0, 1.0, 5), (0.0, 1.0, 5), (2.0, 1.0, 6), (0.0, 1.0, 6)):
        uniforms = {"a": a, "b": b, "pair": ((0, 0), (0, pair))}
        assert summed(ctx, (kernel, resources, uniforms))[0] == 21 + a + 10 * b + pair + 3


def test_sampler_objects_of_others_do_not_count(ctx, summing):
    """With a linear filter, the middle of 1 and 3 would be 2."""
    before = summed(ctx, summing)
    sampler = ctx.sampler(filter=(moderngl.LINEAR, moderngl.LINEAR))
    sampler.use(4)
    assert summed(ctx, summing) == before


# --- Transform feedback -----------------------------------------------------------------------------------------------

SQUARES = {
    "a.vert": "in vec2 in_at; out vec2 v_at; void main() { v_at = in_at; }",
    "a.tesc": """
layout(vertices = 1) out;
in vec2 v_at[];
out vec2 v_corner[];
uniform float u_level;
void main() {
    v_corner[gl_InvocationID] = v_at[gl_InvocationID];
    gl_TessLevelOuter = float[](u_level, u_level, u_level, u_level);
    gl_TessLevelInner = float[](u_level, u_level);
}
""",
    "a.tese": """
layout(quads, equal_spacing, ccw) in;
in vec2 v_corner[];
out vec2 out_at;
void main() {
    out_at = v_corner[0] + gl_TessCoord.xy;
    gl_Position = vec4(out_at, 0, 1);
}
""",
}
STAGES = {"vertex": "a.vert", "tess_control": "a.tesc", "tess_evaluation": "a.tese"}
PATCHES, LEVEL = 20, 30  # 19,220 generated vertices a draw
TRIANGLES = 2 * LEVEL**2 * PATCHES


@pytest.fixture
def squares(ctx, glsl):
    """Row of unit squares, cut into LEVEL segments a side: a pass, and what feeds it."""
    for path, text in SQUARES.items():
        glsl(path, text)
    corners = floats(ctx, *(v for i in range(PATCHES) for v in (i, 0)))
    return DrawPass(ctx, STAGES, varyings=("out_at",)), Feed([(corners, "2f", "in_at")], mode=moderngl.PATCHES)


def captured(ctx, squares, room, *vertices):
    """Triangles in a buffer of `room` bytes, and their number; each command draws so many vertices."""
    first = np.cumsum([0, *vertices[:-1]])
    commands = np.array([(n, 1, at, 0, 0) for n, at in zip(vertices, first, strict=True)], "u4")
    out = ctx.buffer(reserve=room)
    count = squares[0].capture(out, {}, {"level": LEVEL}, squares[1], ctx.buffer(commands.tobytes()), len(vertices))
    return np.frombuffer(out.read(), "f4")[: 6 * count].reshape(count, 3, 2).astype("f8"), count


@pytest.mark.parametrize("draws", [[PATCHES], [1] * PATCHES, [5] * (PATCHES // 5)])
def test_captured_triangles_cover_the_patches_once(ctx, squares, draws):
    triangles, count = captured(ctx, squares, TRIANGLES * 24, *draws)
    assert count == TRIANGLES
    a, b, c = triangles.transpose(1, 0, 2)
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(PATCHES, rel=1e-6)


def test_buffer_too_small_is_told(ctx, squares):
    with pytest.raises(TerrainError, match=f"holds 10 of {TRIANGLES} triangles"):
        captured(ctx, squares, 240, PATCHES)


def test_drawing_goes_on_after_a_capture(ctx, squares):
    target = ctx.simple_framebuffer((4, 4))
    captured(ctx, squares, TRIANGLES * 24, PATCHES)
    commands = ctx.buffer(np.array([2, 1, 0, 0, 0], "u4").tobytes())
    with ctx.query(primitives=True) as query:
        squares[0].draw_indirect(State(target), {}, {"level": LEVEL}, squares[1], commands, range(1))
    assert query.primitives == 2 * 2 * LEVEL**2


def test_a_framebuffer_is_filled(ctx):
    """Masks, a scissor and discarding that are left on do not count."""
    target = ctx.simple_framebuffer((2, 2))
    target.color_mask = False, False, False, False
    target.scissor = 0, 0, 1, 1
    target.use()
    ctx.enable_direct(0x8C89)  # rasterizer discard
    clear(target, 0.25, (1.0, 0.0, 1.0, 0.0))
    assert target.read(components=4) == bytes([255, 0, 255, 0] * 4)
    assert np.allclose(np.frombuffer(target.read(components=1, dtype="f4", attachment=-1), "f4"), 0.25)
    ctx.detect_framebuffer(0).use()


# --- What a text declares ---------------------------------------------------------------------------------------------

PACKAGE = Path(calls.__file__).parents[1]
LITERAL = re.compile(r"bind_to_(?:storage_buffer|uniform_block|image)\(\s*\d|\.use\(\s*\d")


def test_images_say_whether_shaders_read_and_write_them():
    place = declarations(shaders.source("horizon/sweep.comp"))["u_horizon"]
    assert place == Declaration("image", False, True)
    assert declarations(shaders.source("sat/query.comp"))["Boxes"] == Declaration("storage block", True, False)


def test_a_macro_for_the_type_is_a_sampler_still():
    assert declarations(shaders.source("shade/seen.glsl"))["u_depth"].kind == "sampler"


def test_python_states_no_binding_number():
    found = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if LITERAL.search(path.read_text(encoding="utf-8"))
    }
    assert found == set()
