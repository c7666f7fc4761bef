"""All methods at equal triangles, on generated land and on real maps, as tables for docs/comparison.md.

    land     4096² posts of `generate --seed 7 --cliffs 0.7`: three views, 0.1, 0.3 and 1 million triangles
    others   other seeds, other cliffs and the other recipe, 1025² posts: three smaller numbers
    real     every map in the folder TERRAIN_GL_DEM, from outside and from a ridge: six numbers, from 1/64 to 1/2 of
             the triangles of every post
    small    the same for maps of up to two million posts and the bundled ones, three numbers: 1/32, 1/8 and 1/2;
             screen errors alone
    pictures the pictures of these
    pixel    triangles that are needed for an error of at most one pixel
    puget    a view of ps_height_1k.png for which numbers of other methods are published

The tables also have the RMS screen error of the pruned quadtree of quads. All of it takes hours on a software renderer.
Each number is written to a file at once, and a run that is started again continues.

Run: python benchmarks/baselines.py FOLDER [land|others|real|small|pictures|pixel|puget|tables ...]
"""

import json
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.basics.replacing import replacing
from terrain_gl.comparison import compare, curves
from terrain_gl.files.generate import Land, write_land
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.files.views import standard_view
from terrain_gl.gpu.context import create_context

OURS = ("sat", "quadtree")
BASELINES = [method for method in compare.COMPARED if method not in OURS]
VIEWS = ("valley", "ridge", "high")
FINE = 2  # each pixel of a picture is drawn as FINE × FINE pixels
LAND = {"cols": 4096, "rows": 4096, "seed": 7, "cliffs": 0.7}
OTHERS = {
    f"{recipe}-{seed}-{cliffs}": {"cols": 1025, "rows": 1025, "seed": seed, "cliffs": cliffs, "recipe": recipe}
    for recipe, seed, cliffs in (
        ("canyon", 7, 0.2),
        ("canyon", 1, 0.7),
        ("canyon", 2, 1.0),
        ("alpine", 7, 0.7),
    )
}
REAL = {
    "deathvalley_basinrange_4097_u16_off100.png": {"spacing_m": (73, 93), "z_offset_m": -100.0},
    "moon_gld100_lon100-116_lat28-44_4096.png": {"spacing_m": (96, 118), "z_offset_m": -10000.0},
    "narok_srtm_z12_4608_f32.tif": {"spacing_m": 19.1},
    "greenriver.tif": {"spacing_m": 1},
    "mt_rainier_90m.tif": {"spacing_m": (64, 93)},
    "ps_height_1k.png": {"spacing_m": 160, "z_scale": 0.1},
    "N37W123.hgt": {"spacing_m": (73, 93)},
}
SMALL = ("mt_rainier_90m.tif", "ps_height_1k.png", "N37W123.hgt", "greenriver.tif")
PUGET = Camera((81920, 30000, 9000), (81920, 110000, 0), 60)
KEPT = ("triangles", "max_error_px", "rms_error_px", "image_rmse", "flip", "skyline_px", "max_skyline_px", "ms")


