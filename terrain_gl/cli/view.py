"""`terrain-gl view`: the interactive window."""

from __future__ import annotations

import argparse
from typing import Any

from ..maps import bundled
from . import options


def add(commands: Any) -> None:
    """Add the command."""
    first = next(iter(bundled()))
    command = options.add_command(
        commands,
        "view",
        run,
        help="fly over a map in a window",
        description=f"Fly over a map in a window; without MAP, over {first}. The key H shows the others.",
        example="view canyon --max-error 2",
    )
    options.add_map(command, optional=True)
    options.add_view(command)


def run(args: argparse.Namespace) -> int:
    """Open the window."""
    scene = options.open_scene(args, args.map or next(iter(bundled())))
    from .. import viewer  # here, for it needs a window system

    view = options.view_of(args, scene)
    return viewer.run(scene.heightmap, **view, size=args.size, name=scene.heightmap.name)
