"""`terrain-gl info`: the OpenGL of this machine, and facts about a map. Works without OpenGL, too."""

import os
from dataclasses import dataclass
from typing import Any

from ..basics.exceptions import TerrainError
from ..basics.version import __version__
from ..files.maps import bundled, files_read, open_map
from ..gpu import gl
from ..gpu.context import Probe, create_context, probe_backends
from ..heightmap import Heightmap
from ..readers.place import Place, degrees
from ..store import StoredMap, is_store
from . import options, report
from .records import MapOptions

_LIMITS = ("texture_size", "viewport_size", "tess_level", "samples", "storage_block_bytes")


@dataclass(frozen=True)
class InfoOptions:
    """What `info` was told."""

    map: MapOptions
    name: str | None = None  # of the map
    json: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "info",
        InfoOptions,
        run,
        help="the OpenGL of this machine, and facts about a map",
        description="Report which OpenGL back ends work, what to install for the others, and facts about a map.\n"
        "The exit status is 0 even if no back end works; it is 1 if the map cannot be read.",
        example="info dem.tif --spacing 30",
    )
    options.add_map(command, optional=True)
    options.add_json(command)


def run(asked: InfoOptions) -> int:
    """Run the command."""
    report.check_outputs([asked.json], () if asked.name is None else files_read(asked.name))
    about_map = None if asked.name is None else _about(asked.map)
    probes = probe_backends()
    found = {"version": __version__, "backends": [probe._asdict() for probe in probes], "limits": limits()}
    found |= {"map": about_map} if about_map else {"maps": list(bundled())}
    report.write_json(asked.json, found)
    report.say(asked.json, text(probes, found))
    return 0


def _about(asked: MapOptions) -> dict[str, Any]:
    if not is_store(asked.name):
        heightmap, _ = open_map(*asked.source)
        report.notes_of(heightmap)
        return describe(heightmap)
    stored = StoredMap(asked.name)
    return describe(stored) | {"store": {key: value for key, value in stored.about.items() if key != "georeference"}}


def describe(heightmap: Heightmap) -> dict[str, Any]:
    """Facts about a map: posts, spacing, range, voids, bytes of its heights."""
    return {
        "name": heightmap.name,
        "cols": heightmap.cols,
        "rows": heightmap.rows,
        "spacing_m": list(heightmap.spacing_m),
        "extent_m": list(heightmap.extent_m),
        "range_m": list(heightmap.range_m),
        "values": heightmap.values,
        "voids": heightmap.voids,
        "bytes": heightmap.heights.nbytes,
        **_lies(heightmap.place),
    }


def _lies(place: Place | None) -> dict[str, Any]:
    """The place of a map: coordinate system, GDAL's six numbers, and the degrees of its middle if they are known."""
    if place is None:
        return {"crs": None, "transform": None, "middle_lonlat": None, "north_deg": 0.0}
    grid = place.georeference.grid
    try:
        name = place.name
        middle = list(place.middle)
    except TerrainError:
        name = None
        middle = None
    transform = [grid.c, grid.a, grid.b, grid.f, grid.d, grid.e]
    return {"crs": name, "transform": transform, "middle_lonlat": middle, "north_deg": place.north_deg}


def limits() -> dict[str, int]:
    """Limits of the driver in use; empty without a driver."""
    try:
        ctx = create_context()
    except TerrainError:
        return {}
    with ctx:
        found = gl.limits(ctx)
    ctx.release()
    return {name: found[name] for name in _LIMITS}


def text(probes: list[Probe], found: dict[str, Any]) -> str:
    """The report as text."""
    lines = {"terrain-gl": found["version"]}
    lines |= {probe.name: f"works: OpenGL {probe.version}, {probe.renderer}" for probe in probes if probe.works}
    lines |= {probe.name: f"no: {probe.reason.removeprefix(probe.name + ': ')}" for probe in probes if not probe.works}
    if found["limits"]:
        lines["limits"] = ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in found["limits"].items())
    lines |= _map_lines(found["map"]) if "map" in found else {"maps": ", ".join(found["maps"])}
    return report.facts(lines)


def _map_lines(about: dict[str, Any]) -> dict[str, str]:
    east, north = about["spacing_m"]
    width, depth = about["extent_m"]
    low, high = about["range_m"]
    lies = degrees(*about["middle_lonlat"]) if about["middle_lonlat"] else "unknown"
    turned = f"; true north is {about['north_deg']:.2f} degrees clockwise from the grid's" if about["north_deg"] else ""
    return {
        "map": report.shown(os.path.basename(about["name"])),
        "posts": f"{about['cols']} x {about['rows']} (east x north)",
        "spacing": f"{east:g} m east, {north:g} m north",
        "extent": f"{width / 1e3:g} km x {depth / 1e3:g} km",
        "heights": f"{low:g} to {high:g} m",
        "values": about["values"],
        "voids": f"{about['voids']}",
        "middle": f"{lies} ({about['crs']}){turned}" if about["crs"] else lies,
        "memory": f"{report.mebibytes(about['bytes'])} of heights",
    }
