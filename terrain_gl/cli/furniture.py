"""`--furniture`: title, north arrow, scale bar and legend in a picture."""

from pathlib import Path

from ..camera import Camera
from ..files.furniture import Stamp, furniture, land_ahead_m
from ..heightmap import Heightmap
from ..light.lighting import ramp_seen
from ..light.ramps import LOOKS as RAMPS
from ..light.ramps import Ramp, Values, ramp_for
from ..renderer.options import FrameOptions
from . import options
from .records import DrawOptions


def add(command: options.Options) -> None:
    """Declare the options."""
    group = options.group_of(command, "picture")
    what = "draw a title, the north, a scale, and the legend of a ramp"
    group.add_argument("--furniture", action="store_true", help=what)
    group.add_argument("--title", metavar="TEXT", help="of --furniture (default: the map's name)")


def of(asked: DrawOptions, heightmap: Heightmap, camera: Camera) -> list[Stamp]:
    """Stamps to draw over a picture; none without `--furniture`."""
    laid = asked.laid
    if not laid.furniture:
        return []
    title = Path(heightmap.name).stem if laid.title is None else laid.title
    ahead_m = land_ahead_m(heightmap.coarse(), camera)
    ramp = ramp_of(asked.frame, heightmap)
    return furniture(asked.camera.size, camera, ahead_m, title, *ramp, heightmap.north_deg, asked.frame.units)


def ramp_of(frame: FrameOptions, heightmap: Heightmap) -> tuple[Ramp | None, str]:
    """The ramp that the picture shows, and the unit of its numbers."""
    if not frame.shading.is_lit:
        return None, ""
    if frame.drape:
        return ramp_seen(Values(frame.drape, frame.ramp, frame.ramp_range), heightmap.georeference), ""
    if frame.look in RAMPS:
        return ramp_for(*heightmap.range_m, frame.look, frame.ramp_range), frame.units
    return None, ""
