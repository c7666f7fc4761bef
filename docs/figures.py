"""Draw the figures of the chapters in docs/: docs/figures/.

Run: python docs/figures.py [FOLDER]
"""

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection
from matplotlib.patches import Ellipse, Polygon, Rectangle
from matplotlib.ticker import LogLocator

from terrain_gl import reference
from terrain_gl.reference.rings import ring_origin

ROOT = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "figures"
BLUE, RED, GREY = "#1f5fa8", "#c0392b", "#8a8a8a"
LOOK = {"svg.hashsalt": "terrain-gl", "svg.fonttype": "path", "font.size": 10, "axes.titlesize": 10}


def bare(ax, title=""):
    """Axes without ticks and frame, with equal scales."""
    ax.set(title=title, aspect="equal", xticks=[], yticks=[])
    ax.spines[:].set_visible(False)


def arrow(ax, start, end, text="", place=0.5, aside=(0, 0), colour="k", style="-|>"):
    """An arrow with a text beside it."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": style, "color": colour, "shrinkA": 0, "shrinkB": 0})
    at = np.add(start, place * np.subtract(end, start)) + aside
    ax.text(*at, text, color=colour, ha="center", va="center")


# --- What is certified ------------------------------------------------------------------------------------------------


def cell():
    """A cell from the side, and the same error on the screen."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.1), constrained_layout=True)
    x, h = np.arange(9), np.array([1.2, 1.9, 1.7, 2.9, 3.3, 2.6, 2.7, 1.8, 1.6])
    drawn = np.interp(x, [0, 8], h[[0, 8]])
    left.plot(x, h, "o-", color=BLUE, label="the truth $h$: every post")
    left.plot(x[[0, 8]], drawn[[0, 8]], "s-", color=RED, label="drawn $I$: every 8th post")
    arrow(left, (4, drawn[4]), (4, h[4]), "$M_3 = \\max\\, e$", 0.35, (1.15, 0), style="<|-|>")
    left.set(title="the error of a cell, from the side", xlabel="posts", ylim=(0.4, 4.9), yticks=[])
    left.spines[["top", "right", "left"]].set_visible(False)
    left.legend(frameon=False, loc="upper left")
    for end in ((5.6, 1.9), (5.6, -1.5)):
        right.plot([0, end[0]], [0, end[1]], color=GREY, linewidth=0.8)
    right.plot([1.4, 1.4], [-0.375, 0.475], "k", linewidth=2)
    right.text(1.4, -0.62, "screen", ha="center")
    arrow(right, (0, -1.35), (4.4, -1.35), "depth $z$", 0.5, (0, -0.25), style="<|-|>")
    arrow(right, (0, -0.95), (1.4, -0.95), "$K$", 0.5, (0, 0.18), GREY, "<|-|>")
    for y, colour, name in ((0.1, BLUE, "true"), (1.1, RED, "drawn")):
        right.plot([0, 4.4], [0, y], color=colour, linewidth=0.8, linestyle="--")
        right.plot(4.4, y, "o", color=colour)
        right.text(4.85, y, name, color=colour, va="center")
        right.plot(1.4, y * 1.4 / 4.4, "o", color=colour, markersize=3)
    arrow(right, (4.4, 0.14), (4.4, 1.05), "$\\delta$", 0.5, (-0.22, 0), style="<|-|>")
    right.annotate("pixels", (1.4, 0.19), (0.45, 1.2), arrowprops={"arrowstyle": "-", "color": "k", "linewidth": 0.6})
    right.plot(0, 0, "k>", markersize=8)
    right.text(-0.1, 0.25, "eye", ha="center")
    bare(right, "metres become pixels")
    right.set(xlim=(-0.4, 5.8), ylim=(-1.9, 2.1))
    return figure


def land(size=513):
    """Heights of a part of the bundled range, metres."""
    known = json.loads((ROOT / "heightmaps" / "maps.json").read_text())["alpine-30m"]
    pixels = plt.imread(ROOT / "heightmaps" / known["file"])[200 : 200 + size, 300 : 300 + size]
    return pixels * 65535.0 * known["z_scale"] + known["z_offset_m"]


def worst_cells(heights, levels):
    """The largest error of each cell of every level."""
    found = [np.abs(reference.twists(heights)) / 4]
    for level in range(1, levels):
        rows = []
        for row in range((len(heights) - 1) >> level):  # a cell's posts are held in memory: band by band
            band = heights[row << level : ((row + 1) << level) + 1]
            rows.append(np.maximum(*(np.abs(e).max((1, 3)) for e in reference.quad_errors(band, level)))[0])
        found.append(np.array(rows))
    return found


