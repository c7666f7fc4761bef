"""`terrain-gl compare`: every method side by side, as in Fig. D.1 of the supplement of Li et al. 2021."""

import argparse
import os
import re
import textwrap
from typing import Any

from ..basics.exceptions import UsageError
from ..comparison import figures
from ..comparison.compare import FINE, LABELS
from ..comparison.study import SHADING, VERTICES, Study, study
from . import options, report, values

TRIANGLES = 100_000
NARROWEST = 8
_CAPTION = 46  # characters in a line


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "compare",
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


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    figures.available()
    if os.path.splitext(args.output)[1].lower() not in figures.FORMATS:
        raise UsageError(f"{report.shown(args.output)}: must end in one of {', '.join(figures.FORMATS)}")
    if args.size[1] > NARROWEST * args.size[0]:
        raise UsageError(f"--size: expected pictures at most {NARROWEST} times as high as wide: a figure holds several")
    scene = options.open_scene(args)
    with options.make_renderer(args, scene) as renderer, report.progress_bar("comparing") as progress:
        asked = args.triangles or TRIANGLES, args.max_error, args.curve, args.supersample
        own = args.baseline_vertices == "between", args.baseline_shading == "mesh"
        found = study(renderer, scene.camera, *asked, progress, *own, **look(args, scene))
    with report.json_output(args.json, about(args, scene) | found.record()):
        figures.figure(args.output, found, caption(args, scene))
    report.say(args.json, f"{report.shown(args.output)}\n{text(found)}")
    return 0


def look(args: argparse.Namespace, scene: options.CommandScene) -> dict[str, Any]:
    """The options that all methods share, by the names of `FrameOptions`."""
    own = ("method", "triangles", "max_error_px")
    return {key: value for key, value in options.view_of(args, scene).items() if key not in (*own, "camera")}


def about(args: argparse.Namespace, scene: options.CommandScene) -> dict[str, Any]:
    """Map, view and command, for JSON."""
    camera = scene.camera
    view = {"eye": list(camera.eye), "target": list(camera.target), "fov_deg": camera.fov_deg}
    return {"map": scene.heightmap.name, "command": args.command_line, "supersample": args.supersample, "view": view}


def caption(args: argparse.Namespace, scene: options.CommandScene) -> list[str]:
    """The figure's caption: map, view, the meaning of the numbers, the command."""
    heightmap = scene.heightmap
    camera = scene.camera
    place = [",".join(f"{metres:.0f}" for metres in point) for point in (camera.eye, camera.target)]
    lines = [
        f"{os.path.basename(report.shown(heightmap.name))}: {heightmap.cols} × {heightmap.rows} posts",
        f"eye {place[0]} m, target {place[1]} m",
        f"{camera.fov_deg:g}°, {args.size[0]} × {args.size[1]} pixels",
        "in brackets: RMSE of the picture,",
        "black 0 to white 1",
        "",
    ]
    lines = [part for line in lines for part in textwrap.wrap(line, _CAPTION) or [""]]
    return lines + in_lines(report.shown(args.command_line))


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
