"""The interactive window: fly over a map and see what it costs and how true it is.

font, overlay, hud      words over the picture
controller, settings    what keys and mouse mean
flight                  frames: draw what changed, at a pace
window                  GLFW: events in, frames out
"""

from .window import run

__all__ = ["run"]