def cut(worst, x, y, side, level, hole, allowed):
    """Squares x, y, side, spacing of a block, and their cost; four are joined if the whole costs no more."""
    shared = [min(at + side, low + hole[2]) - max(at, low) for at, low in ((x, hole[0]), (y, hole[1]))]
    if min(shared) >= side:
        return [], 0  # the finer ring covers it
    tolerance = allowed(x, y, side)
    own = 0
    for j in range(min(level, len(worst) - 1), -1, -1):
        if worst[j][y >> j : (y + side) >> j, x >> j : (x + side) >> j].max(initial=0) <= tolerance:
            own = j
            break
    segments = side >> own
    whole = [(x, y, side, own)], 2 * segments**2 + 24 if segments <= 64 else np.inf
    beside = min(shared) <= 0
    if side <= 1 << level or (segments <= 4 and beside):
        return whole
    half = side // 2
    parts = [cut(worst, x + i, y + k, half, level, hole, allowed) for k in (0, half) for i in (0, half)]
    cost = sum(each[1] for each in parts)
    return whole if whole[1] <= cost and beside else ([square for each in parts for square in each[0]], cost)


def rings():
    """Rings around the eye, the squares of their blocks, and the strip beside a finer square."""
    heights, levels, blocks = land(), 4, 6
    worst, eye = worst_cells(heights, 7), np.array([250.0, 262.0])
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.9), constrained_layout=True)
    south, east = np.gradient(heights, 30)
    light = np.clip((0.5 * east + 0.5 * south + 0.7) / np.sqrt(1 + east**2 + south**2), 0, 1)
    colours, lines, hole = plt.get_cmap("viridis"), [], (0, 0, 0, 0)

    def allowed(x, y, side):
        away = np.maximum(np.abs(np.array([x, y]) + side / 2 - eye) - side / 2, 0)
        return 0.2 * (np.hypot(*away) + 8)

    for ax in axes[:2]:
        ax.imshow(light, cmap="gray", extent=(0, 512, 512, 0), vmin=-1.2, vmax=1.2)
    for level in range(levels):
        block = 8 << level
        x0, y0 = ring_origin(tuple(eye), (blocks, blocks), level)
        width = blocks * block
        axes[0].add_patch(Rectangle((x0, y0), width, width, fill=False, edgecolor=colours(1 - level / 3), linewidth=2))
        for y in range(y0, y0 + width, block):
            for x in range(x0, x0 + width, block):
                found = cut(worst, x, y, block, level, hole, allowed)[0]
                if found:
                    axes[0].add_patch(Rectangle((x, y), block, block, fill=False, linewidth=0.5, edgecolor="k"))
                for left, top, side, spacing in found:
                    shade = colours(1 - min(spacing, 5) / 5)
                    axes[1].add_patch(Rectangle((left, top), side, side, color=shade, alpha=0.55, linewidth=0))
                    lines.append([(left, top), (left + side, top), (left + side, top + side), (left, top + side)])
        hole = (x0, y0, width)
    axes[1].add_collection(LineCollection([[*line, line[0]] for line in lines], colors="k", linewidths=0.3))
    bare(axes[0], "rings, and their blocks of 8 × 8 cells")
    bare(axes[1], "squares, coloured by spacing")
    for ax in axes[:2]:
        ax.plot(*eye, "r+", markersize=12, markeredgewidth=2)
        ax.set(xlim=(hole[0] - 4, hole[0] + hole[2] + 4), ylim=(hole[1] + hole[2] + 4, hole[1] - 4))
    strip(axes[2])
    return figure


def strip(ax):
    """A square beside a finer one: the strip of cells whose outer edge has twice the vertices."""
    ax.add_patch(Rectangle((4, 0), 2, 8, color=BLUE, alpha=0.25, linewidth=0))
    for k in range(0, 7, 2):
        ax.plot([k, k], [0, 8], "k", linewidth=0.8)
    for k in range(0, 9, 2):
        ax.plot([0, 6], [k, k], "k", linewidth=0.8)
    for x in (6, 7, 8, 9):
        ax.plot([x, x], [0, 8], "k", linewidth=0.5)
    for y in range(9):
        ax.plot([6, 9], [y, y], "k", linewidth=0.5)
    for y in range(0, 8, 2):
        ax.plot([4, 6], [y, y + 1], color=RED, linewidth=0.8)
        ax.plot([4, 6], [y + 2, y + 1], color=RED, linewidth=0.8)
        ax.plot(6, y + 1, "o", color=RED, markersize=4)
    bare(ax, "a strip, and its new vertices")
    ax.set(xlim=(-0.4, 9.4), ylim=(-1.6, 8.6))
    ax.text(3, -0.9, "coarse square", ha="center")
    ax.text(7.6, -0.9, "finer", ha="center")


