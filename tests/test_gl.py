"""Raw OpenGL calls: depth range and limits."""

from terrain_gl.gpu import gl


def test_limits_are_at_least_what_version_43_guarantees(ctx):
    limits = gl.limits(ctx)
    assert limits["tess_level"] >= 64
    assert limits["texture_size"] >= 16384
    assert limits["storage_block_bytes"] >= 2**24
    assert limits["compute_storage_blocks"] >= 8
    assert limits["viewport_size"] >= 16384
