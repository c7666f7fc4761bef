"""The interactive window: fly over a map and see what it costs and how true it is.

font, overlay, hud      words over the picture
controller, settings    what mouse and keys mean
commands                every key, what it does, and its line of help
loading, memory         a map on its way; what is remembered from one run to the next
dawn, filming, editing  light on its way, films, brushes
canvas, lines, marks    the picture composed, and what is drawn over the land
lesson                  what is explained, in words and numbers
gui, sections, charts   panels, if the extra [gui] is there; gui_draw draws them
flight                  frames: draw what changed, at a pace
window                  GLFW: events in, frames out
"""

from .loading import Opened, Opener
from .window import run

__all__ = ["Opened", "Opener", "run"]
