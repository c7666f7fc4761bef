"""Heightmaps drawn with OpenGL tessellation at a certified screen-space error.

import terrain_gl as tg
terrain = tg.Heightmap.open("dem.tif", spacing_m=30)
with tg.Renderer(terrain) as r:
    frame = r.render(tg.Camera.default(terrain), max_error_px=1.0)
    frame.image, frame.stats, r.measure()
tg.show(terrain)  # a window, or a view in a notebook
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .basics.exceptions import TerrainError, UsageError
from .basics.version import __version__

if TYPE_CHECKING:
    from .camera import Camera
    from .files.checking import check
    from .files.maps import bundled_map
    from .gpu.context import create_context
    from .heightmap import Heightmap
    from .renderer import Renderer
    from .renderer.frame import Frame, Measured, Stats
    from .renderer.options import RenderOptions
    from .viewer.showing import show

__all__ = [
    "Camera",
    "Frame",
    "Heightmap",
    "Measured",
    "RenderOptions",
    "Renderer",
    "Stats",
    "TerrainError",
    "UsageError",
    "__version__",
    "bundled_map",
    "check",
    "create_context",
    "show",
]
_MODULES = {
    "Camera": "camera",
    "Frame": "renderer.frame",
    "Heightmap": "heightmap",
    "Measured": "renderer.frame",
    "RenderOptions": "renderer.options",
    "Renderer": "renderer",
    "Stats": "renderer.frame",
    "bundled_map": "files.maps",
    "check": "files.checking",
    "create_context": "gpu.context",
    "show": "viewer.showing",
}


def __getattr__(name: str) -> Any:
    """Import a name when it is first used (PEP 562). So the command line starts at once, and soon handles Ctrl-C."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
