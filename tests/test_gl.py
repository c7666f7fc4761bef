"""Raw OpenGL calls: depth range and limits."""

import numpy as np
import pytest

from terrain_gl.gpu import gl


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
