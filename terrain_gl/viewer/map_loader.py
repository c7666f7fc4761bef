"""Loads maps while another map is shown: from a file, or the same map with another spacing or other heights."""

import os
from collections.abc import Callable
from dataclasses import replace

import moderngl

from ..files.views import standard_view
from ..heightmap import Heightmap
from ..renderer import Renderer
from .frame_budget import FrameBudget
from .loading import LoadJob, Opened, Opener, file_opener, preview, scaled
from .scene import Scene
from .window_state import Size

Pair = tuple[float, float]
ERROR_S = 10.0  # how long the window says why there is no map


class MapLoader:
    """Loads at most one map at a time.

    Attributes
    ----------
    job
        The load in progress; None if there is none.
    fatal
        Why no map can be shown at all; None as long as there is a map or one is loading.
    refused
        The file that was requested last, as long as it is not shown.
    """

    def __init__(self, ctx: moderngl.Context, scene: Scene, budget: FrameBudget) -> None:
        self._ctx = ctx
        self._scene = scene
        self._budget = budget
        self.job: LoadJob | None = None
        self.fatal: Exception | None = None
        self.refused = ""

    def open(self, name: str) -> None:
        """Begin to load a bundled map, by its name, or a file."""
        self.refused = name
        self.load(os.path.basename(name), file_opener(name))

    def load(self, name: str, opener: Opener) -> None:
        """Begin to load a map; the present map stays until the new one is ready."""
        self.start(LoadJob(name, opener))

    def start(self, job: LoadJob) -> None:
        """Take over a map that is already being read."""
        self.cancel()
        self.job = job

    def cancel(self) -> None:
        """Stop loading."""
        if self.job:
            self.job.cancel()
            self.job = None
            self._scene.window.refresh()

    @property
    def can_cancel(self) -> bool:
        """Whether a map is loading, and another map remains if this stops."""
        return self.job is not None and self._scene.has_map and not self._scene.awaits_map

    def hold_in_memory(self) -> None:
        """Begin to load the raster itself into memory, in place of its store; the view stays."""
        scene = self._scene
        how = scene.raster_behind
        assert how
        given = {option: value for option, value in how.items() if value is not None}
        opened = replace(scene.opened, sun=scene.settings.options.sun, rest=None)

        def opener(progress: Callable[[float], None]) -> Opened:
            return replace(opened, heightmap=Heightmap.open(**given, progress=progress))

        self.load(os.path.basename(how["path"]), opener)

    def rescale(self, spacing_m: Pair | None = None, range_m: Pair | None = None) -> None:
        """Begin to load the same posts with other distances between them, or another lowest and highest height."""
        if not self._may_scale():
            return
        plain = self._scene.heightmap
        opened = self._scene.opened
        low_m, high_m = plain.range_m
        if (spacing_m or plain.spacing_m, range_m or plain.range_m) == (plain.spacing_m, plain.range_m):
            return

        def opener(progress: Callable[[float], None]) -> Opened:
            rescaled = plain
            if range_m and high_m > low_m:
                factor = (range_m[1] - range_m[0]) / (high_m - low_m)
                rescaled = scaled(plain, factor, progress, range_m[0] - factor * low_m)
            if spacing_m:
                rescaled = _spaced(rescaled, spacing_m)
            camera = self._scene.beside_panel(standard_view(rescaled))
            return replace(opened, heightmap=rescaled, camera=camera, camera_given=True)

        self.load(plain.name, opener)

    def _may_scale(self) -> bool:
        """Whether the map can be shown with another scale. For a store, a message says why not."""
        if self._scene.is_paged:
            self._scene.window.say(f"a store keeps its size and its heights: {self._scene.in_memory}", ERROR_S)
            return False
        return self._scene.has_map and not self._scene.is_preview

    def step(self) -> tuple[Renderer, Opened] | None:
        """Load for a while; returns a map to show now, or a preview of it.

        Raises
        ------
        TerrainError
            The first map cannot be shown.
        """
        job = self.job
        if not job:
            return None
        job.step(self._ctx, self._small_size, self._budget)
        self._scene.window.refresh()
        if job.error:
            self._fail(job.error)
        elif job.renderer and job.opened:
            self.job = None
            self.refused = ""
            return job.take(), job.opened
        elif not self._scene.has_map and job.sample:
            return Renderer(job.sample.heightmap, self._small_size, ctx=self._ctx), job.sample
        elif not self._scene.has_map and job.opened and (few := preview(job.opened.heightmap)):
            return Renderer(few, self._small_size, ctx=self._ctx), job.opened
        return None

    def _fail(self, error: Exception) -> None:
        self.job = None
        if not self._scene.has_map or self._scene.awaits_map:
            self.fatal = error
            raise error
        self._scene.window.say(str(error) or "not enough memory", ERROR_S)

    @property
    def _small_size(self) -> Size:
        """A picture size that any GPU can draw. The first frame then takes the size of the window."""
        width, height = self._scene.window.size
        return max(1, width // 4), max(1, height // 4)


def _spaced(heightmap: Heightmap, spacing_m: Pair) -> Heightmap:
    """The same posts with other distances between them."""
    spaced = Heightmap(heightmap.heights, spacing_m, heightmap.name)
    spaced.opened = heightmap.opened and heightmap.opened | {"spacing_m": spacing_m}
    spaced.scales = heightmap.scales
    spaced.georeference = heightmap.georeference
    spaced.look = heightmap.look
    spaced.of_earth = heightmap.of_earth
    return spaced
