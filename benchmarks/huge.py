"""A map of 200,000 × 90,000 posts that no file holds: opened, flown over and measured in little memory.

    python benchmarks/huge.py [FRAMES [WIDTHxHEIGHT]]       100 frames, 640x360

The land is a formula (`Land`). It answers any window at any stride exactly. A page is computed when it is read: its
heights, and a proven bound of the error of each node.

The table has: how long opening and a first picture take; a flight that waits for its pages, and one that does not; two
views, measured; the most memory of the process so far (ru_maxrss of getrusage, which includes the driver), and of
textures and buffers on the GPU, after each. With Mesa's software renderer the latter are part of the former.

    python benchmarks/huge.py choosing [ROUNDS]

Compares what choosing a mesh costs: the same land and the same views, on maps of 4,096² posts and of 200,000 × 90,000.
The smaller map is a part of the larger one. Its rims are not in the first three pictures; the fourth shows the land
up to the horizon, which is further away on the larger map. Times are the median of 40 rounds, in which both maps take
turns: processor time of all threads. Pages are loaded before.
"""

from __future__ import annotations

import resource
import sys
import time
from typing import Any

import numpy as np
from table import head, row

import terrain_gl as tg
from terrain_gl.gpu.packing import ERROR_UNIT
from terrain_gl.pages.map import Page, PagedMap, PageKey, PostsOnDemand
from terrain_gl.terrain import quantisation_range

ROWS, COLS, SPACING_M = 90_000, 200_000, 30.0
WAVES = 11
ALONG = np.pi * (3 - 5**0.5)  # angle between the directions of two waves that follow each other
PART = 4096
VIEWS = {  # metres of the eye above the ground, and metres ahead to the place that the eye looks at
    "from 1 km": (1e3, 2e3),
    "from 5 km": (5e3, 8e3),
    "from 30 km": (30e3, 1.0),
    "to the horizon": (2e3, 6e4),
}
GPU_BYTES, MEMORY_BYTES = 384 << 20, 256 << 20


