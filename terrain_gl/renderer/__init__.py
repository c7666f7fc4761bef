"""From a heightmap and a camera to a picture with a certified error, and edits of the map.

renderer                                   the one way to draw; see `Renderer.draw_steps`
options, methods, frame                    settings of a picture; its methods; the picture with its numbers
gpu_resources                              everything that a renderer holds on the GPU
edit, brush                                new heights for a rectangle, and strokes
overlay, draped, lines                     lines and points on the land
inspector                                  questions about the last frame
plan                                       the map from straight above
"""

from .renderer import Renderer

__all__ = ["Renderer"]
