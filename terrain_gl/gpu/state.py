"""The state of OpenGL that we change in a context of somebody else: found on entry, given back at the end.

Passes set all state that they need (`passes`), and moderngl binds buffers, textures and framebuffers while it makes,
writes and reads them. So the state found on entry is saved here as a list of calls that bring it back.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from ctypes import c_double, c_float, c_int, c_int64, c_ubyte, c_uint
from typing import Any
from weakref import WeakKeyDictionary

import moderngl

from . import gl
from .calls import calls

STORAGE_BLOCKS, UNIFORM_BLOCKS, IMAGES, UNITS = 8, 8, 8, 16  # places that our shaders use: the first ones
_DRAW_BUFFERS, _VIEWPORTS = 8, 16
_TEXTURE0, _ACTIVE_TEXTURE, _SAMPLER_BINDING = 0x84C0, 0x84E0, 0x8919
_COMBINED_UNITS = 0x8B4D
_BLEND, _SCISSOR_TEST = 0x0BE2, 0x0C11

SWITCHES = {
    "DEPTH_TEST": 0x0B71,
    "DEPTH_CLAMP": 0x864F,
    "CULL_FACE": 0x0B44,
    "STENCIL_TEST": 0x0B90,
    "COLOR_LOGIC_OP": 0x0BF2,
    "POLYGON_OFFSET_POINT": 0x2A01,
    "POLYGON_OFFSET_LINE": 0x2A02,
    "POLYGON_OFFSET_FILL": 0x8037,
    "LINE_SMOOTH": 0x0B20,
    "POLYGON_SMOOTH": 0x0B41,
    "PRIMITIVE_RESTART": 0x8F9D,
    "PRIMITIVE_RESTART_FIXED_INDEX": 0x8D69,
    "RASTERIZER_DISCARD": 0x8C89,
    "MULTISAMPLE": 0x809D,
    "SAMPLE_ALPHA_TO_COVERAGE": 0x809E,
    "SAMPLE_ALPHA_TO_ONE": 0x809F,
    "SAMPLE_COVERAGE": 0x80A0,
    "SAMPLE_MASK": 0x8E51,
    "SAMPLE_SHADING": 0x8C36,
    "DITHER": 0x0BD0,
    "FRAMEBUFFER_SRGB": 0x8DB9,
    **{f"CLIP_DISTANCE{i}": 0x3000 + i for i in range(8)},
}
Setter = tuple[Any, ...]
NUMBERS: dict[
    str, Setter
] = {  # one number each: its name, and the function that sets it, with arguments before the number
    "DEPTH_FUNC": (0x0B74, "DepthFunc"),
    "DEPTH_WRITEMASK": (0x0B72, "DepthMask"),
    "CULL_FACE_MODE": (0x0B45, "CullFace"),
    "FRONT_FACE": (0x0B46, "FrontFace"),
    "POLYGON_MODE": (0x0B40, "PolygonMode", 0x0408),
    "PROVOKING_VERTEX": (0x8E4F, "ProvokingVertex"),
    "PATCH_VERTICES": (0x8E72, "PatchParameteri", 0x8E72),
    "CURRENT_PROGRAM": (0x8B8D, "UseProgram"),
    "VERTEX_ARRAY_BINDING": (0x85B5, "BindVertexArray"),
    "READ_FRAMEBUFFER_BINDING": (0x8CAA, "BindFramebuffer", 0x8CA8),
    "DRAW_FRAMEBUFFER_BINDING": (0x8CA6, "BindFramebuffer", 0x8CA9),
    "RENDERBUFFER_BINDING": (0x8CA7, "BindRenderbuffer", 0x8D41),
    "ARRAY_BUFFER_BINDING": (0x8894, "BindBuffer", 0x8892),
    "COPY_READ_BUFFER_BINDING": (0x8F36, "BindBuffer", 0x8F36),
    "COPY_WRITE_BUFFER_BINDING": (0x8F37, "BindBuffer", 0x8F37),
    "DRAW_INDIRECT_BUFFER_BINDING": (0x8F43, "BindBuffer", 0x8F3F),
    "DISPATCH_INDIRECT_BUFFER_BINDING": (0x90EF, "BindBuffer", 0x90EE),
    "TEXTURE_BUFFER_BINDING": (0x8C2A, "BindBuffer", 0x8C2A),
}
# How pixels are read from memory and written to it: moderngl sets the alignment alone, and never reads from a buffer.
# With these values it reads and writes what we mean.
PIXELS: dict[str, Setter] = {
    "PIXEL_PACK_BUFFER_BINDING": (0x88ED, "BindBuffer", 0x88EB),
    "PIXEL_UNPACK_BUFFER_BINDING": (0x88EF, "BindBuffer", 0x88EC),
    **{
        f"{way}_{name}": (first + i, "PixelStorei", first + i)
        for way, first in (("UNPACK", 0x0CF0), ("PACK", 0x0D00))
        for i, name in enumerate(("SWAP_BYTES", "LSB_FIRST", "ROW_LENGTH", "SKIP_ROWS", "SKIP_PIXELS"))
    },
    "PACK_SKIP_IMAGES": (0x806B, "PixelStorei", 0x806B),
    "PACK_IMAGE_HEIGHT": (0x806C, "PixelStorei", 0x806C),
    "UNPACK_SKIP_IMAGES": (0x806D, "PixelStorei", 0x806D),
    "UNPACK_IMAGE_HEIGHT": (0x806E, "PixelStorei", 0x806E),
}
ALIGNMENTS = {"UNPACK_ALIGNMENT": (0x0CF5, "PixelStorei", 0x0CF5), "PACK_ALIGNMENT": (0x0D05, "PixelStorei", 0x0D05)}
TEXTURES = {"2D": (0x8069, 0x0DE1), "2D_MULTISAMPLE": (0x9104, 0x9100), "2D_ARRAY": (0x8C1D, 0x8C1A)}
TEXTURES |= {"BUFFER": (0x8C2C, 0x8C2A)}
BLOCKS = {  # binding, start and size; target; number of places
    "SHADER_STORAGE_BUFFER": (0x90D3, 0x90D4, 0x90D5, 0x90D2, STORAGE_BLOCKS),
    "UNIFORM_BUFFER": (0x8A28, 0x8A29, 0x8A2A, 0x8A11, UNIFORM_BLOCKS),
    "TRANSFORM_FEEDBACK_BUFFER": (0x8C8F, 0x8C84, 0x8C85, 0x8C8E, 1),
}
_BLENDING = (0x80C9, 0x80C8, 0x80CB, 0x80CA)  # factors of colours (source, target) and of alpha
_EQUATIONS = (0x8009, 0x883D)
_CLIP = (0x935C, 0x935D)
_IMAGE = (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E)  # name, level, layered, layer, access, format

Found = list[tuple[str, list[Any]]]  # the functions that bring a state back, and their arguments
# where a function takes the number of an object that may be gone, and the function that tells
_OBJECTS = {
    "BindBuffer": (1, "glIsBuffer"),
    "BindBufferBase": (2, "glIsBuffer"),
    "BindBufferRange": (2, "glIsBuffer"),
    "BindFramebuffer": (1, "glIsFramebuffer"),
    "BindImageTexture": (1, "glIsTexture"),
    "BindRenderbuffer": (1, "glIsRenderbuffer"),
    "BindSampler": (1, "glIsSampler"),
    "BindTexture": (1, "glIsTexture"),
    "BindVertexArray": (0, "glIsVertexArray"),
    "UseProgram": (0, "glIsProgram"),
}


class SavedState:
    """Reads and gives back the state of one context."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._call = calls(ctx)
        self._is_enabled = gl.function(ctx, "glIsEnabled", c_ubyte, c_uint)
        self._is_enabled_at = gl.function(ctx, "glIsEnabledi", c_ubyte, c_uint, c_uint)
        self._objects = {name: (at, gl.function(ctx, tell, c_ubyte, c_uint)) for name, (at, tell) in _OBJECTS.items()}
        self._four = (c_int * 4)()
        self._units = [*range(UNITS), self._number(_COMBINED_UNITS) - 1]  # moderngl binds to the last one

    def found(self) -> Found:
        """The calls that bring back the present state."""
        return [(name, arguments) for name, *arguments in self._found()]

    def give_back(self, found: Found) -> None:
        """Bring back a state. Objects that were bound and have been deleted since are left out, as OpenGL does."""
        for name, arguments in found:
            at, is_there = self._objects.get(name, (0, None))
            if not is_there or not arguments[at] or is_there(arguments[at]):
                getattr(self._call, name)(*arguments)

    def make_plain(self) -> None:
        """Read and write pixels in the plain order, from and to memory."""
        for _, name, *before in PIXELS.values():
            getattr(self._call, name)(*before, 0)

    def _found(self) -> Iterator[tuple[Any, ...]]:
        """The functions that bring back the present state, by name, and their arguments."""
        for number in SWITCHES.values():
            yield "Enable" if self._is_enabled(number) else "Disable", number
        for what, name, *before in (*NUMBERS.values(), *PIXELS.values(), *ALIGNMENTS.values()):
            yield name, *before, self._number(what)
        for i in range(_DRAW_BUFFERS):
            yield "Enablei" if self._is_enabled_at(_BLEND, i) else "Disablei", _BLEND, i
            yield "BlendFuncSeparatei", i, *(self._number_at(each, i) for each in _BLENDING)
            yield "BlendEquationSeparatei", i, *(self._number_at(each, i) for each in _EQUATIONS)
            mask = (c_ubyte * 4)()
            self._call.GetBooleani_v(0x0C23, i, mask)
            yield "ColorMaski", i, *mask
        for i in range(_VIEWPORTS):
            yield "Enablei" if self._is_enabled_at(_SCISSOR_TEST, i) else "Disablei", _SCISSOR_TEST, i
            box, depths, scissor = (c_float * 4)(), (c_double * 2)(), (c_int * 4)()
            self._call.GetFloati_v(0x0BA2, i, box)
            self._call.GetDoublei_v(0x0B70, i, depths)
            self._call.GetIntegeri_v(0x0C10, i, scissor)
            yield "ViewportIndexedf", i, *box
            yield "DepthRangeIndexed", i, *depths
            yield "ScissorIndexed", i, *scissor
        if self._call.has_clip_control:
            yield "ClipControl", *(self._number(each) for each in _CLIP)
        yield from self._blocks()
        yield from self._textures()

    def _blocks(self) -> Iterator[tuple[Any, ...]]:
        for binding, start, size, target, count in BLOCKS.values():
            plain = self._number(binding)
            for i in range(count):
                buffer = self._number_at(binding, i)
                first, length = (self._long_at(each, i) if buffer else 0 for each in (start, size))
                if length:
                    yield "BindBufferRange", target, i, buffer, first, length
                else:
                    yield "BindBufferBase", target, i, buffer
            yield "BindBuffer", target, plain
        for i in range(IMAGES):
            name, level, layered, layer, access, form = (self._number_at(each, i) for each in _IMAGE)
            yield "BindImageTexture", i, name, level, layered, layer, access, form

    def _textures(self) -> Iterator[tuple[Any, ...]]:
        active = self._number(_ACTIVE_TEXTURE)
        for unit in self._units:
            self._call.ActiveTexture(_TEXTURE0 + unit)
            yield "ActiveTexture", _TEXTURE0 + unit
            for binding, target in TEXTURES.values():
                yield "BindTexture", target, self._number(binding)
            yield "BindSampler", unit, self._number(_SAMPLER_BINDING)
        self._call.ActiveTexture(active)
        yield "ActiveTexture", active

    def _number(self, name: int) -> int:
        self._call.GetIntegerv(name, self._four)  # the polygon mode may be two numbers
        return self._four[0]

    def _number_at(self, name: int, i: int) -> int:
        self._call.GetIntegeri_v(name, i, self._four)
        return self._four[0]

    def _long_at(self, name: int, i: int) -> int:
        found = c_int64()
        self._call.GetInteger64i_v(name, i, ctypes.byref(found))
        return found.value


_of: WeakKeyDictionary[moderngl.Context, SavedState] = WeakKeyDictionary()


def state_of(ctx: moderngl.Context) -> SavedState:
    """The state of a context."""
    if ctx not in _of:
        _of[ctx] = SavedState(ctx)
    return _of[ctx]
