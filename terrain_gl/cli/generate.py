"""`terrain-gl generate`: a heightmap made from a seed."""

import argparse
import re
import time
from dataclasses import asdict, dataclass
from typing import Any

from ..files.generate import RECIPES, Land, open_options, shot_command, write_land
from ..files.writers import FORMATS, format_of
from ..gpu.context import backend_name, create_context
from ..gpu.selftest import check_driver
from . import options, report, values
from .records import OutputOptions


@dataclass(frozen=True)
class GenerateOptions:
    """What `generate` was told."""

    output: OutputOptions
    size: tuple[int, int]
    seed: int
    cliffs: float
    relief: float
    spacing: float
    recipe: str
    octaves: int | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "generate",
        GenerateOptions,
        run,
        help="a heightmap of gradient noise: hills, canyons, ranges",
        description="Make a heightmap from a seed. A seed gives the same bytes on every driver. A larger map\n"
        "continues a smaller one: its north-west corner is the same land.",
        example="generate land.png --size 1025 --seed 7 --cliffs 0.7",
    )
    command.add_argument("path", metavar="OUT", help=f"heightmap, {', '.join(FORMATS)}")
    command.add_argument("--size", type=size, metavar="N or WxH", default=(1025, 1025), help="posts (default: 1025)")
    command.add_argument("--seed", type=whole, metavar="S", default=0, help="each gives another land (default: 0)")
    command.add_argument(
        "--cliffs", type=values.number, metavar="C", default=0.5, help="0 rolling hills, 1 canyons (default: 0.5)"
    )
    command.add_argument("--octaves", type=whole, metavar="K", help="scales of detail (default: by the spacing)")
    command.add_argument(
        "--relief", type=values.number, metavar="M", default=1000.0, help="metres from plain to summit (default: 1000)"
    )
    command.add_argument(
        "--spacing", type=values.number, metavar="M", default=10.0, help="metres between posts (default: 10)"
    )
    command.add_argument("--recipe", choices=RECIPES, default=RECIPES[0], help="tablelands, or ranges of ridges")
    options.add_backend(command)
    options.add_json(command)


def run(asked: GenerateOptions) -> int:
    """Run the command."""
    path, told = asked.output.path, asked.output.json
    land = Land(*asked.size, asked.seed, asked.cliffs, asked.octaves, asked.relief, asked.spacing, asked.recipe)
    suffix = format_of(path)
    report.check_writable(path, told)
    about = make(land, path, asked.output.backend) | {"open_with": open_options(land, suffix)}
    report.write_json(told, about)
    report.say(told, f"{report.shown(path)}: {summary(about)}")
    report.say(told, report.shown(shot_command(land, path)))
    return 0


def make(land: Land, path: str, backend: str) -> dict[str, Any]:
    """Make the land in a new context and write it; returns its description."""
    ctx = create_context(backend)
    with ctx, report.progress_bar("generating") as progress:
        check_driver(ctx)
        started = time.perf_counter()
        range_m = write_land(ctx, land, path, progress)
        ms = 1e3 * (time.perf_counter() - started)
        driver = {"gl_renderer": ctx.info["GL_RENDERER"], "backend": backend_name(ctx)}
    ctx.release()
    made = asdict(land) | {"octaves": land.octaves_made, "range_m": list(range_m)}
    return {"map": path} | made | driver | {"ms": {"generate": ms}}


def summary(about: dict[str, Any]) -> str:
    """The land in one line."""
    low, high = about["range_m"]
    made = f"{about['cols']} x {about['rows']} posts, {low:g} to {high:g} m, {about['octaves']} octaves"
    return f"{made}, {about['ms']['generate'] / 1e3:.1f} s"


def whole(text: str) -> int:
    """A whole number."""
    if not re.fullmatch(r"-?\d{1,18}", text):
        raise argparse.ArgumentTypeError(f"expected a whole number, got {text!r}")
    return int(text)


def size(text: str) -> tuple[int, int]:
    """N, or WxH."""
    found = re.fullmatch(r"(\d{1,9})(?:x(\d{1,9}))?", text)
    if not found:
        raise argparse.ArgumentTypeError(f"expected posts N or WxH, got {text!r}")
    return int(found[1]), int(found[2] or found[1])
