"""`terrain-gl shot`: one picture, no window."""

from __future__ import annotations

import argparse
import os
from typing import Any

from ..exceptions import UsageError
from ..image import FORMATS, write_image
from . import options, report


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "shot",
        run,
        help="one picture, no window",
        description="Draw one picture of a map into a file.",
        example="shot canyon -o canyon.png --size 1920x1080 --max-error 0.5 --sun 245,20",
    )
    options.add_map(command)
    options.add_output(command, "picture: .png, or .jpg, .tif, .exr")
    options.add_drawing(command)


def run(args: argparse.Namespace) -> int:
    """Draw, write, tell."""
    if os.path.splitext(args.output)[1].lower() not in FORMATS:
        raise UsageError(f"{report.shown(args.output)}: a picture's name must end in one of {', '.join(FORMATS)}")
    scene = options.open_scene(args)
    with options.make_renderer(args, scene) as renderer:
        frame = renderer.render(**options.view_of(args, scene))
    with report.json_output(args.json, {"map": scene.heightmap.name} | frame.stats):
        write_image(args.output, frame.image)
    report.say(args.json, f"{report.shown(args.output)}: {summary(frame.stats)}")
    return 0


def summary(stats: dict[str, Any]) -> str:
    """A frame in a line."""
    size = f"{stats['width']}x{stats['height']}"
    error = f"{stats['metric']} error at most {stats['certified_max_error_px']:.3g} px"
    return f"{size}, {stats['triangles']:,} triangles, {error}, {stats['ms']['frame']:.0f} ms"