class Case:
    """One view of one map: its numbers so far, in a file, and functions that find further ones.

    Parameters
    ----------
    folder, name
        Where the file is.
    open_map
        Opens the heightmap; called when a number is missing.
    view
        A standard view, or a camera.
    """

    def __init__(self, folder, name, open_map, view, size=(1280, 720)):
        self.path, self.name = folder / f"{name}.json", name
        self.open_map, self.view, self.size = open_map, view, size
        self.known = json.loads(self.path.read_text()) if self.path.exists() else {}
        self.renderer = self.truth = None

    def know(self, key, work):
        """The number under a key; if it is missing, the result of `work`, which is stored."""
        if key not in self.known:
            started = time.monotonic()
            self._open()
            self.known[key] = work()
            with replacing(self.path) as part:
                part.write_text(json.dumps(self.known, indent=1))
            print(f"{self.name}: {key}, {time.monotonic() - started:.0f} s", file=sys.stderr, flush=True)
        return self.known[key]

    def full(self):
        """The number of triangles of a mesh with every post in the picture."""
        return self.know("full", lambda: self.renderer.draw(self.camera, method="full")["triangles"])

    def achieved(self, method, triangles):
        """Stats of a method with this number of triangles."""
        return self.know(f"{method} {triangles}", lambda: self._measured(method, triangles))

    def likeness(self, method, triangles):
        """The difference of its picture from the truth."""
        return self.know(f"{method} {triangles} picture", lambda: self._likeness(method, triangles))

    def dense(self):
        """The difference of the dense mesh's picture from the truth, which comes from the diagonals of cells."""
        return self.know("full picture", lambda: self._picture(method="full"))

    def pruned(self, budgets):
        """RMS error of the pruned quadtree of quads, by number of triangles."""
        return self.know(f"pruned {budgets}", lambda: self._pruned(budgets))

    def within(self, max_error_px):
        """Triangles with which an error is certified, and those that each baseline needs to achieve it."""
        return self.know(f"within {max_error_px}", lambda: self._within(max_error_px))

    def close(self):
        """Release GPU resources."""
        if self.renderer:
            self.renderer.release()
        self.renderer = self.truth = None

    def _open(self):
        if self.renderer is None:
            heightmap = self.open_map()
            self.camera = standard_view(heightmap, self.view) if isinstance(self.view, str) else self.view
            self.renderer = Renderer(heightmap, self.size)

    def _measured(self, method, triangles):
        detail = curves.detail_of(self.renderer, self.camera, method, triangles)
        stats = compare.measured(self.renderer, self.camera, method=method, **detail)
        found = {key: stats[key] for key in KEPT if key in stats}
        return found | ({"parameters": asdict(detail["parameters"])} if "parameters" in detail else {})

    def _likeness(self, method, triangles):
        tried = curves.details_of(self.renderer, self.camera, method, triangles)
        detail = compare.best_pictured(self.renderer, self.camera, self._truth(), method, tried)
        found = self._picture(method=method, **detail)
        return found | ({"parameters": asdict(detail["parameters"])} if "parameters" in detail else {})

    def _picture(self, **drawing):
        return compare.likeness_of(self.renderer, self.camera, self._truth(), FINE, **drawing)[1]

    def _truth(self):
        self.truth = self.truth or compare.truth_of(self.renderer, self.camera, FINE)
        return self.truth

    def _pruned(self, budgets):
        found = curves.pruned_curve(self.renderer, self.camera, budgets)
        return [[int(n), float(px)] for n, px in zip(found.triangles, found.rms_px, strict=True)]

    def _within(self, max_error_px):
        own = compare.measured(self.renderer, self.camera, method="sat", max_error_px=max_error_px)
        needed = {"sat": own["triangles"], "achieved_px": own["max_error_px"], "full": self.full()}
        for method in BASELINES:
            stats = curves.fewest(self.renderer, self.camera, method, max_error_px, own["triangles"], needed["full"])
            needed[method] = stats and stats["triangles"]
        return needed


def generated(folder, **land):
    """Generated land; its file is made once."""

    def open_map():
        made = Land(**land)
        path = folder / f"{made.recipe}-{made.cols}-{made.seed}-{made.cliffs}.tif"
        if not path.exists():
            ctx = create_context()
            with ctx:
                write_land(ctx, made, str(path))
            ctx.release()
        return Heightmap.open(path, made.spacing_m)

    return open_map


def cases(folder):
    """All cases by part."""
    dem = os.environ.get("TERRAIN_GL_DEM")
    real = {name: Path(dem) / name for name in REAL if dem and (Path(dem) / name).exists()}
    opened = {name: lambda name=name, path=path: Heightmap.open(path, **REAL[name]) for name, path in real.items()}
    land = {view: Case(folder, f"land-{view}", generated(folder, **LAND), view) for view in VIEWS}
    others = [Case(folder, f"other-{name}", generated(folder, **made), "ridge") for name, made in OTHERS.items()]
    maps = [
        Case(folder, f"{view}-{name}", opened[name], view, (640, 360)) for view in ("default", "ridge") for name in real
    ]
    few = {name: opened[name] for name in SMALL if name in opened}
    few |= {name: lambda name=name: open_map(name)[0] for name in bundled()}
    small = [
        Case(folder, f"small-{view}-{name}", open_it, view, (640, 360))
        for view in ("ridge", "default")
        for name, open_it in few.items()
    ]
    pixel = [Case(folder, f"pixel-{name}", opened[name], "ridge") for name in real]
    puget = [Case(folder, "puget", opened["ps_height_1k.png"], PUGET)] if "ps_height_1k.png" in real else []
    known = {"land": [*land.values()], "others": others, "real": maps, "small": small, "pictures": small}
    return known | {"pixel": [land["ridge"], *pixel], "puget": puget}


def work(part, case):
    """Find all numbers of a case."""
    case.full()
    budgets = budgets_of(part, case)
    for triangles in budgets if part != "pictures" else ():
        for method in compare.COMPARED:
            case.achieved(method, triangles)
    if part == "pixel":
        case.within(1.0)
    if part in ("land", "others", "real"):
        case.pruned(budgets)
    if part in ("land", "real", "pictures"):
        for triangles in budgets:
            for method in compare.COMPARED:
                case.likeness(method, triangles)
        case.dense()
    if part == "puget":
        for error_px in (1.0, 1.94):
            case.know(f"certified {error_px}", lambda px=error_px: certified(case, px))
    case.close()


