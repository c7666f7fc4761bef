"""Times of every stage, beside numpy's cumulative sums of the same data and the dense drawing of the same view."""

from __future__ import annotations

import cProfile
import pstats
import time
from collections.abc import Callable
from functools import cache, partial
from statistics import median
from typing import Any

import numpy as np

from .renderer import Renderer

ENOUGH_S = 4.0  # seconds spent on one number, after which no more repeats are made


def bench(renderer: Renderer, frames: int = 7, dense: bool = True, **view: Any) -> dict[str, Any]:
    """Time everything; each number is the median of up to `frames` repeats in one run.

    Parameters
    ----------
    dense
        Also draw every post; takes long on large maps.
    view
        What `Renderer.render` takes.

    Returns
    -------
    dict
        The stats of a frame, with more times in `ms` and `dense` and `ratio` beside them: docs/stats.md.
    """
    stages = _stages(renderer, frames)
    stats, frame_ms = _frames(renderer, frames, view)
    python_ms = median(_repeat(lambda: _python_ms(lambda: renderer.draw(**view)), frames))
    ms = frame_ms | stages | {"python": python_ms}
    result = stats | {"ms": ms, "ratio": {"sat_to_numpy": ms["sat"] / ms["numpy"]}}
    return result | _dense(renderer, frames, view, result) if dense else result


def _dense(renderer: Renderer, frames: int, view: dict[str, Any], result: dict[str, Any]) -> dict[str, Any]:
    """The drawing of every post in the same view, and how much more it takes."""
    stats, ms = _frames(renderer, frames, view | {"method": "full"})
    more = {
        "dense_to_frame": ms["frame"] / result["ms"]["frame"],
        "dense_to_triangles": stats["triangles"] / max(1, result["triangles"]),
    }
    dense = {"triangles": stats["triangles"], "patches": stats["patches"], "ms": ms}
    return {"dense": dense, "ratio": result["ratio"] | more}


def _stages(renderer: Renderer, repeats: int) -> dict[str, float]:
    """Milliseconds of what is done once per map."""
    values = np.random.default_rng(0).integers(0, 2**16, renderer.heightmap.heights.shape, np.uint32)
    works: dict[str, Callable[[], Any]] = {
        "upload": renderer.terrain.upload,
        "sat": renderer.picture.sums.build,
        "numpy": lambda: values.cumsum(1, np.uint32).cumsum(0, np.uint32),
        "error": renderer.tables.build,
    }
    finish = renderer.ctx.finish
    return {name: median(_repeat(partial(_ms, work, finish), repeats)) for name, work in works.items()}


def _frames(renderer: Renderer, repeats: int, view: dict[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """Stats of a frame, and the medians of its times after a first one that does not count."""
    renderer.render(**view)
    stats = _repeat(lambda: renderer.render(**view).stats, repeats)
    once = ("sat", "error")
    return stats[-1], {key: median(s["ms"][key] for s in stats) for key in stats[-1]["ms"] if key not in once}


def _repeat(work: Callable[[], Any], repeats: int) -> list[Any]:
    started = time.perf_counter()
    results = [work()]
    while len(results) < repeats and time.perf_counter() - started < ENOUGH_S:
        results.append(work())
    return results


def _ms(work: Callable[[], Any], finish: Callable[[], Any]) -> float:
    finish()
    started = time.perf_counter()
    work()
    finish()
    return 1e3 * (time.perf_counter() - started)


def _python_ms(work: Callable[[], Any]) -> float:
    """Time in Python and numpy during `work`: all but what is inside OpenGL calls, and but the profiler's own."""
    calls = _profile(work)
    own = sum(own for (_, _, name), (_, _, own, _, _) in calls.items() if "'mgl." not in name)
    return 1e3 * (own - sum(n for _, n, *_ in calls.values()) * _profiler_s())


def _profile(work: Callable[[], Any]) -> dict[Any, Any]:
    """Calls of each function, as pstats has them: (file, line, name) to (calls, all calls, own s, total s, callers)."""
    profile = cProfile.Profile()
    profile.runcall(work)
    return pstats.Stats(profile).stats  # type: ignore[attr-defined]


@cache
def _profiler_s(calls: int = 20000) -> float:
    """Seconds that the profiler adds to a call."""

    def nothing() -> None:
        pass

    def many() -> None:
        for _ in range(calls):
            nothing()

    started = time.perf_counter()
    many()
    plain = time.perf_counter() - started
    profiled = sum(own for _, _, own, _, _ in _profile(many).values())
    return max(0.0, profiled - plain) / calls
