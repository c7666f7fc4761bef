"""Edits of a store: what a dab of the brush costs, how wide bounds are, and how long it takes to make them exact.

    python benchmarks/store_edits.py [POSTS]     generated land of 4096 posts a side, in tiles of 256

Times are processor time of this process, threads included. The view looks down at the edit from 4 km. Triangles and
tiles are those of a picture within 1 px: before the edit, with wide bounds, and with exact ones.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from table import head, row

import terrain_gl as tg
from terrain_gl.camera import Camera
from terrain_gl.files.generate import Land, generate
from terrain_gl.gpu.context import create_context
from terrain_gl.pages.edited_map import EditedMap
from terrain_gl.renderer.brush import Brush, Sculptor
from terrain_gl.store import StoredMap, build

SIZE = (640, 360)
SPACING_M = 30.0
DABS = 10
RADII_POSTS = (10, 50, 200)


def main() -> int:
    """Edit with brushes of several radii, and print."""
    posts = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s"
        with create_context() as ctx:
            land = generate(ctx, Land(posts, posts, seed=1, relief_m=2000.0, spacing_m=SPACING_M))
        build(land.heights, path, spacing_m=SPACING_M)
        parts = (f"{what}{part}" for what in ("triangles", "tiles") for part in (" before", ", wide", ", exact"))
        head("radius", "a dab", *parts, "rebuild", "memory of the edits")
        for radius in RADII_POSTS:
            edit(path, radius)
    return 0


def edit(path: Path, radius: int) -> None:
    """A stroke with a radius in posts."""
    with tg.Renderer(StoredMap(path), SIZE) as renderer:
        width, depth = renderer.heightmap.extent_m
        middle = 0.55 * width, 0.55 * depth
        camera = Camera((middle[0], middle[1] - 6000.0, renderer.heightmap.range_m[1] + 4000.0), (*middle, 0.0))
        drawn = [renderer.choose(camera, 1.0)]
        sculptor, brush = Sculptor(renderer), Brush("raise", radius * SPACING_M, 20.0)
        sculptor.begin()
        ms = []
        for x in np.linspace(-1000, 1000, DABS):
            ms.append(1000 * spent(lambda x=x: sculptor.dab(brush, middle[0] + x, middle[1])))
        sculptor.end()
        drawn.append(renderer.choose(camera, 1.0))
        rebuild_s = spent(renderer.rebuild)
        drawn.append(renderer.choose(camera, 1.0))
        assert isinstance(renderer.heightmap, EditedMap)
        counts = (f"{stats[key]:,}" for key in ("triangles", "tiles_resident") for stats in drawn)
        held = f"{renderer.heightmap.bytes / 2**20:.1f} MiB"
        row(f"{radius} posts", f"{np.median(ms):.0f} ms", *counts, f"{rebuild_s:.1f} s", held)


def spent(work: object) -> float:
    """Processor time of a piece of work, in seconds."""
    assert callable(work)
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    sys.exit(main())
