"""A study of one view: all methods side by side, their curves, and the results as a table and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from ..basics.steps import Progress
from ..camera import Camera
from ..renderer import Renderer
from ..renderer.methods import BASELINES
from .compare import COMPARED, FINE, MethodResult, Truth, best_pictured, entry_of, measured, part, truth_of
from .curves import BUDGETS, EQUAL, FEWEST, best_detail, curve, details_of, drawable, fewest, pruned_curve

if TYPE_CHECKING:
    from .pruned import Allocation

VERTICES = ("between", "posts")  # where a baseline's vertices may be: also between posts, or on posts alone
MANY = 4  # with vertices between posts: most triangles that are tried, as a multiple of those of a mesh with every post
SHADING = ("map", "mesh")  # the surface from which a baseline's picture is shaded
_NUMBERS = (  # label, key of an entry's stats, format
    ("triangles", "triangles", ",d"),
    ("RMS screen error, px", "rms_error_px", ".3f"),
    ("largest screen error, px", "max_error_px", ".2f"),
    ("RMSE of the picture", "image_rmse", ".4f"),
    ("FLIP of the picture", "flip", ".4f"),
    ("skyline off, px", "skyline_px", ".3f"),
)


class TableRow(NamedTuple):
    """A line of a table: one text for each method, and which of them is best."""

    label: str
    cells: list[str]
    best: list[bool]

    @classmethod
    def of(cls, label: str, values: Sequence[Any], style: str, compared: bool = True) -> TableRow:
        """Make a line from numbers, None for a missing one; the smallest is the best."""
        least = min((value for value in values if value is not None), default=None)
        cells = ["–" if value is None else format(value, style) for value in values]
        return cls(label, cells, [compared and value is not None and value == least for value in values])


@dataclass
class Study:
    """The results of a comparison of one view."""

    truth: Truth
    entries: list[MethodResult]
    triangles: int  # the number for each method
    max_error_px: float | None = None  # the requested error, if any
    between: bool = True  # whether the baselines could have vertices between posts, as our own methods have them
    from_mesh: bool = False  # whether the baselines' pictures are shaded from their own meshes
    curves: dict[str, list[dict[str, Any]]] | None = None  # from `curves.curve`, if requested
    pruned: Allocation | None = None  # from `curves.pruned_curve`, if requested
    needed: dict[str, dict[str, Any] | None] | None = None  # stats of the fewest triangles that achieve the error

    def uneven(self) -> dict[str, float]:
        """The relative difference from the requested triangles, for methods in which it is larger than `EQUAL`."""
        off = {entry.method: entry.stats["triangles"] / self.triangles - 1 for entry in self.entries}
        return {method: share for method, share in off.items() if abs(share) > EQUAL}

    def table(self) -> list[TableRow]:
        """The numbers as a table."""
        lines = []
        for label, key, style in _NUMBERS:
            values = [entry.stats[key] for entry in self.entries]
            lines.append(TableRow.of(label, values, style, compared=key != "triangles"))
        if self.needed:
            needed = [self.needed[entry.method] for entry in self.entries]
            counts = [stats["triangles"] if stats else None for stats in needed]
            of_all = " RMS" if self.entries[0].stats["metric"] == "rms" else ""
            lines.append(TableRow.of(f"triangles to be within {self.max_error_px:g} px{of_all}", counts, ",d"))
        return lines

    def record(self) -> dict[str, Any]:
        """The numbers as JSON: docs/stats.md."""
        found: dict[str, Any] = {
            "truth": self.truth.stats,
            "methods": [entry.stats for entry in self.entries],
            "triangles": self.triangles,
            "baseline_vertices": VERTICES[not self.between],
            "baseline_shading": SHADING[self.from_mesh],
        }
        if self.curves and self.pruned:
            found["curves"] = self.curves
            points = zip(self.pruned.triangles, self.pruned.rms_px, strict=True)
            found["ideal"] = [{"triangles": int(n), "rms_error_px": float(px)} for n, px in points]
        return found | ({"max_error_px": self.max_error_px, "needed": self.needed} if self.needed else {})


def study(
    renderer: Renderer,
    camera: Camera,
    triangles: int,
    max_error_px: float | None = None,
    with_curves: bool = False,
    fine: int = FINE,
    progress: Progress | None = None,
    between: bool = True,
    from_mesh: bool = False,
    **options: Any,
) -> Study:
    """Compare all methods in one view.

    Parameters
    ----------
    triangles
        The number for each method, reduced to a number that all can draw (`drawable`). With `max_error_px`, the number
        with which method "sat" certifies this error.
    with_curves
        Also measure all methods at several numbers of triangles: `triangles` times each factor in `BUDGETS`, as long as
        the product is smaller than the number of triangles in the truth.
    between
        Whether the baselines may have vertices between posts.
    from_mesh
        Shade the baselines' pictures from their own meshes, not from the map.
    fine
        Each pixel of the compared pictures is drawn as fine × fine pixels.
    progress
        Called with the progress, 0 to 1.
    options
        Further fields of `FrameOptions`, the same for all methods.
    """
    certified = {"method": "sat", "max_error_px": max_error_px} | options
    own = measured(renderer, camera, **certified) if max_error_px else None
    triangles = max(own["triangles"], FEWEST) if own else drawable(renderer, camera, triangles, **options)
    tried = {m: details_of(renderer, camera, m, triangles, options.get("near_m"), between) for m in COMPARED}
    details = {method: best_detail(renderer, camera, method, tried[method], **options) for method in COMPARED}
    if own:
        details["sat"] = {"max_error_px": max_error_px}
        del tried["sat"]
    parts = 1 + with_curves + bool(own)
    shown = part(progress, 0, parts)
    pictures = len(COMPARED) + 1
    truth = truth_of(renderer, camera, fine, part(shown, 0, pictures), **options)
    most = truth.stats["triangles"]
    budgets = [max(FEWEST, round(triangles * share)) for share in BUDGETS if triangles * share < most]
    pruned = pruned_curve(renderer, camera, budgets, options.get("near_m")) if with_curves else None
    entries = []
    for i, (method, detail) in enumerate(details.items(), 1):
        seen = {"from_mesh": from_mesh and method in BASELINES} | options
        pictured = best_pictured(renderer, camera, truth, method, tried.get(method, [detail]), **seen)
        step = part(shown, i, pictures)
        entries.append(entry_of(renderer, camera, truth, method, fine, step, pictured, **detail, **seen))
    found = Study(truth, entries, triangles, max_error_px, between, from_mesh, pruned=pruned)
    if with_curves:
        found.curves = curve(renderer, camera, COMPARED, budgets, part(progress, 1, parts), between, **options)
    if own and max_error_px:
        found.needed = {"sat": own}
        for method in COMPARED:
            if method != "sat":
                asked = max_error_px, triangles, MANY * most if between else most, between
                found.needed[method] = fewest(renderer, camera, method, *asked, **options)
    if progress:
        progress(1.0)
    return found
