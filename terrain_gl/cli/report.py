"""What commands print: tables for people, JSON for programs, a progress bar for long work."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from ..files.records import json_text
from ..image import replacing
from ..methods import BASELINES
from .text import printable
from .text import shown as shown


@contextmanager
def json_output(path: str | None, value: Any) -> Iterator[None]:
    """Write `value` to `path` as JSON, to appear when the block has ended well; - prints it then, None does nothing."""
    text = json_text(value)
    if path is None or path == "-":
        yield
        sys.stdout.write(text if path else "")
        return
    with replacing(path) as part:
        with open(part, "w", encoding="utf-8") as file:
            file.write(text)
        yield


def write_json(path: str | None, value: Any) -> None:
    """Write `value` to `path` as JSON; - prints it, None does nothing."""
    with json_output(path, value):
        pass


def say(json_path: str | None, text: str) -> None:
    """Print for people, unless standard output is for JSON alone."""
    if json_path != "-":
        print("\n".join(map(printable, text.split("\n"))))


def table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells in columns: the first to the left, the others to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]

    def line(row: Sequence[str]) -> str:
        first, *others = zip(row, widths, strict=True)
        return "  ".join([first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]).rstrip()

    return "\n".join(map(line, rows))


def facts(values: Mapping[str, str]) -> str:
    """Names and values, two columns."""
    width = max(map(len, values))
    return "\n".join(f"{name.ljust(width)}  {value}" for name, value in values.items())


def asked(stats: Mapping[str, Any]) -> str:
    """What a frame was asked for; with a budget, also what one more triangle would be worth."""
    if stats["method"] in BASELINES:
        return f"{stats['requested_triangles']:,} triangles" if stats["requested_triangles"] else "its parameters"
    if not stats["requested_triangles"]:
        return f"{stats['metric']} error {stats['requested_max_error_px']:g} px"
    price = f"worth {stats['lambda']:.3g} px² each" if stats["lambda"] else "more than this view has use for"
    return f"{stats['requested_triangles']:,} triangles, {price}"


def certified(stats: Mapping[str, Any], px: float | None) -> str:
    """What was certified of a frame, or of many: nothing for baselines."""
    return "nothing certified" if px is None else f"{stats['metric']} error at most {px:.3g} px"


def mebibytes(n: int) -> str:
    """A number of bytes for people."""
    return f"{n / 2**20:,.1f} MiB" if n >= 2**20 else f"{n / 2**10:,.1f} KiB"


@contextmanager
def progress_bar(label: str) -> Iterator[Any]:
    """Give a function of the part done, 0 to 1, that draws a bar on standard error if that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    started = drawn = time.monotonic()

    def show(part: float) -> None:
        nonlocal drawn
        now = time.monotonic()
        if now - drawn > 0.1:
            drawn = now
            left = f"{(now - started) * (1 / part - 1):5.0f} s left" if part > 0.01 else ""
            sys.stderr.write(f"\r{label} [{'#' * int(30 * part):<30}] {part:4.0%} {left}\x1b[K")
            sys.stderr.flush()

    try:
        yield show
    finally:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
