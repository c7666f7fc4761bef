"""`terrain-gl build`: a store of a map, for maps larger than memory."""

import argparse
import os
from typing import Any

from ..files import maps
from ..store import build
from . import options, report, stores, values


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "build",
        run,
        help="a store of a map, for maps larger than memory",
        description="Read a map once, window by window, and write heights and error records of all levels into\n"
        "a Zarr store. The map does not change. The same command continues an interrupted build. Extra [store].",
        example="build tiles/*.tif -o land.zarr --workers 2",
    )
    command.add_argument("map", metavar="MAP", nargs="+", help="heightmap file, or several files on one grid")
    command.add_argument("-o", "--output", metavar="STORE", required=True, help="the folder to write")
    options.add_map_options(command)
    group = command.add_argument_group("build")
    what = "give void posts this height, to be land; without it they stay voids"
    group.add_argument("--fill", type=values.number, metavar="M", help=what)
    options.add_workers(group)
    options.add_json(command)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    options.check_writable(args.json)
    known = [None if os.path.exists(name) else maps.find_bundled(name) for name in args.map]
    paths = [_path(args, name, one) for name, one in zip(args.map, known, strict=True)]
    look = known[0].look if len(known) == 1 and known[0] else "auto"
    options.refuse_inputs((args.output,), paths)
    reading = stores.reading_of(args)
    with report.progress_bar("building") as progress:
        how_built = args.fill, args.workers, args.scheduler, progress
        about = build(paths, args.output, args.spacing, reading, *how_built, tell=options.tell_notes, look=look)
    report.write_json(args.json, {"store": args.output} | about)
    report.say(args.json, f"{report.shown(args.output)}: {summary(about)}")
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
