"""The interactive window: fly over a map and see what it costs and how true it is.

window                  GLFW: events in, frames out
flight                  puts together, frame by frame, what follows; knows no window
land, loading, memory   the map that is seen, one on its way; what is remembered from one run to the next
controller, mouse       the eye, and what the mouse does to it
commands, settings      every key with its line of help; how the picture is drawn
painter, pace, dawn     the picture: at once, or in portions; light on its way
canvas, lines, marks    the picture composed, and what is drawn over the land
insight, lesson         levels frozen, sides compared, patches explained in words and numbers
sculpting, editing      brushes, strokes, the land saved
dressing                skies and grounds from pictures
keeping, filming        pictures, films, command lines
gui, sections, charts   panels, if the extra [gui] is there; legend tells colours, help_page keys, gui_draw draws
font, overlay, hud      text alone
"""

from .loading import Opened, Opener
from .window import run

__all__ = ["Opened", "Opener", "run"]
