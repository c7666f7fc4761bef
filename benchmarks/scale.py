"""Time frames of growing crops of one terrain, each seen from the same height above its middle.

Run: python benchmarks/scale.py [SIZE ...]; by default 1025, 2049, 4097 and 8193 posts a side of the bundled range,
mirrored until it is large enough. Numbers are medians of one run: compare ratios, not milliseconds.
"""

import sys
import time

import numpy as np

import terrain_gl as tg
from terrain_gl.comparison.bench import bench
from terrain_gl.files.maps import bundled

ABOVE_M, AHEAD_M, BELOW_M = 1500.0, 12000.0, 3000.0


def mirrored(heights, posts):
    """Continue a map by its mirror images to `posts` a side, the original in the middle."""
    more = [(posts - n) // 2 for n in heights.shape]
    return np.pad(heights, [(m, posts - n - m) for m, n in zip(more, heights.shape, strict=True)], "reflect")


def camera(heightmap):
    """Look north from above the middle of a map."""
    x, y = (0.5 * extent for extent in heightmap.extent_m)
    z = float(heightmap.heights[heightmap.rows // 2, heightmap.cols // 2]) + ABOVE_M
    return tg.Camera((x, y, z), (x, y + AHEAD_M, z - BELOW_M))


def measure(heights, spacing_m, posts):
    """Seconds from heights to the first picture, and the stats of the frames that follow."""
    middle, half = heights.shape[0] // 2, posts // 2
    crop = heights[middle - half : middle + half + 1, middle - half : middle + half + 1]
    heightmap = tg.Heightmap(crop, spacing_m, f"{posts}")
    started = time.perf_counter()
    with tg.Renderer(heightmap) as renderer:
        view = {"camera": camera(heightmap)}
        renderer.render(**view)
        first_s = time.perf_counter() - started
        return first_s, bench(renderer, dense=False, **view)


def main():
    """Print a line for each size."""
    sizes = [int(word) for word in sys.argv[1:]] or [1025, 2049, 4097, 8193]
    known = bundled()["alpine-30m"]
    land = tg.Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    heights = mirrored(land.heights, max(sizes))
    columns = ("first s", "error ms", "lod ms", "frame ms", "python ms", "triangles", "MiB", "frame ratio")
    print(f"{'posts':>6}" + "".join(f"{column:>12}" for column in columns))
    least = None
    for posts in sizes:
        first_s, stats = measure(heights, land.spacing_m, posts)
        ms = stats["ms"]
        least = least or ms["frame"]
        numbers = [first_s, ms["error"], ms["lod"], ms["frame"], ms["python"], stats["triangles"]]
        numbers += [stats["gpu_bytes"]["total"] / 2**20, ms["frame"] / least]
        print(f"{posts:6}" + "".join(f"{number:12,.6g}" for number in numbers), flush=True)


if __name__ == "__main__":
    main()