class Land(PostsOnDemand):
    """The sum of waves, each with an amplitude that changes from place to place.

        h(p) = Σ a_k · (1 + sin(v_k · p + ψ_k)) / 2 · sin(u_k · p + φ_k)        p in posts

    Attributes
    ----------
    first
        Row and column of its first post in the endless land.
    """

    def __init__(self, shape: tuple[int, int], first: tuple[int, int] = (0, 0)) -> None:
        self.shape, self.first = shape, first
        k = np.arange(WAVES)
        length = 20_000.0 * 0.5**k  # posts: 20,000 to 20
        self.heights_m = 1500.0 * 0.62**k  # most of each wave
        waves = _vectors(2 * np.pi / length, ALONG * k)
        swells = _vectors(2 * np.pi / (5.3 * length), ALONG * (k + 0.5))
        phases = 2.4 * k**2 % (2 * np.pi), 1.7 * k**2 % (2 * np.pi)
        self._parts = list(zip(self.heights_m, waves, swells, *phases, strict=True))

    @property
    def most_m(self) -> float:
        """No height is above this, or below its negative."""
        return float(self.heights_m.sum())

    def __getitem__(self, index: tuple[slice, slice]) -> np.ndarray:
        """Posts at (rows, columns): slices with any stride, numbers, or arrays of numbers; (rows, columns) float32."""
        rows, cols = (
            np.arange(*each.indices(n)) if isinstance(each, slice) else np.asarray(each)
            for each, n in zip(index, self.shape, strict=True)
        )
        found = self.at(rows[:, None] if isinstance(index[0], slice) else rows, cols)
        return found if found.ndim else found[()]

    def at(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """Heights of posts, float32 metres; rows and columns are broadcast."""
        x, y = cols + float(self.first[1]), rows + float(self.first[0])
        waves = [a * _share(v, psi, x, y) * _sine(u, phi, x, y) for a, u, v, phi, psi in self._parts]
        return np.sum(waves, 0).astype(np.float32)

    def _middles(self, n: int, rows: np.ndarray, cols: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The middles of cells of n posts."""
        return cols + 0.5 * n + self.first[1], (rows + 0.5 * n + self.first[0])[:, None]

    def error_m(self, level: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """A bound of the error of each cell of n = 2^level posts from these rows (r,) and columns (c,) on; (r, c).

        A point p of a triangle inside the cell is the mean of its corners q, weighted by w. Taylor at p gives
            |h(p) − Σ w h(q)| = |½ Σ w (q − p)ᵀ H (q − p)| ≤ ½ |H| Σ w |q − p|² ≤ n²/4 |H|,
        because Σ w |q − p|² is least for the mean, and |q − c|² ≤ n²/2 with the cell's middle c. The truth is bilinear
        between posts, as are corners on edges: both differ from h by at most |H|/4. And no error of a wave is more
        than twice its amplitude. With the share s = (1 + sin(v · p + ψ)) / 2 of the amplitude a,
            |H of a s sin| ≤ a (s |u|² + 2 |∇s| |u| + |H of s|)
        and s ≤ s(c) + |∇s| n/√2 in the cell, |∇s| ≤ |v|/2, |H of s| ≤ |v|²/2.
        """
        n = 1 << level
        x, y = self._middles(n, rows, cols)
        bound_m = np.full((len(rows), len(cols)), 1e-3)  # float32
        for a, u, v, _, psi in self._parts:
            long, slow = np.hypot(*u), np.hypot(*v)
            share = np.minimum(_share(v, psi, x, y) + 0.5 * slow * n / 2**0.5, 1.0)
            bend = share * long**2 + slow * long + 0.5 * slow**2
            bound_m += a * np.minimum(0.25 * (n * n + 2) * bend, 2 * share)
        return bound_m

    def range_m(self, level: int, rows: np.ndarray, cols: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the heights in each cell of `error_m`.

        A wave is at most its amplitude, and not far from its value in the cell's middle.
        """
        n = 1 << level
        x, y = self._middles(n, rows, cols)
        low, high = np.full((2, len(rows), len(cols)), 1e-3) * [[[-1]], [[1]]]
        for a, u, v, phi, psi in self._parts:
            reach, slow = n / 2**0.5 * np.hypot(*u), 0.5 * n / 2**0.5 * np.hypot(*v)
            share = _share(v, psi, x, y)
            most, middle = np.minimum(share + slow, 1.0), share * _sine(u, phi, x, y)
            low += a * np.maximum(middle - reach - slow, -most)
            high += a * np.minimum(middle + reach + slow, most)
        return low, high


def _vectors(lengths: np.ndarray, angles: np.ndarray) -> np.ndarray:
    return np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], -1)


