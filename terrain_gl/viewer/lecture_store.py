"""A small store of the map in memory, for the station of a lecture that is about stores; the map is kept for later."""

import tempfile
from dataclasses import replace
from pathlib import Path

from ..renderer import Renderer
from ..store import StoredMap, build, cache
from .loading import LoadJob, Opened, Opener, Progress
from .map_loader import MapLoader
from .scene import Scene
from .sculpting import Sculpting

TILE, SHARD = 64, 1024  # posts a side: small maps have many tiles, too


class LectureStore:
    """Builds the store in the background when it is wanted, and gives the map back when it is not."""

    def __init__(self, scene: Scene, loader: MapLoader, sculpting: Sculpting) -> None:
        self._scene = scene
        self._loader = loader
        self._sculpting = sculpting
        self.words = ""  # a sentence in place of those about the store, until it is shown
        self._asked: Opened | None = None  # the map whose store was asked for last
        self._job: LoadJob | None = None  # builds it
        self._made: Opened | None = None  # its store
        self._aside: tuple[Renderer, Opened] | None = None  # the map in memory, while its store is shown
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def step(self, is_wanted: bool) -> tuple[Renderer, Opened] | None:
        """Begin to build the store, or stop; returns the map in memory when it is to be shown again."""
        scene = self._scene
        if not is_wanted:
            if self._job and self._loader.job is self._job:
                self._loader.cancel()
            self._asked = self._job = None
            if self._aside and not self._sculpting.unsaved:
                back, self._aside = self._aside, None
                return back
        elif not (scene.is_paged or scene.is_preview or self._loader.job or self._asked is scene.opened):
            self._asked = scene.opened
            self._begin()
        return None

    def _begin(self) -> None:
        scene = self._scene
        self.words = "A store of the map is being made, in a temporary folder."
        if not cache.is_possible():
            self.words = "No store is shown, because the extra [store] is not installed."
        elif self._sculpting.unsaved:
            self.words = "No store is shown, because the sculpted land is not saved: undo it (Ctrl Z), and come back."
        else:
            self.remove()
            self._folder = tempfile.TemporaryDirectory(prefix="terrain-gl-", ignore_cleanup_errors=True)
            self._job = LoadJob(Path(scene.heightmap.name).name, self._opener(self._folder.name), "making a store of")
            self._loader.start(self._job)

    def _opener(self, folder: str) -> Opener:
        opened, land = self._scene.opened, self._scene.heightmap

        def store(progress: Progress) -> Opened:
            place = Path(folder) / "map.zarr"
            build(land.heights, place, land.spacing_m, progress=progress, tile=TILE, shard=SHARD)
            stored = StoredMap(place)
            for name in ("name", "look", "georeference", "of_earth", "values", "opened"):
                setattr(stored, name, getattr(land, name))
            stored.notes = ()
            self._made = replace(opened, heightmap=stored, rest=None, note="")
            return self._made

        return store

    def keeps(self, before: Renderer, was: Opened, opened: Opened) -> bool:
        """Whether the map that was shown before is kept, because its store takes its place."""
        if opened is not self._made:
            return False
        self._aside = before, was
        return True

    def remove(self) -> None:
        """Remove the store, and release the map that was kept: another map is shown."""
        if self._aside:
            self._aside[0].release()
        self._aside = self._made = None
        if self._folder:
            self._folder.cleanup()
        self._folder = None
