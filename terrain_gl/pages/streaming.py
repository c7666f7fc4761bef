"""Load the pages that a view needs: choose a mesh, then load finer pages under patches whose bound is over tolerance.

If a picture waits, its mesh is chosen again until no patch needs another page. A flight never waits: pages arrive while
it goes on, first pages of the present view, then pages of the view a second ahead. The certificate holds at any time:
where a page is missing, the records of a coarser page bound the error.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.steps import Steps
from ..camera import Camera
from ..lod import Goal, Selection
from .edited_map import EditedMap
from .loader import Loader
from .map import PageKey, above, called
from .rebuilding import Rebuilder
from .terrain import PagedTables
from .wanted import DrawnPatches

AHEAD_S = 1.0  # a flight also loads pages of the view that it will reach after these seconds
LONGEST_S = 1.0  # longest time between two frames of one motion
UPLOAD_S = 0.004  # least seconds for copying pages to the GPU in a frame of a flight,
UPLOADS = 0.2  # or this share of the time since the last frame, at most of `LONGEST_S`
WAIT_S = 0.05
NO_ROOM = "no room (--gpu-memory)"
LOADING = "loading"

Choose = Callable[[Camera], Selection]


class Streaming:
    """Loads pages for the views of one map."""

    def __init__(self, tables: PagedTables) -> None:
        self._tables = tables
        self.terrain = tables.terrain
        self.loader = Loader(self.terrain.heightmap)
        # Whether a view that waits starts from the coarsest pages. Then its picture does not depend on earlier views.
        # Otherwise finer pages of earlier views stay, and normals are computed from these pages.
        self.is_repeatable = False
        self.progress: Callable[[float], None] | None = None  # gets the loaded share, 0 to 1, while `select` waits
        self.clock: Callable[[], float] = time.monotonic  # tells the time of a frame in seconds
        self._rebuilder = Rebuilder()
        self._holds_back = False  # rebuilding waits, because more edits follow at once
        self._motion = Motion()
        self._recent: deque[list[PageKey]] = deque()  # pages that each of the present views lacks
        self._later: list[PageKey] = []  # pages that the view ahead needed when it was last computed
        self._is_complete = False
        self._flown_s = time.perf_counter()

    @property
    def waits(self) -> bool:
        """Whether `select` waits until all pages that can be loaded are loaded. If not, call it for each frame."""
        return self.terrain.waits

    @waits.setter
    def waits(self, waits: bool) -> None:
        self.terrain.waits = waits

    @property
    def has_news(self) -> bool:
        """Whether the next frame would differ from the last one: a missing page was read, or new records are ready."""
        came = any(key in self.terrain.slot_of for lacked in self._recent for key in lacked)  # for another view
        return self._rebuilder.has_ready or came or (not self._is_complete and self.loader.has_ready)

    @property
    def is_loading(self) -> bool:
        """Whether pages that the last view needs are still being loaded."""
        return not self._is_complete and self.loader.is_busy

    def select(self, choose: Choose, camera: Camera, goal: Goal) -> tuple[Selection, dict[str, Any]]:
        """Choose the mesh of a view; returns it, and numbers about its tiles: docs/stats.md."""
        self.terrain.eye_m = camera.eye
        return (self._wait if self.waits else self._fly)(choose, camera, goal)

    def release(self) -> None:
        """End the threads."""
        self.loader.release()
        self._rebuilder.release()

    # --- Edits --------------------------------------------------------------------------------------------------------

    def follow(self, more_follow: bool = False) -> None:
        """Follow an edit: drop what threads have read of pages that it changed. `more_follow`: more edits come soon."""
        self._holds_back = more_follow
        self.loader.follow(self.terrain.heightmap)
        self._rebuilder.failed = ""

    @property
    def _edited(self) -> EditedMap | None:
        heightmap = self.terrain.heightmap
        return heightmap if isinstance(heightmap, EditedMap) else None

    @property
    def is_rebuilding(self) -> bool:
        """Whether records of edited nodes are being computed anew."""
        return self._rebuilder.is_busy

    @property
    def is_wide(self) -> bool:
        """Whether any bounds of the map are wide: `rebuild_steps` would make them smaller."""
        return self._edited is not None and bool(self._edited.wide)

    def rebuild_steps(self) -> Steps[None]:
        """Compute the records of edited nodes anew, in a thread; yields progress from 0 to 1. Then bounds are exact.

        If that fails, a `TerrainError` says why. The bounds then stay wide, but they still hold.
        """
        edited = self._edited
        first = 0
        while edited and edited.wide:
            first = max(first, len(edited.wide))
            self._rebuilder.want(edited)
            self._rebuilder.wait(WAIT_S)
            self._take_rebuilt(edited)
            if self._rebuilder.failed:
                raise TerrainError(f"{edited.name}: its bounds stay wide: {self._rebuilder.failed}")
            yield 1 - len(edited.wide) / first

    def _take_rebuilt(self, edited: EditedMap) -> None:
        """Store finished records in the map, and replace the pages that hold them."""
        if keys := self._rebuilder.take(edited):
            self._tables.renew(keys)
            self.loader.follow(edited)

    def _rebuild(self) -> None:
        """Compute records in the background while a flight goes on."""
        if edited := self._edited:
            self._take_rebuilt(edited)
            if not self._holds_back and not self._rebuilder.failed:
                self._rebuilder.want(edited)

    # --- A picture that waits -----------------------------------------------------------------------------------------

    def _wait(self, choose: Choose, camera: Camera, goal: Goal) -> tuple[Selection, dict[str, Any]]:
        terrain = self.terrain
        loaded = 0
        terrain.begin()
        (terrain.hide if self.is_repeatable else terrain.show_all)()
        terrain.send()
        while True:
            selection = choose(camera)
            patches, wanted = self._used(selection, camera, goal)
            missing = self._with_those_above(wanted)
            batch = missing[: terrain.make_room(len(missing))]
            if not batch:
                self._is_complete = not wanted
                return selection, self._told(patches, goal, wanted)
            self._load(batch, loaded)
            loaded += len(batch)

    def _load(self, batch: list[PageKey], loaded: int) -> None:
        """Load these pages, coarse ones first, and wait until each is loaded or has failed."""
        self.terrain.show(batch)
        self.loader.want([key for key in batch if key not in self.terrain.slot_of])
        left = set(batch) - self.terrain.slot_of.keys()
        while left:
            self.loader.wait(WAIT_S)
            self._place_ready()
            left = {key for key in left - self.terrain.slot_of.keys() if not self._has_failed(key)}
            if self.progress:
                self.progress(1 - len(left) / (loaded + len(batch)))
        self.loader.want(())
        self.terrain.send()

    # --- A flight that never waits ------------------------------------------------------------------------------------

    def _fly(self, choose: Choose, camera: Camera, goal: Goal) -> tuple[Selection, dict[str, Any]]:
        terrain = self.terrain
        now_s = time.perf_counter()
        terrain.show_all()
        self._rebuild()
        self._place_ready(max(UPLOAD_S, UPLOADS * min(now_s - self._flown_s, LONGEST_S)))
        self._flown_s = now_s
        terrain.send()
        terrain.begin()
        ahead = self._motion.ahead(camera, self.clock())
        if ahead is None:
            self._later = []
        elif self._is_complete:  # the mesh of the present view is chosen last, because it is the one that is drawn
            _, self._later = self._used(choose(ahead), ahead, goal)
        later = self._with_those_above(key for key in self._later if key not in terrain.slot_of)
        selection = choose(camera)
        patches, wanted = self._used(selection, camera, goal)
        self._recent = deque([*self._recent, wanted], maxlen=terrain.views)
        lacking = [key for each in reversed(self._recent) for key in each if key not in terrain.slot_of]
        room = terrain.free + len(terrain.spare())
        now = list(dict.fromkeys([*self._with_those_above(lacking), *later]))[:room]
        self.loader.want(now)
        self._is_complete = not any(self._recent)
        return selection, self._told(patches, goal, wanted, set(now))

    # --- Both ---------------------------------------------------------------------------------------------------------

    def _place_ready(self, seconds: float = math.inf) -> None:
        """For so many seconds, put loaded pages into the pool. A page waits until the page above it is there."""
        end = time.perf_counter() + seconds
        terrain = self.terrain
        for key, sums in self.loader.take():
            if key in terrain.slot_of:
                continue
            is_early = above(key) not in terrain.slot_of
            if is_early or time.perf_counter() > end or not terrain.make_room(1):
                self.loader.put_back(key, sums, is_news=not is_early and terrain.free > 0)
                continue
            self._tables.put(key, sums)

    def _used(self, selection: Selection, camera: Camera, goal: Goal) -> tuple[DrawnPatches, list[PageKey]]:
        """Mark the pages of a selection's patches as used; returns the patches, and the pages that they need.

        The most useful page comes first.
        """
        patches = DrawnPatches(self.terrain, selection, camera)
        patches.use()
        return patches, [self.terrain.numbering.key(number) for number in patches.wanted(goal)[0].tolist()]

    def _with_those_above(self, wanted: Iterable[PageKey]) -> list[PageKey]:
        """The wanted pages that can be loaded. Before each page come the missing pages above it."""
        found: dict[PageKey, None] = {}
        for key in wanted:
            if self._has_failed(key):
                continue
            chain = [key]
            while (coarser := above(chain[-1])) not in self.terrain.slot_of:
                chain.append(coarser)
            self.terrain.hold(coarser)
            found.update(dict.fromkeys(reversed(chain)))
        return list(found)

    def _has_failed(self, key: PageKey) -> str:
        """Why a page, or one above it, cannot be read; "" if no error is known."""
        while key not in self.terrain.slot_of:
            if key in self.loader.failed:
                return self.loader.failed[key]
            key = above(key)
        return ""

    def _told(
        self, patches: DrawnPatches, goal: Goal, wanted: list[PageKey], coming: Set[PageKey] = frozenset()
    ) -> dict[str, Any]:
        reasons = [self._has_failed(key) or (LOADING if key in coming else NO_ROOM) for key in wanted]
        return {
            "complete": not wanted,
            "within_tolerance": patches.within(goal) if wanted else 1.0,
            "tiles_resident": len(self.terrain.slot_of),
            "tiles_wide": sum(map(self._edited.is_wide, self.terrain.in_use())) if self._edited else 0,
            "tiles_missing": [{"tile": called(key), "reason": why} for key, why in zip(wanted, reasons, strict=True)],
        }


@dataclass
class Motion:
    """The camera's motion over the last two frames."""

    camera: Camera | None = None
    at_s: float = 0.0

    def ahead(self, camera: Camera, now_s: float) -> Camera | None:
        """The view `AHEAD_S` from now, if the camera continues its motion; None if it does not move."""
        before = self.camera
        since_s = now_s - self.at_s
        self.camera = camera
        self.at_s = now_s
        if before is None or before == camera or not 0 < since_s < LONGEST_S:
            return None
        times = AHEAD_S / since_s
        eye = np.asarray(camera.eye)
        look = _unit(camera.target - eye)
        turned = look + np.clip(times * (look - _unit(np.subtract(before.target, before.eye))), -1, 1)
        eye = eye + times * (eye - before.eye)
        return replace(camera, eye=tuple(eye.tolist()), target=tuple((eye + turned).tolist()), up=None)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