def _sine(wave: np.ndarray, phase: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """sin(u · p + φ), from sines and cosines of columns and of rows alone."""
    across, down = wave[0] * x + phase, wave[1] * y
    return np.sin(across) * np.cos(down) + np.cos(across) * np.sin(down)


def _share(wave: np.ndarray, phase: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.5 + 0.5 * _sine(wave, phase, x, y)


class Endless(PagedMap):
    """The land as a map."""

    tile, top = 256, 11
    gpu_bytes, memory_bytes = GPU_BYTES, MEMORY_BYTES

    def __init__(self, rows: int = ROWS, cols: int = COLS, first: tuple[int, int] = (0, 0)) -> None:
        self.land = Land((rows, cols), first)
        self.name, self.spacing_m = f"{cols} x {rows}", (SPACING_M, SPACING_M)
        self.range_m = self.quantised_m = -self.land.most_m, self.land.most_m
        self.georeference, self.voids, self.look, self.of_earth = None, 0, "auto", True
        self.assumes_spacing, self.opened, self.scales, self.notes = False, None, (1.0, 0.0), ()
        self.heights = self.land  # type: ignore[assignment]

    def page(self, key: PageKey) -> Page:
        """Compute a page."""
        level, *corner = key
        first = [n * self.tile for n in corner]
        count = [min(self.tile, n - at) for n, at in zip(self.nodes(level), first, strict=True)]
        posts = [slice(at, at + n + 1) for n, at in zip(count, first, strict=True)]
        heights = self.lattice_heights(level, posts[0], posts[1])
        if level == 0:
            return Page(heights, np.zeros((0, 0), np.uint32), np.zeros((2, 0, 0), np.uint16))
        rows, cols = ((at + np.arange(n)) << level for n, at in zip(count, first, strict=True))
        return Page(heights, self._errors(level, rows, cols), self._ranges(level, rows, cols))

    def lattice_heights(self, level: int, rows: slice, cols: slice) -> np.ndarray:
        """Heights of posts of a level's lattice."""
        row, col = (
            np.minimum(np.arange(s.start, s.stop) << level, n - 1)
            for s, n in zip((rows, cols), self.land.shape, strict=True)
        )
        return self.land.at(row[:, None], col)

    def _errors(self, level: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """A word of each node's record: its error as a half float, rounded up, for both the largest and the mean."""
        unit_m = quantisation_range(*self.quantised_m)[2] * ERROR_UNIT
        error = np.maximum(self.land.error_m(level, rows, cols) / unit_m, 2.0**-14)
        half = error.astype(np.float16)
        half = np.where(half < error, np.nextafter(half, np.float16(np.inf)), half).view(np.uint16)
        return half.astype(np.uint32) * np.uint32(0x10001)

    def _ranges(self, level: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """Lowest and highest heights in steps of the quantisation range, rounded outwards."""
        _, low_m, span_m = quantisation_range(*self.quantised_m)
        low, high = ((each - low_m) / span_m * 65535 for each in self.land.range_m(level, rows, cols))
        return np.stack([np.clip(np.floor(low), 0, 65535), np.clip(np.ceil(high), 0, 65535)]).astype(np.uint16)


class Memory:
    """The most memory so far, of this process and of the GPU."""

    gpu_bytes = 0

    def note(self, stats: dict[str, Any]) -> None:
        """Remember what a frame took."""
        self.gpu_bytes = max(self.gpu_bytes, stats["gpu_bytes"]["total"])

    @property
    def cells(self) -> tuple[str, str]:
        """The most memory so far: of the process, and on the GPU."""
        process_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        return f"{process_mib:.0f} MiB", f"{self.gpu_bytes / 2**20:.0f} MiB"


def travel(size: tuple[int, int], frames: int) -> None:
    """Open the map, draw it, fly over it, and measure it."""
    started, memory = time.perf_counter(), Memory()
    endless = Endless()
    print(
        f"{endless.name}: {endless.land.size:,} posts in {endless.numbering.total:,} pages, "
        f"{endless.land.nbytes / 2**30:.1f} GiB of heights"
    )
    with tg.Renderer(endless, size) as renderer:
        cameras = path(endless, frames)
        stats = renderer.draw(cameras[0], 1.0, style="lambert")
        memory.note(stats)
        head("", "result", "memory of the process", "of this, on the GPU")
        took = f"{time.perf_counter() - started:.1f} s, {time.process_time():.1f} s of processor time"
        row("opened and drawn", took, *memory.cells)
        for waits in (True, False):
            fly(renderer, cameras[:: 1 if waits else -1], waits, memory)
        renderer.streaming.waits = True
        for name, camera in views(endless).items():
            measure(renderer, name, camera, memory)


def path(endless: Endless, frames: int) -> list[tg.Camera]:
    """A flight from 500 m above the ground to 100 km, over 200 km of land; the horizon is in each picture."""
    width, depth = endless.extent_m
    cameras = []
    for share in np.linspace(0.0, 1.0, frames):
        x, y, above_m = 0.4 * width + 2e5 * share, 0.4 * depth + 5e4 * share, 500.0 * 200.0**share
        z = ground_m(endless, x, y) + above_m
        cameras.append(tg.Camera((x, y, z), (x + 10 * above_m, y + 5 * above_m, z - 3 * above_m)))
    return cameras


def ground_m(endless: Endless, x: float, y: float) -> float:
    """Height of the post next to a place."""
    row, col = endless.rows - 1 - round(y / SPACING_M), round(x / SPACING_M)
    return float(endless.heights[row : row + 1, col : col + 1][0, 0])


def fly(renderer: tg.Renderer, cameras: list[tg.Camera], waits: bool, memory: Memory) -> None:
    """Draw the frames of a flight at 20 a second."""
    assert renderer.streaming
    renderer.streaming.waits, complete, certified, frame_ms, most_tiles = waits, 0, [], [], 0
    for number, camera in enumerate(cameras):
        renderer.streaming.clock = lambda number=number: number / 20
        worked = time.thread_time()
        stats = renderer.draw(camera, 1.0, style="lambert")
        renderer.ctx.finish()
        frame_ms.append(1e3 * (time.thread_time() - worked))
        memory.note(stats)
        complete += stats["complete"]
        certified.append(stats["certified_max_error_px"])
        most_tiles = max(most_tiles, stats["tiles_resident"])
    name = f"flight, {len(cameras)} frames that wait for pages" if waits else "back again, never waiting"
    row(
        name,
        f"{complete} complete, certified at most {max(certified):.3g} px, {most_tiles} pages; "
        f"{np.median(frame_ms):.0f} ms of the drawing thread in the median",
        *memory.cells,
    )


def views(endless: Endless) -> dict[str, tg.Camera]:
    """A low view and a high one, without a horizon: all ground in the picture is measured."""
    width, depth = endless.extent_m
    x, y = 0.7 * width, 0.3 * depth
    z = ground_m(endless, x, y)
    return {
        "from 1 km": tg.Camera((x, y, z + 1e3), (x, y + 1.5e3, z), 45.0),
        "from 50 km": tg.Camera((x, y, z + 5e4), (x, y + 5e4, z), 45.0),
    }


def measure(renderer: tg.Renderer, name: str, camera: tg.Camera, memory: Memory) -> None:
    """Compare a view's mesh with the truth at all posts in the picture."""
    renderer.draw(camera, 1.0, style="lambert")
    worked = time.process_time()
    stats = renderer.measure()
    memory.note(stats)
    row(
        f"measured {name}, {stats['posts_measured']:,} posts",
        f"certified {stats['certified_max_error_px']:.3f} px, achieved {stats['max_error_px']:.3f} px, "
        f"{stats['holes']} holes; {time.process_time() - worked:.0f} s of processor time",
        *memory.cells,
    )


def choosing(rounds: int) -> None:
    """Compare the cost of choosing a mesh on a part of the land and on all of it."""
    first = 10 * PART, 24 * PART  # the nodes of the part are nodes of the large map, too
    large, small = Endless(), Endless(PART, PART, first)
    corner_m = first[1] * SPACING_M, (ROWS - first[0] - PART) * SPACING_M  # of the part in the large map
    head("view", "triangles", *(f"{each.cols:,} × {each.rows:,} posts" for each in (small, large)), "ratio")
    with tg.Renderer(small, (1280, 720)) as one, tg.Renderer(large, (1280, 720)) as other:
        for name, (above_m, ahead_m) in VIEWS.items():
            camera = over_middle(small, above_m, ahead_m)
            both = {one: camera, other: moved(camera, corner_m)}
            times: dict[tg.Renderer, list[float]] = {one: [], other: []}
            for _ in range(rounds + 1):
                for renderer, each in both.items():
                    times[renderer].append(cost_ms(renderer, each))
            ms = [np.median(each[1:]) for each in times.values()]
            counts = dict.fromkeys(f"{renderer.choose(both[renderer], 1.0)['triangles']:,}" for renderer in times)
            row(name, " and ".join(counts), *(f"{each:.1f} ms" for each in ms), f"{ms[1] / ms[0]:.2f}")


def over_middle(endless: Endless, above_m: float, ahead_m: float) -> tg.Camera:
    """Look north from above the middle of a map."""
    x, y = (0.5 * extent for extent in endless.extent_m)
    z = ground_m(endless, x, y)
    return tg.Camera((x, y, z + above_m), (x, y + ahead_m, z), 45.0)


def moved(camera: tg.Camera, by_m: tuple[float, float]) -> tg.Camera:
    """The same view in a map whose corner lies elsewhere."""
    eye, target = ((x + by_m[0], y + by_m[1], z) for x, y, z in (camera.eye, camera.target))
    return tg.Camera(eye, target, camera.fov_deg)


def cost_ms(renderer: tg.Renderer, camera: tg.Camera) -> float:
    """Choose a mesh: milliseconds of processor time."""
    begun = time.process_time()
    renderer.choose(camera, 1.0)
    return 1e3 * (time.process_time() - begun)


def main() -> int:
    """Travel, or compare what choosing costs."""
    words = sys.argv[1:]
    if words[:1] == ["choosing"]:
        choosing(int(words[1]) if words[1:] else 40)
        return 0
    frames, size = (*words, *("100", "640x360")[len(words) :])
    width, height = map(int, size.split("x"))
    travel((width, height), int(frames))
    return 0


if __name__ == "__main__":
    sys.exit(main())
