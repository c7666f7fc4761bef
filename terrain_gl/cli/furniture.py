"""`--furniture`: title, north arrow, scale bar and legend in a picture."""

import argparse
from pathlib import Path
from typing import Any

from ..camera import Camera
from ..files.furniture import Stamp, furniture, land_ahead_m
from ..heightmap import Heightmap
from ..light.lighting import ramp_seen
from ..light.ramps import LOOKS as RAMPS
from ..light.ramps import Ramp, Values, ramp_for
from ..shade.picture import Look


def add(command: Any) -> None:
    """Declare the options."""
    group = command.add_argument_group("picture")
    what = "draw a title, the north, a scale, and the legend of a ramp"
    group.add_argument("--furniture", action="store_true", help=what)
    group.add_argument("--title", metavar="TEXT", help="of --furniture (default: the map's name)")


def of(args: argparse.Namespace, heightmap: Heightmap, camera: Camera) -> list[Stamp]:
    """Stamps to draw over a picture of `args.size`; none without `--furniture`."""
    if not args.furniture:
        return []
    title = Path(heightmap.name).stem if args.title is None else args.title
    away_m = land_ahead_m(heightmap.coarse(), camera)
    return furniture(args.size, camera, away_m, title, *ramp_of(args, heightmap), heightmap.north_deg)


def ramp_of(args: argparse.Namespace, heightmap: Heightmap) -> tuple[Ramp | None, str]:
    """The ramp that the picture shows, and the unit of its numbers."""
    if not Look(args.style).is_lit:
        return None, ""
    if args.drape:
        return ramp_seen(Values(args.drape, args.ramp, args.ramp_range), heightmap.georeference), ""
    if args.look in RAMPS:
        return ramp_for(*heightmap.range_m, args.look, args.ramp_range), "m"
    return None, ""
