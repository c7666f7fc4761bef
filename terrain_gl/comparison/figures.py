"""Figures for print, made with matplotlib: methods side by side, and error against triangles."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.replacing import replacing
from .compare import LABELS, inset_of
from .study import Study

if TYPE_CHECKING:
    from .pruned import Allocation

FORMATS = (".png", ".jpg", ".pdf", ".svg")
# Okabe, Ito 2008, "Color universal design": colours that people with any colour vision can tell apart
COLOURS = {"clipmap": "#D55E00", "tessellated": "#E69F00", "sat": "#0072B2", "pruned": "#555555"}
_MARKERS = {"clipmap": "s", "tessellated": "^", "sat": "o"}
_WIDTH_IN = 16.0
_DPI = 150
_HEAT = "inferno"  # perceptually uniform; black means no error
_STYLE: Any = {
    "font.family": "serif",
    "font.serif": ["STIXGeneral"],  # comes with matplotlib: the same everywhere
    "mathtext.fontset": "stix",
    "font.size": 13,
    "axes.linewidth": 0.8,
    "svg.hashsalt": "terrain-gl",
}


def available() -> None:
    """If there is no matplotlib, raise a `TerrainError` that says what to install."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise TerrainError("figures need matplotlib: pip install 'terrain-gl[compare]'") from None


def figure(path: str | os.PathLike[str], found: Study, caption: Sequence[str]) -> None:
    """Write the figure: one column for the truth and for each method, with picture, inset and errors.

    If there are curves, they are drawn below, with a table. The caption is written under the truth.
    """
    import matplotlib

    with matplotlib.rc_context(_STYLE), replacing(path) as beside:
        sheet = _Sheet(found, len(caption))
        _side_by_side(sheet, found, caption)
        if found.curves:
            _curves(sheet, found.curves, found.pruned)
            _table(sheet, found)
        # into memory first, because matplotlib prints tracebacks if the disk is full
        sheet.figure.savefig(whole := io.BytesIO(), **_file_options(path))
        beside.write_bytes(whole.getvalue())  # getbuffer() would keep the memory in use after an error


class _Sheet:
    """The figure; positions in inches from the upper left."""

    margin = 0.25
    gap = 0.12
    title = 0.82

    def __init__(self, found: Study, lines: int) -> None:
        from matplotlib.figure import Figure

        self.columns = len(found.entries) + 1
        rows, cols = found.truth.sky.shape
        self.width = (_WIDTH_IN - 2 * self.margin - (self.columns - 1) * self.gap) / self.columns
        self.height = self.width * rows / cols
        self.tops = [self.margin + self.title + i * (self.height + self.gap) for i in range(3)]
        self.below = self.tops[2] + max(self.height, 0.95 + 0.21 * lines) + self.margin
        self.curves_in = 5.2 if found.curves else 0.0
        self.height_in = self.below + self.curves_in
        self.figure = Figure(figsize=(_WIDTH_IN, self.height_in), dpi=_DPI, facecolor="white")

    def axes(self, column: int, row: int) -> Any:
        """Axes of one picture, without ticks."""
        left = self.margin + column * (self.width + self.gap)
        axes = self.at(left, self.tops[row], self.width, self.height)
        axes.set_xticks([])
        axes.set_yticks([])
        return axes

    def at(self, left: float, top: float, width: float, height: float) -> Any:
        """Axes in inches."""
        tall = self.height_in
        wide = _WIDTH_IN
        return self.figure.add_axes((left / wide, 1 - (top + height) / tall, width / wide, height / tall))

    def write(self, left: float, top: float, text: str, **style: Any) -> None:
        """Write text with its upper left corner at a position; with `ha="right"` its upper right corner."""
        self.figure.text(left / _WIDTH_IN, 1 - top / self.height_in, text, va="top", parse_math=False, **style)

    def rule(self, left: float, right: float, top: float) -> None:
        """A thin horizontal line."""
        from matplotlib.lines import Line2D

        x, y = [left / _WIDTH_IN, right / _WIDTH_IN], [1 - top / self.height_in] * 2
        self.figure.add_artist(Line2D(x, y, color="0.3", linewidth=0.8))


def _side_by_side(sheet: _Sheet, found: Study, caption: Sequence[str]) -> None:
    truth = found.truth
    scale_px = _heat_scale([entry.error_px for entry in found.entries])
    inset = inset_of(truth, [entry.image for entry in found.entries])
    _picture(sheet, 0, truth.image, inset)
    _title(sheet, 0, "Ground truth", f"every post: {truth.stats['triangles']:,} triangles")
    for i, entry in enumerate(found.entries, 1):
        _picture(sheet, i, entry.image, inset)
        shown = _heat(sheet.axes(i, 2), entry.error_px, scale_px)
        rms_px, max_px = (entry.stats[key] for key in ("rms_error_px", "max_error_px"))
        numbers = f"{entry.stats['triangles']:,} triangles\n{rms_px:.3f} px RMS, {max_px:.2f} px at most"
        _title(sheet, i, f"{LABELS[entry.method]} ({entry.stats['image_rmse']:.4f})", numbers)
    _legend(sheet, shown, scale_px, ["Screen error, pixels", *caption])


def _title(sheet: _Sheet, column: int, title: str, subtitle: str) -> None:
    left = sheet.margin + column * (sheet.width + sheet.gap)
    sheet.write(left, sheet.margin, title, size=17, weight="bold")
    sheet.write(left, sheet.margin + 0.33, subtitle, size=12, color="0.25")


