"""A window's flight without a window: what the benchmarks of the window share."""

from __future__ import annotations

import time
from collections.abc import Callable

from terrain_gl.context import create_context
from terrain_gl.maps import open_map
from terrain_gl.viewer.flight import Flight
from terrain_gl.viewer.gui import Gui
from terrain_gl.viewer.gui import library as library_of_gui
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.overlay import Overlay
from terrain_gl.viewer.settings import Settings


def open_flight(size: tuple[int, int]) -> Flight:
    """A flight in a picture of its own, without a map yet; with panels where they are installed."""
    ctx = create_context()
    target = ctx.framebuffer([ctx.texture(size, 4)])
    return Flight(Overlay(ctx), target, size, Settings(), gui=Gui(ctx) if library_of_gui() else None)


def opened(name: str) -> Opened:
    """A bundled map with its own view."""
    heightmap, known = open_map(name)
    assert known
    return Opened(heightmap, known.camera, known.sun, known.name)


def time_of(work: Callable[[], object], finish: Callable[[], object]) -> tuple[float, float]:
    """How long something takes until the GPU is done: milliseconds by the clock, and of all cores' work."""
    begun, worked = time.perf_counter(), time.process_time()
    work()
    finish()
    return 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - worked)
