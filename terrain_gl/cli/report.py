"""Output of the commands: checks of its files before any work, text tables, JSON, a progress bar for long work."""

import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..basics import resources
from ..basics.exceptions import TerrainError, UsageError
from ..basics.replacing import replacing
from ..files.records import json_text
from ..heightmap import Heightmap
from ..readers.windows import WindowedRaster
from ..renderer.methods import BASELINES
from .text import printable
from .text import shown as shown


def check_outputs(outputs: Iterable[str | None], inputs: Iterable[str]) -> None:
    """Refuse outputs that cannot be written, and those that are also inputs."""
    written = tuple(outputs)
    check_writable(*written)
    refuse_inputs(written, inputs)


def refuse_inputs(outputs: Iterable[str | None], inputs: Iterable[str]) -> None:
    """Refuse outputs that are also inputs."""
    written = {os.path.realpath(path) for path in outputs if path}
    for read in inputs:
        if os.path.realpath(read) in written:
            raise UsageError(f"{read}: is also an input: name another file for the output")


def check_writable(*paths: str | None) -> None:
    """Refuse outputs that cannot be written, and two outputs with one name, before any work is done."""
    files = [path for path in paths if path and path != "-"]
    for path in files:
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise TerrainError(f"{path}: there is no folder {folder}: make it first")
        if os.path.exists(path) and not os.path.isfile(path):
            raise TerrainError(f"{path}: is a folder or a device: name a file")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise TerrainError(f"{path}: no permission to write in {folder}: choose another folder")
        if resources.holds(Path(path)):
            raise UsageError(f"{path}: comes with terrain-gl: name another file for the output")
    if len({os.path.realpath(path) for path in files}) < len(files):
        raise UsageError(f"{files[0]}: is the name of two outputs: name two files")


@contextmanager
def json_output(path: str | None, value: object) -> Iterator[None]:
    """Write `value` to `path` as JSON if the block ends without an error. With "-" print it; with None do nothing."""
    text = json_text(value)
    if path is None or path == "-":
        yield
        sys.stdout.write(text if path else "")
        return
    with replacing(path) as part:
        with open(part, "w", encoding="utf-8") as file:
            file.write(text)
        yield


def write_json(path: str | None, value: object) -> None:
    """Write `value` to `path` as JSON. With "-" print it; with None do nothing."""
    with json_output(path, value):
        pass


def say(json_path: str | None, text: str) -> None:
    """Print text, unless standard output is reserved for JSON."""
    if json_path != "-":
        print("\n".join(map(printable, text.split("\n"))))


def note(text: str) -> None:
    """Print a note to standard error."""
    print(f"terrain-gl: note: {text}", file=sys.stderr)


def notes_of(heightmap: Heightmap | WindowedRaster) -> None:
    """Print how a file was interpreted to standard error."""
    for told in heightmap.notes:
        note(f"{shown(heightmap.name)}: {told}")


def table(rows: Sequence[Sequence[str]]) -> str:
    """A text table: the first column is aligned left, the others right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]

    def line(row: Sequence[str]) -> str:
        first, *others = zip(row, widths, strict=True)
        return "  ".join([first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]).rstrip()

    return "\n".join(map(line, rows))


def facts(values: Mapping[str, str]) -> str:
    """Names and values in two columns."""
    width = max(map(len, values))
    return "\n".join(f"{name.ljust(width)}  {value}" for name, value in values.items())


def asked(stats: Mapping[str, Any]) -> str:
    """The tolerance or the budget of a frame; for a budget also the error that it minimises."""
    if stats["method"] in BASELINES:
        return f"{stats['requested_triangles']:,} triangles" if stats["requested_triangles"] else "its parameters"
    if not stats["requested_triangles"]:
        return f"{stats['metric']} error {stats['requested_max_error_px']:g} px"
    if stats["triangles"] > stats["requested_triangles"]:
        why = "fewer than the coarsest mesh of this view has"
    elif stats["metric"] == "max":
        why = "for the smallest largest error"
    else:
        why = f"worth {stats['lambda']:.3g} px² each" if stats["lambda"] else "more than this view needs"
    return f"{stats['requested_triangles']:,} triangles, {why}"


def certified(stats: Mapping[str, Any], px: float | None) -> str:
    """The certified error of one or more frames as text. Baselines certify nothing."""
    return "nothing certified" if px is None else f"{stats['certified_metric']} error at most {px:.3g} px"


def mebibytes(n: int) -> str:
    """A number of bytes in MiB or KiB."""
    return f"{n / 2**20:,.1f} MiB" if n >= 2**20 else f"{n / 2**10:,.1f} KiB"


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[float], None] | None]:
    """Yield a function that draws the progress, 0 to 1, as a bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    started = time.monotonic()
    drawn = -math.inf

    def show(part: float) -> None:
        nonlocal drawn
        now = time.monotonic()
        if now - drawn > 0.1:
            drawn = now
            left = f"{(now - started) * (1 / part - 1):5.0f} s left" if part > 0.01 else ""
            sys.stderr.write(f"\r{label} [{'#' * int(30 * part):<30}] {part:4.0%} {left}\x1b[K")
            sys.stderr.flush()

    show(0.0)
    try:
        yield show
    finally:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