def _picture(sheet: _Sheet, column: int, pixels: np.ndarray, inset: tuple[slice, slice]) -> None:
    """A picture with a frame around the inset; below it, the inset magnified."""
    from matplotlib.patches import Rectangle

    axes = sheet.axes(column, 0)
    axes.imshow(pixels, interpolation="antialiased", aspect="auto")
    rows, cols = inset
    corner = (cols.start - 0.5, rows.start - 0.5)
    width = cols.stop - cols.start
    height = rows.stop - rows.start
    axes.add_patch(Rectangle(corner, width, height, fill=False, edgecolor="black", linewidth=2.4))
    axes.add_patch(Rectangle(corner, width, height, fill=False, edgecolor="white", linewidth=1.2))
    sheet.axes(column, 1).imshow(pixels[inset], interpolation="nearest", aspect="auto")


def _heat_scale(maps: Sequence[np.ndarray]) -> float:
    """The value of the lightest colour: the 99.5th percentile of the worst method, as a round number."""
    worst = max(float(np.nanpercentile(px, 99.5)) if np.isfinite(px).any() else 0.0 for px in maps)
    if worst <= 0:
        return 1.0
    unit = 10.0 ** np.floor(np.log10(worst))
    return float(next(step * unit for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * unit >= worst))


def _heat(axes: Any, error_px: np.ndarray, scale_px: float) -> Any:
    import matplotlib
    from matplotlib.colors import PowerNorm

    colours = matplotlib.colormaps[_HEAT].with_extremes(bad="0.85")
    by_root = PowerNorm(0.5, 0, scale_px)  # a square root makes small errors visible
    return axes.imshow(np.ma.masked_invalid(error_px), cmap=colours, norm=by_root, aspect="auto")


def _legend(sheet: _Sheet, shown: Any, scale_px: float, caption: Sequence[str]) -> None:
    """The first column of the last row: the colour scale and the caption."""
    left, top = sheet.margin, sheet.tops[2]
    bar = sheet.at(left, top + 0.36, sheet.width - 0.15, 0.17)
    ticks = [scale_px * share for share in (0, 0.05, 0.2, 0.5, 1)]
    sheet.figure.colorbar(shown, cax=bar, orientation="horizontal", extend="max", ticks=ticks, format="%.3g")
    bar.minorticks_off()
    bar.tick_params(labelsize=11, length=3)
    sheet.write(left, top + 0.04, caption[0], size=13)
    sheet.write(left, top + 0.95, "\n".join(caption[1:]), size=11, linespacing=1.35, color="0.15")


def _curves(sheet: _Sheet, curves: Mapping[str, Sequence[Mapping[str, Any]]], pruned: Allocation | None) -> None:
    """RMS screen error against triangles, both logarithmic."""
    left, top = sheet.margin + 0.7, sheet.below + 0.15
    axes = sheet.at(left, top, 2 * sheet.width + sheet.gap - 0.7, sheet.curves_in - 0.95)
    for method, points in curves.items():
        line = {"color": COLOURS[method], "marker": _MARKERS[method], "label": LABELS[method]}
        x, y = ([point[key] for point in points] for key in ("triangles", "rms_error_px"))
        axes.plot(x, y, markersize=6.5, linewidth=1.8, **line)
    if pruned:
        dashed: Any = {"color": COLOURS["pruned"], "linestyle": (0, (4, 2)), "label": "Quads alone, pruned"}
        axes.plot(pruned.triangles, pruned.rms_px, linewidth=1.4, **dashed)
    axes.set(xscale="log", yscale="log", xlabel="triangles", ylabel="RMS screen error, pixels")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(_plain)
        axis.set_minor_formatter(_plain_at_2_and_5)
        axis.set_tick_params(which="both", labelsize=11)
    axes.grid(which="both", color="0.92", linewidth=0.7)
    axes.grid(which="major", color="0.80", linewidth=0.9)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, loc="lower left", handlelength=2.6, labelspacing=0.35)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _plain(value: float, _: int) -> str:
    return f"{value:,.0f}" if value >= 1 else f"{value:g}"


def _plain_at_2_and_5(value: float, place: int) -> str:
    digit = round(value / 10.0 ** np.floor(np.log10(value) + 1e-9))
    return _plain(value, place) if digit in (2, 5) else ""


def _table(sheet: _Sheet, found: Study) -> None:
    """A table of the numbers beside the curves, one column for each method; the best of each row is bold."""
    methods = [entry.method for entry in found.entries]
    left, top = sheet.margin + 2 * (sheet.width + sheet.gap) + 0.35, sheet.below + 0.3
    right = _WIDTH_IN - sheet.margin
    columns = [right - (len(methods) - 1 - i) * 1.95 for i in range(len(methods))]
    for column, method in zip(columns, methods, strict=True):
        name = LABELS[method].replace(" ", "\n", 1)
        sheet.write(column, top, name, size=13, ha="right", weight="bold", color=COLOURS[method])
    sheet.rule(left, right, top + 0.55)
    lines = found.table()
    for i, line in enumerate(lines):
        y = top + 0.68 + 0.34 * i
        sheet.write(left, y, line.label, size=13)
        for column, cell, best in zip(columns, line.cells, line.best, strict=True):
            sheet.write(column, y, cell, size=13, ha="right", weight="bold" if best else "normal")
    sheet.rule(left, right, top + 0.68 + 0.34 * len(lines))


def _file_options(path: str | os.PathLike[str]) -> dict[str, Any]:
    suffix = Path(path).suffix.lower()
    options: dict[str, dict[str, Any]] = {  # no dates: the same input gives the same bytes
        ".jpg": {"pil_kwargs": {"quality": 92, "optimize": True}},
        ".pdf": {"metadata": {"CreationDate": None}},
        ".svg": {"metadata": {"Date": None}},
    }
    return {"format": suffix[1:]} | options.get(suffix, {})
