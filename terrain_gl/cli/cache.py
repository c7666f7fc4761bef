"""`terrain-gl cache`: the stores that were made of large rasters."""

import argparse
import os
import time
from typing import Any

from ..store import cache
from . import options, report, values


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "cache",
        run,
        help="the stores that were made of large rasters: list, clear, limit",
        description="Large rasters are drawn from stores, which are made at first use, in the user's cache folder.\n"
        "If they take more than a limit, those whose last use is longest ago are removed.",
        example="cache --limit 20",
    )
    command.add_argument("--clear", action="store_true", help="remove all stores that are not in use")
    what = f"GiB that all stores may take, from now on (at first {cache.MOST_BYTES >> 30})"
    command.add_argument("--limit", type=values.not_negative, metavar="GIB", help=what)
    options.add_json(command)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    options.check_writable(args.json)
    if args.limit is not None:
        cache.set_limit(int(args.limit * 2**30))
    if args.clear:
        for entry in cache.entries():
            cache.remove(entry)
    found = cache.entries()
    about = {"folder": str(cache.folder()), "limit_bytes": cache.limit(), "stores": [each._asdict() for each in found]}
    report.write_json(args.json, about)
    report.say(args.json, text(found))
    return 0


def text(found: list[cache.CachedStore]) -> str:
    """The stores as a table."""
    total = sum(entry.bytes for entry in found)
    head = f"{cache.folder()}: {len(found)} stores, {report.mebibytes(total)} of at most "
    head += report.mebibytes(cache.limit())
    if not found:
        return head
    rows = [["raster", "size", "last use"]]
    for entry in found:
        used = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.used_s))
        state = used if entry.is_finished else f"{used}, not finished"
        rows.append([report.shown(os.path.relpath(entry.source)), report.mebibytes(entry.bytes), state])
    return head + "\n" + report.table(rows)
