"""The few OpenGL calls that moderngl does not wrap, such as depth range, limits and counters."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from ctypes import POINTER, byref, c_float, c_int, c_int64, c_uint
from typing import Any

import moderngl

from ..basics.exceptions import TerrainError

_QUERY_RESULT = 0x8866
_SAMPLES_PASSED = 0x8914
_PRIMITIVES_GENERATED = 0x8C87
_PRIMITIVES_WRITTEN = 0x8C88
_TEXTURE0 = 0x84C0
_TEXTURE_BUFFER = 0x8C2A
_R32UI = 0x8236
SOFTWARE = ("llvmpipe", "softpipe")  # names of Mesa's software renderers
CODE_FOR = "TERRAIN_GL_CODE_FOR"  # environment variable: with "gpu", a processor runs the code for GPUs, for tests
MOST_VERTICES = 65535  # most tessellated vertices in one draw: Mesa's software renderer counts them in 16 bits
COMMAND_STRIDE = 20  # bytes between indirect commands, as in moderngl's render_indirect

_LIMITS = {
    "texture_size": 0x0D33,
    "texture_layers": 0x88FF,
    "storage_block_bytes": 0x90DE,
    "storage_blocks": 0x90DD,
    "compute_storage_blocks": 0x90DB,
    "fragment_storage_blocks": 0x90DA,
    "uniform_block_bytes": 0x8A30,
    "tess_level": 0x8E7E,
    "patch_vertices": 0x8E7D,
    "samples": 0x8D57,
    "renderbuffer_size": 0x84E8,
    "texture_buffer_texels": 0x8C2B,
    "compute_images": 0x91BD,
    "fragment_images": 0x90CE,
    "image_units": 0x8F38,
    "compute_textures": 0x91BC,
    "fragment_textures": 0x8872,
    "compute_invocations": 0x90EB,
    "shared_bytes": 0x8262,
}


def function(ctx: moderngl.Context, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    """OpenGL function `name` of the context, as a ctypes function; `TerrainError` if the driver has none."""
    address = ctx.mglo._context.load_opengl_function(name)  # the loader that the context was made with
    if not address:
        raise TerrainError(f"{ctx.info['GL_RENDERER']} has no {name}; a driver with OpenGL 4.3 is needed")
    return ctypes.CFUNCTYPE(result, *arguments)(address)


def is_software(ctx: moderngl.Context) -> bool:
    """Whether the processor draws. A processor has few cores, and every work group takes time to start."""
    return str(ctx.info["GL_RENDERER"]).startswith(SOFTWARE)


def wants_few_groups(ctx: moderngl.Context) -> bool:
    """Whether kernels run in few work groups, as suits a processor; `TERRAIN_GL_CODE_FOR=gpu` forbids it, for tests."""
    return is_software(ctx) and os.environ.get(CODE_FOR) != "gpu"


def texel_texture(ctx: moderngl.Context, size: tuple[int, int], dtype: str) -> moderngl.Texture:
    """A texture of one value per texel, read without interpolation. Outside it, its rim is repeated.

    Where a shader reads a `WordTexture`, llvmpipe still has the sampler that an earlier shader had in this place, and
    compiles the shader again for each other sampler. So all textures that compute shaders read have the same one.
    Places are in the order of declarations: the shader of light declares its few other textures before most words.
    """
    texture = ctx.texture(size, 1, dtype=dtype)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    texture.repeat_x = texture.repeat_y = False
    return texture


def release_with_pixels(framebuffer: moderngl.Framebuffer) -> None:
    """Release a framebuffer and its attachments; moderngl's release keeps the attachments."""
    for pixels in framebuffer.color_attachments:
        pixels.release()
    framebuffer.release()


def limits(ctx: moderngl.Context) -> dict[str, int]:
    """The driver's limits, in texels, bytes or counts; also `viewport_size`, the largest side of a square viewport."""
    get = function(ctx, "glGetInteger64v", None, c_uint, POINTER(c_int64))
    pair = (c_int64 * 2)()

    def value(name: int) -> int:
        get(name, pair)
        return pair[0]

    found = {key: value(name) for key, name in _LIMITS.items()}
    get(0x0D3A, pair)
    return found | {"viewport_size": min(pair)}


