"""Layers over the land: tracks, outlines and names from files that the user drops on the window, and ground images.

Renderer and options hold what is shown, so saved pictures, films and the names that one can go to have the same layers.
"""

import os
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

from ..renderer.draped import COLOURS
from ..renderer.lines import Color
from ..renderer.overlay import Overlay, paint_of, painted, read_overlay, read_paint
from ..renderer.photos import photo_in
from .image_reader import ImageReader
from .loading import Opened, in_a_line
from .painter import Painter
from .saver import Saver
from .scene import Scene

TRACKS = (".gpx", ".kml", ".kmz", ".tcx", ".nmea", ".igc", ".geojson", ".geojsonl", ".json", ".jsonl")
PHOTOS = (".jpg", ".jpeg", ".webp")  # no map of heights has these endings


@dataclass
class Layer:
    """A file over the land."""

    path: str
    colour: Color
    overlay: Overlay | None = None  # None for an image, and until the file is read
    is_shown: bool = True
    is_image: bool = False  # whether it is the picture of the ground
    is_coloured: bool = False  # whether the user chose the colour; otherwise the file's own colours come first

    @property
    def name(self) -> str:
        return os.path.basename(self.path) or "overlay"

    @property
    def painted(self) -> Overlay:
        """The overlay with the colour of the layer, which does not depend on the other layers."""
        assert self.overlay
        return painted(self.overlay, self.paint)

    @property
    def paint(self) -> str:
        """The colour, as `overlay.painted` takes it."""
        return paint_of(self.colour, self.is_coloured)

    @property
    def state(self) -> dict[str, Any]:
        """The layer in a state of the window: `Layers.restore`."""
        return {"path": self.path, "shown": self.is_shown, "colour": self.paint}

    def take(self, state: dict[str, Any]) -> None:
        """Be shown, or not, and coloured, as in a state."""
        self.is_shown = bool(state.get("shown", True))
        self.colour, self.is_coloured = read_paint(state["colour"])


def is_layer(path: str) -> bool:
    """Whether a file is shown over the land, and is not a map itself."""
    return path.lower().endswith((*TRACKS, *PHOTOS))


def _absolute(path: str) -> str:
    """A path that also holds in another folder; "" for an overlay without a file."""
    return os.path.abspath(path) if path else ""


