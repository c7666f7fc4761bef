"""`terrain-gl build`: a store of a map, for maps larger than memory."""

import argparse
import os
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..files import maps
from ..store import build, check
from ..store.format import mending
from . import options, report, stores, values


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "build",
        run,
        help="a store of a map, for maps larger than memory",
        description="Read a map once, window by window, and write heights and error records of all levels into\n"
        "a Zarr store. The map does not change. The same command continues an interrupted build, and checks\n"
        "a finished store. Extra [store].",
        example="build tiles/*.tif -o land.zarr --workers 2",
    )
    command.add_argument("map", metavar="MAP", nargs="*", help="heightmap file, or several files on one grid")
    command.add_argument("-o", "--output", metavar="STORE", help="the folder to write")
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
    command.set_defaults(unset=vars(command.parse_args([])))


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    options.check_writable(args.json)
    if args.check is not None:
        return _check(args)
    if not args.map or args.output is None:
        raise UsageError("expected MAP… -o STORE, or --check STORE")
    known = [None if os.path.exists(name) else maps.find_bundled(name) for name in args.map]
    paths = [_path(args, name, one) for name, one in zip(args.map, known, strict=True)]
    look = known[0].look if len(known) == 1 and known[0] else "auto"
    options.refuse_inputs((args.output,), paths)
    reading = stores.reading_of(args)
    with report.progress_bar("building") as progress:
        how_built = args.fill, args.workers, args.scheduler, progress
        about = build(paths, args.output, args.spacing, reading, *how_built, tell=_tell, look=look, mends=args.mend)
    report.write_json(args.json, {"store": args.output} | about)
    report.say(args.json, f"{report.shown(args.output)}: {summary(about)}")
    return 0


def _tell(line: str) -> None:
    """Print a line about the source or the store."""
    report.note(report.shown(line))


def _check(args: argparse.Namespace) -> int:
    """Check a store; print each damaged file."""
    name = args.check
    if any(getattr(args, key) != value for key, value in args.unset.items() if key not in ("check", "json")):
        raise UsageError("--check: takes a store, and no other option but --json")
    with report.progress_bar("checking") as progress:
        damage = check(name, progress).damage
    report.write_json(args.json, {"store": name, "damage": [each._asdict() for each in damage]})
    report.say(args.json, "\n".join(f"{each.file}: {each.reason}" for each in damage) or f"{report.shown(name)}: whole")
    if damage:
        raise TerrainError(f"{report.shown(name)}: {len(damage)} damaged files: {mending(name)}")
    return 0


def _path(args: argparse.Namespace, name: str, known: maps.BundledMap | None) -> str:
    """The file of a map. For a bundled map, `args` also get its scales."""
    if known is None:
        return name
    for option, own in (("spacing", known.spacing_m), ("z_scale", known.z_scale), ("z_offset", known.z_offset_m)):
        if getattr(args, option) is None:
            setattr(args, option, own)
    return known.path


def summary(about: dict[str, Any]) -> str:
    """A store in one line."""
    low, high = about["range_m"]
    filled = about["filled_voids"]
    voids = f", {filled:,} voids filled with {about['fill_m']:g} m" if filled else ""
    voids += f", {about['voids']:,} posts without data" if about["voids"] else ""
    return f"{about['cols']} x {about['rows']} posts, {low:g} to {high:g} m{voids}"
