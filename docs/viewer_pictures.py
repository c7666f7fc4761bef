"""Draw the pictures of docs/viewer.md: each mode of the window, without a window.

    python docs/viewer_pictures.py [FOLDER]

The triangles that each picture states are written to viewer-pictures.json, with camera and options of each side:
tests/test_viewer_pictures.py compares them with those of today's program.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from terrain_gl.camera import Camera
from terrain_gl.files.maps import open_map
from terrain_gl.gpu.context import create_context
from terrain_gl.image import write_image
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer.app import App
from terrain_gl.viewer.controller import Pose
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.settings import Settings

SIZE = (1000, 562)
MAP = "canyon-15m"
NUMBERS = "viewer-pictures.json"


def main(folder: str = "docs") -> None:
    """Draw all pictures; each begins in the state that the last one has left."""
    app = first_app()
    stated = {}
    for name, change in SCENES.items():
        change(app)
        settle(app)
        path = Path(folder) / f"viewer-{name}.jpg"
        write_image(path, pixels(app))
        stated[name] = sides_of(app)
        print(f"{path}: {app.viewer.painter.frame.stats['triangles']:,} triangles, {app.viewer.ctx.error}", flush=True)
    (Path(folder) / NUMBERS).write_text(json.dumps(stated, indent=1) + "\n")


def first_app() -> App:
    """An app with the map, in a framebuffer of its own."""
    ctx = create_context()
    app = App(ctx, ctx.framebuffer([ctx.texture(SIZE, 4)]), SIZE, Settings())
    heightmap, known = open_map(MAP)
    assert known
    land = Opened(heightmap, known.camera, known.sun, known.name)
    app.viewer.show(Renderer(heightmap, (64, 64), ctx=ctx), land)
    return app


def sides_of(app: App) -> list[dict[str, Any]]:
    """What each side of the picture states: its triangles, and the camera and options of its mesh."""
    painter = app.viewer.painter
    spec = painter.drawn
    assert spec
    tool = app.viewer.sculpting.tool
    edits = bool(tool and any(tool.strokes))
    return [
        {"triangles": stats["triangles"], "edited": edits, "camera": asdict(spec.camera), "options": changed(options)}
        for stats, options in zip(painter.side_stats, spec.sides, strict=True)
    ]


def changed(options: FrameOptions) -> dict[str, Any]:
    """The options that are not as they are by default, as JSON can hold them."""
    given = {each.name: getattr(options, each.name) for each in fields(options)}
    usual = FrameOptions()
    given = {name: value for name, value in given.items() if value != getattr(usual, name)}
    return {name: asdict(value) if isinstance(value, Camera) else value for name, value in given.items()}


def settle(app: App) -> None:
    """Draw frames until nothing changes any more."""
    app.viewer.window.message = ""
    app.viewer.window.refresh()
    while (
        app.frame(app.viewer.window.now_s + 0.5)
        or app.busy
        or app.viewer.painter.waits_for_rest
        or not app.viewer.settled
    ):
        pass


def pixels(app: App) -> np.ndarray:
    """(height, width, 3): the pixels that a window would show."""
    data = app.viewer.target.read(components=3, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1]


# --- Scenes -----------------------------------------------------------------------------------------------------------


def first(app: App) -> None:
    """The window as it opens."""


def patch(app: App) -> None:
    """A click: the look-up that decides the level of a patch, with the mesh over the picture."""
    app.viewer.settings.change(max_error_px=2.0)
    app.press("n")
    settle(app)
    app.viewer.explainer.explain(480, 440)


def split(app: App) -> None:
    """The split picture as it begins: equal triangles on both sides, and their errors, under the magnifying glass."""
    app.press("escape")
    app.press("n")
    app.viewer.settings.change(max_error_px=4.0)
    settle(app)
    app.press("t")
    app.viewer.settings.divider = 0.62
    app.press("z")
    app.viewer.mouse.move(760, 230)


def promise(app: App) -> None:
    """The bound of each patch, and the error of each pixel."""
    app.press("z")
    app.viewer.settings.active = 0
    app.viewer.settings.change(style="promise", max_error_px=2.0)
    app.viewer.settings.active = 1
    app.viewer.settings.change(style="error", method="sat", max_error_px=2.0)


def frozen(app: App) -> None:
    """Frozen levels and the frustum of their camera, from elsewhere."""
    app.press("t")
    app.viewer.settings.change(style="lod")
    app.press("l")
    x, y, z = app.viewer.scene.controller.eye
    app.viewer.scene.controller.pose = Pose.of(
        Camera((x - 2900.0, y - 1700.0, z + 2300.0), (x, y + 2600.0, z - 500.0), 50.0)
    )


def sums(app: App) -> None:
    """The summed-area table, and the box under the cursor."""
    app.press("l")
    app.viewer.scene.controller.home()
    app.viewer.settings.change(style="shaded", max_error_px=1.0)
    app.press("u")
    app.viewer.mouse.move(500, 380)


def light(app: App) -> None:
    """A low sun over a flooded canyon."""
    app.press("u")
    open_sections(app, "Picture", "Save")
    low, high = app.viewer.scene.renderer.heightmap.range_m
    app.viewer.settings.change_all(sun=(290.0, 9.0), water_m=low + 0.25 * (high - low))


def ruler(app: App) -> None:
    """Contour lines, and a line across the canyon with its profile."""
    open_sections(app, "Detail", "Sculpt")
    app.viewer.settings.change_all(sun=app.viewer.scene.opened.sun, water_m=None)
    app.press("shift+c")
    app.press("shift+r")
    for at in ((480, 300), (760, 380), (600, 470)):
        app.mouse_down("left", *at)
        app.mouse_up("left", *at)
        app.frame(app.viewer.window.now_s + 0.1)


def lecture(app: App) -> None:
    """The second station of the lecture."""
    app.press("escape")
    app.press("shift+c")
    app.viewer.give_lecture()
    assert app.viewer.lecture
    app.viewer.lecture.go_to(1)


def sculpt(app: App) -> None:
    """A new hill."""
    app.press("escape")
    app.press("b")
    settle(app)
    assert app.viewer.sculpting.tool
    app.viewer.sculpting.tool.radius_m, app.viewer.sculpting.tool.strength_m = 350.0, 60.0
    app.viewer.mouse.press("left", 520, 440)
    for x in range(540, 760, 40):
        app.viewer.mouse.move(x, 440)
        app.frame(app.viewer.window.now_s + 0.1)
    app.viewer.mouse.release("left", 740, 440)


def open_sections(app: App, *titles: str) -> None:
    """Open these sections of the panel, and close the others."""
    app.panels.opened = {title: title in titles for title in app.panels.opened}


SCENES: dict[str, Callable[[App], None]] = {
    "first": first,
    "patch": patch,
    "split": split,
    "promise": promise,
    "frozen": frozen,
    "sums": sums,
    "light": light,
    "ruler": ruler,
    "lecture": lecture,
    "sculpt": sculpt,
}


if __name__ == "__main__":
    main(*sys.argv[1:])
