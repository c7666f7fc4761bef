"""The map that is seen: where it comes from, how it takes the place of the one before, and how high it is."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..renderer import Renderer
from ..timing import Stopwatch
from .controller import Controller
from .editing import Editing
from .hud import Figures
from .loading import Loading, Opened, Opener, coarse, file_opener

if TYPE_CHECKING:
    from .flight import Flight

SPACING_HINT = "1 m is assumed; set the spacing under Map, or with --spacing"
TOLD_S = 10.0  # how long it is said why there is no map


class Land:
    """The map, and the one that is on its way.

    Attributes
    ----------
    renderer
        What draws it, once there is one.
    opened
        As it was read.
    loading
        The next one, while it is read and its tables are built.
    is_coarse
        It stands for one of more posts, whose tables are being built.
    exaggeration
        What all heights are multiplied by.
    refused
        The file that was asked for last, if it did not come.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.renderer: Renderer | None = None
        self.opened: Opened
        self.loading: Loading | None = None
        self.is_coarse = False
        self.exaggeration = 1.0
        self.refused = ""
        self._plain: Heightmap | None = None  # not exaggerated
        self._next: float | None = None  # exaggeration of what is on its way, if it is the same land

    def open(self, name: str) -> None:
        """Begin to load a bundled map, by its name, or a file."""
        if self._flight.sculpting.may_be_left():
            self.refused = name  # until it is there
            self.load(os.path.basename(name), file_opener(name))

    def load(self, name: str, opener: Opener) -> None:
        """Begin to load a map; the present one stays until that is done."""
        self.cancel()
        self.loading, self._next = Loading(name, opener), None

    def cancel(self) -> None:
        """Stop loading, if anything is loading."""
        if self.loading:
            self.loading.cancel()
            self.loading = self._next = None
            self._flight.factor = self.exaggeration
            self._flight.refresh()

    @property
    def can_cancel(self) -> bool:
        """Whether there would still be a map to see without the one that is loading."""
        return self.loading is not None and self.renderer is not None and not self.is_coarse

    @property
    def is_changing(self) -> bool:
        """Whether the same land is being made higher or lower."""
        return self.loading is not None and self._next is not None

    def exaggerate(self, factor: float) -> None:
        """Begin to multiply all heights by a factor."""
        if not self.renderer or self.is_coarse:
            return
        if self._flight.sculpting.at_work:
            self._flight.factor = self.exaggeration
            self._flight.say("the brush is still at work")
            return
        now, start = self.renderer.heightmap, self._flight.controller.start
        plain = self._plain or times(now, 1 / self.exaggeration)
        ratio = factor / self.exaggeration
        camera = replace(start, eye=_raised(start.eye, ratio), target=_raised(start.target, ratio))
        opened = replace(self.opened, camera=camera, sun=self._flight.settings.drawing.sun)

        def opener(progress: Callable[[float], None]) -> Opened:
            return replace(opened, heightmap=times(plain, factor, progress))

        self.load(f"{now.name} × {factor:.2f}", opener)
        self._next, self._plain, self._flight.factor = factor, plain, factor

    def space(self, spacing_m: float) -> None:
        """See the same posts with another distance between them."""
        if not self.renderer or self.is_coarse or not self._flight.sculpting.may_be_left():
            return
        plain, opened = self._plain or times(self.renderer.heightmap, 1 / self.exaggeration), self.opened

        def opener(progress: Callable[[float], None]) -> Opened:
            spaced = Heightmap(plain.heights, spacing_m, plain.name)
            spaced.opened = plain.opened and plain.opened | {"spacing_m": spacing_m}
            return replace(opened, heightmap=spaced, camera=Camera.default(spaced), camera_given=True)

        self.load(plain.name, opener)

    def changed(self) -> None:
        """Somebody has sculpted it: what was read is no longer what it is without exaggeration."""
        self._plain = None

    def step(self) -> None:
        """Load on for a while."""
        loading, flight = self.loading, self._flight
        if not loading:
            return
        loading.step(flight.ctx, self._some_size, flight.pace)
        flight.refresh()
        if loading.error:
            self.loading = self._next = None
            flight.factor = self.exaggeration
            if not self.renderer or self.is_coarse:
                raise loading.error
            flight.say(str(loading.error) or "not enough memory", TOLD_S)
        elif loading.renderer and loading.opened:
            self.show(loading.take(), loading.opened)
            self.loading = None
        elif loading.opened and not self.renderer and (few := coarse(loading.opened.heightmap)):
            self.show(Renderer(few, self._some_size, ctx=flight.ctx), loading.opened)

    def show(self, renderer: Renderer, opened: Opened) -> None:
        """See a map from now on; the renderer of the one before is released, this one will be."""
        self.note()
        before, was_coarse, flight = self.renderer, self.is_coarse, self._flight
        flight.painter.interrupt()
        raised = self._next and self._next / self.exaggeration
        flight.sculpting.new_land(None if renderer.heightmap is not opened.heightmap else Editing(renderer), raised)
        flight.keeping.land_changed()
        self.renderer, self.is_coarse = renderer, renderer.heightmap is not opened.heightmap
        fresh = not (before and was_coarse)
        posts = opened.heightmap.cols, opened.heightmap.rows
        flight.painter.new_map(Figures(Path(opened.heightmap.name).name, posts) if fresh else None)
        if before:
            before.release()
        if fresh:
            self._enter(opened)
        renderer.picture.waits_for_light = False
        renderer.queries = Stopwatch.works(flight.ctx)
        flight.insight.put_away()

    def note(self) -> None:
        """Remember where the eye is, and its bookmarks."""
        if self.renderer:
            controller = self._flight.controller
            self._flight.memory.note_map(self.opened.key, controller.pose, controller.bookmarks)

    def release(self) -> None:
        """Give everything back."""
        self.cancel()
        if self.renderer:
            self.renderer.release()

    def _enter(self, opened: Opened) -> None:
        flight = self._flight
        self.opened, self.refused = opened, ""
        if self._next is not None:
            self._raise(opened, self._next)
            return
        self._plain, self.exaggeration, flight.factor = opened.heightmap, 1.0, 1.0
        flight.controller = Controller(opened.heightmap, opened.camera, bookmarks=flight.memory.bookmarks(opened.key))
        if (pose := flight.memory.last_pose(opened.key)) and not opened.camera_given:
            flight.controller.pose = pose
        flight.settings.draw_both(sun=opened.sun)
        if opened.heightmap.assumes_spacing:
            name = Path(opened.heightmap.name).name
            flight.say(f"{name} does not say how far its posts are apart: {SPACING_HINT}", TOLD_S)

    def _raise(self, opened: Opened, factor: float) -> None:
        """The same land as before, higher or lower: the eye goes with it, the rest stays."""
        before = self._flight.controller
        now = Controller(opened.heightmap, opened.camera, before.above_ground, before.bookmarks, before.held)
        now.pose = replace(before.pose, eye=_raised(before.pose.eye, factor / self.exaggeration))
        now.change_mode(before.mode)
        self._flight.controller = now
        self.exaggeration, self._next = factor, None
        self._flight.factor = factor

    @property
    def _some_size(self) -> tuple[int, int]:
        """The window may be out of sight, or larger than what the GPU draws; the first frame will tell."""
        width, height = self._flight.size
        return max(1, width // 4), max(1, height // 4)


def times(heightmap: Heightmap, factor: float, progress: Callable[[float], None] | None = None) -> Heightmap:
    """A map with all heights multiplied; read anew with another scale if it is a file's, which can be told again."""
    if factor == 1:
        return heightmap
    if heightmap.opened is None:
        return Heightmap(heightmap.heights * np.float32(factor), heightmap.spacing_m, heightmap.name)
    how = dict(heightmap.opened)
    how |= {"z_scale": factor * how["z_scale"], "z_offset_m": factor * how["z_offset_m"]}
    again = Heightmap.open(**how, progress=progress)
    again.name, again.spacing_m = heightmap.name, heightmap.spacing_m
    return again


def _raised(place: Vector, ratio: float) -> Vector:
    return place[0], place[1], ratio * place[2]
