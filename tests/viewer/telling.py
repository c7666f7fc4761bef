"""The real window on a map, which reports its state: python telling.py MAP WIDTHxHEIGHT STYLE.

In each frame it writes state.json to the working directory, for tests: the viewer's state, the places of the controls
in pixels, and the windows of the panels.
"""

import json
import os
import sys
import time
from collections import deque

from viewers import Listening

from terrain_gl.cli.line import command_line
from terrain_gl.viewer import window
from terrain_gl.viewer.loading import file_opener

FRAMES = deque(maxlen=2000)  # when each of the last frames began, and its seconds: no event is handled meanwhile


def state_of(app, listening):
    """What a test looks at."""
    viewer = app.viewer
    scene, frame = viewer.scene, viewer.painter.frame
    told = {"busy": viewer.busy or not viewer.settled, "message": viewer.window.message, "error": app.viewer.ctx.error}
    told |= {"windows": listening.windows, "texts": listening.texts, "places": app.gui.widgets.places}
    told |= {"opened": app.panels.opened, "list": app.gui.covers(-1, -1)}  # an open list covers everything
    told |= {"slow": [frame for frame in FRAMES if frame[1] > 0.1]}
    lecture = viewer.lecture
    told |= {"station": lecture.number if lecture else None, "layers": [each.name for each in viewer.layers.layers]}
    told |= {"recording": viewer.saver.filming.running, "drawing": bool(viewer.saver.shot)}
    if scene.has_map:
        controller, options = scene.controller, viewer.settings.options
        told |= {"title": viewer.title, "eye": list(controller.eye), "speed": controller.speed_m_s}
        told |= {"moving": controller.moving, "mode": controller.mode, "elevation": controller.elevation_deg}
        told |= {"fov": controller.fov_deg, "contour_m": options.contour_m, "style": options.style}
        told |= {"explained": bool(viewer.explainer.explanation), "corners": len(viewer.ruler.corners)}
        told |= {"ruler": viewer.ruler.taken, "sides": [s["triangles"] for s in viewer.painter.side_stats]}
        told |= {"measured": frame.measured_px, "bound": frame.certified_px, "folder": bool(viewer.files.folder)}
        told |= {"height": controller.height_above_ground_m, "strokes": viewer.sculpting.tool.strokes}
        told |= {"sun": options.sun, "sketch": frame.is_sketch, "achieved": viewer.painter.side_measured}
        told |= {"labels": [label.name for label in viewer.painter.labels], "scale": viewer.settings.ui_scale}
        told |= {"box": bool(viewer.explainer.explanation and viewer.explainer.error_box), "frozen": bool(scene.frozen)}
        told |= {"ends_px": [side.error_scale_px for side in viewer.settings.sides], "size": viewer.window.size}
        place = viewer.pointer.place
        told |= {"cursor": viewer.pointer.last}
        told |= {"place": None if place is None else list(place)}
    return told


class Telling(window.Window):
    """A window that writes its state each turn."""

    def _frame(self):
        widgets = self._app.gui.widgets
        if not isinstance(widgets.imgui, Listening):
            widgets.imgui = Listening(widgets.imgui)
        listening = widgets.imgui
        listening.texts, listening.windows, before = [], [], (listening.texts, listening.windows)
        begun_s = time.monotonic()
        super()._frame()
        FRAMES.append((begun_s, time.monotonic() - begun_s))
        if not listening.windows:  # nothing was drawn
            listening.texts, listening.windows = before
        if self._app.viewer.sculpting.tool or not self._app.viewer.scene.has_map:
            with open("state.part", "w", encoding="utf-8") as file:
                json.dump(state_of(self._app, listening), file)
            os.replace("state.part", "state.json")


if __name__ == "__main__":
    path, size, style = sys.argv[1:]
    window.Window = Telling
    width, height = map(int, size.split("x"))
    window.run(file_opener(path), size=(width, height), line_of=command_line, style=style, look="auto")
