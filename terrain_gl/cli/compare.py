"""`terrain-gl compare`: every method side by side, as in Fig. D.1 of the supplement of Li et al. 2021."""

import os
import re
import textwrap
from dataclasses import dataclass
from typing import Any

from ..basics.exceptions import UsageError
from ..comparison import figures
from ..comparison.compare import FINE, LABELS
from ..comparison.study import SHADING, VERTICES, Study, study
from . import options, report, values
from .records import DrawOptions
from .scene import CommandScene, make_renderer, open_scene

TRIANGLES = 100_000
NARROWEST = 8
_CAPTION = 46  # characters in a line
_OWN = (
    "method",
    "triangles",
    "max_error_px",
    "metric",
    "parameters",
)  # what differs between methods


@dataclass(frozen=True)
class CompareOptions(DrawOptions):
    """What `compare` was told."""

    baseline_vertices: str
    baseline_shading: str
    curve: bool
    supersample: int
    metric: str
    command_line: str = ""
    triangles: int | None = None
    max_error: float | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "compare",
        CompareOptions,
        run,
        help="all methods side by side with equal triangle counts, next to the truth",
        description="Draw one view with every method and the same number of triangles, next to the truth: every post,\n"
        "supersampled. The figure magnifies the place where they differ most, and shows the screen error.\n"
        "With --max-error: the triangles needed to certify that error, and how many the other methods need\n"
        "to achieve it.",
        example="compare canyon --view ridge --triangles 50000 --curve -o compare.png",
    )
    options.add_map(command)
    options.add_output(command, f"figure, {', '.join(figures.FORMATS)}")
    options.add_camera(command)
    group = command.add_argument_group("detail")
    asked = group.add_mutually_exclusive_group()
    asked.add_argument("--triangles", type=values.count, metavar="N", help=f"for each method (default: {TRIANGLES})")
    asked.add_argument("--max-error", type=values.positive, metavar="PX", help="the error to certify and to achieve")
    options.add_option(group, "metric")
    group.add_argument(
        "--baseline-vertices",
        choices=VERTICES,
        default=VERTICES[0],
        help="between: baselines may have vertices between posts, as ours have (default); posts: on posts alone",
    )
    group.add_argument(
        "--baseline-shading",
        choices=SHADING,
        default=SHADING[0],
        help="map: same shading for all (default); mesh: baselines are shaded from the surface that they draw",
    )
    group.add_argument("--curve", action="store_true", help="also plot the error at other numbers of triangles")
    group.add_argument(
        "--supersample",
        type=values.count,
        metavar="K",
        default=FINE,
        help=f"draw each pixel as K x K pixels (default: {FINE})",
    )
    options.add_look(command)
    options.add_technical(command)


def run(asked: CompareOptions) -> int:
    """Run the command."""
    figures.available()
    path, size = asked.output.path, asked.camera.size
    if os.path.splitext(path)[1].lower() not in figures.FORMATS:
        raise UsageError(f"{report.shown(path)}: must end in one of {', '.join(figures.FORMATS)}")
    if size[1] > NARROWEST * size[0]:
        raise UsageError(f"--size: expected pictures at most {NARROWEST} times as high as wide: a figure holds several")
    scene = open_scene(asked)
    with make_renderer(scene, asked) as renderer, report.progress_bar("comparing") as progress:
        wanted = asked.triangles or TRIANGLES, asked.max_error, asked.curve, asked.supersample
        own = asked.baseline_vertices == "between", asked.baseline_shading == "mesh"
        look = {name: value for name, value in vars(scene.frame).items() if name not in _OWN} | {"metric": asked.metric}
        found = study(renderer, scene.camera, *wanted, progress, *own, **look)
    with report.json_output(asked.output.json, about(asked, scene) | found.record()):
        figures.figure(path, found, caption(asked, scene))
    report.say(asked.output.json, f"{report.shown(path)}\n{text(found)}")
    return 0


def about(asked: CompareOptions, scene: CommandScene) -> dict[str, Any]:
    """Map, view and command, for JSON."""
    camera = scene.camera
    view = {"eye": list(camera.eye), "target": list(camera.target), "fov_deg": camera.fov_deg}
    told = {"command": asked.command_line, "supersample": asked.supersample}
    return {"map": scene.heightmap.name} | told | {"view": view}


def caption(asked: CompareOptions, scene: CommandScene) -> list[str]:
    """The figure's caption: map, view, the meaning of the numbers, the command."""
    heightmap = scene.heightmap
    camera = scene.camera
    width, height = asked.camera.size
    place = [",".join(f"{metres:.0f}" for metres in point) for point in (camera.eye, camera.target)]
    lines = [
        f"{os.path.basename(report.shown(heightmap.name))}: {heightmap.cols} × {heightmap.rows} posts",
        f"eye {place[0]} m, target {place[1]} m",
        f"{camera.fov_deg:g}°, {width} × {height} pixels",
        "in brackets: RMSE of the picture,",
        "black 0 to white 1",
        "",
    ]
    lines = [part for line in lines for part in textwrap.wrap(line, _CAPTION) or [""]]
    return lines + in_lines(report.shown(asked.command_line))


def in_lines(command: str) -> list[str]:
    """Wrap a command line between options."""
    bound = re.sub(r"(?<= )(--?[a-z-]+) (?=[^-])", "\\1\N{NO-BREAK SPACE}", command)
    lines = textwrap.wrap(bound, _CAPTION, subsequent_indent="   ", break_on_hyphens=False)
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]


def text(found: Study) -> str:
    """The numbers as a text table, one column for each method."""
    rows = [["", *(LABELS[entry.method] for entry in found.entries)]]
    rows += [[line.label, *line.cells] for line in found.table()]
    return report.table(rows) + curves_text(found) + uneven_text(found)


def uneven_text(found: Study) -> str:
    """A note on methods that could not draw the requested number of triangles."""
    off = [f"{LABELS[method]} {100 * share:+.0f} %" for method, share in found.uneven().items()]
    return f"\n\nnot equal to {found.triangles:,} triangles: {', '.join(off)}" if off else ""


def curves_text(found: Study) -> str:
    """RMS error by number of triangles; empty without --curve."""
    if not (found.curves and found.pruned):
        return ""
    rows = [["RMS px at triangles", *(LABELS[method] for method in found.curves), "Quads alone, pruned"]]
    for i, pruned_px in enumerate(found.pruned.rms_px):
        points = [points[i] for points in found.curves.values()]
        cells = [f"{point['rms_error_px']:.3f} ({point['triangles']:,})" for point in points]
        rows += [[f"{found.pruned.triangles[i]:,}", *cells, f"{pruned_px:.3f}"]]
    return "\n\n" + report.table(rows)