def budgets_of(part, case):
    """The numbers of triangles of a case."""
    if part in ("real", "small", "pictures"):
        return [round(case.known["full"] / 2**k) for k in ((6, 5, 4, 3, 2, 1) if part == "real" else (5, 3, 1))]
    return {"land": [100_000, 300_000, 1_000_000], "others": [10_000, 30_000, 100_000], "puget": [103_040]}.get(
        part, []
    )


def certified(case, max_error_px):
    """Stats of a frame with a certified error."""
    stats = compare.measured(case.renderer, case.camera, method="sat", max_error_px=max_error_px)
    return {key: stats[key] for key in KEPT if key in stats}


# --- tables -----------------------------------------------------------------------------------------------------------


def markdown(rows):
    """A table."""
    head, *body = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body])


def tables(part, found):
    """The tables of a part, as text."""
    rows = {"pixel": pixel_rows, "puget": puget_rows, "pictures": picture_rows}.get(part, budget_rows)(part, found)
    pictures = picture_rows(part, found) if part in ("land", "real") else []
    return "\n\n".join(markdown(table) for table in (rows, pictures) if len(table) > 1)


def pixel_rows(_, found):
    """Rows: triangles for an error of at most one pixel."""
    rows = [["map", "every post", "SAT, certified", "achieved, px", *(f"{m}, achieved" for m in BASELINES)]]
    for case in found:
        if needed := case.known.get("within 1.0"):
            counts = [f"{needed[m]:,}" if needed[m] else "not reached" for m in BASELINES]
            rows += [[case.name, f"{needed['full']:,}", f"{needed['sat']:,}", f"{needed['achieved_px']:.3f}", *counts]]
    return rows


def puget_rows(_, found):
    """Rows: the view with published numbers of other methods."""
    rows = [["asked", "triangles", "largest error, px", "RMS error, px"]]
    for case in found:
        for key, stats in (each for each in case.known.items() if each[0] != "full"):
            rows += [[key, f"{stats['triangles']:,}", f"{stats['max_error_px']:.3f}", f"{stats['rms_error_px']:.3f}"]]
    return rows


def budget_rows(part, found):
    """Rows: errors at equal triangles of all methods and of the pruned quadtree, and ratios of errors."""
    ours, methods = "sat", compare.COMPARED
    rows = [["view or map", "triangles", *(f"{m} RMS px" for m in methods), "quads, pruned", "sat / pruned"]]
    rows[0] += [*(f"{m} / {ours}" for m in BASELINES), "sat / quadtree"]
    for case in found:
        for triangles in budgets_of(part, case):
            px = {m: case.known.get(f"{m} {triangles}", {}).get("rms_error_px") for m in methods}
            pruned_px = pruned_at(case, budgets_of(part, case), triangles)
            ratios = [ratio(px[ours], pruned_px), *(ratio(px[m], px[ours]) for m in BASELINES)]
            ratios += [ratio(px[ours], px["quadtree"])]
            rows += [[case.name, f"{triangles:,}", *map(shown, px.values()), shown(pruned_px), *ratios]]
    return rows


def picture_rows(part, found):
    """Rows: differences of pictures from the truth, of all methods and of the dense mesh."""
    drawn = (*compare.COMPARED, "full")
    rows = [["view or map", "triangles", *(f"{m} {what}" for what in ("RMSE", "FLIP") for m in drawn)]]
    for case in found:
        for triangles in budgets_of(part, case):
            keys = [*(f"{m} {triangles} picture" for m in compare.COMPARED), "full picture"]
            known = [case.known.get(key, {}) for key in keys]
            if known[0]:
                numbers = [shown(picture.get(what)) for what in ("image_rmse", "flip") for picture in known]
                rows += [[case.name, f"{triangles:,}", *numbers]]
    return rows


def pruned_at(case, budgets, triangles):
    """RMS error of the pruned quadtree with this number of triangles, if it is known."""
    found = case.known.get(f"pruned {budgets}")
    return found[budgets.index(triangles)][1] if found else None


def shown(value):
    """A number as text; empty for None."""
    return "" if value is None else f"{value:.4f}"


def ratio(a, b):
    """A ratio as text; empty if a number is missing."""
    return f"{a / b:.2f}" if a and b else ""


def main(folder, *parts):
    """Find the requested numbers, and print the tables."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    known = cases(folder)
    asked = [part for part in parts if part != "tables"] or (() if parts else known)
    todo = [(part, case) for part in asked for case in known[part]]
    for i, (part, case) in enumerate(todo):
        print(f"[{'#' * (30 * i // len(todo)):<30}] {part} {case.name}", file=sys.stderr, flush=True)
        work(part, case)
    for part in asked or known:
        done = [case for case in known[part] if case.known and (part != "real" or "full" in case.known)]
        print(f"\n## {part}\n\n{tables(part, done)}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
