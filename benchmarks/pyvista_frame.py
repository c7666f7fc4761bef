"""One view, drawn by pyvista (VTK) from every post, and by terrain-gl: milliseconds a frame, in one run.

    pip install pyvista
    python benchmarks/pyvista_frame.py ps_height_1k.png --spacing 160 --z-scale 0.1

Both draw off screen and read the picture back. They take turns, so that the load is the same for both. Each line gives
the samples a pixel; pyvista is drawn with one and with four. Only this benchmark needs pyvista.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
import pyvista

import terrain_gl as tg

SIZE = (1280, 720)


def main() -> None:
    """Draw, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map")
    parser.add_argument("--spacing", type=float, default=30.0)
    parser.add_argument("--z-scale", type=float, default=1.0)
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--method", default="sat")
    args = parser.parse_args()
    heightmap = tg.Heightmap.open(args.map, args.spacing, args.z_scale)
    camera = view_of(heightmap)
    renderer = tg.Renderer(heightmap, SIZE)

    def ours(style: str) -> Callable[[], object]:
        return lambda: renderer.render(camera, style=style, method=args.method)

    plotters = {samples: plotter_of(heightmap, camera, samples) for samples in (0, 4)}
    draws: dict[tuple[str, int], Callable[[], object]] = {
        ("pyvista, every post", samples or 1): frame_of(plotter) for samples, plotter in plotters.items()
    }
    draws |= {(f"terrain-gl, {style}", renderer.picture.samples): ours(style) for style in ("lambert", "shaded")}
    print_table(draws, times_of(draws, args.frames))


def view_of(heightmap: tg.Heightmap) -> tg.Camera:
    """South of the map's middle, a ninth of its side above it, with the far rim in view."""
    (east, north), (low, high) = heightmap.extent_m, heightmap.range_m
    return tg.Camera((east / 2, 0.18 * north, high + 0.03 * north), (east / 2, 0.67 * north, low), 60.0)


def plotter_of(heightmap: tg.Heightmap, camera: tg.Camera, samples: int) -> pyvista.Plotter:
    """Return a plotter of every post, smooth and plainly lit, that has drawn once."""
    rows, cols = heightmap.heights.shape
    east, north = heightmap.spacing_m
    x, y = np.meshgrid(np.arange(cols) * east, (rows - 1 - np.arange(rows)) * north)
    grid = pyvista.StructuredGrid(x, y, heightmap.heights.astype(np.float64))
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
    if samples:
        plotter.enable_anti_aliasing("msaa", multi_samples=samples)
    else:
        plotter.disable_anti_aliasing()
    plotter.add_mesh(grid, color="white", smooth_shading=True)
    plotter.camera.position, plotter.camera.focal_point = camera.eye, camera.target
    plotter.camera.up, plotter.camera.view_angle = (0.0, 0.0, 1.0), camera.fov_deg
    plotter.reset_camera_clipping_range()
    plotter.show(auto_close=False)
    return plotter


def frame_of(plotter: pyvista.Plotter) -> Callable[[], object]:
    """Return a function that draws the picture again and reads it."""

    def draw() -> object:
        plotter.render()
        return plotter.screenshot(return_img=True)

    return draw


def times_of(draws: dict[tuple[str, int], Callable[[], object]], frames: int) -> dict[tuple[str, int], list[float]]:
    """Milliseconds of each frame, drawn alternately; the first round is not counted."""
    times: dict[tuple[str, int], list[float]] = {name: [] for name in draws}
    for _ in range(frames + 1):
        for name, draw in draws.items():
            started = time.perf_counter()
            draw()
            times[name].append(1e3 * (time.perf_counter() - started))
    return {name: all_of[1:] for name, all_of in times.items()}


def print_table(draws: dict[tuple[str, int], Callable[[], object]], times: dict[tuple[str, int], list[float]]) -> None:
    """Medians, and their ratio to pyvista's frame with as many samples."""
    print("| | samples | ms, median | least | of pyvista's |\n|---|---|---|---|---|")
    for name, samples in draws:
        same = times.get(("pyvista, every post", samples), times["pyvista, every post", 1])
        median = float(np.median(times[name, samples]))
        ratio = median / float(np.median(same))
        print(f"| {name} | {samples} | {median:.0f} | {min(times[name, samples]):.0f} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
