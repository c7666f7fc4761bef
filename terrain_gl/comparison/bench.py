"""Times of every stage. We compare them with numpy's cumulative sums of the same data, and with drawing every post."""

import cProfile
import pstats
import time
from collections.abc import Callable
from functools import cache, partial
from statistics import median
from typing import Any

import numpy as np

from ..film.tour import tour
from ..gpu.session import in_session
from ..renderer import Renderer
from ..renderer.brush import Brush, Sculptor

_IN_THE_MIDDLE = 5  # dabs in the middle of the map; their median is reported
_IN_A_ROUND = 5  # frames in a row with the profiler, or without; the first frame after a change takes longer
DABS, RADIUS_POSTS = 20, 64  # of `strokes`: at random places
TINY = (16, 16)  # size of the picture whose time in Python is measured
ENOUGH_S = 4.0  # a measurement that took this long is not repeated again


@in_session
def bench(renderer: Renderer, frames: int = 7, dense: bool = True, **view: Any) -> dict[str, Any]:
    """Time everything in one run; each number is the median of up to `frames` repeats (`python`: three times as many).

    The result has the stats of a frame with further times in `ms`, `ratio`, and unless `dense` is False those of a mesh
    with every post, which takes long on large maps: docs/stats.md. `view` has arguments of `Renderer.render`.
    """
    stages = _stages(renderer, frames)
    stats, frame_ms = _frames(renderer, frames, view)
    python_ms = _python_ms(renderer, 3 * frames, view)
    lambert_ms = _frames(renderer, frames, view | {"style": "lambert"})[1]["shade"]
    ms = frame_ms | stages | {"python": python_ms, "lambert": lambert_ms}
    ratio = {"sat_to_numpy": ms["sat"] / ms["numpy"], "shade_to_lambert": ms["shade"] / lambert_ms}
    result = stats | {"ms": ms, "ratio": ratio}
    return result | _dense(renderer, frames, view, result) if dense else result


@in_session
def strokes(renderer: Renderer) -> dict[str, Any]:
    """Time brush dabs at random places, and some in the middle of the map, where they change nodes of every level.

    The dabs are undone at the end. docs/stats.md describes the result.
    """
    heightmap = renderer.heightmap
    finish = renderer.ctx.finish
    east, north = heightmap.extent_m
    low, high = heightmap.range_m
    rng = np.random.default_rng(0)
    sculptor = Sculptor(renderer)
    places = rng.random((DABS, 2)) * (east, north)
    # warm up: shaders are compiled before anything is timed
    sculptor.dab(Brush("raise", min(heightmap.spacing_m), 0.01), *places[0])
    times = []
    for i, place in enumerate([*places, *[(east / 2, north / 2)] * _IN_THE_MIDDLE]):
        brush = Brush(("raise", "lower")[i % 2], RADIUS_POSTS * max(heightmap.spacing_m), 0.02 * (high - low))
        times.append(_ms(partial(sculptor.dab, brush, *place), finish))
    rebuild_ms = median(_repeat(lambda: _ms(partial(_rebuild, renderer), finish), 3))
    while sculptor.undo():
        pass
    sculptor.end()
    elsewhere = times[:DABS]
    middle = times[DABS:]
    ms = {"median": median(elsewhere), "most": max(elsewhere), "middle": median(middle)}
    ratio = {name: value / rebuild_ms for name, value in ms.items()}
    return {"radius_posts": RADIUS_POSTS, "count": DABS, "ms": ms | {"rebuild": rebuild_ms}, "ratio": ratio}


