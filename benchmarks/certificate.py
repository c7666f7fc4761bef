"""The certificate, map by map: achieved ≤ certified ≤ tolerance, and no holes, on the whole surface.

    python benchmarks/certificate.py                  the synthetic worst cases
    python benchmarks/certificate.py FOLDER           then the real maps of the folder
    python benchmarks/certificate.py --random 1000    views from anywhere, of random maps; with --seed, others

Random views have fields of view of 0.1 to 170 degrees, tolerances of 0.01 to 1,000 pixels for the largest error or for
the mean, or budgets; maps with voids, filled or cut out, edits, exaggeration; pictures from 17 x 5 pixels. A third of
the maps is drawn from a store with small tiles, and half of the stores have memory for only some of them. Each view is
drawn with hidden land and without; with a tolerance for the largest error, both pictures must have the same bytes,
unless other tiles may have been loaded. A last line counts views of each kind.

Else it tests both metrics, eight cameras and four tolerances; `--maps`, `--cameras`, `--metrics` and `--errors` select
some of them. There is one line for each map and metric: the largest ratio of achieved to certified error, and of
certified error to tolerance; the number of views in which the certified error is above the tolerance, which is allowed
very near the ground; broken views, holes, pictures that differ without hidden land, views with hidden patches; posts,
triangles. The exit status is 1 if a view is broken, or a picture differs.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import terrain_gl as tg
from terrain_gl.basics.steps import drain
from terrain_gl.gpu.context import create_context
from terrain_gl.pages.map import PagedMap
from terrain_gl.pages.pool import OF_COPIES
from terrain_gl.shade.picture import UNLIT
from terrain_gl.store import StoredMap, build

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import MAPS, REAL, cameras, random_camera, random_map, ridges, standing  # noqa: E402  the tests' own maps and cameras

SIZE = (1280, 720)
ERRORS_PX = (0.5, 1.0, 2.0, 4.0)
METRICS = ("max", "rms")
SIZES = ((640, 360), (320, 700), (160, 90), (96, 64), (48, 27), (17, 5))  # of pictures of random maps
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
    different: int = 0
    hidden: int = 0
    posts: int = 0
    triangles: int = 0
    seconds: float = 0.0

    def add(self, stats: dict[str, Any], label: str) -> None:
        """Count a measured view; print it if it is broken."""
        metric = stats["certified_metric"]
        got, bound, asked = (stats[f"{key}_error_px"] for key in (metric, "certified_max", "requested_max"))
        asked = math.inf if asked is None else asked  # a budget
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
            f" {self.different:9} {self.hidden:6}"
        )
        return f"{shares} {self.posts:>10} {self.triangles:>10} {self.seconds:8.0f}"


HEADER = (
    f"{'map':44} metric views  achieved  certified  above  broken  holes different hidden      posts  triangles"
    "  seconds"
)


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
            for metric in args.metrics:
                tally, started = Tally(), time.perf_counter()
                for view, camera in views.items():
                    for px in args.errors:
                        renderer.draw(camera, px, metric=metric, style=UNLIT)
                        tally.add(renderer.measure(), f"{name}, {metric}, {view} at {px:g} px")
                tally.seconds = time.perf_counter() - started
                print(f"{name:44} {metric:6} {tally.line()}", flush=True)
                yield tally


def random_views(args: argparse.Namespace, ctx: Any) -> Iterator[Tally]:
    """Random maps, ten views of each; every second map is mountains, and two of four have an edit halfway."""
    tallies = {(where, kind): Tally() for where in ("map", "store") for kind in (*args.metrics, "budget")}
    kinds, counts = [kind for _, kind in tallies][: len(tallies) // 2], Counter[str]()
    end = time.perf_counter() + args.seconds
    for i in range(-(-args.random // VIEWS_A_MAP)):
        if time.perf_counter() > end:
            break
        rng = np.random.default_rng([args.seed, i])
        heightmap = _mountains(rng) if i % 2 else random_map(rng)
        size = SIZES[rng.integers(0, len(SIZES))]
        with tempfile.TemporaryDirectory() as folder:
            drawn = _stored(rng, heightmap, Path(folder) / "s") if i % 3 == 2 else heightmap
            with tg.Renderer(drawn, size, ctx=ctx) as renderer:
                if isinstance(drawn, StoredMap):
                    drawn.limit(drawn.gpu_bytes, PagedMap.memory_bytes)  # for edits
                for k in range(min(VIEWS_A_MAP, args.random - VIEWS_A_MAP * i)):
                    if k == VIEWS_A_MAP // 2 and i % 4 > 1:
                        _edit(rng, renderer)
                        counts["edited"] += min(VIEWS_A_MAP, args.random - VIEWS_A_MAP * i) - k
                    where, kind = "store" if drawn.is_store else "map", kinds[rng.integers(0, len(kinds))]
                    tally, started = tallies[where, kind], time.perf_counter()
                    label = f"seed {args.seed}, map {i}, view {k}, {where}, {kind}"
                    counts.update(_random_view(rng, renderer, kind, tally, label))
                    tally.seconds += time.perf_counter() - started
    for (where, kind), tally in tallies.items():
        print(f"{f'random {where}s':44} {kind:6} {tally.line()}", flush=True)
        yield tally
    print("views: " + ", ".join(f"{n} {trait}" for trait, n in sorted(counts.items())))


def _random_view(rng: np.random.Generator, renderer: tg.Renderer, kind: str, tally: Tally, label: str) -> Iterator[str]:
    """Draw a view twice, and count it; yields what it is."""
    fov_deg = float(
        [10 ** rng.uniform(-1, math.log10(170)), rng.uniform(60, 170), rng.uniform(10, 80)][rng.integers(3)]
    )
    known = renderer.heightmap
    if isinstance(known, PagedMap):
        known = tg.Heightmap(known.heights[:, :], known.spacing_m)
    stands = rng.random() < 0.6 and min(known.heights.shape) > 5
    camera = replace((standing if stands else random_camera)(rng, known), fov_deg=fov_deg)
    options: dict[str, Any] = {"voids": ("fill", "hole")[rng.integers(0, 2)], "style": UNLIT}
    if rng.random() < 0.3:
        options["exaggeration"] = float(10 ** rng.uniform(-1, 1))
        yield "exaggerated"
    if rng.random() < 0.3:
        options["near_m"] = float(min(known.spacing_m) * 10 ** rng.uniform(-3, 0))
    if kind == "budget":
        options["triangles"] = int(10 ** rng.uniform(1, 4.5))
        options["metric"] = METRICS[rng.integers(0, 2)]
    else:
        options["max_error_px"] = float(10 ** rng.uniform(-2, 3))
        options["metric"] = kind
    yield from ("in all", *(["with voids"] if known.voids else []))
    frames, tiles = {}, {}
    try:
        for occlusion in ("off", "on"):
            frames[occlusion] = renderer.render(camera, occlusion=occlusion, **options)
            tiles[occlusion] = set(getattr(renderer.terrain, "slot_of", ()))
            tally.add(renderer.measure(), f"{label}, occlusion {occlusion}, {camera}, {options}")
    except tg.TerrainError as error:
        tally.broken += 1
        print(f"  broken: {label}: {error}, {camera}, {options}", flush=True)
        return
    tally.hidden += frames["on"].stats["patches_hidden"] > 0
    if not all(frame.stats.get("complete", True) for frame in frames.values()):
        yield "without some tiles"
    elif kind == "max" and tiles["on"] == tiles["off"]:
        yield "compared"
        if (frames["on"].image != frames["off"].image).any():
            tally.different += 1
            print(f"  different: {label}, {camera}, {options}", flush=True)


def _stored(rng: np.random.Generator, heightmap: tg.Heightmap, path: Path) -> StoredMap:
    """The map's store; every second one has slots for a half of its tiles."""
    build(heightmap.heights, path, spacing_m=heightmap.spacing_m, tile=16, shard=64)
    stored = StoredMap(path)
    if rng.random() < 0.5:
        copies = max(16, stored.numbering.total // 2) * 5 * (stored.tile + 1) ** 2
        stored.limit(stored.gpu_bytes, int(copies / OF_COPIES))
    return stored


def _mountains(rng: np.random.Generator) -> tg.Heightmap:
    """Ridges that hide land, at times with a lake of voids."""
    rows, cols = rng.integers(65, 200, 2)
    heights = ridges(rows, cols, int(rng.integers(0, 10**6)), float(10 ** rng.uniform(2, 3.3)))
    if rng.random() < 0.3:
        row, col = rng.integers(0, rows - 20), rng.integers(0, cols - 20)
        heights[row : row + 20, col : col + 20] = np.nan
    return tg.Heightmap(heights, tuple(rng.uniform(5, 30, 2)))


def _edit(rng: np.random.Generator, renderer: tg.Renderer) -> None:
    """Move a rectangle of posts up or down, or make some of it void. In a store, voids stay as they are."""
    map_ = renderer.heightmap
    row, col = (int(rng.integers(0, n - 1)) for n in (map_.rows, map_.cols))
    rows, cols = (slice(at, at + int(rng.integers(1, 40))) for at in (row, col))
    heights = map_.heights[rows, cols].copy()
    heights += np.float32(rng.normal() * (map_.range_m[1] - map_.range_m[0]) * rng.choice([1, 10]))
    heights[rng.random(heights.shape) < rng.choice([0.0, 0.2])] = np.nan
    with suppress(tg.TerrainError):  # a store refuses heights that its units cannot hold
        renderer.editor.write(col, row, heights)
    if rng.random() < 0.5:
        drain(renderer.editor.rebuild_steps())


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="with the real maps")
    parser.add_argument("--random", type=int, default=0, metavar="N", help="N random views, and nothing else")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=math.inf, metavar="S", help="begin no random map after S")
    parser.add_argument("--maps", nargs="+")
    parser.add_argument("--cameras", nargs="+")
    parser.add_argument("--metrics", nargs="+", choices=METRICS, default=METRICS)
    parser.add_argument("--errors", nargs="+", type=float, default=ERRORS_PX, metavar="PX")
    return parser.parse_args()


def main() -> int:
    """Measure everything; print a table."""
    args, ctx = arguments(), create_context()
    print(HEADER)
    tallies = list((random_views if args.random else fixed_views)(args, ctx))
    keys = "views", "broken", "holes", "different"
    views, broken, holes, different = (sum(getattr(tally, key) for tally in tallies) for key in keys)
    print(f"{views} pictures, {broken} broken, {holes} holes, {different} different without hidden land")
    return int(broken + different > 0)


if __name__ == "__main__":
    raise SystemExit(main())
