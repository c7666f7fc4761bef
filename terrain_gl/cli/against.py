"""`terrain-gl shot --against GOLDEN`: compare with an earlier picture, and name the patch where they differ most."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..camera.pieces import LARGEST
from ..comparison.difference import Difference, check_alike, differ, difference_name
from ..image import Rows, difference, read_image, write_png
from ..renderer import Renderer
from ..shade.picture import UNLIT
from ..verify.explain import Explanation
from ..viewer.explain_text import bound_px, plain, title
from . import diff, options, report


def add(command: Any) -> None:
    """Add the options."""
    command.add_argument("--against", metavar="GOLDEN", help="picture to compare with; exit status 1 if it differs")
    diff.add_tolerance(command)


def golden_of(args: argparse.Namespace) -> Golden | None:
    """The picture to compare with; None without --against."""
    if args.against is None:
        return None
    outputs = args.output, args.json, difference_name(args.output)
    if os.path.realpath(args.against) in {os.path.realpath(path) for path in outputs if path}:
        raise UsageError(f"{report.shown(args.against)}: is compared with: name another file for the output")
    options.check_writable(*outputs)
    pixels = read_image(args.against)
    if pixels.dtype != np.uint8 or pixels.shape[2] < 3:
        raise TerrainError(f"{report.shown(args.against)}: is not an 8-bit picture in colour, as shot draws them")
    if pixels.shape[:2] != args.size[::-1]:
        found = f"{pixels.shape[1]}x{pixels.shape[0]}"
        raise TerrainError(f"{report.shown(args.against)}: has {found} pixels: draw with --size {found}")
    return Golden(args.against, pixels[..., :3])


@dataclass
class Verdict:
    """The comparison of a picture with an earlier one; `patch` is the patch under the worst pixel, if it is known."""

    golden: str
    found: Difference
    picture: str | None = None
    patch: Explanation | None = None

    @property
    def is_within(self) -> bool:
        """Whether the pictures are equal within the tolerance."""
        return self.found.is_within

    def record(self) -> dict[str, Any]:
        """The numbers for JSON."""
        told = {"golden": self.golden, "picture": self.picture} | self.found.record()
        if self.patch:
            col, row = self.patch.corner
            told["patch"] = {"corner": [col, row], "side": self.patch.side, "certified_px": bound_px(self.patch)}
        return {"against": told}

    def text(self) -> str:
        """The comparison in one line or more."""
        lines = [f"against {report.shown(self.golden)}: {'equal within' if self.is_within else 'beyond'} the tolerance"]
        lines += [diff.text(self.found)]
        if self.picture:
            lines.append(f"difference  {report.shown(self.picture)}")
        if self.patch:
            corner = ", ".join(map(str, self.patch.corner))
            lines.append(f"patch       {title(self.patch)}, from column and row {corner}: {plain(self.patch)}")
        elif not self.is_within:
            lines.append("patch       none is known: there is sky at that pixel, or a surface that has no explanation")
        return "\n".join(lines)


class Golden:
    """An earlier picture, and the rows of the new picture as they are drawn."""

    def __init__(self, name: str, pixels: np.ndarray) -> None:
        self.name = name
        self._pixels = pixels
        self._rows: list[np.ndarray] = []

    def receive(self, write: Rows) -> Callable[[np.ndarray], None]:
        """A function that keeps rows and passes them on to `write`."""

        def keep(rows: np.ndarray) -> None:
            self._rows.append(rows[..., :3].copy())
            write(rows)

        return keep

    def compare(self, renderer: Renderer, args: argparse.Namespace, scene: options.CommandScene) -> Verdict:
        """Compare the whole picture; beyond the tolerance, write the difference and find the patch."""
        pictures = self._pixels, np.concatenate(self._rows)
        check_alike(pictures, (self.name, args.output))
        verdict = Verdict(self.name, differ(*pictures, diff.tolerance_of(args)))
        if not verdict.is_within:
            verdict.picture = difference_name(args.output)
            write_png(verdict.picture, difference(*pictures))
            verdict.patch = _patch_at(renderer, args, scene, verdict.found.worst)
        return verdict


def _patch_at(
    renderer: Renderer, args: argparse.Namespace, scene: options.CommandScene, pixel: tuple[int, int]
) -> Explanation | None:
    """The patch under a pixel; None for the sky, for baselines, and in a picture that is drawn in pieces."""
    if max(args.size) > LARGEST:
        return None
    renderer.draw(**options.view_of(args, scene) | {"style": UNLIT})
    of_samples = renderer.picture.places()[:, pixel[1], pixel[0]]
    on_land = of_samples[(of_samples >= 0).all(-1)]
    if not len(on_land):
        return None
    col, row = (float(v) for v in on_land[0])
    east, north = scene.heightmap.spacing_m
    return renderer.inspector.explain(col * east, (scene.heightmap.rows - 1 - row) * north)
