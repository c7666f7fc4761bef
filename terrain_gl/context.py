"""OpenGL 4.3 contexts without a visible window: EGL, OSMesa or a hidden GLFW window.

Each way that fails says why in one line: what is missing, what to install, which version was found.
"""

from __future__ import annotations

import ctypes
import platform
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl

from .exceptions import TerrainError, UsageError

REQUIRED = 430  # compute shaders and storage buffers
_WANTED = (450, REQUIRED)
_OLDEST = 330  # the least that a driver is asked for, only to say what it has

_PACKAGES = {
    "egl": "libegl1 libgl1 libgl1-mesa-dri",
    "osmesa": "libosmesa6, gone from Mesa 25.1",
    "glfw": "libgl1 libgl1-mesa-dri xvfb",
}


class Probe(NamedTuple):
    """What one back end gives on this machine; `reason` is empty when it works."""

    name: str
    works: bool
    renderer: str = ""
    version: str = ""
    reason: str = ""


def create_context(backend: str = "auto") -> moderngl.Context:
    """Make an OpenGL context of version 4.3 or newer, and make it current.

    Parameters
    ----------
    backend
        "egl", "osmesa", "glfw" (a hidden window, needs a display), or "auto": the first of these that works.

    Raises
    ------
    UsageError
        For another name.
    TerrainError
        If no context can be had; one line tells why for each back end tried.
    """
    if backend != "auto" and backend not in _BACKENDS:
        raise UsageError(f"backend {backend!r}: expected one of auto, {', '.join(_BACKENDS)}")
    reasons = []
    for name in _BACKENDS if backend == "auto" else [backend]:
        try:
            return _newest(name)
        except TerrainError as error:
            reasons.append(str(error))
    raise TerrainError("no OpenGL context: " + "; ".join(reasons))


def probe_backends() -> list[Probe]:
    """Try every back end and tell what each gives or why it does not work."""
    return [_probe(name) for name in _BACKENDS]


def backend_name(ctx: moderngl.Context) -> str:
    """Name of the back end that made `ctx`; "external" for a context made elsewhere."""
    return ctx.extra["backend"] if isinstance(ctx.extra, dict) and "backend" in ctx.extra else "external"


def from_glfw_window(window: Any, require: int = REQUIRED) -> moderngl.Context:
    """Context of a GLFW window, which becomes current; the window stays the caller's."""
    return _finish(_with_loader(_GLFW(window), require), "glfw")


def _probe(name: str) -> Probe:
    try:
        ctx = _newest(name)
    except TerrainError as error:
        return Probe(name, False, reason=str(error))
    with ctx:
        found = Probe(name, True, ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"])
    ctx.release()
    return found


def _newest(name: str) -> moderngl.Context:
    """Context of back end `name`, or a `TerrainError` of one line."""
    reason = ""
    for version in _WANTED:
        try:
            return _finish(_BACKENDS[name](version), name)
        except Exception as error:  # ValueError, OSError, or glcontext's bare Exception
            reason = str(error)
    raise TerrainError(f"{name}: {_too_old(name) or reason}{_advice(name)}")


def _with_loader(loader: Any, version: int) -> moderngl.Context:
    return moderngl.create_context(version, context=loader)


def _finish(ctx: moderngl.Context, name: str) -> moderngl.Context:
    ctx.extra = {"backend": name}
    _ = ctx.error  # moderngl's look at the default framebuffer may leave one where there is none
    return ctx


def _too_old(name: str) -> str:
    """Sentence on the version found, if there is any OpenGL at all."""
    try:
        ctx = _BACKENDS[name](_OLDEST)
    except Exception:
        return ""
    found = f"found OpenGL {ctx.version_code // 100}.{ctx.version_code // 10 % 10} ({ctx.info['GL_RENDERER']})"
    ctx.release()
    return f"{found}, needed 4.3 for compute shaders"


def _advice(name: str) -> str:
    if platform.system() == "Darwin":
        return "; macOS stops at OpenGL 4.1, this program runs on Linux and Windows"
    return f"; on Debian or Ubuntu: apt install {_PACKAGES[name]}"


def _egl(version: int) -> moderngl.Context:
    # explicit sonames: searching for them takes ldconfig or a compiler, which small containers lack
    names: dict[str, Any] = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    return moderngl.create_context(version, standalone=True, **names)


def _osmesa(version: int) -> moderngl.Context:
    return _with_loader(_OSMesa(version), version)


def _glfw(version: int) -> moderngl.Context:
    try:
        import glfw
    except ImportError as error:
        raise TerrainError(f"{error}; pip install glfw") from None
    with warnings.catch_warnings():  # the glfw module warns of what is raised here
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise TerrainError(f"no display ({_glfw_error(glfw)}); set DISPLAY or run under xvfb-run")
        hints = {
            glfw.VISIBLE: glfw.FALSE,
            glfw.CONTEXT_VERSION_MAJOR: version // 100,
            glfw.CONTEXT_VERSION_MINOR: version // 10 % 10,
            glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
            glfw.OPENGL_FORWARD_COMPAT: glfw.TRUE,
        }
        glfw.default_window_hints()
        for hint, value in hints.items():
            glfw.window_hint(hint, value)
        window = glfw.create_window(16, 16, "terrain-gl", None, None)
        if not window:
            raise TerrainError(f"no window ({_glfw_error(glfw)})")
    ctx = from_glfw_window(window, version)
    ctx.mglo._context.owns_window = True
    return ctx


def _glfw_error(glfw: Any) -> str:
    text = glfw.get_error()[1]
    return text.decode() if text else "unknown"


class _GLFW:
    """GLFW window as the loader object that moderngl asks for."""

    def __init__(self, window: Any) -> None:
        self.window, self.owns_window = window, False
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


class _OSMesa:
    """OSMesa context as the loader object that moderngl asks for."""

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
        self._current(self.context, self.pixels, 0x1401, 16, 16)  # GL_UNSIGNED_BYTE

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        self._function("OSMesaDestroyContext", None, ctypes.c_void_p)(self.context)


def _osmesa_attributes(version: int) -> Any:
    # format RGBA, depth 24, stencil 8, core profile, version major.minor, end
    pairs = [0x22, 0x1908, 0x30, 24, 0x31, 8, 0x33, 0x34, 0x36, version // 100, 0x37, version // 10 % 10, 0]
    return (ctypes.c_int * len(pairs))(*pairs)


_BACKENDS: dict[str, Callable[[int], moderngl.Context]] = {"egl": _egl, "osmesa": _osmesa, "glfw": _glfw}
