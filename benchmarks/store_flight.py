"""A flight over a store whose tiles come late: whether frames are even, and what is complete.

    python benchmarks/store_flight.py [STORE [FRAMES [LATENCY_MS [WIDTHxHEIGHT]]]] [--lit] [--still]

Defaults: 1000 frames, 200 ms, 320x180.

Without a store, one is built of `canyon-15m`. Every read of a page waits for the latency. The tour around the map
(terrain_gl/film/tour.py) is flown at 20 frames for each second of the tour's clock, without waiting for any tile.
Prints the median and the 99.9th percentile of frame times, by the clock and by the processor time of the thread that
draws; the share of complete frames, the most that is certified, and memory after a tenth of the frames and at the end.
The first frames compile shaders, and do not count. With --lit, the style is `shaded`, and tiles get light; else it is
`lambert`. With --still, nothing is ever read.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import open_map
from terrain_gl.film.tour import tour
from terrain_gl.pages.map import Page, PageKey
from terrain_gl.store import StoredMap, build

FPS = 20.0
WARM = 5  # frames that do not count


class Late(StoredMap):
    """A store whose pages come late."""

    latency_s = 0.2

    def page(self, key: PageKey) -> Page:
        """Read a page; fine ones only after a delay."""
        if key[0] < self.top:
            time.sleep(self.latency_s)
        return super().page(key)


def main() -> int:
    """Fly, and print what came of it."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    style = "shaded" if "--lit" in sys.argv else "lambert"
    store, frames, latency_ms, size = (*words, *("", "1000", "200", "320x180")[len(words) :])
    with tempfile.TemporaryDirectory() as folder:
        path = store or _canyon(folder)
        stored = Late(path)
        stored.latency_s = 1e9 if "--still" in sys.argv else float(latency_ms) / 1e3
        width, height = map(int, size.split("x"))
        fly(stored, int(frames), (width, height), style)
    return 0


def fly(stored: Late, count: int, size: tuple[int, int], style: str) -> None:
    """One flight, and its numbers."""
    poses = [pose.camera for pose in tour(stored).poses(count)]
    times, busy, complete, unlit, certified, memory = [], [], 0, 0, [], []
    with tg.Renderer(stored, size) as renderer:
        assert renderer.streaming
        renderer.streaming.waits = False
        for number, camera in enumerate(poses):
            renderer.streaming.clock = lambda number=number: number / FPS
            started, worked = time.perf_counter(), time.thread_time()
            stats = renderer.draw(camera, 1.0, style=style)
            renderer.ctx.finish()
            times.append(1e3 * (time.perf_counter() - started))
            busy.append(1e3 * (time.thread_time() - worked))
            time.sleep(max(0.0, 1 / FPS - times[-1] / 1e3))
            complete += stats["complete"]
            unlit += stats.get("tiles_unlit", 0) > 0
            certified.append(stats["certified_max_error_px"])
            if number in (count // 10, count - 1):
                memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(f"{stored.name}: {count} frames of {size[0]}x{size[1]} in {style}, {1e3 * stored.latency_s:g} ms a tile")
    columns = (
        "median frame",
        "99.9th percentile",
        "99.9th percentile / median",
        "complete frames",
        "memory, at a tenth and the end",
    )
    head(f"`{style}`", *columns)
    lit = f"; with all light {100 * (1 - unlit / count):.0f} %" if style == "shaded" else ""
    more = f"{100 * complete / count:.1f} %{lit}", f"{memory[0]:.0f} and {memory[-1]:.0f} MiB"
    for name, each in (("the thread that draws, processor time", busy[WARM:]), ("by the clock", times[WARM:])):
        middle, slow = np.median(each), np.percentile(each, 99.9)
        row(name, f"{middle:.0f} ms", f"{slow:.0f} ms", f"{slow / middle:.1f}", *more)
        more = "", ""
    print(f"\ncertified at most {max(certified):.2f} px")


def _canyon(folder: str) -> Path:
    heightmap, _ = open_map("canyon-15m")
    path = Path(folder) / "canyon.zarr"
    build(heightmap.heights, path, spacing_m=heightmap.spacing_m, tile=64, shard=512)
    return path


if __name__ == "__main__":
    sys.exit(main())
