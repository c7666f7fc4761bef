"""The certificate of stores: random views, measured, over small tiles of which at most half have room.

    python benchmarks/store_measured.py [VIEWS [MAP …]]      150 views of each map

Maps, views and tolerances are those of `store_equal.py`; with "+voids" after its name, voids are cut out of a map.
Every second pair of views draws them as holes. In each view, also one whose tiles have no room, achieved ≤ certified
must hold, with no holes but the voids. Exit status 1 if a view is broken.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from certificate import HEADER, Tally
from store_equal import SHARD, SIZE, TILE, bytes_for, middle_of, random_views

import terrain_gl as tg
from terrain_gl.store import StoredMap, build

VOIDS = ("fill", "fill", "hole", "hole")  # each with both metrics
MAPS = ("alpine-30m+voids", "mt_rainier_90m.tif+voids")


def measure(name: str, views: int) -> int:
    """One map: print its row; returns how many views are broken."""
    whole, tally, complete = middle_of(name), Tally(), 0
    with tempfile.TemporaryDirectory() as folder:
        build(whole.heights, Path(folder) / "s", spacing_m=whole.spacing_m, tile=TILE, shard=SHARD)
        stored = StoredMap(Path(folder) / "s")
        stored.gpu_bytes = bytes_for(stored, stored.numbering.total // 2)
        started = time.perf_counter()
        with tg.Renderer(stored, SIZE) as renderer:
            for number, view in enumerate(random_views(whole, views)):
                complete += renderer.draw(**view, style="lambert", voids=VOIDS[number % len(VOIDS)])["complete"]
                tally.add(renderer.measure(), f"{name}, view {number}")
    tally.seconds = time.perf_counter() - started
    print(f"{name:44} {'sat':8} {'both':6} {tally.line()}   {complete} complete", flush=True)
    return tally.broken


def main() -> int:
    """Measure, and print a row for each map."""
    print(HEADER)
    views = int(sys.argv[1]) if len(sys.argv) > 1 else 150
    return int(sum(measure(name, views) for name in sys.argv[2:] or MAPS) > 0)


if __name__ == "__main__":
    sys.exit(main())
