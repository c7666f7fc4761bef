"""Which OpenGL context is current in this thread, whoever made it; and how to give it back.

moderngl makes a context current, but does not say whether that worked, and on EGL it does not give back the one before.
So we ask the library of the window system: EGL, GLX, WGL or OSMesa.
"""

from __future__ import annotations

import ctypes
import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_int, c_size_t, c_uint, c_void_p
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar
from weakref import WeakKeyDictionary

import moderngl

from ..basics.exceptions import TerrainError

_RESIDENT = getattr(os, "RTLD_NOLOAD", 0)  # only libraries that the process has loaded already
_DRAW, _READ = 0x3059, 0x305A
_UNSIGNED_BYTE = 0x1401
_each_loaded = getattr(ctypes.pythonapi, "dl_iterate_phdr", None)  # of Linux and BSD


def _note(info: Any, _: int, found: Any) -> int:
    found[0] = info[4]  # dl_phdr_info.dlpi_adds, the same for all libraries
    return 1


_NOTE = ctypes.CFUNCTYPE(c_int, ctypes.POINTER(c_size_t), c_size_t, ctypes.POINTER(c_size_t))(_note)


def _loads() -> float:
    """How many libraries the process has loaded so far; NaN, which equals nothing, where the system does not tell."""
    found = c_size_t()
    if not _each_loaded:
        return math.nan
    _each_loaded(_NOTE, byref(found))
    return found.value


@cache
def _function(library: str, name: str) -> Any:
    function = getattr(ctypes.CDLL(library, mode=_RESIDENT), name)
    function.restype = c_void_p
    return function


_absent: dict[str, float] = {}  # libraries that were not there, and `_loads` then: to look takes 0.1 ms


def _call(library: str, name: str, *arguments: Any) -> int:
    """Call a function of handles; 0 if the process has not loaded the library."""
    if library in _absent and _absent.get(library) == _loads():
        return 0
    try:
        function = _function(library, name)
    except (OSError, AttributeError):
        _absent[library] = _loads()
        return 0
    _absent.pop(library, None)
    return function(*[c_void_p(each) if isinstance(each, int) else each for each in arguments]) or 0


@dataclass(frozen=True)
class Current:
    """A context that was current, and the surfaces it drew to."""

    context: int
    others: tuple[int, ...] = ()

    library: ClassVar[str]
    asks: ClassVar[str]  # the function that returns the current context
    tells: ClassVar[tuple[tuple[Any, ...], ...]] = ()  # functions that return its display and surfaces, with arguments
    makes: ClassVar[str]  # the function that makes a context current

    @classmethod
    def now(cls) -> Current | None:
        """The current context of this window system."""
        context = _call(cls.library, cls.asks)
        return cls(context, tuple(_call(cls.library, *told) for told in cls.tells)) if context else None

    def is_current(self) -> bool:
        """Whether it is the current context of this thread."""
        return _call(self.library, self.asks) == self.context and not _osmesa_draws()

    def restore(self) -> None:
        """Make it current again."""
        _call(self.library, self.makes, *self.others, self.context)

    def let_go(self) -> None:
        """Make no context of this window system current."""
        _call(self.library, self.makes, self.others[0], 0, 0, 0)


class _Egl(Current):
    library = "libEGL.so.1"
    asks = "eglGetCurrentContext"
    tells = ("eglGetCurrentDisplay",), ("eglGetCurrentSurface", _DRAW), ("eglGetCurrentSurface", _READ)
    makes = "eglMakeCurrent"


class _Glx(Current):
    library = "libGL.so.1"
    asks = "glXGetCurrentContext"
    tells = ("glXGetCurrentDisplay",), ("glXGetCurrentDrawable",), ("glXGetCurrentReadDrawable",)
    makes = "glXMakeContextCurrent"


class _Wgl(Current):
    library = "opengl32"
    asks = "wglGetCurrentContext"
    tells = (("wglGetCurrentDC",),)
    makes = "wglMakeCurrent"

    def let_go(self) -> None:
        _call(self.library, self.makes, 0, 0)


class _OSMesa(Current):
    library = "libOSMesa.so.8"
    asks = "OSMesaGetCurrentContext"
    makes = "OSMesaMakeCurrent"

    def is_current(self) -> bool:
        return _call(self.library, self.asks) == self.context

    @classmethod
    def now(cls) -> Current | None:
        context = _call(cls.library, cls.asks)
        if not context:
            return None
        width, height, form, pixels = c_int(), c_int(), c_int(), c_void_p()
        places = byref(width), byref(height), byref(form), byref(pixels)
        _call(cls.library, "OSMesaGetColorBuffer", context, *places)
        return cls(context, (pixels.value or 0, width.value, height.value))

    def restore(self) -> None:
        pixels, width, height = self.others
        size = c_int(width), c_int(height)
        _call(self.library, self.makes, self.context, pixels, c_uint(_UNSIGNED_BYTE), *size)

    def let_go(self) -> None:
        _call(self.library, self.makes, 0, 0, c_uint(0), c_int(0), c_int(0))


# OSMesa last: it shares its record with EGL and GLX, and may answer with a context of theirs
_SYSTEMS: tuple[type[Current], ...] = (_Wgl,) if sys.platform == "win32" else (_Egl, _Glx, _OSMesa)
_known: WeakKeyDictionary[moderngl.Context, Current] = WeakKeyDictionary()
_of_osmesa: set[int] = set()


def _osmesa_draws() -> bool:
    """Whether OSMesa draws here. EGL may still count a context of its own as current."""
    return bool(_of_osmesa) and _call(_OSMesa.library, _OSMesa.asks) in _of_osmesa


def current() -> Current | None:
    """The context that is current in this thread, whoever made it."""
    systems = (_OSMesa,) if _osmesa_draws() else _SYSTEMS
    return next(filter(None, (system.now() for system in systems)), None)


def remember(ctx: moderngl.Context) -> None:
    """Note the handle of a context that was just made, and so is current."""
    now = current()
    if now:
        _known[ctx] = now
    if isinstance(now, _OSMesa):
        _of_osmesa.add(now.context)


def forget_osmesa(context: int) -> None:
    """Note that a context of OSMesa is gone: another library may get its address."""
    _of_osmesa.discard(context)


def check_current(ctx: moderngl.Context) -> None:
    """Refuse to go on where a context is known and not current: OpenGL would do nothing, or draw in another one.

    Raises
    ------
    TerrainError
        Another context, or none, is current in this thread.
    """
    handle = _known.get(ctx)
    if handle and not handle.is_current():
        raise TerrainError("the renderer's OpenGL context is not current here: put this into `with renderer.session:`")


def handle_of(ctx: moderngl.Context) -> Current | None:
    """The handle of a context; None if the window system is not known."""
    if ctx not in _known:  # a context of the caller
        with kept():
            switch(current(), None)  # what is current then is the caller's context
            ctx.__enter__()  # type: ignore[no-untyped-call]
            remember(ctx)
    return _known.get(ctx)


def switch(before: Current | None, to: Current | None) -> None:
    """Make another context current, or none."""
    if before and (to is None or type(before) is not type(to)):
        before.let_go()  # a window system refuses while another one has a current context
    if to:
        to.restore()


@contextmanager
def kept() -> Iterator[None]:
    """Whatever the block makes current, the context that was current before is so again."""
    before = current()
    try:
        yield
    finally:
        now = current()
        if now != before:
            switch(now, before)