# --- A budget of triangles --------------------------------------------------------------------------------------------


def price():
    """Trees as points. A price is the slope of a line; the first point that the line touches is its tree."""
    rng = np.random.default_rng(4)
    n = rng.uniform(2, 60, 260)
    error = 600 / (n + 9) - 6 + rng.gamma(1.6, 4.5, len(n))
    order = np.argsort(n)
    hull = []
    for i in order:
        while _above(hull, i, n, error):
            hull.pop()
        hull.append(i)
    hull = hull[: int(np.argmin(error[hull])) + 1]
    figure, ax = plt.subplots(figsize=(6, 3.5), constrained_layout=True)
    ax.plot(n, error, "o", color=GREY, markersize=3, alpha=0.6, label="trees")
    ax.plot(n[hull], error[hull], "o-", color=BLUE, markersize=5, label="trees that some price $\\lambda$ chooses")
    k = len(hull) // 2
    slopes = np.diff(error[hull]) / np.diff(n[hull])
    slope = 0.7 * slopes[k - 1] + 0.3 * slopes[k]
    at = n[hull[k]] + np.array([-18, 15])
    ax.plot(at, error[hull[k]] + slope * (at - n[hull[k]]), color=RED, label="slope $-\\lambda$")
    ax.axvline(n[hull[k]] + 1.2, color="k", linestyle=":", linewidth=1)
    ax.text(n[hull[k]] + 1.8, 1.5, "$N$")
    ax.set(xlabel="triangles", ylabel="squared error, px²", ylim=(0, 75))
    ax.legend(frameon=False)
    ax.spines[["top", "right"]].set_visible(False)
    return figure


def _above(hull, i, n, error):
    """Whether the hull's last point lies above the line from the one before it to the point i."""
    if len(hull) < 2:
        return False
    a, b = hull[-2:]
    return (error[b] - error[a]) * (n[i] - n[a]) >= (error[i] - error[a]) * (n[b] - n[a])


# --- Light ------------------------------------------------------------------------------------------------------------


