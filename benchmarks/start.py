"""From the start of a process to a picture in a file: the time of each step, and a comparison with pyvista (VTK).

    python benchmarks/start.py                                              alpine-30m, step by step
    python benchmarks/start.py ps_height_1k.png --spacing 160 --z-scale 0.1 --pyvista   whole processes in turn, too

Steps run in one process. Whole processes are started alternately, so that the load is the same for all; a shader cache
on disk is warm after the first. Each line has elapsed seconds and processor seconds of all threads: on a busy machine
compare the latter. Unset PYTHONDONTWRITEBYTECODE before: an installed package has its bytecode. Only `--pyvista` needs
pyvista and imageio.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from table import head, row

PYVISTA = """
import sys, numpy as np, imageio.v3 as iio, pyvista
path, spacing, z_scale, out, *numbers = sys.argv[1:]
h = iio.imread(path).astype(float) * float(z_scale)
rows, cols = h.shape
x, y = np.meshgrid(np.arange(cols) * float(spacing), (rows - 1 - np.arange(rows)) * float(spacing))
eye, target, fov = numbers[:3], numbers[3:6], numbers[6]
plotter = pyvista.Plotter(off_screen=True, window_size=[1280, 720])
plotter.add_mesh(pyvista.StructuredGrid(x, y, h), color="white", smooth_shading=True)
plotter.camera.position, plotter.camera.focal_point = [float(v) for v in eye], [float(v) for v in target]
plotter.camera.up, plotter.camera.view_angle = (0, 0, 1), float(fov)
plotter.reset_camera_clipping_range()
plotter.show(auto_close=False)
plotter.screenshot(out)
"""


@contextmanager
def line(name: str) -> Iterator[None]:
    """Print how long a step takes."""
    clock, cpu = time.perf_counter(), time.process_time()
    yield
    row(name, f"{time.perf_counter() - clock:.2f}", f"{time.process_time() - cpu:.2f}")


def steps(args: argparse.Namespace) -> None:
    """One process, step by step."""
    head("step", "s", "processor s")
    with line("import"):
        import terrain_gl as tg
        from terrain_gl.files.maps import open_map
        from terrain_gl.files.views import standard_view
        from terrain_gl.readers import Reading
    with line("read the map"):
        heightmap, _ = open_map(args.map, Reading(z_scale=args.z_scale), args.spacing)
    with line("context, shaders and tables of the error"):
        renderer = tg.Renderer(heightmap, (1280, 720))
        renderer.ctx.finish()
    camera = standard_view(heightmap)
    for style in ("lambert", "shaded"):
        for which in ("first", "next"):
            with line(f"{which} picture, `{style}`"):
                renderer.draw(camera, 1.0, style=style)
                renderer.ctx.finish()


def processes(args: argparse.Namespace) -> None:
    """Whole processes, from their start to the file."""
    import terrain_gl as tg

    z_scale = args.z_scale or 1.0
    heightmap = tg.Heightmap.open(args.map, args.spacing, z_scale)
    (east, north), (low, high) = heightmap.extent_m, heightmap.range_m
    eye, target, fov = (east / 2, 0.18 * north, high + 0.03 * north), (east / 2, 0.67 * north, low), 60.0
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "picture.png")
        scale = ["--spacing", str(args.spacing), "--z-scale", str(z_scale), "--fov", str(fov)]
        view = [f"--eye={','.join(map(str, eye))}", f"--target={','.join(map(str, target))}"]
        ours = [sys.executable, "-m", "terrain_gl", "shot", args.map, *scale, *view, "-o", out]
        numbers = [str(v) for v in (*eye, *target, fov)]
        theirs = [sys.executable, "-c", PYVISTA, args.map, str(args.spacing), str(z_scale), out, *numbers]
        runs = {
            "pyvista, every post": theirs,
            "terrain-gl, `lambert`": [*ours, "--style", "lambert"],
            "terrain-gl, default": ours,
        }
        seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
        for _ in range(args.times + 1):
            for name, command in runs.items():
                seconds[name].append(run(command))
    head("from start to file", "s, least", "processor s, least")
    for name, taken in seconds.items():
        clock, cpu = (min(values) for values in zip(*taken[1:], strict=True))
        row(name, f"{clock:.1f}", f"{cpu:.1f}")


def run(command: list[str]) -> tuple[float, float]:
    """Elapsed seconds and processor seconds of a process."""
    before, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter() - clock, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Time the steps; with --pyvista, also whole processes."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("map", nargs="?", default="alpine-30m")
    parser.add_argument("--spacing", type=float)
    parser.add_argument("--z-scale", type=float)
    parser.add_argument("--pyvista", action="store_true", help="also whole processes, ours and pyvista's, in turn")
    parser.add_argument("--times", type=int, default=3)
    args = parser.parse_args()
    steps(args)
    if args.pyvista:
        if not args.spacing:
            parser.error("--pyvista needs the path of an image that imageio reads, and --spacing")
        processes(args)


if __name__ == "__main__":
    main()
