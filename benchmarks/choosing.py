"""Time for choosing a mesh: the same land, seen from the same place, in larger and larger maps.

The land in the picture is the middle of the bundled range, mirrored until the map is large enough. All maps have the
same range of heights, so `sat` draws the same mesh. Times are processor milliseconds of all threads, the least of
eight runs of five frames.

Run: python benchmarks/choosing.py [SIZE ...]; by default 1025, 2049, 4097 and 8193 posts a side.
"""

import resource
import sys

import numpy as np
from scale import mirrored
from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import bundled
from terrain_gl.lod import Goal
from terrain_gl.renderer.options import near_plane_m
from terrain_gl.shade.picture import UNLIT

SIZE = (1280, 720)
ABOVE_M, AHEAD_M, BELOW_M = 1500.0, 2500.0, 500.0
RUNS, FRAMES = 8, 5


def processor_ms() -> float:
    """Processor time of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return 1e3 * (used.ru_utime + used.ru_stime)


def camera(heightmap):
    """Above the middle, looking down to the north."""
    east, north = (0.5 * extent for extent in heightmap.extent_m)
    ground = float(heightmap.heights[heightmap.rows // 2, heightmap.cols // 2])
    return tg.Camera(eye=(east, north, ground + ABOVE_M), target=(east, north + AHEAD_M, ground - BELOW_M))


def chosen(renderer, view):
    """Triangles and patches of the mesh, and milliseconds for choosing it."""
    stats = renderer.draw(view, 1.0, style=UNLIT)
    selector, near_m = renderer.inspector.frame.selection.surface, near_plane_m(renderer.heightmap)
    times = []
    for _ in range(RUNS):
        start = processor_ms()
        for _ in range(FRAMES):
            selector.select(view, SIZE, near_m, Goal(1.0))
        selector.ctx.finish()
        times.append((processor_ms() - start) / FRAMES)
    return stats["triangles"], stats["patches"], min(times)


def main():
    """Print a line for each map."""
    sizes = [int(word) for word in sys.argv[1:]] or [1025, 2049, 4097, 8193]
    known = bundled()["alpine-30m"]
    land = tg.Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    heights = mirrored(land.heights, max(sizes))
    head("posts", "triangles", "patches", "ms")
    for posts in sizes:
        first = (max(sizes) - posts) // 2
        part = np.ascontiguousarray(heights[first : first + posts, first : first + posts])
        heightmap = tg.Heightmap(part, land.spacing_m, f"{posts}")
        heightmap.quantised_m = float(heights.min()), float(heights.max())
        with tg.Renderer(heightmap, SIZE) as renderer, renderer.session:
            triangles, patches, ms = chosen(renderer, camera(heightmap))
            row(f"{posts}²", f"{triangles:,}", f"{patches:,}", f"{ms:.1f}")


if __name__ == "__main__":
    main()
