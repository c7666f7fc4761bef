"""OpenGL functions that moderngl does not offer, fetched once for each context."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_double, c_float, c_int, c_int64, c_ssize_t, c_ubyte, c_uint, c_void_p
from typing import Any
from weakref import WeakKeyDictionary

import moderngl

from ..basics.exceptions import TerrainError

_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # names without "gl", and the types of their arguments
    "ActiveTexture": (c_uint,),
    "BeginTransformFeedback": (c_uint,),
    "BindBuffer": (c_uint, c_uint),
    "BindBufferBase": (c_uint, c_uint, c_uint),
    "BindBufferRange": (c_uint, c_uint, c_uint, c_ssize_t, c_ssize_t),
    "BindFramebuffer": (c_uint, c_uint),
    "BindImageTexture": (c_uint, c_uint, c_int, c_ubyte, c_int, c_uint, c_uint),
    "BindRenderbuffer": (c_uint, c_uint),
    "BindSampler": (c_uint, c_uint),
    "BindTexture": (c_uint, c_uint),
    "BindVertexArray": (c_uint,),
    "BlendEquation": (c_uint,),
    "BlendEquationSeparatei": (c_uint, c_uint, c_uint),
    "BlendFuncSeparatei": (c_uint, c_uint, c_uint, c_uint, c_uint),
    "BlendFuncSeparate": (c_uint, c_uint, c_uint, c_uint),
    "ClearBufferfv": (c_uint, c_int, POINTER(c_float)),
    "ClipControl": (c_uint, c_uint),
    "ColorMask": (c_ubyte, c_ubyte, c_ubyte, c_ubyte),
    "ColorMaski": (c_uint, c_ubyte, c_ubyte, c_ubyte, c_ubyte),
    "CullFace": (c_uint,),
    "DepthFunc": (c_uint,),
    "DepthMask": (c_ubyte,),
    "DepthRangeIndexed": (c_uint, c_double, c_double),
    "DepthRangef": (c_float, c_float),
    "Disable": (c_uint,),
    "Disablei": (c_uint, c_uint),
    "DrawBuffers": (c_int, POINTER(c_uint)),
    "Enable": (c_uint,),
    "Enablei": (c_uint, c_uint),
    "EndTransformFeedback": (),
    "FrontFace": (c_uint,),
    "GetBooleani_v": (c_uint, c_uint, POINTER(c_ubyte)),
    "GetDoublei_v": (c_uint, c_uint, POINTER(c_double)),
    "GetFloati_v": (c_uint, c_uint, POINTER(c_float)),
    "GetInteger64i_v": (c_uint, c_uint, POINTER(c_int64)),
    "GetIntegeri_v": (c_uint, c_uint, POINTER(c_int)),
    "GetIntegerv": (c_uint, POINTER(c_int)),
    "MultiDrawArraysIndirect": (c_uint, c_void_p, c_int, c_int),
    "MultiDrawElementsIndirect": (c_uint, c_uint, c_void_p, c_int, c_int),
    "GetUniformiv": (c_uint, c_int, POINTER(c_int)),
    "PatchParameteri": (c_uint, c_int),
    "PixelStorei": (c_uint, c_int),
    "PolygonMode": (c_uint, c_uint),
    "ProvokingVertex": (c_uint,),
    "Scissor": (c_int, c_int, c_int, c_int),
    "ScissorIndexed": (c_uint, c_int, c_int, c_int, c_int),
    "UseProgram": (c_uint,),
    "Viewport": (c_int, c_int, c_int, c_int),
    "ViewportIndexedf": (c_uint, c_float, c_float, c_float, c_float),
}
_OPTIONAL = ("ClipControl",)  # OpenGL 4.5; without it, far depths are less precise, but still in order


class Calls:
    """The functions of one context, as attributes named without "gl". A function that the driver lacks is None."""

    def __init__(self, ctx: moderngl.Context) -> None:
        load = ctx.mglo._context.load_opengl_function  # the loader that the context was made with
        self.has_clip_control = ctx.version_code >= 450 or "GL_ARB_clip_control" in ctx.extensions
        for name, arguments in _FUNCTIONS.items():
            address = load(f"gl{name}") if self.has_clip_control or name not in _OPTIONAL else 0
            if not address and name not in _OPTIONAL:
                raise TerrainError(f"{ctx.info['GL_RENDERER']} has no gl{name}; a driver with OpenGL 4.3 is needed")
            setattr(self, name, ctypes.CFUNCTYPE(None, *arguments)(address) if address else None)

    def __getattr__(self, name: str) -> Callable[..., None]:
        raise AttributeError(f"gpu/calls.py lists no OpenGL function {name}")


_of: WeakKeyDictionary[moderngl.Context, Calls] = WeakKeyDictionary()


def calls(ctx: moderngl.Context) -> Calls:
    """The functions of a context."""
    if ctx not in _of:
        _of[ctx] = Calls(ctx)
    return _of[ctx]
