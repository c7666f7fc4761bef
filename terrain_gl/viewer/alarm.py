"""The alarm: the window compares every achieved error with its certified bound.

The achieved error is never above the bound (docs/guarantee.md). If it ever is, this is an error of the program or of
the driver. Then a red line and a red frame mark the picture, and a report holds everything that is needed to draw it
again.
"""

import json
import platform
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import NamedTuple

from ..basics.version import __version__
from ..renderer.frame import Stats
from .frame_stats import achieved_px
from .scene import FrameSpec, Scene


class Broken(NamedTuple):
    """A side of a picture whose achieved error is above its certified bound, in pixels."""

    side: int
    achieved_px: float
    certified_px: float


def broken_sides(stats: list[Stats], measured: list[dict[str, float]]) -> list[Broken]:
    """The sides of a picture that break their promise, given the stats and the achieved errors of each side."""
    found = []
    for side, (numbers, achieved) in enumerate(zip(stats, measured, strict=False)):
        px, bound_px = achieved_px(numbers, achieved), numbers["certified_max_error_px"]
        if px is not None and bound_px is not None and px > bound_px:
            found.append(Broken(side, px, bound_px))
    return found


class Alarm:
    """Reports pictures that break their promise.

    Attributes
    ----------
    folder
        Where reports are written; None for no reports.
    line
        The words about the present picture; empty if it keeps its promise, or is not measured yet.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self.line = ""
        self._reported: FrameSpec | None = None

    def watch(self, scene: Scene, spec: FrameSpec, stats: list[Stats], measured: list[dict[str, float]]) -> None:
        """Compare the numbers of the picture of `spec`; `measured` is empty until all its sides are measured."""
        broken = broken_sides(stats, measured)
        if not broken:
            self.line = ""
        elif spec != self._reported or not self.line:
            self._reported = spec
            self.line = self._report(scene, spec, stats, broken)

    def _report(self, scene: Scene, spec: FrameSpec, stats: list[Stats], broken: list[Broken]) -> str:
        worst = max(broken, key=lambda each: each.achieved_px / max(each.certified_px, 1e-9))
        line = f"PROMISE BROKEN: achieved {worst.achieved_px:.3f} px, certified {worst.certified_px:.3f} px"
        if self.folder is None:
            return line
        ctx = scene.renderer.ctx
        heightmap = scene.heightmap
        report = {
            "terrain_gl": __version__,
            "python": platform.python_version(),
            "system": platform.platform(),
            "gl": {name: ctx.info[name] for name in ("GL_VENDOR", "GL_RENDERER", "GL_VERSION")},
            "gl_error": ctx.error,
            "map": {
                "name": heightmap.name,
                "opened": heightmap.opened,
                "posts": [heightmap.cols, heightmap.rows],
                "spacing_m": heightmap.spacing_m,
                "voids": heightmap.voids,
            },
            "camera": asdict(spec.camera),
            "size": spec.size,
            "options": [asdict(side) for side in spec.sides],
            "stats": stats,
            "broken": [each._asdict() for each in broken],
            "messages": list(scene.window.said),
        }
        try:
            path = _free(self.folder)
            path.write_text(json.dumps(report, indent=1, default=str), "utf-8")
        except OSError as error:
            return f"{line}; no report could be written: {error.strerror}"
        return f"{line}; please report it with {path}"


def _free(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return next(path for n in count(1) if not (path := folder / f"broken-promise-{n:03d}.json").exists())
