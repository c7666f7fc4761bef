"""Light of a paged map: the sun's horizon and the visible sky of each page, made page by page from its windows.

A thread reads the windows around a page (`pages.windows`). Then the GPU sweeps them in 16 azimuths and towards the sun
(glsl/horizon/around.comp), and keeps the results in the page's slot. A page gets its light once. If the sun moves to
another azimuth, only the horizon for the sun is computed again. A page without light is drawn with the light of a
coarser page.

A picture that waits makes the light of all pages that it uses. A flight makes some of it in each frame: first the pages
that are large in the picture.
"""

import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, cast

import numpy as np

from ..basics.rect import Rect
from ..basics.steps import Steps, drain
from ..camera import Vector
from ..gpu import gl, layout
from ..gpu.passes import Resources
from ..light.gaussians import SKY_AXES
from ..light.ground import HeightSums, SumsTable
from ..light.horizon import FULL, SUN_RADIUS, Visibility, lattice_direction, sun_uniforms
from ..light.lighting import Lighting, sky_seen
from ..light.moments import Direction
from ..light.sky import SHAPE, Sky
from .map import PageKey
from .sweep import PageSweep
from .terrain import PagedTerrain
from .windows import BORDER, PageWindows, flat_windows, holds, most_windows, side_of, sky_side, windows_of

THREADS = 4
OF_WINDOWS = 0.05  # share of `memory_bytes` for windows around pages
GROUP = 16  # most pages that get light in one frame of a flight
LIGHT_S = 0.004  # least seconds for light in a frame of a flight,
LIGHTS = 0.2  # or this share of the time since the last frame,
LONGEST_S = 1.0  # which counts as at most this
WAIT_S = 0.05
PATIENCE_S = 30.0  # windows without an answer for this long are not waited for


