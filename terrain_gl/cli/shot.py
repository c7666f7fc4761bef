"""`terrain-gl shot`: one picture, no window."""

from __future__ import annotations

import os
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.exceptions import UsageError
from ..basics.steps import drain
from ..camera.pieces import LARGEST, Piece
from ..files.furniture import stamp
from ..image import FORMATS, Rows, writing_image
from ..renderer import Renderer
from ..renderer.facts import Facts
from ..renderer.names import Label
from ..renderer.options import NO_SKY
from . import against, effects, options, overlays, report, stores
from .records import DrawOptions
from .scene import CommandScene, make_renderer, open_scene

MOST_PIXELS = 2**32
MOST_FACTS = 2**26  # pixels whose facts are held in memory: 2.6 GiB


@dataclass(frozen=True)
class ShotOptions(DrawOptions):
    """What `shot` was told."""

    golden: against.GoldenOptions


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "shot",
        ShotOptions,
        run,
        help="one picture, no window",
        description="Draw one picture of a map into a file. It may be larger than the GPU can draw at once: it is\n"
        "drawn and written in pieces of one mesh.",
        example="shot canyon -o canyon.png --size 1920x1080 --max-error 0.5 --sun 245,20",
    )
    options.add_map(command)
    options.add_output(command, "picture: .png, or .jpg, .tif, .exr")
    against.add(command)
    overlays.add(command)
    overlays.add_furniture(command)
    options.add_rendering(command)
    options.add_facts(command)
    stores.add_options(command)


def run(asked: ShotOptions) -> int:
    """Run the command."""
    size, path, told = asked.camera.size, asked.output.path, asked.output.json
    if os.path.splitext(path)[1].lower() not in FORMATS:
        raise UsageError(f"{report.shown(path)}: a picture's name must end in one of {', '.join(FORMATS)}")
    if asked.frame.sky == NO_SKY and path.lower().endswith((".jpg", ".jpeg")):
        raise UsageError(f"{report.shown(path)}: has no alpha: with --sky none, name a .png, .tif or .exr")
    if size[0] * size[1] > MOST_PIXELS:
        raise UsageError(f"--size: expected at most {MOST_PIXELS:,} pixels, got {size[0]:,} x {size[1]:,}")
    beside = asked.output.facts_beside(path)
    if beside == path:
        raise UsageError(
            f"--facts {asked.output.facts}: {report.shown(path)} is the picture: name it .png, or take npz"
        )
    if beside and size[0] * size[1] > MOST_FACTS:
        raise UsageError(f"--facts: expected at most {MOST_FACTS:,} pixels, got {size[0]:,} x {size[1]:,}")
    facts = Facts.empty(size) if beside else None
    golden = against.golden_of(asked.golden, asked.output, size)
    asked = overlays.with_ground(asked)
    scene = open_scene(asked)
    effects.tell(asked, scene)
    piece = min(size[0], LARGEST), min(size[1], LARGEST)
    with ExitStack() as picture, make_renderer(scene, asked, piece, lit=True) as renderer:
        write = picture.enter_context(writing_image(path, size))
        stats = (
            {"map": scene.heightmap.name}
            | scene.pose(size)
            | _draw(renderer, asked, scene, golden.receive(write) if golden else write, facts)
        )
        if facts and beside:
            facts.write(beside)
        found = golden.compare(renderer, scene, path, size) if golden else None
        with report.json_output(told, stats | (found.record() if found else {})):
            picture.close()
    report.say(told, f"{report.shown(path)}: {summary(stats)}")
    if found:
        report.say(told, found.text())
    return stores.status_of(stats) or (0 if found is None or found.is_within else 1)


def _draw(
    renderer: Renderer, asked: ShotOptions, scene: CommandScene, write: Rows, facts: Facts | None
) -> dict[str, Any]:
    """Draw pieces of one mesh, write each row of pieces, and fill in `facts`; returns the picture's stats."""
    size, laid, frame = asked.camera.size, asked.laid, scene.frame
    width = size[0]
    exact = FORMATS[os.path.splitext(asked.output.path)[1].lower()] == "float"
    rows = np.empty((0, width, 4))
    sees_land = False
    stamps = [] if exact else scene.stamps(laid, size)
    seen: list[Label] = []

    def receive(piece: Piece, pixels: np.ndarray) -> None:
        nonlocal rows, sees_land
        sees_land = sees_land or renderer.picture.sees_land()
        if not exact:
            seen.extend(renderer.labels())
            if laid.labels != overlays.NO_LABELS:
                seen.extend(renderer.contour_labels(frame.contour_m, frame.water_m, frame.units))
        if facts:
            facts.put(piece, renderer.facts())
        if piece.corner[0] == 0:
            rows = np.empty((piece.size[1], width, 4), pixels.dtype)
        rows[:, piece.cols] = pixels
        if piece.cols.stop == width:
            stamp(rows, piece.rows.start, [*overlays.names(size, seen, stamps), *stamps])
            write(rows)

    steps = renderer.draw_steps(size=size, receive=receive, gradual=False, exact=exact, **scene.view())
    with stores.loading(renderer):
        next(steps)
    with report.progress_bar("drawing") as progress:
        stats = drain(steps, progress)
    if not sees_land:
        effects.tell_no_land(asked.camera, scene)
    if exact and laid.furniture:
        report.note("--furniture: is not in a picture of floats")
    if renderer.overlays:
        if exact:
            report.note("--overlay: lines and points are not in a picture of floats")
        else:
            overlays.tell_unseen(laid.overlay, scene.heightmap, renderer.overlays, stats["overlay_samples"])
    return dict(stats)


def summary(stats: dict[str, Any]) -> str:
    """A frame in one line."""
    size = f"{stats['width']}x{stats['height']}"
    error = report.certified(stats, stats["certified_max_error_px"])
    voids = f", {stats['voids']:,} posts without data" if stats["voids"] else ""
    return f"{size}, {stats['triangles']:,} triangles, {error}{voids}, {stats['ms']['frame']:.0f} ms"
