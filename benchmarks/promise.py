"""The promise, map by map: achieved ≤ certified ≤ asked, no holes; from eight cameras, for four errors, both metrics.

    python benchmarks/promise.py FOLDER        the synthetic worst cases, then the real maps of the folder
    python benchmarks/promise.py               the synthetic ones alone

Prints a line a map and metric: the largest share of the certified error that was achieved, of the asked error that was
certified, both in the metric; the holes; the triangles of all views. Ends with status 1 if any view breaks the promise.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import terrain_gl as tg
from terrain_gl.context import create_context
from terrain_gl.shade import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import MAPS, REAL, cameras  # noqa: E402  the tests' own maps and cameras

SIZE = (1280, 720)
ASKED_PX = (0.5, 1.0, 2.0, 4.0)
METRICS = ("max", "rms")


def maps(folder: str | None) -> Iterator[tuple[str, tg.Heightmap]]:
    """Name and map, one at a time."""
    for name, make in MAPS.items():
        yield name, make()
    for name, options in REAL.items() if folder else ():
        if (Path(folder or "") / name).exists():
            yield name, tg.Heightmap.open(Path(folder or "") / name, **options)


def views(renderer: tg.Renderer, metric: str) -> Iterator[tuple[str, dict]]:
    """Measured stats of every camera and error."""
    for view, camera in cameras(renderer.heightmap, SIZE).items():
        for asked_px in ASKED_PX:
            renderer.draw(camera, asked_px, metric=metric, style=UNLIT)
            yield f"{view} at {asked_px:g} px", renderer.measure()


def main() -> int:
    """Measure everything; print a table."""
    ctx = create_context()
    broken = 0
    print(f"{'map':44} metric  achieved  certified  holes    posts  triangles  seconds")
    for name, heightmap in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        with tg.Renderer(heightmap, SIZE, ctx=ctx) as renderer:
            for metric in METRICS:
                broken += report(name, metric, renderer)
    return int(broken > 0)


def report(name: str, metric: str, renderer: tg.Renderer) -> int:
    """Measure one map in one metric, print its line and any view that breaks the promise; how many do."""
    achieved = certified = 0.0
    holes = posts = triangles = broken = 0
    started = time.perf_counter()
    for view, stats in views(renderer, metric):
        got, bound, asked = (stats[f"{key}_error_px"] for key in (metric, "certified_max", "requested_max"))
        achieved, certified = max(achieved, got / bound if bound else got), max(certified, bound / asked)
        holes, posts = holes + stats["holes"], posts + stats["posts_measured"]
        triangles += stats["triangles"]
        if not (got <= bound <= asked and stats["holes"] == 0):
            broken += 1
            print(f"  broken: {name}, {view}: {got:g} px achieved, {bound:g} certified, {stats['holes']} holes")
    seconds = time.perf_counter() - started
    print(
        f"{name:44} {metric:6} {achieved:9.4f} {certified:10.6f} {holes:6} {posts:>9} {triangles:>9} {seconds:8.0f}",
        flush=True,
    )
    return broken


if __name__ == "__main__":
    raise SystemExit(main())