def reserve(ctx: moderngl.Context, size: int, what: str) -> moderngl.Buffer:
    """Make a storage buffer of `size` bytes; `TerrainError` if this driver's storage blocks are smaller."""
    most = storage_block_bytes(ctx)
    if size > most:
        raise TerrainError(
            f"{what} of {size >> 20} MiB is more than this driver's storage blocks hold ({most >> 20} MiB);"
            " draw the map from a store (terrain-gl build)"
        )
    return ctx.buffer(reserve=size)


def at_least(ctx: moderngl.Context, buffer: moderngl.Buffer, needed: int) -> moderngl.Buffer:
    """The buffer, if it has `needed` bytes; else a larger one that replaces it. The old content is then lost."""
    if needed <= buffer.size:
        return buffer
    buffer.release()
    return ctx.buffer(reserve=needed + needed // 2)


def storage_block_bytes(ctx: moderngl.Context) -> int:
    """The most bytes that a storage block holds."""
    # Mesa's software renderer reports 128 MiB but does not enforce it: tables of 2 GiB are exact
    return 2**31 if ctx.info["GL_RENDERER"].startswith("llvmpipe") else limits(ctx)["storage_block_bytes"]


class WordTexture:
    """A buffer of 32-bit words, read through a texture: see WORDS_IN_TEXTURES in glsl/shade/posts.glsl."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._delete = function(ctx, "glDeleteTextures", None, c_int, POINTER(c_uint))
        self._activate = function(ctx, "glActiveTexture", None, c_uint)
        self._bind = function(ctx, "glBindTexture", None, c_uint, c_uint)
        self._attach = function(ctx, "glTexBuffer", None, c_uint, c_uint, c_uint)
        self._name = c_uint()
        self._attached: moderngl.Buffer | None = None
        function(ctx, "glGenTextures", None, c_int, POINTER(c_uint))(1, byref(self._name))

    def of(self, buffer: moderngl.Buffer) -> WordTexture:
        """Select the buffer to read."""
        self._buffer = buffer
        return self

    def use(self, location: int) -> None:
        """Make the buffer visible at a texture unit."""
        self._activate(_TEXTURE0 + location)
        self._bind(_TEXTURE_BUFFER, self._name.value)
        if self._attached is not self._buffer:
            self._attach(_TEXTURE_BUFFER, _R32UI, self._buffer.glo)
            self._attached = self._buffer

    def release(self) -> None:
        """Release GPU resources."""
        self._delete(1, byref(self._name))


def floats(*values: float) -> Any:
    """An array of floats, as OpenGL reads it."""
    return (c_float * len(values))(*values)


def numbers(*values: int) -> Any:
    """An array of unsigned numbers, as OpenGL reads it."""
    return (c_uint * len(values))(*values)


def fragments_drawn(ctx: moderngl.Context) -> AbstractContextManager[c_uint]:
    """Count the samples that the block draws; the result is set when the block ends."""
    return _counter(ctx, _SAMPLES_PASSED)


def triangles_made(ctx: moderngl.Context) -> AbstractContextManager[c_uint]:
    """Count the triangles that the block makes, and `triangles_written` those that transform feedback records."""
    return _counter(ctx, _PRIMITIVES_GENERATED)


def triangles_written(ctx: moderngl.Context) -> AbstractContextManager[c_uint]:
    """Count the triangles that transform feedback records."""
    return _counter(ctx, _PRIMITIVES_WRITTEN)


@contextmanager
def _counter(ctx: moderngl.Context, target: int) -> Iterator[c_uint]:
    """Run a query `target` over the block; the result is set when the block ends."""
    query = c_uint()
    result = c_uint()
    function(ctx, "glGenQueries", None, c_int, POINTER(c_uint))(1, byref(query))
    function(ctx, "glBeginQuery", None, c_uint, c_uint)(target, query)
    try:
        yield result
    finally:
        function(ctx, "glEndQuery", None, c_uint)(target)
        function(ctx, "glGetQueryObjectuiv", None, c_uint, c_uint, POINTER(c_uint))(query, _QUERY_RESULT, byref(result))
        function(ctx, "glDeleteQueries", None, c_int, POINTER(c_uint))(1, byref(query))
