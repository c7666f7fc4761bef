"""Loads maps while another map is shown: from a file, or the same map with another spacing or other heights."""

import os
from dataclasses import replace

import moderngl

from ..files.views import standard_view
from ..heightmap import Heightmap
from ..readers import Spacing
from ..renderer import Renderer
from .frame_budget import FrameBudget
from .loading import LoadJob, Opened, Opener, Progress, file_opener, scaled
from .scene import Scene
from .window_state import Size

ERROR_S = 10.0  # how long the window says why there is no map


class MapLoader:
    """Loads at most one map at a time."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, budget: FrameBudget) -> None:
        self._ctx = ctx
        self._scene = scene
        self._budget = budget
        self.job: LoadJob | None = None  # the load in progress
        self.fatal: Exception | None = None  # why no map can be shown at all
        self.refused = ""  # the file that was requested last, as long as it is not shown

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
        opened = replace(scene.opened, sun=scene.settings.options.sun, rest=None, camera_given=False)

        def opener(progress: Progress) -> Opened:
            return replace(opened, heightmap=Heightmap.open(**given, progress=progress))

        self.load(os.path.basename(how["path"]), opener)

    def rescale(self, spacing_m: Spacing | None = None, range_m: tuple[float, float] | None = None) -> None:
        """Begin to load the same posts with other distances between them, or another lowest and highest height."""
        scene = self._scene
        if scene.is_paged:
            scene.window.say(f"a store keeps its size and its heights: {scene.in_memory}", ERROR_S)
            return
        if not scene.has_map or scene.is_preview:
            return
        before = scene.heightmap
        opened = scene.opened
        low_m, high_m = before.range_m
        if (spacing_m or before.spacing_m, range_m or before.range_m) == (before.spacing_m, before.range_m):
            return

        def opener(progress: Progress) -> Opened:
            rescaled = before
            if range_m and high_m > low_m:
                factor = (range_m[1] - range_m[0]) / (high_m - low_m)
                rescaled = scaled(before, factor, progress, range_m[0] - factor * low_m)
            if spacing_m:
                rescaled = _spaced(rescaled, spacing_m)
            camera = scene.beside_panel(standard_view(rescaled))
            return replace(opened, heightmap=rescaled, camera=camera, camera_given=True)

        self.load(before.name, opener)

    def step(self) -> tuple[Renderer, Opened] | None:
        """Load for a while; returns a map to show now, or a preview of it. Raises an error if the first map fails."""
        job = self.job
        if not job:
            return None
        self._scene.window.refresh()
        if not self._scene.has_map:  # a preview comes first
            if shown := job.preview_step(self._ctx, self._small_size, self._budget):
                return shown
            if job.previews:
                return None
        job.step(self._ctx, self._small_size, self._budget)
        if job.error:
            self._fail(job.error)
        elif job.renderer and job.opened:
            self.job = None
            self.refused = ""
            return job.renderer, job.opened
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


def _spaced(heightmap: Heightmap, spacing_m: Spacing) -> Heightmap:
    spaced = Heightmap(heightmap.heights, spacing_m, heightmap.name)
    spaced.opened = heightmap.opened and heightmap.opened | {"spacing_m": spacing_m}
    for name in ("values", "scales", "georeference", "look", "of_earth"):
        setattr(spaced, name, getattr(heightmap, name))
    return spaced
