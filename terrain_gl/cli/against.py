"""`terrain-gl shot --against GOLDEN`: compare with an earlier picture, and name the patch where they differ most."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..camera.pieces import LARGEST
from ..comparison.difference import Difference, Tolerance, check_alike, differ, difference_name
from ..image import Rows, difference, read_image, write_png
from ..renderer import Renderer
from ..shade.picture import UNLIT
from ..verify.explain import Explanation
from ..viewer.explain_text import bound_px, plain, title
from . import diff, options, report
from .records import OutputOptions
from .scene import CommandScene


@dataclass(frozen=True)
class GoldenOptions:
    """The picture to compare with, and how much may differ."""

    allowed: Tolerance
    against: str | None = None


def add(command: options.Options) -> None:
    """Add the options."""
    command.add_argument("--against", metavar="GOLDEN", help="picture to compare with; exit status 1 if it differs")
    diff.add_tolerance(command)


def golden_of(asked: GoldenOptions, output: OutputOptions, size: tuple[int, int]) -> Golden | None:
    """The picture to compare with a picture of some size; None without --against."""
    golden = asked.against
    if golden is None:
        return None
    outputs = output.path, output.json, difference_name(output.path)
    if os.path.realpath(golden) in {os.path.realpath(path) for path in outputs if path}:
        raise UsageError(f"{report.shown(golden)}: is compared with: name another file for the output")
    report.check_writable(*outputs)
    pixels = read_image(golden)
    if pixels.dtype != np.uint8 or pixels.shape[2] < 3:
        raise TerrainError(f"{report.shown(golden)}: is not an 8-bit picture in colour, as shot draws them")
    if pixels.shape[:2] != size[::-1]:
        found = f"{pixels.shape[1]}x{pixels.shape[0]}"
        raise TerrainError(f"{report.shown(golden)}: has {found} pixels: draw with --size {found}")
    return Golden(golden, pixels[..., :3], asked.allowed)


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

    def __init__(self, name: str, pixels: np.ndarray, allowed: Tolerance) -> None:
        self.name = name
        self._allowed = allowed
        self._pixels = pixels
        self._rows: list[np.ndarray] = []

    def receive(self, write: Rows) -> Callable[[np.ndarray], None]:
        """A function that keeps rows and passes them on to `write`."""

        def keep(rows: np.ndarray) -> None:
            self._rows.append(rows[..., :3].copy())
            write(rows)

        return keep

    def compare(self, renderer: Renderer, scene: CommandScene, path: str, size: tuple[int, int]) -> Verdict:
        """Compare the whole picture; beyond the tolerance, write the difference and find the patch."""
        pictures = self._pixels, np.concatenate(self._rows)
        check_alike(pictures, (self.name, path))
        verdict = Verdict(self.name, differ(*pictures, self._allowed))
        if not verdict.is_within:
            verdict.picture = difference_name(path)
            write_png(verdict.picture, difference(*pictures))
            verdict.patch = _patch_at(renderer, scene, size, verdict.found.worst)
        return verdict


def _patch_at(
    renderer: Renderer, scene: CommandScene, size: tuple[int, int], pixel: tuple[int, int]
) -> Explanation | None:
    """The patch under a pixel; None for the sky, for baselines, and in a picture that is drawn in pieces."""
    if max(size) > LARGEST:
        return None
    renderer.draw(**scene.view(style=UNLIT))
    with renderer.session:
        of_samples = renderer.picture.places()[:, pixel[1], pixel[0]]
    on_land = of_samples[(of_samples >= 0).all(-1)]
    if not len(on_land):
        return None
    col, row = (float(v) for v in on_land[0])
    east, north = scene.heightmap.spacing_m
    return renderer.inspector.explain(col * east, (scene.heightmap.rows - 1 - row) * north)
