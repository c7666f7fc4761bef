"""`terrain-gl bench`: times, triangles and memory, stage by stage."""

import time
from dataclasses import dataclass, replace
from typing import Any

from ..comparison.bench import bench, flight, strokes
from ..files.maps import bundled
from . import options, report, values
from .records import DrawOptions
from .scene import make_renderer, open_scene

_ONCE = ("open", "first_picture", "upload", "sat", "numpy", "error")
_STAGES = (*_ONCE, "lod", "draw", "shade", "lambert", "frame", "python")


@dataclass(frozen=True)
class BenchOptions(DrawOptions):
    """What `bench` was told."""

    maps: tuple[str, ...] = ()
    frames: int = 7
    strokes: bool = False
    flight: int | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "bench",
        BenchOptions,
        run,
        help="times, triangles and memory, per stage",
        description="Time every stage on the given or the bundled maps: medians in milliseconds. For comparison: two\n"
        "cumulative sums over all posts by numpy (numpy), and a drawing of every post in the same view (dense).\n"
        "Compare the ratios of one run, not the milliseconds of two runs.",
        example="bench dem.tif --spacing 30 --json bench.json",
    )
    command.add_argument("maps", metavar="MAP", nargs="*", help="heightmap files or bundled names")
    command.add_argument("--frames", type=values.count, metavar="N", default=7, help="repeats (default: 7)")
    command.add_argument("--strokes", action="store_true", help="also time brush dabs with a radius of 64 posts")
    command.add_argument("--flight", type=values.count, metavar="FRAMES", help="also time a flight with brush dabs")
    options.add_map_options(command)
    options.add_rendering(command)


def run(asked: BenchOptions) -> int:
    """Run the command."""
    results = []
    names = asked.maps or tuple(bundled())
    with report.progress_bar("timing") as progress:
        for i, name in enumerate(names):
            if progress:
                progress(i / len(names))
            results.append(bench_map(replace(asked, map=replace(asked.map, name=name))))
    report.write_json(asked.output.json, results)
    report.say(asked.output.json, text(results))
    return 0


def bench_map(asked: BenchOptions) -> dict[str, Any]:
    """All numbers of one map."""
    started = time.perf_counter()
    scene = open_scene(asked)
    opened = time.perf_counter()
    with make_renderer(scene, asked) as renderer:
        view = scene.view()
        renderer.render(**view)
        pictured = time.perf_counter()
        result = bench(renderer, asked.frames, **view)
        if asked.strokes:
            result["strokes"] = strokes(renderer)
        if asked.flight:
            result["flight"] = flight(renderer, asked.flight, **view)
    result["ms"] |= {"open": 1e3 * (opened - started), "first_picture": 1e3 * (pictured - started)}
    about = {"map": scene.heightmap.name, "posts": scene.heightmap.heights.size}
    return about | result


def text(results: list[dict[str, Any]]) -> str:
    """The numbers as a text table, one column for each map."""
    rows = [["", *(report.shown(result["map"]).rpartition("/")[2] for result in results)]]
    rows += [["posts", *(f"{result['posts']:,}" for result in results)]]
    rows += [[f"{stage} ms", *(_ms(result["ms"], stage) for result in results)] for stage in _STAGES]
    rows += [["dense frame ms", *(_ms(result["dense"]["ms"], "frame") for result in results)]]
    rows += [["triangles", *(f"{result['triangles']:,}" for result in results)]]
    rows += [["dense triangles", *(f"{result['dense']['triangles']:,}" for result in results)]]
    rows += [[name.replace("_", " "), *(f"{r['ratio'][name]:.3g}" for r in results)] for name in results[0]["ratio"]]
    rows += [["certified px", *(_px(result["certified_max_error_px"]) for result in results)]]
    if "strokes" in results[0]:
        ms = [result["strokes"]["ms"] for result in results]
        rows += [[f"stroke {name} ms", *(f"{each[name]:.2f}" for each in ms)] for name in ms[0]]
    if "flight" in results[0]:
        flown = [result["flight"] for result in results]
        rows += [[f"flight {name} ms", *(f"{each['ms'][name]:.2f}" for each in flown)] for name in flown[0]["ms"]]
        rows += [["flight p99_9 to median", *(f"{each['p99_9_to_median']:.3g}" for each in flown)]]
    parts = results[0]["gpu_bytes"]
    rows += [[f"{part} memory", *(report.mebibytes(r["gpu_bytes"][part]) for r in results)] for part in parts]
    return f"{results[0]['gl_renderer']} ({results[0]['backend']})\n{report.table(rows)}"


def _px(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _ms(times: dict[str, float], stage: str) -> str:
    return f"{times[stage]:.2f}" if stage in times else "-"