class PageVisibility:
    """Takes the place of `Visibility` for a paged map."""

    def __init__(self, terrain: PagedTerrain) -> None:
        self.terrain = terrain
        self.sweep: PageSweep | None = None
        self._at: tuple[Vector, float] | None = None
        self._sun_of: dict[PageKey, Direction] = {}
        self._threads = ThreadPoolExecutor(THREADS, "windows")
        self._reading: dict[PageKey, tuple[Future[PageWindows], float]] = {}
        self._failed: set[PageKey] = set()
        self._stale: set[PageKey] = set()  # pages whose light is that of the map before an edit
        self._making: tuple[PageKey, int, Iterator[float]] | None = None
        self._is_rehearsed = False
        self.is_idle = False  # whether the last step could do nothing, because it waits for a disk

    @property
    def bytes(self) -> int:
        """GPU memory of light."""
        return self.sweep.bytes if self.sweep else 0

    @property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include horizon/visible.glsl."""
        side = sky_side(self.terrain.heightmap.tile)
        texel = 2 * layout.SKY_TEXEL  # posts of the page
        return {"LOBES": len(SKY_AXES), "TEXEL": texel, "FULL": f"{FULL}.0", "SKY_SIDE": side, "SKY_BORDER": BORDER}

    @property
    def is_there(self) -> bool:
        """Whether every place has light: its own, or at least that of a page of the coarsest level."""
        return self._at is not None and all(map(self.terrain.is_lit, self.terrain.roots))

    def follow_steps(self, sun: Vector, radius: float = SUN_RADIUS, posts: int = 0) -> Steps[None]:
        """Make the light of the pages in use for this sun. If pictures do not wait: of at most about `GROUP` pages."""
        self._at = sun, radius
        self.sweep = self.sweep or PageSweep(self.terrain)
        left = self._left()
        first = len(left)
        try:
            while left:
                self.is_idle = not self._step(left)
                yield 1 - len(left) / first
                if self._making is None:
                    left = self._left()
                if not self.terrain.waits and first - len(left) >= GROUP:
                    break
        finally:
            self.terrain.send()

    def rehearse(self) -> bool:
        """Run all passes once for flat land, so that drivers compile them before a flight needs them.

        The result goes into a root's slot, which gets its real light later.
        """
        if self._is_rehearsed or self.terrain.waits:
            return False
        self._is_rehearsed = True  # if the light of a page was begun, it begins anew
        self._making = None
        self._at = self._at or ((0.0, 0.0, 1.0), SUN_RADIUS)
        self.sweep = self.sweep or PageSweep(self.terrain)
        slot = self.terrain.slot_of[self.terrain.roots[0]]
        self.sweep.send(flat_windows(self.terrain.heightmap), 0)
        drain(self.sweep.sun_steps(slot, (1.0, 0.0)))
        drain(self.sweep.sky_steps(slot))
        return True

    @property
    def missing(self) -> int:
        """Number of pages of the present view that have no light of their own."""
        return sum(not self._has_light(key) for key in self.terrain.in_use())

    @property
    def is_coming(self) -> bool:
        """Whether missing light can still be made."""
        return bool(self._left())

    @property
    def uniforms(self) -> dict[str, float]:
        """Uniforms of horizon/visible.glsl."""
        assert self._at
        return sun_uniforms(*self._at)

    @property
    def resources(self) -> Resources:
        """The light, for shaders that include horizon/visible.glsl."""
        return {"u_sun_horizon": self.sweep.sun, "u_packed": self.sweep.sky} if self.sweep else {}

    def update(self, posts: Rect) -> None:
        """Follow an edit: pages whose windows hold edited posts get new light, and until then keep their old light."""
        heightmap = self.terrain.heightmap
        making = self._making[0] if self._making else None
        for key in {*self.terrain.slot_of, *self._reading, *([making] if making else ())}:
            if holds(heightmap, key, posts):
                self._stale.add(key)
                if key in self._reading:
                    self._reading.pop(key)[0].cancel()
                if key == making:
                    self._making = None

    def release(self) -> None:
        """Release GPU resources, and end the threads."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        if self.sweep:
            self.sweep.release()

    @property
    def _towards(self) -> Direction:
        assert self._at
        return lattice_direction(self._at[0], self.terrain.heightmap.spacing_m)

    def _left(self) -> list[PageKey]:
        """Pages in use that have no light yet, the most wanted first."""
        return [key for key in self.terrain.in_use() if key not in self._failed and not self._has_light(key)]

    def _has_light(self, key: PageKey) -> bool:
        is_lit = self._at is not None and key not in self._stale and self.terrain.is_lit(key)
        return is_lit and self._sun_of.get(key) == self._towards

    def _step(self, left: list[PageKey]) -> bool:
        """Do one step of the light of a page whose windows have been read; returns whether there is such a page."""
        if self._making is None or self.terrain.slot_of.get(self._making[0]) != self._making[1]:
            self._making = self._begin(left)
        if self._making is None:
            return False
        key, _, steps = self._making
        if next(steps, None) is None:
            self._making = None
            self._stale.discard(key)
            if not self.terrain.is_lit(key):
                self.terrain.light(key)
        return True

    def _begin(self, left: list[PageKey]) -> tuple[PageKey, int, Iterator[float]] | None:
        """Begin the light of the most wanted page whose windows have been read. If there is none yet, wait a moment."""
        coming = self._ask(left)
        wait([self._reading[key][0] for key in coming], WAIT_S if self.terrain.waits else 0.002, FIRST_COMPLETED)
        done = next((key for key in coming if self._reading[key][0].done()), None)
        late_s = time.perf_counter() - PATIENCE_S
        if done is None:
            self._failed.update(key for key in coming if self._reading[key][1] < late_s)
            return None
        try:
            windows = self._reading.pop(done)[0].result()
        except Exception:  # a disk may fail in any way: the light of a coarser page remains
            self._failed.add(done)
            return None
        slot = self.terrain.slot_of[done]
        return done, slot, self._light_steps(done, slot, windows)

    def _ask(self, left: list[PageKey]) -> list[PageKey]:
        """Let threads read the windows of the first pages of `left`, as many as memory allows; returns these pages."""
        heightmap = self.terrain.heightmap
        bytes_of_page = 4 * (side_of(heightmap.tile) + 1) ** 2 * most_windows(heightmap)
        most = max(1, int(OF_WINDOWS * heightmap.memory_bytes) // bytes_of_page)
        coming = left[:most]
        for key in [key for key in self._reading if key not in coming]:
            self._reading.pop(key)[0].cancel()
        for key in coming:
            if key not in self._reading:
                read = self._threads.submit(windows_of, heightmap, key)
                self._reading[key] = read, time.perf_counter()
        return coming

    def _light_steps(self, key: PageKey, slot: int, windows: PageWindows) -> Iterator[float]:
        assert self.sweep
        towards = self._towards
        is_new = key in self._stale or not self.terrain.is_lit(key)
        self.sweep.send(windows, key[0])
        yield from self.sweep.sun_steps(slot, towards)
        self._sun_of[key] = towards
        if is_new:
            self.sweep.send(windows.coarser(), key[0] + 1)
            yield from self.sweep.sky_steps(slot)


class SumsOfPages:
    """Takes the place of `HeightSums`: the sums of heights belong to the pages."""

    bytes = 0

    def __init__(self, terrain: PagedTerrain) -> None:
        self._terrain = terrain
        self._texture = gl.WordTexture(terrain.ctx)

    @property
    def resources(self) -> Resources:
        """What shaders read of the sums: glsl/shade/posts.glsl."""
        sums = self._terrain.height_sums
        return {"HeightSums": sums, "u_height_sums": self._texture.of(sums)}

    def update(self, posts: Rect) -> None:
        """Follow an edit. There is nothing to do: the pages have new sums already."""

    def table_over(self, col: int, row: int) -> SumsTable:
        """The table of the finest loaded page over a post."""
        terrain = self._terrain
        heightmap, side = terrain.heightmap, terrain.heightmap.tile
        rows, cols = heightmap.pages(0)
        fine = min(row // side, rows - 1), min(col // side, cols - 1)
        level = int(terrain.levels[fine])
        key = level, fine[0] >> level, fine[1] >> level
        down, across = (min(side, n - side * at) + 1 for n, at in zip(heightmap.nodes(level), key[1:], strict=True))
        first = (side + 1) ** 2 * terrain.slot_of[key]
        corner = key[2] * side << level, key[1] * side << level
        return SumsTable(terrain.height_sums, first, (across, down), side + 1, corner, level)

    def release(self) -> None:
        """Release GPU resources."""
        self._texture.release()


def light_of(terrain: Any) -> tuple[HeightSums, Lighting]:
    """The sums of heights and the light of a map."""
    if terrain.streams:
        paged = cast(HeightSums, SumsOfPages(terrain))
        return paged, PagedLighting(terrain, paged)
    sums = HeightSums(terrain)
    return sums, Lighting(terrain, sums)


class PagedLighting(Lighting):
    """Takes the place of `Lighting` for a paged map: no tables of lobes, and the visibility of pages."""

    has_lobes = False

    def __init__(self, terrain: PagedTerrain, sums: HeightSums) -> None:
        self._thread = ThreadPoolExecutor(1, "sky")
        self._coming: tuple[object, Future[Sky]] | None = None
        self._is_late = False  # whether the last picture used an earlier sky, or none
        self._flown_s = time.perf_counter()
        super().__init__(cast(Any, terrain), sums)
        words = terrain.height_sums.size // 4
        self._words = {"WORDS_IN_TEXTURES": 1} if words <= gl.limits(self.ctx)["texture_buffer_texels"] else {}

    @property
    def missing(self) -> int:  # type: ignore[override]
        """Number of pages of the present view that have no light of their own from the requested sky."""
        return len(self._terrain.in_use()) if self._is_late else self._pages.missing

    @property
    def is_coming(self) -> bool:  # type: ignore[override]
        """Whether missing light can still be made."""
        return self._is_late or self._pages.is_coming

    def _run(self, steps: Steps[None]) -> None:
        """Make the missing light. If pictures do not wait: only as much as the time for light in a frame allows."""
        now_s = time.perf_counter()
        end_s = now_s + max(LIGHT_S, LIGHTS * min(now_s - self._flown_s, LONGEST_S))
        for _ in steps:
            if not self._terrain.waits:
                self.ctx.finish()
                if self._pages.is_idle or time.perf_counter() > end_s:
                    break
        steps.close()
        self._flown_s = time.perf_counter()

    def rehearse(self) -> bool:
        """Run all passes once for flat land, under a black sky if there is none yet; returns whether they ran."""
        if not self._pages.rehearse():
            return False
        if not self.dome:
            self._hang(np.zeros((*SHAPE, 3)))
        return True

    @property
    def _pages(self) -> PageVisibility:
        return cast(PageVisibility, self.visibility)

    @property
    def _terrain(self) -> PagedTerrain:
        return cast(PagedTerrain, self.terrain)

    def release(self) -> None:
        """Release GPU resources, and end the thread."""
        self._thread.shutdown(wait=False, cancel_futures=True)
        super().release()

    def _visibility(self) -> Visibility:
        return cast(Visibility, PageVisibility(self._terrain))

    def _sky_of(self, sun: tuple[float, float], path: str | None) -> Sky | None:
        """The sky. A flight does not wait for it: until it is ready, the last sky is used."""
        self._is_late = False
        if self._terrain.waits:
            return super()._sky_of(sun, path)
        asked = sun, path
        if self._coming is None or self._coming[0] != asked:
            self._coming = asked, self._thread.submit(_fitted_sky, sun, path, self.has_air, self.north_deg)
        self._is_late = not self._coming[1].done()
        return self.sky if self._is_late else self._coming[1].result()


def _fitted_sky(*asked: Any) -> Sky:
    """A sky with its lobes, which are otherwise fitted when the first picture needs them."""
    sky = sky_seen(*asked)
    _ = sky.lights
    return sky
