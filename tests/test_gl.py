"""Raw OpenGL calls: depth range, limits, and the triangles of tessellated patches, captured."""

import moderngl
import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import gl

VERTEX = "#version 430 core\nin vec2 in_at; out vec2 v_at; void main() { v_at = in_at; }"
CONTROL = """
#version 430 core
layout(vertices = 4) out;
in vec2 v_at[];
out vec2 v_corner[];
uniform float u_level;
void main() {
    v_corner[gl_InvocationID] = v_at[gl_InvocationID];
    gl_TessLevelOuter = float[](u_level, u_level, u_level, u_level);
    gl_TessLevelInner = float[](u_level, u_level);
}
"""
EVALUATION = """
#version 430 core
layout(quads, equal_spacing, ccw) in;
in vec2 v_corner[];
out vec2 out_at;
void main() {
    vec2 t = gl_TessCoord.xy;
    out_at = mix(mix(v_corner[0], v_corner[1], t.x), mix(v_corner[2], v_corner[3], t.x), t.y);
    gl_Position = vec4(out_at, 0, 1);
}
"""
PATCHES, LEVEL = 20, 30  # 19,220 generated vertices a draw
TRIANGLES = 2 * LEVEL**2 * PATCHES


@pytest.fixture
def patches(ctx):
    """Row of unit squares, cut into LEVEL segments a side."""
    program = ctx.program(
        vertex_shader=VERTEX, tess_control_shader=CONTROL, tess_evaluation_shader=EVALUATION, varyings=["out_at"]
    )
    program["u_level"] = LEVEL
    corners = np.array([(i + x, y) for i in range(PATCHES) for y in (0, 1) for x in (0, 1)], "f4")
    ctx.patch_vertices = 4
    vao = ctx.vertex_array(program, [(ctx.buffer(corners.tobytes()), "2f", "in_at")])
    return program, vao


def areas(out, count):
    a, b, c = np.frombuffer(out.read(), "f4")[: 6 * count].reshape(count, 3, 2).astype("f8").transpose(1, 0, 2)
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def commands_of(ctx, *vertices):
    """Indirect commands that draw so many vertices each, one after the other."""
    first = np.cumsum([0, *vertices[:-1]])
    return ctx.buffer(np.array([(n, 1, at, 0, 0) for n, at in zip(vertices, first, strict=True)], "u4").tobytes())


@pytest.mark.parametrize("draws", [[4 * PATCHES], [4] * PATCHES, [20] * (PATCHES // 5)])
def test_captured_triangles_cover_the_patches_once(ctx, patches, draws):
    out = ctx.buffer(reserve=TRIANGLES * 24)
    assert gl.capture(ctx, *patches, out, commands_of(ctx, *draws), len(draws)) == TRIANGLES
    area = areas(out, TRIANGLES)
    assert (area > 0).all()
    assert area.sum() == pytest.approx(PATCHES, rel=1e-6)


def test_count_selects_commands(ctx, patches):
    out = ctx.buffer(reserve=TRIANGLES * 24)
    assert gl.capture(ctx, *patches, out, commands_of(ctx, 4, 8, 40), 2) == 3 * 2 * LEVEL**2


def test_buffer_too_small_is_told(ctx, patches):
    with pytest.raises(TerrainError, match=f"holds 10 of {TRIANGLES} triangles"):
        gl.capture(ctx, *patches, ctx.buffer(reserve=240), commands_of(ctx, 4 * PATCHES), 1)


def test_drawing_goes_on_after_a_capture(ctx, patches):
    target = ctx.simple_framebuffer((4, 4))
    target.use()
    program, vao = patches
    gl.capture(ctx, program, vao, ctx.buffer(reserve=TRIANGLES * 24), commands_of(ctx, 4 * PATCHES), 1)
    with ctx.query(primitives=True) as query:
        vao.render(moderngl.PATCHES, vertices=8)
    assert query.primitives == 2 * 2 * LEVEL**2


def test_limits_are_at_least_what_version_43_guarantees(ctx):
    limits = gl.limits(ctx)
    assert limits["tess_level"] >= 64
    assert limits["texture_size"] >= 16384
    assert limits["storage_block_bytes"] >= 2**24
    assert limits["compute_storage_blocks"] >= 8
    assert limits["viewport_size"] >= 16384


def test_clip_control_takes_depth_from_zero_to_one(ctx):
    if not gl.clip_control_zero_to_one(ctx):
        pytest.skip("this driver has no clip control")
    get = gl.function(ctx, "glGetIntegerv", None, gl.c_uint, gl.POINTER(gl.c_int))
    mode = gl.c_int()
    get(0x935D, mode)
    assert mode.value == 0x935F
    gl.function(ctx, "glClipControl", None, gl.c_uint, gl.c_uint)(0x8CA1, 0x935E)  # the default again


def test_a_uniform_is_written_when_it_changes(ctx):
    """A value that is set already is not written again; any other value is written, and so is the first."""
    kernel = ctx.compute_shader(
        "#version 430 core\nlayout(local_size_x = 1) in; layout(std430, binding = 0) buffer Out { float out_[]; };\n"
        "uniform float u_factor; uniform vec2 u_pair; void main() { out_[0] = u_factor * (u_pair.x + u_pair.y); }"
    )
    out = ctx.buffer(reserve=4)
    out.bind_to_storage_buffer(0)
    for factor, pair, sum_ in (
        (0.0, (1, 2), 0),
        (2.0, (1, 2), 6),
        (2.0, (1, 2), 6),
        (3.0, (1, 4), 15),
        (2.0, (1, 4), 10),
    ):
        gl.write_uniforms(kernel, factor=factor, pair=pair, unknown=1)
        kernel.run()
        assert np.frombuffer(out.read(), "f4") == sum_
    kernel.release()
    out.release()
