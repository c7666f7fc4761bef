"""Opens a GLFW window with the newest OpenGL that the driver has."""

import warnings
from typing import Any

from ..basics.exceptions import TerrainError
from ..gpu.loaders import glfw_error, glfw_library

_INSTEAD = "to draw a picture without a window: terrain-gl shot MAP -o picture.png"
_VERSIONS = ((4, 5), (4, 3))


def library() -> Any:
    """GLFW, initialised; `TerrainError` if there is no display."""
    try:
        return glfw_library()
    except TerrainError as error:
        raise TerrainError(f"no window: {error}; {_INSTEAD}") from None


def open_window(glfw: Any, size: tuple[int, int], title: str, backend: str = "auto") -> Any:
    """Open a window; its context is made by EGL, or in the system's own way. `TerrainError` without OpenGL 4.3."""
    # EGL first: GLX kills the process if an EGL context is current
    ways = {"egl": glfw.EGL_CONTEXT_API, "glfw": glfw.NATIVE_CONTEXT_API}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for version in _VERSIONS:
            for creation in ways.values() if backend == "auto" else (ways[backend],):
                glfw.default_window_hints()
                for hint, value in _hints(glfw, version, creation).items():
                    glfw.window_hint(hint, value)
                if handle := glfw.create_window(*size, title, None, None):
                    return handle
        reason = glfw_error(glfw)
        glfw.terminate()
    raise TerrainError(f"no window: this display has no OpenGL 4.3 ({reason}): update the graphics driver; {_INSTEAD}")


def _hints(glfw: Any, version: tuple[int, int], creation: int) -> dict[int, int]:
    return {
        glfw.CONTEXT_CREATION_API: creation,
        glfw.CONTEXT_VERSION_MAJOR: version[0],
        glfw.CONTEXT_VERSION_MINOR: version[1],
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        glfw.OPENGL_FORWARD_COMPAT: glfw.TRUE,
        glfw.SCALE_TO_MONITOR: glfw.TRUE,
        glfw.DEPTH_BITS: 0,
        glfw.STENCIL_BITS: 0,
    }