@in_session
def flight(renderer: Renderer, frames: int = 1000, dab_every: int = 10, **view: Any) -> dict[str, Any]:
    """Time the frames of `tour`, one by one, with a brush dab below the eye in every `dab_every`-th frame.

    A frame's time runs from the camera to the finished picture on the GPU. A first round warms up and does not count.
    The dabs are undone. docs/stats.md describes the result.
    """
    heightmap = renderer.heightmap
    sculptor = Sculptor(renderer)
    relief_m = heightmap.range_m[1] - heightmap.range_m[0]
    poses = list(tour(heightmap).poses(frames))
    dabs = [Brush(tool, 16 * max(heightmap.spacing_m), 0.005 * relief_m) for tool in ("raise", "lower")]

    def frame(i: int) -> None:
        camera = poses[i].camera
        if i % dab_every == 0:
            sculptor.dab(dabs[i // dab_every % 2], *camera.eye[:2])
        renderer.draw(**view | {"camera": camera})

    for i in range(0, frames, max(1, frames // 20)):
        frame(i)
    times = [_ms(partial(frame, i), renderer.ctx.finish) for i in range(frames)]
    while sculptor.undo():
        pass
    sculptor.end()
    ms = {"median": median(times), "p99_9": float(np.quantile(times, 0.999)), "most": max(times)}
    dab_count = -(-frames // dab_every)
    return {"frames": frames, "dabs": dab_count, "ms": ms, "p99_9_to_median": ms["p99_9"] / ms["median"]}


def _rebuild(renderer: Renderer) -> None:
    """Update the tables of the whole map in the way in which an edit updates the tables of its rectangle."""
    renderer.terrain.upload()
    renderer.tables.build()
    renderer.picture.update((0, 0, renderer.heightmap.cols - 1, renderer.heightmap.rows - 1))


def _dense(renderer: Renderer, frames: int, view: dict[str, Any], result: dict[str, Any]) -> dict[str, Any]:
    """Draw every post in the same view, and report how much longer that takes."""
    stats, ms = _frames(renderer, frames, view | {"method": "full"})
    more = {
        "dense_to_frame": ms["frame"] / result["ms"]["frame"],
        "dense_to_triangles": stats["triangles"] / max(1, result["triangles"]),
    }
    dense = {"triangles": stats["triangles"], "patches": stats["patches"], "ms": ms}
    return {"dense": dense, "ratio": result["ratio"] | more}


def _stages(renderer: Renderer, repeats: int) -> dict[str, float]:
    """Milliseconds of the stages that run once for each map."""
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
    """Stats of a frame, and the medians of its times; the first frame does not count."""
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


def _python_ms(renderer: Renderer, rounds: int, view: dict[str, Any]) -> float:
    """Milliseconds that the drawing thread computes in a frame, outside of OpenGL: in Python, numpy and moderngl.

    The picture is tiny, so the driver takes little time; for Python, it is a frame like any other. Rounds of frames
    with and without the profiler alternate, so that other programs slow both alike.
    """
    size = renderer.size
    draw = partial(renderer.draw, **view)
    renderer.resize(TINY)
    try:
        draw()
        measures = _thread_ms, _opengl_ms
        times = _repeat(lambda: [median(measure(draw) for _ in range(_IN_A_ROUND)) for measure in measures], rounds)
        whole_ms, opengl_ms = (median(each) for each in zip(*times, strict=True))
        return max(0.0, whole_ms - opengl_ms)
    finally:
        renderer.resize(size)


def _thread_ms(work: Callable[[], Any]) -> float:
    started = time.thread_time()  # the time of this thread alone
    work()
    return 1e3 * (time.thread_time() - started)


def _opengl_ms(work: Callable[[], Any]) -> float:
    """Milliseconds of this thread in moderngl's C functions, which call the driver.

    Calls that the profiler does not see count as Python: attributes that are set, and OpenGL through ctypes.
    """
    calls = [(n, own) for (_, _, name), (_, n, own, _, _) in _profile(work).items() if "'mgl." in name]
    return 1e3 * (sum(own for _, own in calls) - sum(n for n, _ in calls) * _profiler_s())


def _profile(work: Callable[[], Any]) -> dict[Any, Any]:
    """Calls of each function as in pstats: (file, line, name) to (calls, all calls, own s, total s, callers)."""
    profile = cProfile.Profile(time.thread_time)
    profile.runcall(work)
    return pstats.Stats(profile).stats  # type: ignore[attr-defined]


@cache
def _profiler_s() -> float:
    """Seconds that the profiler adds to a call of a function of C."""

    def many() -> None:
        for i in range(20000):
            i.bit_length()

    # the minimum of several: other programs can only add time
    profiles = (_profile(many).items() for _ in range(5))
    return min(own / n for profile in profiles for (*_, name), (_, n, own, *_) in profile if "bit_length" in name)
