"""The leaderboard: who needs the fewest triangles for a checked error, on secret maps and views.

An entry is a file with one function, which runs behind the walls of the grader:

    mesh(heights, spacing_m, camera, size, tolerance_px)   returns vertices (n, 3) metres and triangles (m, 3)

    heights       (2^k + 1, 2^k + 1) metres; row 0 is the northern edge
    spacing_m     metres between posts to the east and to the north
    camera        dict: eye and target in metres (east and north of the south-western post, up), fov_deg from the
                  picture's bottom to its top
    size          width and height of the picture in pixels

The mesh must cover the map without cracks. The verifier of the open benchmark finds the largest error over the whole
surface. Entries that keep the tolerance in all views are ranked; the others are listed with the reason.
"""

from __future__ import annotations

import csv
import importlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .folders import HERE
from .land import land, spike
from .remote import Student, StudentError
from .solving import SOLUTIONS

BENCHMARK = HERE.parent / "benchmarks" / "open"
OURS = ("every_post", "roam", "sat")  # entries of the open benchmark that stand in the table
SIZE = 640, 360
LARGEST_CRACK_M = 1e-6
Mesh = Callable[..., Any]


@dataclass
class Row:
    """An entry: its triangles in each view, its largest error in tolerances, and why it is not ranked."""

    name: str
    triangles: list[int]
    share: float = 0.0
    reason: str = ""


def secret_views(seed: int) -> list[dict[str, Any]]:
    """Maps, cameras and tolerances: hills of unlike size and spacing, seen from above and from the side.

    The tolerance is twice the error of a mesh of all posts, so a mesh whose vertices are posts can keep it.
    """
    rng, found = np.random.default_rng(seed), []
    for side in (65, 129):
        heights = land(rng, side, side, float(rng.uniform(150, 400)))
        heights = spike(heights, rng, 60.0) if rng.random() < 0.5 else heights
        spacing_m = [float(each) for each in rng.uniform(20, 40, 2)]
        wide, high = (side - 1) * np.array(spacing_m)
        for above_m, away in ((900.0, 0.3), (250.0, 0.1)):
            eye = [rng.uniform(0.3, 0.7) * wide, -away * high, heights.max() + above_m]
            target = [rng.uniform(0.4, 0.6) * wide, 0.5 * high, heights.mean()]
            camera = {"eye": [float(n) for n in eye], "target": [float(n) for n in target], "fov_deg": 45.0}
            view = {"heights": heights, "spacing_m": spacing_m, "camera": camera, "tolerance_px": np.inf}
            _, worst_px, _ = _verified(_of_benchmark("every_post"), view)
            found.append(view | {"tolerance_px": round(max(2 * worst_px, 0.5), 3)})
    return found


def board(files: dict[str, Path], seed: int, seconds: float) -> list[Row]:
    """All rows: students' entries, the course's own, and the project's methods; the best first."""
    views = secret_views(seed)
    rows = []
    for name, file in {**files, "(course)": SOLUTIONS / "entry.py"}.items():
        with Student(file, seconds, walled=True) as student:
            rows.append(_row(name, partial(student.call, "mesh"), views, partial(student.allow, seconds)))
    for name in OURS:
        rows.append(_row(f"({name})", _of_benchmark(name), views, lambda: None))
    return sorted(rows, key=lambda row: (bool(row.reason), sum(row.triangles), row.name))


def _row(name: str, mesh: Mesh, views: list[dict[str, Any]], begin: Callable[[], None]) -> Row:
    row = Row(name, [])
    for number, view in enumerate(views, 1):
        begin()
        try:
            triangles, max_px, reason = _verified(mesh, view)
        except Exception as error:  # whatever an entry does, it has a row
            row.reason = f"view {number}: {type(error).__name__ if not str(error) else str(error)[:200]}"
            return row
        row.triangles.append(triangles)
        row.share = max(row.share, max_px / view["tolerance_px"])
        if reason:
            row.reason = f"view {number}: {reason}"
            return row
    return row


def _verified(mesh: Mesh, view: dict[str, Any]) -> tuple[int, float, str]:
    """Triangles in the picture, the largest error, and what is wrong with a mesh."""
    heights, spacing_m, camera = view["heights"], view["spacing_m"], view["camera"]
    allowed = view["tolerance_px"]
    answer = mesh(heights, spacing_m, camera, list(SIZE), allowed)
    if not isinstance(answer, tuple | list) or len(answer) != 2:
        raise StudentError("expected vertices and triangles")
    vertices, triangles = (np.asarray(part) for part in answer)
    if (
        vertices.dtype.kind not in "iuf"
        or vertices.ndim != 2
        or vertices.shape[1] != 3
        or not np.isfinite(vertices).all()
    ):
        raise StudentError("expected finite vertices (n, 3)")
    if triangles.dtype.kind not in "iu" or triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise StudentError("expected triangles (m, 3) of whole numbers")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise StudentError("a triangle names a vertex that is not there")
    verify = _benchmark("verify")
    of_view = verify.View(camera, SIZE)
    found, _ = verify.verified_frame(heights, spacing_m, of_view, vertices.astype(float), triangles.astype(np.int64))
    reasons = {
        f"{found['uncovered_posts']} posts without land": found["uncovered_posts"] > 0,
        f"cracks of up to {found['largest_crack_m']:.3g} m": found["largest_crack_m"] > LARGEST_CRACK_M,
        f"{found['max_px']:.2f} px off, {allowed:g} are allowed": not found["max_px"] <= allowed,
    }
    return int(found["triangles"]), float(found["max_px"]), "; ".join(text for text, is_so in reasons.items() if is_so)


def _benchmark(name: str) -> Any:
    """A module of the open benchmark."""
    if str(BENCHMARK) not in sys.path:
        sys.path.insert(0, str(BENCHMARK))
    return importlib.import_module(name)


def _of_benchmark(name: str) -> Mesh:
    """An entry of the open benchmark, for one view."""

    def mesh(heights: np.ndarray, spacing_m: list[float], camera: dict[str, Any], size: list[int], px: float) -> Any:
        made: Iterator[Any] = _benchmark(f"entries.{name}").meshes(heights, spacing_m, [camera], size, px)
        return tuple(next(iter(made)))[:2]

    return mesh


def write(rows: list[Row], path: Path) -> None:
    """Write the table as CSV."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(
            ["place", "entry", "triangles", "in each view", "largest error in tolerances", "not ranked because"]
        )
        for place, row in enumerate(rows, 1):
            each = " ".join(map(str, row.triangles))
            table.writerow(
                ["" if row.reason else place, row.name, sum(row.triangles), each, f"{row.share:.3f}", row.reason]
            )
