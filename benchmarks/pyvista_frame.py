"""One view, drawn by pyvista (VTK) from every post, and by terrain-gl: milliseconds a frame, in one run.

    pip install pyvista
    python benchmarks/pyvista_frame.py ps_height_1k.png --spacing 160 --z-scale 0.1

Both draw off screen and read the picture back. Each draws in a process of its own, because two GL libraries in one
process disturb each other. They take turns, so that the load is the same for both, and the eye moves a little in
each frame. A frame without a picture ends the benchmark. Only this benchmark needs pyvista.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection

import numpy as np
from table import head, row

import terrain_gl as tg

SIZE = (1280, 720)
STEP = 1e-4  # of the map's side: how far the eye moves from frame to frame
Draw = Callable[[tg.Camera], np.ndarray]


def main() -> None:
    """Draw, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map")
    parser.add_argument("--spacing", type=float, default=30.0)
    parser.add_argument("--z-scale", type=float, default=1.0)
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--method", default="sat")
    args = parser.parse_args()
    times = times_of(
        {
            ("pyvista, every post", 1): (drawn_by_pyvista, args, 0),
            ("pyvista, every post", 4): (drawn_by_pyvista, args, 4),
            ("terrain-gl, lambert", 4): (drawn_by_us, args, "lambert"),
            ("terrain-gl, shaded", 4): (drawn_by_us, args, "shaded"),
        },
        args.frames,
    )
    heightmap = map_of(args)
    print_table(f"{heightmap.cols} × {heightmap.rows} posts", times)


def map_of(args: argparse.Namespace) -> tg.Heightmap:
    """The map that the command line names."""
    return tg.Heightmap.open(args.map, args.spacing, args.z_scale)


def views_of(heightmap: tg.Heightmap) -> Iterator[tg.Camera]:
    """South of the map's middle, above it, with the far rim in view; each time a little further east."""
    (east, north), (low, high) = heightmap.extent_m, heightmap.range_m
    x = east / 2
    while True:
        yield tg.Camera((x, 0.18 * north, high + 0.03 * north), (x, 0.67 * north, low), 60.0)
        x += STEP * east


def drawn_by_us(args: argparse.Namespace, style: str) -> Draw:
    """Return a function that draws the map in a style and reads the picture."""
    renderer = tg.Renderer(map_of(args), SIZE)
    return lambda camera: renderer.render(camera, style=style, method=args.method).image


def drawn_by_pyvista(args: argparse.Namespace, samples: int) -> Draw:
    """Return a function that draws every post, smooth and plainly lit, and reads the picture."""
    import pyvista

    heightmap = map_of(args)
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
    plotter.set_background("black")
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.show(auto_close=False)

    def draw(camera: tg.Camera) -> np.ndarray:
        plotter.camera.position, plotter.camera.focal_point = camera.eye, camera.target
        plotter.camera.view_angle = camera.fov_deg
        plotter.reset_camera_clipping_range()
        plotter.render()
        return plotter.screenshot(return_img=True)

    return draw


def answer(pipe: Connection, make: Callable[..., Draw], args: argparse.Namespace, how: int | str) -> None:
    """In a process of its own: draw a frame for each message, and send its milliseconds."""
    draw, views = make(args, how), views_of(map_of(args))
    while pipe.recv():
        camera = next(views)
        started = time.perf_counter()
        image = draw(camera)
        took_ms = 1e3 * (time.perf_counter() - started)
        if image[..., :3].std() < 5.0:
            raise SystemExit("a frame shows nothing: the times would be false")
        pipe.send(took_ms)


def times_of(drawers: dict[tuple[str, int], tuple], frames: int) -> dict[tuple[str, int], list[float]]:
    """Milliseconds of each frame, drawn in turn; the first two rounds are not counted."""
    spawn = multiprocessing.get_context("spawn")
    pipes: dict[tuple[str, int], Connection] = {}
    for name, drawer in drawers.items():
        pipes[name], theirs = spawn.Pipe()
        spawn.Process(target=answer, args=(theirs, *drawer), daemon=True).start()
        theirs.close()
    times: dict[tuple[str, int], list[float]] = {name: [] for name in drawers}
    for _ in range(frames + 2):
        for name, pipe in pipes.items():
            pipe.send(True)
            times[name].append(pipe.recv())
    for pipe in pipes.values():
        pipe.send(False)
    return {name: all_of[2:] for name, all_of in times.items()}


def print_table(posts: str, times: dict[tuple[str, int], list[float]]) -> None:
    """Medians, and their ratios to pyvista's frames."""
    medians = {name: float(np.median(all_of)) for name, all_of in times.items()}
    one, four = (medians["pyvista, every post", samples] for samples in (1, 4))
    head(posts, "samples", "ms, median", "least", "relative to pyvista with 4 samples", "with 1 sample")
    for (name, samples), median in medians.items():
        least = min(times[name, samples])
        row(name, samples, f"{median:,.0f}", f"{least:,.0f}", f"{median / four:.2f}", f"{median / one:.2f}")


if __name__ == "__main__":
    main()
