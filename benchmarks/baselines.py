"""All methods at equal triangles, on real and bundled maps: the numbers of docs/comparison.md.

    maps      four bundled maps, and four real ones in the folder TERRAIN_GL_DEM, from a ridge and from outside: RMS
              screen errors with 1/32, 1/8 and 1/2 of the triangles of every post
    pictures  RMSE and FLIP of the pictures of these

Each number is written to a file at once, and a run that is started again continues. Part `maps` takes an hour on two
busy cores of Mesa's software renderer. It also writes FOLDER/screen_error.csv, the table in docs/tables.

Run: python benchmarks/baselines.py FOLDER [maps|pictures ...]
"""

import csv
import json
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path

from table import head, row

from terrain_gl import Heightmap, Renderer
from terrain_gl.basics.replacing import replacing
from terrain_gl.comparison import compare, curves
from terrain_gl.files.maps import open_map
from terrain_gl.files.views import standard_view

OURS = ("sat",)
BASELINES = [method for method in compare.COMPARED if method not in OURS]
FINE = 2  # each pixel of a picture is drawn as FINE × FINE pixels
REAL = {
    "greenriver.tif": {"spacing_m": 1},
    "mt_rainier_90m.tif": {"spacing_m": (64, 93)},
    "ps_height_1k.png": {"spacing_m": 160, "z_scale": 0.1},
    "N37W123.hgt": {"spacing_m": (73, 93)},
}
LARGE = ("canyon", "alpine")  # from a ridge alone: a mesh of every post has millions of triangles from outside
VIEWS = "ridge", "default"
BUNDLED = ("canyon-15m", "alpine-30m", *LARGE)
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


def cases(folder):
    """All cases by part."""
    dem = os.environ.get("TERRAIN_GL_DEM")
    paths = {name: Path(dem) / name for name in REAL if dem and (Path(dem) / name).exists()}
    opened = {name: lambda name=name, path=path: Heightmap.open(path, **REAL[name]) for name, path in paths.items()}
    opened |= {name: lambda name=name: open_map(name)[0] for name in BUNDLED}
    maps = [
        Case(folder, f"{view}-{name}", open_it, view, (640, 360))
        for view in VIEWS
        for name, open_it in opened.items()
        if view == "ridge" or name not in LARGE
    ]
    return {"maps": maps, "pictures": maps}


def work(part, case):
    """Find all numbers of a case."""
    case.full()
    for triangles in budgets_of(case):
        for method in compare.COMPARED:
            (case.likeness if part == "pictures" else case.achieved)(method, triangles)
    if part == "pictures":
        case.dense()
    case.close()


def budgets_of(case):
    """The numbers of triangles of a case."""
    return [round(case.known["full"] / 2**k) for k in (5, 3, 1)]


# --- tables -----------------------------------------------------------------------------------------------------------


def error_rows(found, view):
    """Rows of a view: RMS screen errors of all methods at equal triangles, and ratios of errors."""
    ours, methods = "sat", compare.COMPARED
    rows = [[f"{view}, map", "triangles", *methods, *(f"{m} / {ours}" for m in BASELINES)]]
    for case in (case for case in found if case.name.startswith(view)):
        for triangles in budgets_of(case):
            px = {m: case.known.get(f"{m} {triangles}", {}).get("rms_error_px") for m in methods}
            ratios = [*(ratio(px[m], px[ours]) for m in BASELINES)]
            name = Path(case.name.removeprefix(f"{view}-")).stem
            rows += [[name, f"{triangles:,}", *map(shown, px.values()), *ratios]]
    return rows


def picture_rows(found):
    """Rows: differences of pictures from the truth, of all methods and of the dense mesh."""
    drawn = (*compare.COMPARED, "full")
    rows = [["view or map", "triangles", *(f"{m} {what}" for what in ("RMSE", "FLIP") for m in drawn)]]
    for case in found:
        for triangles in budgets_of(case):
            keys = [*(f"{m} {triangles} picture" for m in compare.COMPARED), "full picture"]
            known = [case.known.get(key, {}) for key in keys]
            if known[0]:
                numbers = [shown(picture.get(what)) for what in ("image_rmse", "flip") for picture in known]
                rows += [[case.name, f"{triangles:,}", *numbers]]
    return rows


def shown(value):
    """A number as text; empty for None."""
    return "" if value is None else f"{value:.4f}"


def ratio(a, b):
    """A ratio as text; empty if a number is missing."""
    return f"{a / b:.2f}" if a and b else ""


def write_errors(found, path):
    """The RMS screen errors of the part `maps` as CSV, for docs/tables."""
    with replacing(path) as part, open(part, "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["view", "map", "triangles", *compare.COMPARED])
        for case in found:
            for triangles in budgets_of(case):
                px = [case.known.get(f"{method} {triangles}", {}).get("rms_error_px") for method in compare.COMPARED]
                if all(px):
                    view, name = case.name.split("-", 1)
                    view = {"default": "outside"}.get(view, view)
                    rows.writerow([view, Path(name).stem, triangles, *map(shown, px)])


def main(folder, *parts):
    """Find the requested numbers, and print the tables."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    known = cases(folder)
    todo = [(part, case) for part in parts or known for case in known[part]]
    for i, (part, case) in enumerate(todo):
        print(f"[{'#' * (30 * i // len(todo)):<30}] {part} {case.name}", file=sys.stderr, flush=True)
        work(part, case)
    for part in parts or known:
        tables = [error_rows(known[part], view) for view in VIEWS] if part == "maps" else [picture_rows(known[part])]
        for names, *rows in tables:
            head(*names)
            for cells in rows:
                row(*cells)
    write_errors([case for case in known["maps"] if "full" in case.known], folder / "screen_error.csv")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
