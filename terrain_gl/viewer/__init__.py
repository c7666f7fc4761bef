"""The interactive window. Beside each picture, it shows what the picture costs, and the picture's error.

The modules from top to bottom. Each imports only from its own line and the lines below.

showing                        `show`: a window, or a view in a notebook
notebook                       the view in a notebook; it needs no window
window, glfw_window            the GLFW window: events in, frames out
app                            a viewer with panels; sends input to a panel, the camera or a command
panels, sections, map_section, picture_section  the panels over the picture
charts, file_list, help_page, orientation, profile_plot, overview, tile_map  graphs, keys, north, maps
commands                       every key and what it does
viewer                         connects the parts below, frame by frame; knows neither window nor panels
mouse, marks                   clicks and drags; lines over the land
tour                           turns around the land when nobody is there
lecture_store                  a store of the map in memory, for a station of the lecture
lecture, jumps                 stations with a state of the window, and their texts; jumps between two frames
memory, state                  settings that are remembered; a whole state as JSON
layers                         files over the land: tracks, outlines, names, a ground image
sculpting, saver, explainer, store_tiles  the brush; saved files; why a patch has its detail; missing tiles
loops, places                  flights for short films; places that the user types
map_loader, image_reader       load maps, read sky and ground images
alarm, painter                 watches the promise; draws the picture, in motion and at rest
ahead                          draws the picture that is expected next
pointer, scene                 where the mouse points; the map and the camera
loading, light_builder         tables and light, made in steps
recovery, brush_tool, map_writer, filming, file_dialog, error_box, explain_text
gui, widgets, gui_draw, theme  Dear ImGui
advice, box_sum, controller, pose, settings, window_state, frame_budget, frame_stats, canvas, legend, ruler, split
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .loading import Opened, Opener
    from .window import run

__all__ = ["Opened", "Opener", "run"]
_MODULES = {"Opened": "loading", "Opener": "loading", "run": "window"}


def __getattr__(name: str) -> Any:
    """Import a name when it is first used (PEP 562): a notebook needs no window."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)
