"""Draw the pictures of docs/viewer.md: the window in each of its modes, without a window.

python benchmarks/viewer_pictures.py [FOLDER]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from windowless import open_flight, opened

from terrain_gl.camera import Camera
from terrain_gl.image import write_image
from terrain_gl.renderer import Renderer
from terrain_gl.viewer.controller import Pose
from terrain_gl.viewer.flight import Flight

SIZE = (1000, 562)
MAP = "canyon"


def main(folder: str = "docs") -> None:
    """Draw them all; each begins where the one before ended."""
    flight = first_flight()
    for name, change in SCENES.items():
        change(flight)
        settle(flight)
        path = Path(folder) / f"viewer-{name}.jpg"
        write_image(path, pixels(flight))
        print(f"{path}: {flight.figures.stats['triangles']:,} triangles, {flight.ctx.error}", flush=True)


def first_flight() -> Flight:
    """A flight over the map, in a picture of its own."""
    flight, land = open_flight(SIZE), opened(MAP)
    assert flight.gui, "pip install 'terrain-gl[gui]'"
    flight.land.show(Renderer(land.heightmap, (64, 64), ctx=flight.ctx), land)
    return flight


def settle(flight: Flight) -> None:
    """Frames until nothing changes any more."""
    flight.message = ""
    flight.refresh()
    while flight.frame(flight.now_s + 0.5) or flight.busy or flight.painter.waits_for_rest or not flight.settled:
        pass


def pixels(flight: Flight) -> np.ndarray:
    """What a window would show."""
    data = flight.target.read(components=3, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1]


# --- Scenes -----------------------------------------------------------------------------------------------------------


def first(flight: Flight) -> None:
    """As it opens."""


def patch(flight: Flight) -> None:
    """A click, with the mesh over the picture."""
    flight.press("n")
    settle(flight)
    flight.insight.explain(560, 430)


def split(flight: Flight) -> None:
    """A pixel and eight, side by side, under a glass."""
    flight.press("escape")
    flight.press("n")
    flight.settings.draw(style="lod")
    flight.press("t")
    flight.settings.active = 1
    flight.settings.draw(method="sat", max_error_px=8.0)
    flight.settings.divider = 0.62
    flight.press("z")
    flight.mouse.point(640, 400)


def promise(flight: Flight) -> None:
    """Patches by what was promised of them, and the error that came of it."""
    flight.press("z")
    flight.settings.active = 0
    flight.settings.draw(style="promise", max_error_px=2.0)
    flight.settings.active = 1
    flight.settings.draw(style="error", max_error_px=2.0)


def frozen(flight: Flight) -> None:
    """Levels chosen for an eye, and that eye's pyramid, from elsewhere."""
    flight.press("t")
    flight.settings.draw(style="lod")
    flight.press("l")
    x, y, z = flight.controller.eye
    flight.controller.pose = Pose.of(Camera((x - 2900.0, y - 1700.0, z + 2300.0), (x, y + 2600.0, z - 500.0), 50.0))


def sums(flight: Flight) -> None:
    """The summed-area table, and the box under the cursor."""
    flight.press("l")
    flight.controller.home()
    flight.settings.draw(style="shaded", max_error_px=1.0)
    flight.press("u")
    flight.mouse.point(500, 380)


def light(flight: Flight) -> None:
    """A low sun over a flooded canyon."""
    flight.press("u")
    open_sections(flight, "Picture", "Keep")
    low, high = flight.renderer.heightmap.range_m
    flight.settings.draw_both(sun=(290.0, 9.0), water_m=low + 0.25 * (high - low))


def sculpt(flight: Flight) -> None:
    """A hill of one's own."""
    open_sections(flight, "Detail", "Sculpt")
    flight.settings.draw_both(sun=flight.land.opened.sun, water_m=None)
    flight.press("b")
    assert flight.sculpting.editing
    flight.sculpting.editing.radius_m, flight.sculpting.editing.strength_m = 350.0, 60.0
    flight.mouse.press("left", 520, 440)
    for x in range(540, 760, 40):
        flight.mouse.point(x, 440)
        flight.frame(flight.now_s + 0.1)
    flight.mouse.let_go("left", 740, 440)


def open_sections(flight: Flight, *titles: str) -> None:
    """Open these sections of the panel, and close the others."""
    assert flight.gui
    flight.gui.opened = {title: title in titles for title in flight.gui.opened}


SCENES: dict[str, Callable[[Flight], None]] = {
    "first": first,
    "patch": patch,
    "split": split,
    "promise": promise,
    "frozen": frozen,
    "sums": sums,
    "light": light,
    "sculpt": sculpt,
}


if __name__ == "__main__":
    main(*sys.argv[1:])
