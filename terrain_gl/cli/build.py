"""`terrain-gl build`: a store of a map, for maps larger than memory."""

import os
from dataclasses import dataclass
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..files import maps
from ..store import build, check
from ..store.format import mending
from . import options, report, values
from .records import MapOptions


@dataclass(frozen=True)
class BuildOptions:
    """What `build` was told."""

    map: MapOptions = MapOptions()
    maps: tuple[str, ...] = ()
    path: str | None = None
    check: str | None = None
    mend: bool = False
    fill: float | None = None
    workers: int = 1
    scheduler: str | None = None
    json: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "build",
        BuildOptions,
        run,
        help="a store of a map, for maps larger than memory",
        description="Read a map once, window by window, and write heights and error records of all levels into\n"
        "a Zarr store. The map does not change. The same command continues an interrupted build, and checks\n"
        "a finished store. Extra [store].",
        example="build tiles/*.tif -o land.zarr --workers 2",
    )
    command.add_argument("maps", metavar="MAP", nargs="*", help="heightmap file, or several files on one grid")
    command.add_argument("-o", "--output", metavar="STORE", dest="path", help="the folder to write")
    options.add_map_options(command)
    group = command.add_argument_group("build")
    what = "compare all files of a store with their hashes; exit status 1 if any is damaged"
    group.add_argument("--check", metavar="STORE", help=what)
    what = "write the damaged files of the store again, remove files that are not its own"
    group.add_argument("--mend", action="store_true", help=what)
    what = "give void posts this height, to be land; without it they stay voids"
    group.add_argument("--fill", type=values.number, metavar="M", help=what)
    options.add_workers(group)
    options.add_json(command)


def run(asked: BuildOptions) -> int:
    """Run the command."""
    report.check_writable(asked.json)
    if asked.check is not None:
        return _check(asked, asked.check)
    if not asked.maps or asked.path is None:
        raise UsageError("expected MAP… -o STORE, or --check STORE")
    known = [None if os.path.exists(name) else maps.find_bundled(name) for name in asked.maps]
    paths = [each.path if each else name for name, each in zip(asked.maps, known, strict=True)]
    first = next(filter(None, known), None)
    report.refuse_inputs((asked.path,), paths)
    spacing_m = asked.map.spacing_m or (first.spacing_m if first else None)
    reading = first.read_as(asked.map.reading) if first else asked.map.reading
    how_built = asked.fill, asked.workers, asked.scheduler
    look = first.look if first and len(known) == 1 else "auto"
    with report.progress_bar("building") as bar:
        about = build(paths, asked.path, spacing_m, reading, *how_built, bar, tell=_tell, look=look, mends=asked.mend)
    report.write_json(asked.json, {"store": asked.path} | about)
    report.say(asked.json, f"{report.shown(asked.path)}: {summary(about)}")
    return 0


def _tell(line: str) -> None:
    """Print a line about the source or the store."""
    report.note(report.shown(line))


def _check(asked: BuildOptions, name: str) -> int:
    """Check a store; print each damaged file."""
    if asked != BuildOptions(check=name, json=asked.json):
        raise UsageError("--check: takes a store, and no other option but --json")
    with report.progress_bar("checking") as progress:
        damage = check(name, progress).damage
    report.write_json(asked.json, {"store": name, "damage": [each._asdict() for each in damage]})
    told = "\n".join(f"{each.file}: {each.reason}" for each in damage)
    report.say(asked.json, told or f"{report.shown(name)}: whole")
    if damage:
        raise TerrainError(f"{report.shown(name)}: {len(damage)} damaged files: {mending(name)}")
    return 0


def summary(about: dict[str, Any]) -> str:
    """A store in one line."""
    low, high = about["range_m"]
    filled = about["filled_voids"]
    voids = f", {filled:,} voids filled with {about['fill_m']:g} m" if filled else ""
    voids += f", {about['voids']:,} posts without data" if about["voids"] else ""
    return f"{about['cols']} x {about['rows']} posts, {low:g} to {high:g} m{voids}"
