"""OpenGL 4.3 contexts without a visible window: EGL, OSMesa or a hidden GLFW window.

Each way that fails says why in one line: what is missing, what to install, which version was found.
"""

from __future__ import annotations

import platform
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl

from ..exceptions import TerrainError, UsageError
from .apart import may_crash, try_apart
from .loaders import OSMesaLoader, WindowLoader, glfw_error, glfw_library

REQUIRED = 430  # compute shaders and storage buffers
_WANTED = (450, REQUIRED)
_OLDEST = 330  # the least that a driver is asked for, only to say what it has

_PACKAGES = {
    "egl": "libegl1 libgl1 libgl1-mesa-dri",
    "osmesa": "libosmesa6, where the release still has it",
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
            if may_crash(name):
                try_apart(name)
            return newest(name)
        except TerrainError as error:
            reasons.append(str(error))
    raise TerrainError("no OpenGL context: " + "; ".join(reasons))


def probe_backends() -> list[Probe]:
    """Try every back end, in a process of its own, and tell what each gives or why it does not work."""
    probes = []
    for name in _BACKENDS:
        try:
            probes.append(Probe(name, True, *try_apart(name)))
        except TerrainError as error:
            probes.append(Probe(name, False, reason=str(error)))
    return probes


def backend_name(ctx: moderngl.Context) -> str:
    """Name of the back end that made `ctx`; "external" for a context made elsewhere."""
    return ctx.extra["backend"] if isinstance(ctx.extra, dict) and "backend" in ctx.extra else "external"


def from_glfw_window(window: Any, require: int = REQUIRED) -> moderngl.Context:
    """Context of a GLFW window, which becomes current; the window stays the caller's."""
    return _finish(_with_loader(WindowLoader(window), require), "glfw")


def newest(name: str) -> moderngl.Context:
    """Context of back end `name`, or a `TerrainError` of one line."""
    reason = ""
    for version in _WANTED:
        try:
            return _finish(_BACKENDS[name](version), name)
        except Exception as error:  # ValueError, OSError, or glcontext's bare Exception
            reason = str(error)
    raise TerrainError(f"{name}: {_too_old(name) or reason + _install(name)}")


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
    mac = platform.system() == "Darwin"
    advice = "macOS has no more, use Linux or Windows" if mac else "update the graphics driver"
    return f"{found}, needed 4.3 for compute shaders; {advice}"


def _install(name: str) -> str:
    return f"; on Debian or Ubuntu: apt install {_PACKAGES[name]}" if platform.system() == "Linux" else ""


def _egl(version: int) -> moderngl.Context:
    # explicit sonames: searching for them takes ldconfig or a compiler, which small containers lack
    names: dict[str, Any] = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    return moderngl.create_context(version, standalone=True, **names)


def _osmesa(version: int) -> moderngl.Context:
    return _with_loader(OSMesaLoader(version), version)


def _glfw(version: int) -> moderngl.Context:
    glfw = glfw_library()
    with warnings.catch_warnings():  # the glfw module warns of what is raised here
        warnings.simplefilter("ignore")
        # EGL first: GLX kills the process if an EGL context is current, as one from here may be
        ways = (glfw.EGL_CONTEXT_API, glfw.NATIVE_CONTEXT_API)
        window = next(filter(None, (_hidden_window(glfw, version, way) for way in ways)), None)
        if not window:
            raise TerrainError(f"no window ({glfw_error(glfw)})")
    ctx = from_glfw_window(window, version)
    ctx.mglo._context.owns_window = True
    return ctx


def _hidden_window(glfw: Any, version: int, creation: int) -> Any:
    hints = {
        glfw.VISIBLE: glfw.FALSE,
        glfw.CONTEXT_CREATION_API: creation,
        glfw.CONTEXT_VERSION_MAJOR: version // 100,
        glfw.CONTEXT_VERSION_MINOR: version // 10 % 10,
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        glfw.OPENGL_FORWARD_COMPAT: glfw.TRUE,
    }
    glfw.default_window_hints()
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(16, 16, "terrain-gl", None, None)


_BACKENDS: dict[str, Callable[[int], moderngl.Context]] = {"egl": _egl, "osmesa": _osmesa, "glfw": _glfw}
