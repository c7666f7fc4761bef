"""Hidden land: triangles, patches and milliseconds with occlusion and without, for one certified pixel.

Three views of every map at 1280 × 720: the first view, from a ridge, and in a valley. `seen` is the share of patches
that own a sample of the picture: no test of whole patches can leave out more. Milliseconds are the sum of `lod` and
`draw`, the best of nine frames of both in turn, given as a ratio, because times vary with the load of the machine.

`--random N` draws N random views of small random maps instead. A third of the eyes is above the map, a third in valleys
and a third beside it; both metrics; half of the cameras are rolled. It compares the pictures with occlusion and
without, bit for bit, and counts holes.

Run: python benchmarks/hidden.py [FOLDER]    the bundled maps, and the real maps of the folder
     python benchmarks/hidden.py --random N [--seed N]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from budgets import maps

import terrain_gl as tg
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import bilinear
from terrain_gl.lod import RingsSelector
from terrain_gl.shade.picture import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import random_map, rough  # noqa: E402  the tests' own maps

SIZE = (1280, 720)
FRAMES = 9
PER_MAP = 75  # random views of a map, and their size
RANDOM_SIZE = (96, 64)
COUNTED = ("views", "hide land", "pictures differ", "holes", "above the certificate")


def seen_share(renderer: tg.Renderer) -> float:
    """The share of the last frame's patches that own a sample, hidden ones included."""
    frame = renderer.inspector.frame
    assert frame and isinstance(frame.selection.surface, RingsSelector)
    with renderer.session:
        patches = frame.selection.surface.chosen(frame.selection)
        places = renderer.picture.places().reshape(-1, 2)
    rows, cols = renderer.heightmap.heights.shape
    owner = np.full((rows, cols), -1)
    low = np.maximum(patches.corner, 0)
    for i, ((x0, y0), (x1, y1)) in enumerate(zip(low, patches.corner + patches.size, strict=True)):
        owner[y0:y1, x0:x1] = i
    col, row = places[np.isfinite(places).all(1)].astype(int).T
    seen = np.unique(owner[np.clip(row, 0, rows - 2), np.clip(col, 0, cols - 2)])
    return float(np.count_nonzero(seen >= 0) / max(len(patches.corner), 1))


def views_of(folder: str | None) -> None:
    """Print a line for each view."""
    print(f"{'map':24} {'view':7}{'triangles':>10}{'off':>10}{'ratio':>7}{'patches':>9}{'seen':>6}{'lod':>6}{'ms':>6}")
    for name, heightmap, first in maps(folder):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                best: dict[str, tuple[float, float]] = {}
                stats = {}
                for _ in range(FRAMES):
                    for occlusion in ("on", "off"):
                        told = stats[occlusion] = renderer.draw(camera, 1.0, occlusion=occlusion, style=UNLIT)
                        ms = told["ms"]["lod"], told["ms"]["draw"]
                        best[occlusion] = min(best.get(occlusion, ms), ms, key=sum)
                on, off = stats["on"], stats["off"]
                lod, both = best["on"][0] / best["off"][0], sum(best["on"]) / sum(best["off"])
                print(
                    f"{name[:24]:24} {view:7}{on['triangles']:10,}{off['triangles']:10,}"
                    f"{on['triangles'] / max(off['triangles'], 1):7.2f}{on['patches'] / max(off['patches'], 1):9.2f}"
                    f"{seen_share(renderer):6.2f}{lod:6.2f}{both:6.2f}",
                    flush=True,
                )


def standing(rng: np.random.Generator, heightmap: tg.Heightmap, way: str) -> tg.Camera:
    """A random camera: its eye is above the map, in a valley or beside the map."""
    (east, north), step = heightmap.extent_m, max(heightmap.spacing_m)
    low_m, high_m = heightmap.range_m
    heights = np.nan_to_num(heightmap.heights, nan=high_m)
    if way == "beside":
        away = (0.5 + rng.uniform(0.02, 0.6)) * np.sign(rng.normal(size=2))
        away[rng.integers(2)] = rng.uniform(-0.6, 0.6)
        eye = (0.5 + away[0]) * east, (0.5 + away[1]) * north, rng.uniform(low_m - step, high_m + 0.3 * east)
    else:
        row, col = rng.integers(2, heightmap.rows - 2), rng.integers(2, heightmap.cols - 2)
        for _ in range(100 if way == "valley" else 0):  # walk downhill
            around = heights[row - 1 : row + 2, col - 1 : col + 2]
            down = np.add(np.unravel_index(np.argmin(around), (3, 3)), (row - 1, col - 1))
            row, col = np.clip(down, 2, [heightmap.rows - 3, heightmap.cols - 3])
        ground_m = float(heights[row - 2 : row + 3, col - 2 : col + 3].max())
        above_m = step * 10 ** (rng.uniform(-0.5, 1) if way == "valley" else rng.uniform(0.3, 1.7))
        eye = col * heightmap.spacing_m[0], (heightmap.rows - 1 - row) * heightmap.spacing_m[1], ground_m + above_m
    target = rng.uniform(0, east), rng.uniform(0, north), rng.uniform(low_m, high_m)
    up = tuple(rng.normal(size=3)) if rng.random() < 0.5 else None
    return tg.Camera(tuple(map(float, eye)), target, float(rng.uniform(10, 110)), up)


def random_views(views: int, seed: int) -> None:
    """After each map, print the counts so far, by the place of the eye."""
    rng = np.random.default_rng(seed)
    counts = {way: np.zeros(len(COUNTED), int) for way in ("above", "valley", "beside")}
    for i in range(0, views, PER_MAP):
        heightmap = random_map(rng, 60, 120) if i % (5 * PER_MAP) == 0 else smooth_map(rng)
        with tg.Renderer(heightmap, RANDOM_SIZE) as renderer:
            for k in range(min(PER_MAP, views - i)):
                way = tuple(counts)[k % 3]
                camera = standing(rng, heightmap, way)
                options = {"metric": ("max", "rms")[k // 3 % 2], "style": UNLIT}
                tolerance_px = float(10 ** rng.uniform(-1, 0.5))
                off = renderer.render(camera, tolerance_px, occlusion="off", **options)
                on = renderer.render(camera, tolerance_px, occlusion="on", **options)
                stats = on.stats | renderer.measure()
                hides, beyond = stats["patches_hidden"] > 0, stats[f"{options['metric']}_error_px"]
                beyond = beyond > stats["certified_max_error_px"]
                counts[way] += 1, hides, (on.image != off.image).any(), stats["holes"], beyond
        for way, count in counts.items():
            print(way + ": " + ", ".join(f"{n} {what}" for n, what in zip(count, COUNTED, strict=True)), flush=True)


def smooth_map(rng: np.random.Generator) -> tg.Heightmap:
    """Mountains about as wide as eight posts, with a little noise: there is land to hide."""
    rows, cols = rng.integers(100, 200, 2)
    heights = rough(rows // 8 + 2, cols // 8 + 2, int(rng.integers(1 << 30)), float(rng.uniform(200, 1500)))
    y, x = np.indices((rows, cols)) / 8
    noise = rough(rows, cols, int(rng.integers(1 << 30)), float(rng.uniform(0, 10)))
    return tg.Heightmap((bilinear(heights, x.ravel(), y.ravel()).reshape(rows, cols) + noise).astype("f4"), 10.0)


def main() -> None:
    """Views of known maps, or random ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--random", type=int, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.random:
        random_views(options.random, options.seed)
    else:
        views_of(options.folder)


if __name__ == "__main__":
    main()