class Layers:
    """The layers of the map, the first one at the bottom."""

    def __init__(self, scene: Scene, painter: Painter, saver: Saver, images: ImageReader) -> None:
        self.layers: list[Layer] = []
        self._scene = scene
        self._painter = painter
        self._saver = saver
        self._images = images
        self._key = ""  # of the map
        self._waiting: list[Layer] = []  # layers whose files are to be read
        self._reading: tuple[Layer, Future[Overlay]] | None = None
        self._thread = ThreadPoolExecutor(1, "layer")

    @property
    def busy(self) -> bool:
        return bool(self._reading or self._waiting)

    def new_map(self, opened: Opened, is_preview: bool) -> None:
        """Begin with the overlays of a map. If it is the same map, at another scale, dropped files are placed again."""
        given = {_absolute(overlay.path) for overlay in opened.overlays}
        is_same = opened.key == self._key
        dropped = [layer for layer in self.layers if layer.is_image or (is_same and layer.path not in given)]
        self._key, self._reading = opened.key, None
        self.layers = [Layer(_absolute(each.path), self._colour(i), each) for i, each in enumerate(opened.overlays)]
        for layer, overlay in zip(self.layers, opened.overlays, strict=True):
            if overlay.paint:
                layer.colour, layer.is_coloured = read_paint(overlay.paint)
        self.layers += dropped
        self._waiting = [layer for layer in dropped if not layer.is_image]
        if not is_preview:
            self._lay()

    def add(self, path: str) -> None:
        """Show a file over the land, as soon as the map is there."""
        layer = self._of(_absolute(os.path.expanduser(path.strip())), len(self.layers))
        if layer.is_image:
            self._scene.window.say(f"{layer.name} has no place (GPS): it is laid over the ground")
            self._drop_images()
            self._images.read("material", layer.path)
            self.layers.append(layer)
        else:
            self._waiting.append(layer)

    @property
    def state(self) -> list[dict[str, Any]]:
        """The layers of files, the first one at the bottom, for a bookmark."""
        return [layer.state for layer in self.layers if layer.path]

    def restore(self, states: list[dict[str, Any]] | None) -> None:
        """Show the layers of a state, in its order; layers that it does not have are hidden. None: change nothing."""
        if states is None or states == self.state:
            return
        known = {layer.path: layer for layer in self.layers if layer.path}
        wanted = [known.pop(path) if path in known else self._of(path, 0) for path in (each["path"] for each in states)]
        for layer, each in zip(wanted, states, strict=True):
            layer.take(each)
        for layer in known.values():
            layer.is_shown = layer.is_image and layer.is_shown  # an image is an option, which the state has
        self._waiting = [layer for layer in wanted if layer.overlay is None and not layer.is_image]
        self.layers = [*(layer for layer in self.layers if not layer.path), *wanted, *known.values()]
        self.changed()

    def step(self) -> None:
        """Read the next file, or show a layer that was read."""
        scene = self._scene
        if not self._images.busy:  # an image that could not be read, or that the user has replaced
            laid = scene.settings.options.material
            self.layers = [each for each in self.layers if not (each.is_image and each.is_shown and each.path != laid)]
        if self._waiting and not self._reading and scene.has_map and not scene.is_preview:
            layer = self._waiting.pop(0)
            self._reading = layer, self._thread.submit(read_overlay, layer.path, scene.heightmap)
        if not self._reading or not self._reading[1].done():
            return
        layer, read = self._reading
        self._reading = None
        try:
            layer.overlay = read.result()
            if layer not in self.layers:
                self.layers.append(layer)
            self.changed()
            shown = f"{len(layer.overlay.lines):,} lines, {len(layer.overlay.points):,} points"
            scene.window.say(f"{layer.name}: {shown}; Layers, in the panel, has its colour")
        except Exception as error:
            self.layers = [each for each in self.layers if each is not layer]
            scene.window.say(str(in_a_line(error, f"{layer.path}: cannot be read")))

    def toggle(self, layer: Layer) -> None:
        """Show a layer, or hide it."""
        layer.is_shown = not layer.is_shown
        if layer.is_image:
            self._images.read("material", layer.path if layer.is_shown else "")
        self.changed()

    def paint(self, layer: Layer, colour: Color) -> None:
        """Draw a layer in one colour."""
        layer.colour, layer.is_coloured = colour, True
        self.changed()

    def lower(self, layer: Layer) -> None:
        """Draw a layer before the one below it."""
        at = self.layers.index(layer)
        self.layers.insert(max(at - 1, 0), self.layers.pop(at))
        self.changed()

    def remove(self, layer: Layer) -> None:
        self.layers.remove(layer)
        if layer.is_image and layer.is_shown:
            self._images.read("material", "")
        self.changed()

    def changed(self) -> None:
        """Draw what has changed; a picture or film that is being saved would show both."""
        self._saver.cancel("nothing was saved: the layers have changed")
        if self._lay():
            self._painter.light.stop()
        self._painter.forget(at_once=True)

    def join(self) -> None:
        if self._reading:
            wait([self._reading[1]])

    def _lay(self) -> bool:
        """Give the renderer what is shown; returns whether the colours of the land may have changed."""
        before = self._scene.renderer.overlays
        laid = tuple(layer.painted for layer in self.layers if layer.is_shown and layer.overlay)
        self._scene.renderer.overlays = laid
        return any(overlay.areas for overlay in (*before, *laid))

    def _drop_images(self) -> None:
        """There is one ground image at a time."""
        self.layers = [layer for layer in self.layers if not layer.is_image]

    def _of(self, path: str, number: int) -> Layer:
        """A layer of a file; a photo without a place is a picture of the ground."""
        return Layer(path, self._colour(number), is_image=path.lower().endswith(PHOTOS) and not photo_in(path))

    @staticmethod
    def _colour(number: int) -> Color:
        return COLOURS[number % len(COLOURS)]
