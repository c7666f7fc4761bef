"""Whether a store draws what the same map in memory draws: random views over small tiles.

    python benchmarks/store_equal.py [VIEWS [PICTURES [MAP …]]]      1000 views and 100 pictures of each map

A map is a bundled one, or a file, also one in the folder TERRAIN_GL_DEM. With "+voids" after its name, voids are cut
out. A large map is cropped to the 1000 rows and 900 columns in its middle. Tiles have 32 posts a side. Views stand
close to the ground or high above it, also outside the map. Tolerances are 0.3, 1 and 4 px. Both metrics take turns.

First all tiles are loaded. Each view must have the same patches and the same certificate. In each picture, all samples
(four a pixel) must see the same place of the map, and all pixels must be equal in the styles `lambert` and `normals`.
All of this is compared bit for bit.
Then there are slots for half of the tiles, and tiles change with the views. Each view must be certified within its
tolerance, unless it needs more tiles than there are slots; then it is not complete. The views with the same patches as
the map in memory are counted. If a finer tile is not loaded, the bound of a coarser one may choose another patch.
The exit status is 1 if a view breaks one of these rules.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from table import head, row

import terrain_gl as tg
from terrain_gl.camera import Camera
from terrain_gl.files.maps import open_map
from terrain_gl.gpu import layout
from terrain_gl.pages.map import PageKey
from terrain_gl.pages.streaming import NO_ROOM
from terrain_gl.pages.sums import bytes_of_slot
from terrain_gl.store import StoredMap, build

SIZE, PART, TILE, SHARD = (160, 90), (1000, 900), 32, 256
STYLES = "lambert", "normals"


def main() -> int:
    """Compare, and print a row for each map."""
    views, pictures = (int(word) for word in (*sys.argv[1:3], *("1000", "100")[len(sys.argv[1:3]) :]))
    head("map", "posts", "tiles", "views", "equal", "pictures", "equal", "few slots", "complete", "with equal patches")
    bad = sum(compare(name, views, pictures) for name in sys.argv[3:] or ["alpine-30m", "canyon-15m"])
    return int(bad > 0)


def compare(name: str, views: int, pictures: int) -> int:
    """One map: print its row; returns how many views break a rule."""
    whole = middle_of(name)
    heights = whole.heights
    with tempfile.TemporaryDirectory() as folder, tg.Renderer(whole, SIZE) as one:
        build(heights, Path(folder) / "s", spacing_m=whole.spacing_m, tile=TILE, shard=SHARD)
        stored, few = StoredMap(Path(folder) / "s"), StoredMap(Path(folder) / "s")
        counts = Counter[str]()
        with tg.Renderer(stored, SIZE) as other:
            load_all(other)
            for number, view in enumerate(random_views(whole, views)):
                counts["equal"] += same_mesh(one, other, view)
                counts["pictures"] += number < pictures and same_picture(one, other, view)
        pages = stored.numbering.total
        few.gpu_bytes = bytes_for(few, pages // 2)
        with tg.Renderer(few, SIZE) as other:
            slots = other.resources.terrain.slots
            for view in random_views(whole, views):
                stats = other.choose(**view)
                counts["complete"] += stats["complete"]
                counts["kept"] += is_kept(stats)
                counts["alike"] += same_mesh(one, other, view)
    posts, few_slots = f"{whole.cols} × {whole.rows}", (slots, counts["complete"], counts["alike"])
    row(Path(name).stem, posts, pages, views, counts["equal"], pictures, counts["pictures"], *few_slots)
    return 2 * views + pictures - counts["equal"] - counts["kept"] - counts["pictures"]


def middle_of(name: str) -> tg.Heightmap:
    """The middle of a bundled map or a file, with voids if its name says so."""
    source = name.removesuffix("+voids")
    file = Path(os.environ.get("TERRAIN_GL_DEM", "")) / source
    opened, _ = open_map(str(file) if file.is_file() else source)
    row, col = (max(0, (n - most) // 2) for n, most in zip((opened.rows, opened.cols), PART, strict=True))
    heights = opened.heights[row : row + PART[0], col : col + PART[1]].copy()
    if source != name:
        cut_voids(heights)
    return tg.Heightmap(heights, opened.spacing_m)


def cut_voids(heights: np.ndarray) -> None:
    """A missing tile, shadows of radar behind the steepest places, and single posts without data."""
    rows, cols = heights.shape
    heights[rows // 2 : rows // 2 + 256, cols // 5 : cols // 5 + 256] = np.nan
    falls = np.abs(np.diff(heights, axis=1, prepend=0))
    heights[falls > np.nanpercentile(falls, 98)] = np.nan
    heights[::97, ::89] = np.nan


def random_views(heightmap: tg.Heightmap, count: int) -> Iterator[dict[str, Any]]:
    """Cameras anywhere around the map, close to the ground or high above it, with tolerances and metrics."""
    rng, (width, depth), (low, high) = np.random.default_rng(3), heightmap.extent_m, heightmap.range_m
    for number in range(count):
        x, y = rng.uniform(-0.2, 1.2, 2) * (width, depth)
        z = high + 0.2 * width * rng.choice([0.01, 0.1, 1.0]) * rng.random()
        target = (*(rng.random(2) * (width, depth)), low)
        camera = Camera((x, y, z), target, rng.uniform(20, 70))
        metric = ("max", "rms")[number % 2]
        yield {"camera": camera, "max_error_px": float(rng.choice([0.3, 1.0, 4.0])), "metric": metric}


def load_all(renderer: tg.Renderer) -> None:
    """Load all tiles."""
    terrain = renderer.heightmap
    assert isinstance(terrain, StoredMap)
    keys: list[PageKey] = [terrain.numbering.key(number) for number in range(terrain.numbering.total)]
    with renderer.session:
        tables: Any = renderer.tables
        tables.load(keys[::-1])
        assert len(tables.terrain.slot_of) == len(keys), "the pool is too small"


def same_mesh(one: tg.Renderer, other: tg.Renderer, view: dict[str, Any]) -> bool:
    """Whether both choose the same patches with the same certificate."""
    found = [(r.choose(**view)["certified_max_error_px"], patches_of(r)) for r in (one, other)]
    return found[0] == found[1]


def patches_of(renderer: tg.Renderer) -> bytes:
    """The records of the patches of the last mesh."""
    with renderer.session:
        frame: Any = renderer.inspector.frame
        selection = frame.selection
        return bytes(selection.buffers.patches.read(selection.patches * layout.PATCH.itemsize))


def same_picture(one: tg.Renderer, other: tg.Renderer, view: dict[str, Any]) -> bool:
    """Whether the samples of both pictures see the same places, and all pixels of two styles are equal."""
    is_same = np.array_equal(*(seen_by(r, view) for r in (one, other)))
    for style in STYLES:
        is_same &= np.array_equal(*(r.render(**view, style=style).image for r in (one, other)))
    return is_same


def seen_by(renderer: tg.Renderer, view: dict[str, Any]) -> np.ndarray:
    """The place on the map that each sample of a picture sees."""
    renderer.draw(**view, style="depth")
    with renderer.session:
        return renderer.picture.places()


def is_kept(stats: dict[str, Any]) -> bool:
    """Whether a view keeps its tolerance, or tells that the pool is too small for it."""
    if stats["complete"]:
        return bool(stats["certified_max_error_px"] <= stats["requested_max_error_px"])
    return all(tile["reason"] == NO_ROOM for tile in stats["tiles_missing"])


def bytes_for(stored: StoredMap, slots: int) -> int:
    """GPU memory with room for about so many tiles."""
    return slots * bytes_of_slot(stored.tile, stored.is_marked) + 8 * stored.numbering.total


if __name__ == "__main__":
    sys.exit(main())
