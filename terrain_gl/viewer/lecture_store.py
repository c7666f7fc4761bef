"""A small store of the map in memory, for the station of a lecture that is about stores; the map is kept for later.

The store is made at the station before, while the picture is at rest.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

from ..renderer import Renderer
from ..store import StoredMap, build, cache
from .frame_budget import FrameBudget
from .loading import LoadJob, Opened, Opener, Progress
from .map_loader import MapLoader
from .scene import Scene
from .sculpting import Sculpting

TILE, SHARD = 64, 1024  # posts a side: small maps have many tiles, too


class LectureStore:
    """Builds the store in the background when it is wanted, and gives the map back when it is not."""

    def __init__(self, scene: Scene, loader: MapLoader, sculpting: Sculpting, budget: FrameBudget) -> None:
        self._budget = budget
        self._scene = scene
        self._loader = loader
        self._sculpting = sculpting
        self.words = ""  # a sentence in place of those about the store, until it is shown
        self._asked: Opened | None = None  # the map whose store was asked for last
        self._job: LoadJob | None = None  # builds it, and its renderer
        self._is_ahead = False  # whether the job is not wanted yet, and its renderer is ours
        self._aside: tuple[Renderer, Opened] | None = None  # the map in memory, while its store is shown
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    @property
    def at_work(self) -> bool:
        """Whether the store is being made ahead."""
        return self._is_ahead and self._job is not None and not (self._job.renderer or self._job.error)

    @property
    def builds(self) -> bool:
        """Whether its tables are being built ahead, in steps."""
        return self.at_work and self._job is not None and self._job.opened is not None

    def step(self, is_wanted: bool, is_next: bool = False, has_time: bool = True) -> tuple[Renderer, Opened] | None:
        """Begin to build the store, or stop; returns the map in memory when it is to be shown again.

        `is_next` says that the next station wants the store; it is built ahead while there is time.
        """
        scene = self._scene
        if not is_wanted:
            if self._job and self._loader.job is self._job:
                self._loader.cancel()
                self._job = None
            self._asked = None
            if self._aside and not self._sculpting.unsaved:
                back, self._aside = self._aside, None
                return back
            self._go_ahead(is_next, has_time)
        elif not (scene.is_paged or scene.is_preview or self._loader.job or self._asked is scene.opened):
            self._asked = scene.opened
            self._begin()
        return None

    def _go_ahead(self, is_next: bool, has_time: bool) -> None:
        """Make the store before it is wanted; or drop it, because it is not, or because the land was sculpted."""
        scene = self._scene
        if scene.is_paged or scene.is_preview or self._loader.job or not cache.is_possible():
            return
        if not is_next or self._sculpting.unsaved:
            self.drop()
        elif has_time and not self._is_ahead:
            self._job, self._is_ahead = self._new_job(), True
        elif has_time and self._job:
            self._job.step(scene.renderer.ctx, scene.window.size, self._budget)

    def drop(self) -> None:
        """Drop a store that was made ahead."""
        if self._is_ahead and self._job:
            self._job.cancel()
            self._job, self._is_ahead = None, False

    def _begin(self) -> None:
        self.words = "A store of the map is being made, in a temporary folder."
        if not cache.is_possible():
            self.words = "No store is shown, because the extra [store] is not installed."
        elif self._sculpting.unsaved:
            self.words = "No store is shown, because the sculpted land is not saved: undo it (Ctrl Z), and come back."
        else:
            self._job = self._job if self._is_ahead and self._job else self._new_job()
            self._is_ahead = False
            self._loader.start(self._job)

    def _new_job(self) -> LoadJob:
        self.remove()
        self._folder = tempfile.TemporaryDirectory(prefix="terrain-gl-", ignore_cleanup_errors=True)
        name = Path(self._scene.heightmap.name).name
        return LoadJob(name, self._opener(self._folder.name), "making a store of")

    def _opener(self, folder: str) -> Opener:
        opened, land = self._scene.opened, self._scene.heightmap

        def store(progress: Progress) -> Opened:
            place = Path(folder) / "map.zarr"
            build(land.heights, place, land.spacing_m, progress=progress, tile=TILE, shard=SHARD)
            stored = StoredMap(place)
            for name in ("name", "look", "georeference", "of_earth", "values", "opened"):
                setattr(stored, name, getattr(land, name))
            stored.notes = ()
            return replace(opened, heightmap=stored, rest=None, note="")

        return store

    def keeps(self, before: Renderer, was: Opened, opened: Opened) -> bool:
        """Whether the map that was shown before is kept, because its store takes its place."""
        if self._job is None or opened is not self._job.opened:
            return False
        self._aside = before, was
        return True

    def remove(self) -> None:
        """Remove the store, and release the map that was kept: another map is shown."""
        self.drop()
        if self._aside:
            self._aside[0].release()
        self._aside = None
        if self._folder:
            self._folder.cleanup()
        self._folder = None
