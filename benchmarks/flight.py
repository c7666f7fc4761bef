"""A fixed flight, frame by frame: how much frame times vary, and whether memory and OpenGL objects pile up.

    python benchmarks/flight.py [MAP [FRAMES [WIDTHxHEIGHT]]]      a bundled map or a file; canyon-15m, 1000, 320x180

The tour around the map (terrain_gl/film/tour.py) is flown three times: alone, with a stroke of radius 16 posts under
the eye in every frame, and recorded as a folder of pictures. The output has the median and the 99.9th percentile of
frame times, the share of them that the recorder takes, and the memory of the process and the number of OpenGL objects
after a tenth of the frames and at the end.
"""

from __future__ import annotations

import sys
import tempfile
import time
from ctypes import c_ubyte, c_uint
from pathlib import Path

import moderngl
import numpy as np

import terrain_gl as tg
from terrain_gl.files.maps import open_map
from terrain_gl.film.record import Recorder
from terrain_gl.film.tour import tour
from terrain_gl.gpu import gl

RADIUS = 16  # radius of a stroke, in posts
NAMES = 20_000  # largest number of an OpenGL object that is tested


def main() -> int:
    """Fly, and print the table."""
    name, frames, size = (*sys.argv[1:], *("canyon-15m", "1000", "320x180")[len(sys.argv) - 1 :])
    heightmap, _ = open_map(name)
    width, height = map(int, size.split("x"))
    with tempfile.TemporaryDirectory() as folder, tg.Renderer(heightmap, (width, height)) as renderer:
        print(f"{name}, {frames} frames of {size}, {renderer.ctx.info['GL_RENDERER']}")
        fly(renderer, int(frames), strokes=False, film=None)
        fly(renderer, int(frames), strokes=True, film=None)
        fly(renderer, int(frames), strokes=False, film=Path(folder) / "frames")
    return 0


def fly(renderer: tg.Renderer, count: int, strokes: bool, film: Path | None) -> None:
    """One flight, and its line in the table."""
    path, times, waits = tour(renderer.heightmap), [], []
    recorder = Recorder(film) if film else None
    early: tuple[int, dict[str, int]] | None = None
    for number, (camera, _) in enumerate(path.poses(count)):
        started = time.perf_counter()
        if strokes:
            stroke(renderer, camera.eye, number)
        image = renderer.render(camera).image
        drawn = time.perf_counter()
        if recorder:
            recorder.append(image)
        waits.append(1e3 * (time.perf_counter() - drawn))
        times.append(1e3 * (time.perf_counter() - started))
        if number == max(1, count // 10):
            early = memory(), objects(renderer.ctx)
    if recorder:
        recorder.close()
    times = times[1:]  # the first frame compiles shaders
    median, slowest = np.median(times), np.percentile(times, 99.9)
    what = "a stroke in each" if strokes else "recorded" if film else "as it is"
    print(f"{what:18} median {median:7.1f} ms   p99.9 {slowest:7.1f} ms   ratio {slowest / median:5.2f}", end="")
    print(f"   recorder {100 * sum(waits) / sum(times):4.1f} %" if film else "", end="")
    if early:
        print(f"   memory {early[0]:.1f} → {memory():.1f} MiB   objects {early[1]} → {objects(renderer.ctx)}", end="")
    print()


def stroke(renderer: tg.Renderer, eye: tuple[float, float, float], number: int) -> None:
    """Raise the land under the eye, or lower it again."""
    land = renderer.heightmap
    col, row = int(eye[0] / land.spacing_m[0]), int(land.rows - 1 - eye[1] / land.spacing_m[1])
    part = tuple(slice(max(0, at - RADIUS), at + RADIUS + 1) for at in (row, col))
    rows, cols = (np.arange(*side.indices(n)) for side, n in zip(part, land.heights.shape, strict=True))
    away = np.hypot(rows[:, None] - row, cols[None, :] - col) / RADIUS
    bump = min(land.spacing_m) * np.maximum(0, 1 - away * away) ** 2
    renderer.edit(*part, land.heights[part] + (-1) ** number * bump)


def memory() -> float:
    """Memory of the process in MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


def objects(ctx: moderngl.Context) -> dict[str, int]:
    """The number of OpenGL objects, by kind."""
    kinds = ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Query")
    asks = {kind: gl.function(ctx, f"glIs{kind}", c_ubyte, c_uint) for kind in kinds}
    return {kind: sum(bool(ask(name)) for name in range(1, NAMES)) for kind, ask in asks.items()}


if __name__ == "__main__":
    sys.exit(main())
