"""Heightmaps drawn with OpenGL tessellation at a certified screen-space error.

import terrain_gl as tg
terrain = tg.Heightmap.open("dem.tif", spacing_m=30)
with tg.Renderer(terrain) as r:
    frame = r.render(tg.Camera.default(terrain), max_error_px=1.0)
    frame.image, frame.stats, r.measure()
"""

from .camera import Camera
from .context import create_context
from .exceptions import TerrainError, UsageError
from .heightmap import Heightmap
from .renderer import Frame, Renderer

__version__ = "0.1.0"
__all__ = ["Camera", "Frame", "Heightmap", "Renderer", "TerrainError", "UsageError", "create_context"]
