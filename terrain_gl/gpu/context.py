"""OpenGL 4.3 contexts without a visible window: EGL, OSMesa or a hidden GLFW window.

If a back end fails, one line says why: what is missing, what to install, which version was found.
"""

import os
import platform
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl

from ..basics.exceptions import NotInstalledError, TerrainError, UsageError
from .apart import may_crash, try_apart
from .current import remember
from .loaders import OSMesaLoader, WindowLoader, glfw_error, glfw_library

REQUIRED = 430  # compute shaders and storage buffers
_WANTED = (450, REQUIRED)
_OLDEST = 330  # requested only to find out which version an old driver has

_PACKAGES = {
    "egl": "libegl1 libgl1 libgl1-mesa-dri",
    "osmesa": "libosmesa6, where the release still has it",
    "glfw": "libgl1 libgl1-mesa-dri xvfb",
}


class Probe(NamedTuple):
    """Whether a back end works on this machine; `reason` is empty if it does."""

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
        The name is not one of these.
    TerrainError
        No back end works; the message gives the reason for each one tried.
    """
    if backend != "auto" and backend not in _BACKENDS:
        raise UsageError(f"backend {backend!r}: expected one of auto, {', '.join(_BACKENDS)}")
    if _processes - {os.getpid()}:
        raise TerrainError("OpenGL was used before a fork, and would hang; start processes with spawn")
    _processes.add(os.getpid())
    reasons = []
    for name in _BACKENDS if backend == "auto" else [backend]:
        try:
            if may_crash(name):
                try_apart(name)
            return newest(name)
        except TerrainError as error:
            reasons.append(str(error))
    raise TerrainError("no OpenGL context: " + "; ".join(reasons))


_processes: set[int] = set()  # those that have made a context: this one, or before a fork its parent


def probe_backends() -> list[Probe]:
    """Try every back end in a separate process, and report its renderer and version, or why it does not work."""
    probes = []
    for name in _BACKENDS:
        try:
            probes.append(Probe(name, True, *try_apart(name)))
        except TerrainError as error:
            probes.append(Probe(name, False, reason=str(error)))
    return probes


def backend_name(ctx: moderngl.Context) -> str:
    """Name of the back end that made `ctx`; "external" for a context of the caller."""
    return ctx.extra["backend"] if isinstance(ctx.extra, dict) and "backend" in ctx.extra else "external"


def from_glfw_window(window: Any, require: int = REQUIRED) -> moderngl.Context:
    """Context of a GLFW window; it becomes current. The caller keeps the window."""
    return _finish(_with_loader(WindowLoader(window), require), "glfw")


def newest(name: str) -> moderngl.Context:
    """Context of back end `name`, or a `TerrainError` of one line."""
    reason = ""
    for version in _WANTED:
        try:
            return _finish(_BACKENDS[name](version), name)
        except NotInstalledError as error:
            raise TerrainError(f"{name}: {error}") from None
        except Exception as error:  # ValueError, OSError, or glcontext's bare Exception
            reason = str(error)
    raise TerrainError(f"{name}: {_too_old(name) or reason + _install(name)}")


def _with_loader(loader: Any, version: int) -> moderngl.Context:
    return moderngl.create_context(version, context=loader)


def _finish(ctx: moderngl.Context, name: str) -> moderngl.Context:
    ctx.extra = {"backend": name}
    remember(ctx)
    _ = ctx.error  # moderngl queries the default framebuffer, which is an error if there is none
    return ctx


def _too_old(name: str) -> str:
    """A sentence about the version that was found; empty if there is no OpenGL at all."""
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
    # explicit library names: a search needs ldconfig or a compiler, which small containers lack
    names: dict[str, Any] = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    return moderngl.create_context(version, standalone=True, **names)


def _osmesa(version: int) -> moderngl.Context:
    return _with_loader(OSMesaLoader(version), version)


def _glfw(version: int) -> moderngl.Context:
    glfw = glfw_library()
    with warnings.catch_warnings():  # the glfw module also warns about errors that we raise
        warnings.simplefilter("ignore")
        # EGL first: GLX kills the process if an EGL context is current, such as one made here
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
