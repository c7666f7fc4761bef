"""The app without a window: functions that the benchmarks of the window share."""

from __future__ import annotations

import time
from collections.abc import Callable

from terrain_gl.files.maps import open_map
from terrain_gl.gpu.context import create_context
from terrain_gl.viewer.app import App
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.settings import Settings


def open_app(size: tuple[int, int]) -> App:
    """An app that draws into its own framebuffer; it has no map yet."""
    ctx = create_context()
    return App(ctx, ctx.framebuffer([ctx.texture(size, 4)]), size, Settings())


def opened(name: str) -> Opened:
    """A bundled map with its own view."""
    heightmap, known = open_map(name)
    assert known
    return Opened(heightmap, known.camera, known.sun, known.name)


def time_of(work: Callable[[], object], finish: Callable[[], object]) -> tuple[float, float]:
    """Milliseconds until some work is done on the GPU: elapsed time, and processor time of all cores."""
    begun, worked = time.perf_counter(), time.process_time()
    work()
    finish()
    return 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - worked)
