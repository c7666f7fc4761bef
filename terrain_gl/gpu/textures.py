"""Textures that moderngl does not make or read as we need them."""

import ctypes

import moderngl
import numpy as np

from . import gl

Size = tuple[int, int]
_TEXTURE_2D = 0x0DE1
_TEXTURE_2D_MULTISAMPLE = 0x9100
_DEPTH_COMPONENT = 0x1902
_DEPTH_COMPONENT32F = 0x8CAC
_FLOAT = 0x1406


def depth_texture(ctx: moderngl.Context, size: Size, samples: int) -> moderngl.Texture:
    """A depth texture of 32-bit floats, which moderngl does not offer."""
    texture = ctx.depth_texture(size, samples=samples)
    i = ctypes.c_int
    u = ctypes.c_uint
    target = _TEXTURE_2D_MULTISAMPLE if samples else _TEXTURE_2D
    gl.function(ctx, "glBindTexture", None, u, u)(target, texture.glo)
    if samples:
        define = gl.function(ctx, "glTexImage2DMultisample", None, u, i, u, i, i, ctypes.c_ubyte)
        define(target, samples, _DEPTH_COMPONENT32F, *size, 1)
    else:
        define = gl.function(ctx, "glTexImage2D", None, u, i, i, i, i, i, u, u, ctypes.c_void_p)
        define(target, 0, _DEPTH_COMPONENT32F, *size, 0, _DEPTH_COMPONENT, _FLOAT, None)
    return texture


def from_top(data: bytes, dtype: str, size: Size, components: int) -> np.ndarray:
    """Pixels read from OpenGL, lowest row first, as (height, width, components) with the top row first."""
    return np.frombuffer(data, dtype).reshape(size[1], size[0], components)[::-1].copy()