def footprint():
    """A pixel from the side, its footprint on the map, and the box that replaces it."""
    figure, (side, above, box) = plt.subplots(1, 3, figsize=(11, 3.4), constrained_layout=True)
    x = np.linspace(0, 10, 200)
    ground = 0.25 * np.sin(1.7 * x) + 0.12 * np.sin(5 * x + 1) + 0.04 * x
    side.fill_between(x, ground, -1.6, color=GREY, alpha=0.3, linewidth=0)
    side.plot(x, ground, "k", linewidth=0.8)
    side.plot(0.4, 3.2, "k>", markersize=8)
    for reach in (6.3, 8.4):
        side.plot([0.4, reach], [3.2, np.interp(reach, x, ground)], color=BLUE, linewidth=0.8)
    inside = (x >= 6.3) & (x <= 8.4)
    side.plot(x[inside], ground[inside], color=RED, linewidth=3)
    side.text(7.4, -0.65, "footprint $\\Omega$", color=RED, ha="center")
    side.text(3.2, 2.75, "one pixel", color=BLUE)
    bare(side, "what one pixel sees")
    side.set(xlim=(0, 10), ylim=(-3, 5.6))
    u, v = np.array([2.4, 1.6]), np.array([4.0, 6.4])
    corners = [0.5 * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    spread = np.outer(u, u) + np.outer(v, v)
    values, axes_ = np.linalg.eigh(spread)
    turn = np.degrees(np.arctan2(*axes_[::-1, 1]))
    sides = np.sqrt(np.diag(spread))
    for ax in (above, box):
        for k in np.arange(-8, 9):
            ax.plot([k, k], [-8, 8], color=GREY, linewidth=0.3)
            ax.plot([-8, 8], [k, k], color=GREY, linewidth=0.3)
        ax.add_patch(Polygon(corners, facecolor=RED, alpha=0.25, edgecolor=RED))
        ax.set(xlim=(-7, 7), ylim=(-6, 6))
    bare(above, "on the map: a parallelogram of sides $u$, $v$")
    above.add_patch(Ellipse((0, 0), *np.sqrt(values[::-1]), angle=turn, fill=False, edgecolor="k"))
    arrow(above, corners[0], corners[1], "$u$", 0.5, (0.4, -0.7), BLUE)
    arrow(above, corners[0], corners[3], "$v$", 0.5, (-0.7, 0.3), BLUE)
    bare(box, "the box around its ellipse")
    box.add_patch(Rectangle(-sides / 2, *sides, fill=False, edgecolor=BLUE, linewidth=1.5))
    return figure


# --- Next to its baselines --------------------------------------------------------------------------------------------

STYLES = {
    "clipmap": {"color": "#d98324", "marker": "s"},
    "tessellated": {"color": "#4c9a5b", "marker": "^"},
    "sat": {"color": "#7a3fa0", "marker": "D"},
}


def table(name):
    """A table of docs/tables/: (view, map) -> column -> numbers; NaN where there is none."""
    found = {}
    with open(ROOT / "docs" / "tables" / name, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            columns = found.setdefault((row.pop("view"), row.pop("map")), {})
            for column, number in row.items():
                columns.setdefault(column, []).append(float(number) if number else np.nan)
    return found


def panels(name, unit):
    """One panel for each map and view of a table: the columns of the methods against triangles."""
    found = table(name)
    rows = -(-len(found) // 4)
    figure, axes = plt.subplots(rows, 4, figsize=(11, 2.5 * rows), constrained_layout=True)
    for ax, ((view, land_name), columns) in zip(axes.flat, found.items(), strict=False):
        for method, style in STYLES.items():
            ax.plot(columns["triangles"], columns[method], markersize=4, label=method, **style)
        plain(ax, f"{land_name}, {view}")
    for ax in axes.flat[len(found) :]:
        ax.set_axis_off()
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=6, frameon=False)
    figure.supxlabel("triangles")
    figure.supylabel(unit)
    return figure


def other_programs():
    """Triangles of whole maps against the error in metres: with and without `--between`, and pymartini's."""
    found = {}
    with open(ROOT / "docs" / "tables" / "other_programs.csv", encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            curves = found.setdefault(row["map"], {"sat": [], "pydelatin": [], "pymartini": []})
            metres, theirs = float(row["metres"]), float(row["pymartini metres"])
            for ours in ("sat", "pydelatin"):
                curves[ours] += [(metres, int(row[ours])), (theirs, int(row[f"{ours} there"]))]
            curves["pymartini"].append((theirs, int(row["pymartini"])))
    styles = {
        "sat": {"color": BLUE, "marker": "o"},
        "pydelatin": STYLES["tessellated"],
        "pymartini": STYLES["clipmap"],
    }
    figure, axes = plt.subplots(3, 3, figsize=(10, 7.5), constrained_layout=True)
    for ax, (name, curves) in zip(axes.flat, found.items(), strict=True):
        for program, points in curves.items():
            ax.plot(*zip(*sorted(points), strict=True), markersize=4, label=program, **styles[program])
        plain(ax, name)
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    figure.supxlabel("error, m")
    figure.supylabel("triangles")
    return figure


def plain(ax, title):
    """Logarithmic axes with plain numbers."""
    ax.set(title=title, xscale="log", yscale="log")
    for axis, steps in ((ax.xaxis, (1, 3)), (ax.yaxis, (1, 2, 5))):
        axis.set_major_locator(LogLocator(subs=steps))
        axis.set_major_formatter(lambda value, _: f"{value / 1000:g}k" if value >= 1000 else f"{value:g}")
    ax.grid(True, which="major", linewidth=0.3)
    ax.minorticks_off()


FIGURES = {"cell.svg": cell, "rings.png": rings, "price.svg": price, "footprint.svg": footprint}
FIGURES |= {
    "screen_error.svg": lambda: panels("screen_error.csv", "RMS screen error, px"),
    "other_programs.svg": other_programs,
}


def main(folder):
    """Draw all."""
    folder.mkdir(exist_ok=True)
    with plt.rc_context(LOOK):
        for name, draw in FIGURES.items():
            figure = draw()
            metadata = {"Date": None} if name.endswith(".svg") else {"Software": None}
            figure.savefig(folder / name, dpi=110, metadata=metadata)
            plt.close(figure)
            if name.endswith(".svg"):
                number_clips(folder / name)


def number_clips(path):
    """Number an SVG's clip paths: matplotlib names them by their coordinates' last digits, which differ by machine."""
    text = path.read_text(encoding="utf-8")
    for i, name in enumerate(re.findall(r'<clipPath id="(\w+)"', text)):
        text = text.replace(f'id="{name}"', f'id="clip{i}"').replace(f"url(#{name})", f"url(#clip{i})")
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
