"""`terrain-gl cache`: the stores that were made of large rasters."""

import os
import time
from dataclasses import dataclass

from ..store import cache
from . import options, report, values


@dataclass(frozen=True)
class CacheOptions:
    """What `cache` was told."""

    clear: bool
    limit: float | None = None
    json: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "cache",
        CacheOptions,
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


def run(asked: CacheOptions) -> int:
    """Run the command."""
    report.check_writable(asked.json)
    if asked.limit is not None:
        cache.set_limit(int(asked.limit * 2**30))
    if asked.clear:
        for entry in cache.entries():
            cache.remove(entry)
    found = cache.entries()
    about = {"folder": str(cache.folder()), "limit_bytes": cache.limit(), "stores": [each._asdict() for each in found]}
    report.write_json(asked.json, about)
    report.say(asked.json, text(found))
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
