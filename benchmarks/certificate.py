"""The certificate, map by map: achieved ≤ certified ≤ tolerance, and no holes, on the whole surface.

    python benchmarks/certificate.py                  the synthetic worst cases
    python benchmarks/certificate.py FOLDER           then the real maps of the folder
    python benchmarks/certificate.py --random 1000    views from anywhere, of random maps; with --seed, others

It tests both metrics, eight cameras and four tolerances. `--maps`, `--cameras`, `--methods`,
`--metrics` and `--errors` select some of them. There is one line for each map, method and metric: the largest ratio of
achieved to certified error, and of certified error to tolerance; the number of views in which the certified error is
above the tolerance, which is allowed very near the ground; broken views, holes, posts, triangles. The exit status is 1
if a view is broken.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import terrain_gl as tg
from terrain_gl.gpu.context import create_context
from terrain_gl.shade.picture import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import MAPS, REAL, cameras, random_camera, random_map  # noqa: E402  the tests' own maps and cameras

SIZE = (1280, 720)
ERRORS_PX = (0.5, 1.0, 2.0, 4.0)
METRICS = ("max", "rms")
METHODS = ("sat",)
VIEWS_A_MAP = 10  # views of each random map


@dataclass
class Tally:
    """Results of several views."""

    views: int = 0
    achieved: float = 0.0
    certified: float = 0.0
    above: int = 0
    broken: int = 0
    holes: int = 0
    posts: int = 0
    triangles: int = 0
    seconds: float = 0.0

    def add(self, stats: dict[str, Any], label: str) -> None:
        """Count a measured view; print it if it is broken."""
        got, bound, asked = (stats[f"{key}_error_px"] for key in (stats["metric"], "certified_max", "requested_max"))
        self.views += 1
        self.achieved = max(self.achieved, got / bound if bound else got)
        if math.isfinite(bound):
            self.certified = max(self.certified, bound / asked)
        self.above += bound > asked
        self.holes += stats["holes"]
        self.posts += stats["posts_measured"]
        self.triangles += stats["triangles"]
        if got > bound or stats["holes"]:
            self.broken += 1
            print(f"  broken: {label}: {got:g} px achieved, {bound:g} certified, {stats['holes']} holes", flush=True)

    def line(self) -> str:
        """A row of the table."""
        shares = (
            f"{self.views:5} {self.achieved:9.4f} {self.certified:10.6f} {self.above:6} {self.broken:7} {self.holes:6}"
        )
        return f"{shares} {self.posts:>10} {self.triangles:>10} {self.seconds:8.0f}"


HEADER = f"{'map':44} method   metric views  achieved  certified  above  broken  holes      posts  triangles  seconds"


def maps(folder: Path | None) -> Iterator[tuple[str, tg.Heightmap]]:
    """Name and map, one at a time."""
    for name, make in MAPS.items():
        yield name, make()
    for name, options in REAL.items() if folder else ():
        if folder and (folder / name).exists():
            yield name, tg.Heightmap.open(folder / name, **options)


def fixed_views(args: argparse.Namespace, ctx: Any) -> Iterator[Tally]:
    """Every map, method and metric from every camera."""
    for name, heightmap in maps(args.folder):
        if args.maps and name not in args.maps:
            continue
        views = {k: v for k, v in cameras(heightmap, SIZE).items() if not args.cameras or k in args.cameras}
        with tg.Renderer(heightmap, SIZE, ctx=ctx) as renderer:
            for method in args.methods:
                for metric in args.metrics:
                    tally, started = Tally(), time.perf_counter()
                    for view, camera in views.items():
                        for px in args.errors:
                            renderer.draw(camera, px, metric=metric, method=method, style=UNLIT)
                            tally.add(renderer.measure(), f"{name}, {method}, {metric}, {view} at {px:g} px")
                    tally.seconds = time.perf_counter() - started
                    print(f"{name:44} {method:8} {metric:6} {tally.line()}", flush=True)
                    yield tally


def random_views(args: argparse.Namespace, ctx: Any) -> Iterator[Tally]:
    """Random maps, ten views of each, every method in each view."""
    tallies = {method: Tally() for method in args.methods}
    for i in range(-(-args.random // VIEWS_A_MAP)):
        rng = np.random.default_rng([args.seed, i])
        heightmap = random_map(rng)
        size = [(640, 360), (320, 700)][rng.integers(0, 2)]
        with tg.Renderer(heightmap, size, ctx=ctx) as renderer:
            for k in range(min(VIEWS_A_MAP, args.random - VIEWS_A_MAP * i)):
                camera, px = random_camera(rng, heightmap), float(10 ** rng.uniform(-1.5, 1))
                metric = METRICS[rng.integers(0, 2)]
                for method, tally in tallies.items():
                    started = time.perf_counter()
                    renderer.draw(camera, px, metric=metric, method=method, style=UNLIT)
                    tally.add(
                        renderer.measure(), f"seed {args.seed}, map {i}, view {k}, {method}, {metric} at {px:g} px"
                    )
                    tally.seconds += time.perf_counter() - started
    for method, tally in tallies.items():
        print(f"{'random':44} {method:8} {'both':6} {tally.line()}", flush=True)
        yield tally


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="with the real maps")
    parser.add_argument("--random", type=int, default=0, metavar="N", help="N random views, and nothing else")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--maps", nargs="+")
    parser.add_argument("--cameras", nargs="+")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS)
    parser.add_argument("--metrics", nargs="+", choices=METRICS, default=METRICS)
    parser.add_argument("--errors", nargs="+", type=float, default=ERRORS_PX, metavar="PX")
    return parser.parse_args()


def main() -> int:
    """Measure everything; print a table."""
    args, ctx = arguments(), create_context()
    print(HEADER)
    tallies = list((random_views if args.random else fixed_views)(args, ctx))
    views, broken, holes = (sum(getattr(tally, key) for tally in tallies) for key in ("views", "broken", "holes"))
    print(f"{views} views, {broken} broken, {holes} holes")
    return int(broken > 0)


if __name__ == "__main__":
    raise SystemExit(main())
