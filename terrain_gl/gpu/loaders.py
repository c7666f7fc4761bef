"""Loader objects for contexts that moderngl cannot make itself.

A loader finds OpenGL functions by name, makes its context current on `with`, and destroys it on `release`.
"""

import contextlib
import ctypes
import warnings
from collections.abc import Callable
from typing import Any

from ..basics.exceptions import NotInstalledError, TerrainError
from .current import forget_osmesa


def glfw_library() -> Any:
    """The GLFW module, initialised; `TerrainError` if it is missing or there is no display."""
    try:
        import glfw
    except ImportError as error:
        raise NotInstalledError("a window", "gui", error) from None
    with warnings.catch_warnings():  # the glfw module also warns about errors that we raise
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise TerrainError(f"no display ({glfw_error(glfw)}); set DISPLAY or run under xvfb-run")
    return glfw


def glfw_error(glfw: Any) -> str:
    """GLFW's message about its last error."""
    text = glfw.get_error()[1]
    return text.decode() if text else "for an unknown reason"


class WindowLoader:
    """A loader for the context of a GLFW window."""

    def __init__(self, window: Any) -> None:
        self.window = window
        self.owns_window = False
        self.__enter__()

    def load_opengl_function(self, name: str) -> int:
        import glfw

        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    def __enter__(self) -> None:
        import glfw

        glfw.make_context_current(self.window)

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        import glfw

        if self.owns_window:
            glfw.destroy_window(self.window)


class OSMesaLoader:
    """A loader for a context of OSMesa, which draws into memory."""

    def __init__(self, version: int) -> None:
        self.library = ctypes.CDLL("libOSMesa.so.8")
        self.context = self._function("OSMesaCreateContextAttribs", ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(
            _osmesa_attributes(version), None
        )
        if not self.context:
            raise TerrainError(f"OSMesaCreateContextAttribs gave no {version / 100} context")
        self.pixels = ctypes.create_string_buffer(4 * 16 * 16)  # must live as long as the context
        self._current = self._function(
            "OSMesaMakeCurrent", ctypes.c_ubyte, ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int] * 3
        )
        self._address = self._function("OSMesaGetProcAddress", ctypes.c_void_p, ctypes.c_char_p)
        self.__enter__()

    def _function(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        return ctypes.CFUNCTYPE(result, *arguments)((name, self.library))

    def load_opengl_function(self, name: str) -> int:
        return self._address(name.encode()) or 0

    def __enter__(self) -> None:
        _let_go_of_egl()
        self._current(self.context, self.pixels, 0x1401, 16, 16)  # GL_UNSIGNED_BYTE

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        self._function("OSMesaDestroyContext", None, ctypes.c_void_p)(self.context)
        forget_osmesa(self.context)


def _let_go_of_egl() -> None:
    """Release EGL's current context. Otherwise EGL still counts it as current after OSMesa has made its own current."""
    with contextlib.suppress(OSError):
        ctypes.CDLL("libEGL.so.1").eglReleaseThread()


def _osmesa_attributes(version: int) -> Any:
    # format RGBA, depth 24, stencil 8, core profile, version major.minor, end
    pairs = [0x22, 0x1908, 0x30, 24, 0x31, 8, 0x33, 0x34, 0x36, version // 100, 0x37, version // 10 % 10, 0]
    return (ctypes.c_int * len(pairs))(*pairs)
