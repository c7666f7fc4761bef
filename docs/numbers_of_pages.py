"""Write the numbers of the pages again, each from the program of today.

    python docs/numbers_of_pages.py [--page PAGE] [--table NAME] [--maps FOLDER] [--pictures] [--benchmarks [WORD]]

A page has a block for each table:

    <!-- numbers: NAME -->
    ...
    <!-- end of numbers: the command, commit, date, driver -->

`TABLES` has a function for the rows of each table. With `--maps`, a folder of the real maps of maps.md, rows of real
maps are measured again; if a map is missing, its rows stay as they are. `tests/test_numbers.py` measures some rows of
each table and compares them with the page. `--pictures` also draws the pictures of the pages again.

A table that a benchmark prints has a block that names the benchmark's command:

    <!-- printed: python benchmarks/sat.py -->
    ...
    <!-- end of printed: commit, date, driver -->

Such tables are in the pages, in CONTRIBUTING.md and in the README of benchmarks/open. `--benchmarks` runs these
commands, and takes from what they print the table with the same first line. That takes hours, and times need a quiet
machine. With a word, only the commands that have it are run, and nothing else. Where a command fails, its tables stay
as they are.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

import terrain_gl as tg
from terrain_gl.camera.rounding import rounding_px
from terrain_gl.comparison import compare, curves
from terrain_gl.comparison.likeness import flip_map
from terrain_gl.files.generate import Land, generate
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.files.views import standard_view
from terrain_gl.image import linear_from_srgb
from terrain_gl.shade.picture import UNLIT

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent / "benchmarks"))
from hidden import seen_share  # noqa: E402  the benchmark of the same page

SIZE, SMALL = (1280, 720), (640, 360)
BUNDLED = ("alpine", "canyon", "alpine-30m", "canyon-15m")
REAL = {  # how the real maps are opened: docs/maps.md
    "N37W123.hgt": {},
    "greenriver.tif": {},
    "mt_rainier_90m.tif": {},
    "ps_height_1k.png": {"spacing_m": 160.0, "z_scale": 0.1},
    "deathvalley_basinrange_4097_u16_off100.png": {"spacing_m": (73.0, 93.0), "z_offset_m": -100.0},
    "moon_gld100_lon100-116_lat28-44_4096.png": {"spacing_m": (96.0, 118.0), "z_offset_m": -10000.0},
    "narok_srtm_z12_4608_f32.tif": {"spacing_m": 19.1},
}
GENERATED = {  # `terrain-gl generate`
    "hills": Land(1025, 1025, seed=1, cliffs=0.0),
    "mixed": Land(1025, 1025, seed=2, cliffs=0.5),
    "canyons": Land(1025, 1025, seed=3, cliffs=1.0),
    "ridges": Land(1025, 1025, seed=4, recipe="alpine"),
    "tablelands": Land(1025, 1025, seed=5, cliffs=0.8),
    "ranges": Land(1025, 1025, seed=6, recipe="alpine"),
}
BASELINES = ("clipmap", "tessellated")
BUDGET = 20_000
DEPTHS = {"≥ 10 posts": 10.0, "the near plane": 0.1, "far away": 1e9}  # in spacings
BUDGETS = (50, 200, 1000, 5000, 20_000, 100_000)
Key = tuple[str, ...]


class Table(NamedTuple):
    """A table of a page, or a paragraph with one row."""

    page: str  # its path from the folder above docs
    name: str
    head: tuple[str, ...]  # of the columns; empty for a paragraph
    keys: tuple[Key, ...]  # of the rows: their first cells, a map first
    row: Callable[..., list[str]]  # the other cells of a row, from its key
    sample: tuple[Key, ...]  # rows that a test measures


# --- maps -------------------------------------------------------------------------------------------------------------

_folder: Path | None = None


@lru_cache(1)
def renderer_of(name: str, size: tuple[int, int]) -> tg.Renderer:
    """A renderer of a map; only the last one is kept."""
    if name in BUNDLED:
        return tg.Renderer(open_map(name)[0], size)
    if name in GENERATED:
        return tg.Renderer(generate(tg.create_context(), GENERATED[name]), size)
    assert _folder
    return tg.Renderer(tg.Heightmap.open(_folder / name, **REAL[name]), size)


def release() -> None:
    """Forget the last renderer."""
    renderer_of.cache_clear()
    pictured.cache_clear()


def is_there(name: str) -> bool:
    """Whether a map can be opened here."""
    return name not in REAL or bool(_folder and (_folder / name).is_file())


def camera_of(name: str, view: str, heightmap: tg.Heightmap) -> tg.Camera:
    """A view of a map. The first view is the map's own, or straight from outside."""
    if view != "first":
        return standard_view(heightmap, view)
    return bundled()[name].camera if name in BUNDLED else tg.Camera.default(heightmap)


def count(name: str, view: str, size: tuple[int, int] = SIZE, **options: object) -> dict:
    """The stats of a mesh for one pixel."""
    renderer = renderer_of(name, size)
    return renderer.choose(camera_of(name, view, renderer.heightmap), 1.0, **options)


# --- rows -------------------------------------------------------------------------------------------------------------


def first_view(name: str) -> list[str]:
    """The paragraph of README.md on a first view."""
    ours, every = count(name, "first"), count(name, "first", method="full")
    return [
        f"With a tolerance of one pixel, the first view of `{name}` takes {ours['triangles']:,} triangles in "
        f"{ours['patches']:,} patches. {ours['patches_hidden']:,} more patches are hidden behind ridges, and are not "
        f"drawn (`terrain-gl shot {name} -o {name}.png --json -`). A mesh with every post takes "
        f"{every['triangles']:,} triangles in this view (`--method full`)."
    ]


def hidden(name: str, view: str) -> list[str]:
    """Triangles and patches with occlusion and without, and the patches that a sample of the picture shows."""
    on, off = (count(name, view, occlusion=occlusion) for occlusion in ("on", "off"))
    ratios = [f"{on[key] / max(off[key], 1):.2f}" for key in ("triangles", "patches")]
    renderer = renderer_of(name, SIZE)
    renderer.draw(camera_of(name, view, renderer.heightmap), 1.0, style=UNLIT)
    return [f"{on['triangles']:,}", f"{off['triangles']:,}", *ratios, f"{seen_share(renderer):.2f}"]


def patches(name: str, view: str) -> list[str]:
    """Triangles and patches for one certified pixel."""
    ours = count(name, view)
    return [f"{ours['triangles']:,}", f"{ours['patches']:,}"]


def of_every_post(name: str, view: str) -> list[str]:
    """Triangles for one certified pixel, and those of a mesh with every post."""
    ours, every = count(name, view), count(name, view, method="full")
    bound = ours["certified_max_error_px"]
    return [f"{every['triangles']:,}", f"{ours['triangles']:,}", ratio(ours, every), f"{bound:.3f}"]


def ratio(ours: dict, every: dict) -> str:
    """Triangles as a share of those of every post."""
    return f"{ours['triangles'] / max(every['triangles'], 1):.3f}"


def opening(name: str) -> list[str]:
    """How a map is opened, and whether the Earth's curvature is drawn."""
    renderer = renderer_of(name, SMALL)
    given = {"spacing_m": "--spacing", "z_scale": "--z-scale", "z_offset_m": "--z-offset"}
    options = [f"`{given[key]} {shown(value)}`" for key, value in REAL.get(name, {}).items()]
    radius_m = count(name, "first", SMALL)["curvature_radius_m"]
    metres = [f"{step:.5g}" for step in renderer.heightmap.spacing_m]
    return [" ".join(options), " × ".join(metres), f"{radius_m / 1000:,.0f} km" if radius_m else "flat"]


def shown(value: float | tuple[float, float]) -> str:
    """An option's value."""
    return ",".join(f"{each:g}" for each in (value if isinstance(value, tuple) else (value,)))


def spent(name: str) -> list[str]:
    """The least share of each budget that is drawn, over three views; "–" if no view has a share."""
    renderer = renderer_of(name, SIZE)
    cameras = [camera_of(name, view, renderer.heightmap) for view in VIEWS]
    shares = []
    for budget in BUDGETS:
        found = [renderer.choose(camera, triangles=budget) for camera in cameras]
        of_budget = [stats["triangles"] / budget for stats in found if stats["lambda"] and stats["triangles"] <= budget]
        shares.append(f"{min(of_budget):.3f}" if of_budget else "–")
    return shares


def of_the_mean(name: str, view: str) -> list[str]:
    """Meshes whose largest error, and whose mean error, is certified to be one pixel."""
    renderer = renderer_of(name, SMALL)
    camera = camera_of(name, view, renderer.heightmap)
    largest, mean = (
        renderer.draw(camera, 1.0, metric=metric, style=UNLIT) | renderer.measure() for metric in ("max", "rms")
    )
    triangles = [f"{each['triangles']:,}" for each in (largest, mean)]
    achieved = [f"{each[key]:.2f}" for key in ("rms_error_px", "max_error_px") for each in (largest, mean)]
    return [*triangles, ratio(mean, largest), f"{mean['certified_max_error_px']:.3f}", *achieved]


def medians(_: str) -> list[str]:
    """The paragraph of allocation.md on its table."""
    page = (DOCS / "allocation.md").read_text("utf-8")
    rows = rows_of(page, next(table for table in TABLES if table.name == "mean")).values()
    share, achieved = (statistics.median(float(cells[i]) for cells in rows) for i in (2, 5))
    most = max(float(cells[5]) for cells in rows)
    return [
        f"In the median, the mean takes {share:.2f} times as many triangles as the largest error. The achieved mean is "
        f"{achieved:.2f} E in the median, and {most:.2f} E at most."
    ]


def whole_mesh(name: str) -> list[str]:
    """The mesh that `terrain-gl mesh MAP -o m.ply` writes, by the keys of its JSON."""
    given = {"spacing_m": "--spacing", "z_scale": "--z-scale", "z_offset_m": "--z-offset"}
    options = [f"{given[key]}={shown(value)}" for key, value in REAL.get(name, {}).items()]
    path = str(_folder / name) if name in REAL and _folder else name
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "terrain_gl", "mesh", path, *options, "-o", "m.ply", "--json", "-"]
        environment = os.environ | {"PYTHONPATH": str(DOCS.parent)}
        told = subprocess.run(command, capture_output=True, check=True, cwd=folder, env=environment)
    stats = json.loads(told.stdout)
    keys = ("requested_max_error_m", "max_error_posts_m", "max_error_surface_m", "every_post_max_error_surface_m")
    return [f"{stats['triangles']:,}", *(f"{stats[key]:.4g}" for key in keys)]


def rounding(picture: str, at: str) -> list[str]:
    """The bound of precision.md for a vertex at the corner of a picture, rounded up to two digits."""
    size, fov = picture.removesuffix("°").split(", ")
    width, height = map(int, size.split(" × "))
    camera = tg.Camera((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), float(fov))
    depth = DEPTHS[at]
    away = depth * np.hypot(1.0, np.hypot(*camera.half_extent((width, height))))
    (bound,) = rounding_px(camera, (width, height), (1.0, 1.0), np.array([away]), np.array([depth]))
    step = 10.0 ** (np.floor(np.log10(bound)) - 1)
    return [f"{np.ceil(bound / step) * step:.2g} px"]


def bytes_a_post(name: str, part: str) -> list[str]:
    """Bytes of a part of the tables on the GPU, for each post."""
    renderer = renderer_of(name, SIZE)
    camera = camera_of(name, "first", renderer.heightmap)
    stats = renderer.draw(camera, 1.0)
    return [f"{stats['gpu_bytes'][part] / renderer.heightmap.heights.size:.1f}"]


def for_one_pixel(name: str) -> list[str]:
    """From a ridge: triangles of a mesh with every post and of `sat` for one pixel, with their largest errors."""
    renderer = renderer_of(name, SIZE)
    camera = camera_of(name, "ridge", renderer.heightmap)
    cells = []
    for method in ("full", "sat"):
        stats = renderer.draw(camera, 1.0, method=method, style=UNLIT) | renderer.measure()
        cells += [f"{stats['triangles']:,}", f"{stats['max_error_px']:.3g}"]
    return cells


def compared(_: str) -> list[str]:
    """The paragraph of README.md on baselines, from the tables of comparison.md."""
    page = (DOCS / "comparison.md").read_text("utf-8")
    tables = {table.name: rows_of(page, table) for table in TABLES if table.page == "docs/comparison.md"}
    with open(DOCS / "tables" / "screen_error.csv", encoding="utf-8") as file:
        errors = list(csv.DictReader(file))
    won = sum(float(row["sat"]) < min(float(row[method]) for method in BASELINES) for row in errors)
    told = [
        "With the same number of triangles, our RMS screen error is smaller than the errors of both baselines in "
        f"{won} of {len(errors)} cases on eight maps."
    ]
    rows = tables["equal-triangles"]
    parts = []
    for place, measure in enumerate(("RMS screen error", "RMSE of the picture", "FLIP of the picture")):
        triples = {key: [float(cell) for cell in cells[1 + 3 * place : 4 + 3 * place]] for key, cells in rows.items()}
        ratios = {key: ours / min(others) for key, (*others, ours) in triples.items()}
        worst = max(ratios, key=lambda key: ratios[key])
        count_won = sum(value < 1 for value in ratios.values())
        parts.append(
            f"our {measure} is smaller than that of the better baseline on {count_won}, and at worst "
            f"{ratios[worst]:.2f} times as large ({Path(worst[0]).stem})"
        )
    told.append(f"From a ridge of each of {len(rows)} maps, with {BUDGET:,} triangles, {'; '.join(parts)}.")
    shares = [float(cells[2]) for cells in tables["every-post"].values()]
    fewer = sum(share < 1 for share in shares)
    told.append(
        "The baselines certify nothing. For one certified pixel, `sat` takes "
        f"{min(shares):.2g} to {max(shares):.2g} times as many triangles as a mesh with every post has, in {fewer} of "
        f"{len(shares)} views fewer ([docs/comparison.md](docs/comparison.md#more-maps)). It takes more where cells "
        "are many pixels wide: there, a mesh with every post is not within one pixel, because the surface between "
        "posts is curved."
    )
    return [" ".join(told)]


class Pictured(NamedTuple):
    """A method's picture of a view, and its difference from the truth."""

    error_px: np.ndarray  # (height, width) screen error; NaN in the sky
    flip: np.ndarray  # (height, width)
    likeness: dict


@lru_cache(1)
def pictured(name: str, view: str) -> tuple[int, dict[str, Pictured]]:
    """The number of triangles that all methods draw, and their pictures."""
    renderer = renderer_of(name, SMALL)
    camera = camera_of(name, view, renderer.heightmap)
    triangles = curves.drawable(renderer, camera, BUDGET)
    truth = compare.truth_of(renderer, camera, 2)
    found = {}
    for method in (*BASELINES, "sat"):
        tried = curves.details_of(renderer, camera, method, triangles)
        best = compare.best_pictured(renderer, camera, truth, method, tried)
        compare.measured(renderer, camera, method=method, **best)
        error_px = renderer.inspector.error_map()
        image, numbers = compare.likeness_of(renderer, camera, truth, 2, method=method, **best)
        light = [linear_from_srgb(picture[..., :3]) for picture in (truth.image, image)]
        found[method] = Pictured(error_px, flip_map(*light), numbers)
    return triangles, found


def at_equal_triangles(name: str, view: str) -> list[str]:
    """RMS screen error, RMSE and FLIP of the picture of both baselines and of `sat`."""
    triangles, pictures = pictured(name, view)
    renderer = renderer_of(name, SMALL)
    camera = camera_of(name, view, renderer.heightmap)
    found = []
    for method, picture in pictures.items():
        detail = curves.detail_of(renderer, camera, method, triangles)
        error = compare.measured(renderer, camera, method=method, **detail)["rms_error_px"]
        found.append((error, picture.likeness["image_rmse"], picture.likeness["flip"]))
    return [f"{triangles:,}", *(f"{value:.4f}" for values in zip(*found, strict=True) for value in values)]


def spread(name: str, view: str, method: str) -> list[str]:
    """How an error spreads over the picture: few pixels that are far off, or many that are a little off."""
    picture = pictured(name, view)[1][method]
    near = (picture.error_px < 0.1).sum() / np.isfinite(picture.error_px).sum()
    far = np.nanpercentile(picture.error_px, 99)
    mean, square, visible = picture.flip.mean(), np.sqrt(np.square(picture.flip).mean()), (picture.flip > 0.2).mean()
    return [f"{100 * near:.0f} %", f"{far:.2f}", f"{mean:.4f}", f"{square:.4f}", f"{100 * visible:.1f} %"]


# --- tables -----------------------------------------------------------------------------------------------------------

MAPS = (*BUNDLED, *REAL, *GENERATED)
VIEWS = ("first", "ridge", "valley")
_SMALL_MAPS = (  # of about a million posts
    *("ranges", "alpine-30m", "mt_rainier_90m.tif", "ps_height_1k.png", "greenriver.tif"),
    *("mixed", "hills", "canyons", "canyon-15m", "ridges", "tablelands", "N37W123.hgt"),
)
TABLES = (
    Table(
        "docs/maps.md",
        "opening",
        ("map", "opened with", "spacing, m", "drawn on a sphere of"),
        tuple((name,) for name in (*BUNDLED, *REAL)),
        opening,
        (("alpine-30m",),),
    ),
    Table(
        "docs/stats.md",
        "spent",
        ("map", *(f"{budget:,}" for budget in BUDGETS)),
        tuple((name,) for name in (*BUNDLED, *list(GENERATED)[:3])),
        spent,
        (("canyon-15m",),),
    ),
    Table("README.md", "first-view", (), (("alpine",),), first_view, (("alpine",),)),
    Table(
        "docs/hidden.md",
        "hidden",
        ("map", "view", "triangles", "without", "ratio", "patches", "seen"),
        tuple(
            (name, view) for name in (*BUNDLED, "N37W123.hgt", "greenriver.tif", "mt_rainier_90m.tif") for view in VIEWS
        ),
        hidden,
        (("alpine-30m", "valley"), ("canyon-15m", "ridge")),
    ),
    Table(
        "docs/performance.md",
        "patches",
        ("map", "view", "triangles", "patches"),
        tuple((name, view) for name in (*BUNDLED, *REAL) for view in VIEWS),
        patches,
        (("alpine-30m", "ridge"),),
    ),
    Table(
        "docs/precision.md",
        "rounding",
        ("picture", "vertex at", "bound"),
        tuple(
            (f"{size}, {fov}°", at)
            for size, fov, at in (
                ("1280 × 720", "45", "≥ 10 posts"),
                ("1280 × 720", "45", "the near plane"),
                ("7680 × 4320", "45", "≥ 10 posts"),
                ("1280 × 720", "170", "≥ 10 posts"),
                ("1280 × 720", "1", "far away"),
                ("1280 × 720", "0.1", "far away"),
                ("3840 × 2160", "0.1", "far away"),
            )
        ),
        rounding,
        (("1280 × 720, 45°", "the near plane"), ("3840 × 2160, 0.1°", "far away")),
    ),
    Table(
        "docs/performance.md",
        "bytes",
        ("map", "what", "bytes a post"),
        tuple(("alpine-30m", part) for part in ("heights", "error", "sat", "shade")),
        bytes_a_post,
        (("alpine-30m", "error"),),
    ),
    Table(
        "docs/performance.md",
        "whole",
        ("map", "triangles", "asked, m", "at posts, m", "between posts, m", "every post as a vertex, m"),
        tuple((name,) for name in (*BUNDLED, *REAL)),
        whole_mesh,
        (("canyon-15m",),),
    ),
    Table(
        "docs/allocation.md",
        "mean",
        ("map", "view", *(f"{what}, {of}" for what, of in (("triangles", "largest"), ("triangles", "mean"))), "ratio")
        + (
            "certified px, mean",
            "achieved RMS, largest",
            "achieved RMS, mean",
            "largest px, largest",
            "largest px, mean",
        ),
        tuple(
            (name, view)
            for name in ("alpine-30m", "canyon-15m", "greenriver.tif", "mt_rainier_90m.tif")
            for view in VIEWS
        ),
        of_the_mean,
        (("canyon-15m", "valley"),),
    ),
    Table("docs/allocation.md", "medians", (), (("all maps",),), medians, (("all maps",),)),
    Table(
        "docs/comparison.md",
        "every-post",
        ("map", "view", "every post", "sat", "ratio", "certified, px"),
        tuple((name, view) for name in MAPS for view in VIEWS),
        of_every_post,
        (("hills", "ridge"), ("canyon-15m", "first")),
    ),
    Table(
        "docs/comparison.md",
        "equal-triangles",
        ("map", "view", "triangles", *(f"{m} {what}" for what in ("px", "RMSE", "FLIP") for m in (*BASELINES, "sat"))),
        tuple((name, "ridge") for name in _SMALL_MAPS),
        at_equal_triangles,
        (("mixed", "ridge"),),
    ),
    Table(
        "docs/comparison.md",
        "spread",
        ("map", "view", "method", "off by less than 0.1 px", "99 % within, px", "FLIP", "RMS of FLIP", "FLIP over 0.2"),
        tuple((name, "ridge", method) for name in ("mixed", "hills") for method in (*BASELINES, "sat")),
        spread,
        (("mixed", "ridge", "sat"),),
    ),
    Table(
        "docs/comparison.md",
        "one-pixel",
        ("map", "every post", "largest error, px", "sat", "largest error, px, of `sat`"),
        tuple(
            (name,)
            for name in ("canyon-15m", "N37W123.hgt", "ps_height_1k.png", "mt_rainier_90m.tif", "greenriver.tif")
        ),
        for_one_pixel,
        (("canyon-15m",),),
    ),
    Table("README.md", "compared", (), (("all maps",),), compared, (("all maps",),)),  # from the tables above
)


# --- pictures ---------------------------------------------------------------------------------------------------------

_DAY = "--spacing 160 --z-scale 0.1 --fov 28 --max-error 0.7"
PICTURES = (  # commands, as the pages have them; puget.png is the map ps_height_1k.png
    "compare canyon-15m --view ridge --triangles 20000 --curve --supersample 2 -o compare.jpg",
    "shot alpine -o alpine.png",
    f"shot puget.png {_DAY} --eye 151000,90500,2500 --target 128480,79200,2400 --sun 118,3.2 -o dawn.jpg",
    f"shot puget.png {_DAY} --eye 121000,104000,2300 --target 128480,79200,2500 --sun 250,48 -o noon.jpg",
    f"shot puget.png {_DAY} --eye 104048,88093,2600 --target 128480,79200,2500 --sun 318,1.2 -o dusk.jpg",
    "shot alpine-30m --water 500 --sun 325,14 -o lake.jpg",
)
SCRIPTS = ("figures", "viewer_pictures", "first_pictures", "first_film")


def draw_pictures() -> None:
    """Draw the pictures again, those of real maps if the maps are here."""
    environment = os.environ | {"PYTHONPATH": str(DOCS.parent)} | ({"TERRAIN_GL_DEM": str(_folder)} if _folder else {})
    for command in PICTURES:
        words = command.split()
        if words[1] == "puget.png":
            if not is_there("ps_height_1k.png"):
                continue
            words[1] = f"{_folder}/ps_height_1k.png"
        subprocess.run([sys.executable, "-m", "terrain_gl", *words], check=True, cwd=DOCS, env=environment)
    for script in SCRIPTS[: None if _folder else 2]:
        subprocess.run([sys.executable, DOCS / f"{script}.py"], check=True, cwd=DOCS.parent, env=environment)


# --- pages ------------------------------------------------------------------------------------------------------------


def block_of(text: str, name: str) -> re.Match[str]:
    """The block of a table in a page."""
    found = re.search(
        rf"(<!-- numbers: {re.escape(name)} -->\n)(.*?)(<!-- end of numbers: [^\n]* -->)", text, re.DOTALL
    )
    assert found, f"no block <!-- numbers: {name} --> ... <!-- end of numbers: ... -->"
    return found


def rows_of(text: str, table: Table) -> dict[Key, list[str]]:
    """The rows of a table that a page has, by their keys."""
    body = block_of(text, table.name)[2].strip()
    if not table.head:
        return {table.keys[0]: [" ".join(body.split())]}
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in body.split("\n")[2:] if line]
    width = len(table.keys[0])
    return {tuple(line[:width]): line[width:] for line in cells}


def written(table: Table, rows: dict[Key, list[str]]) -> str:
    """A block's text."""
    if not table.head:
        return wrapped(next(iter(rows.values()))[0])
    lines = [table.head, ("---",) * len(table.head), *((*key, *cells) for key, cells in rows.items())]
    return (
        "\n".join(f"| {' | '.join(line)} |" for line in lines).replace("| --- ", "|---").replace("---|---", "---|---")
    )


def wrapped(text: str, width: int = 148) -> str:
    """A paragraph in lines, which break between words outside of code."""
    lines, line = [], ""
    for word in re.findall(r"`[^`]*`\S*|\S+", text):
        if line and len(line) + 1 + len(word) > width:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "\n".join([*lines, line])


def stamp() -> str:
    """The code that measures today."""
    last = ["git", "log", "-1", "--format=%h", "--", "terrain_gl", "glsl", "heightmaps"]  # a commit of the code
    commit = subprocess.run(last, capture_output=True, text=True, cwd=DOCS.parent).stdout
    driver = tg.create_context().info["GL_RENDERER"].split(" (")[0]
    return f"commit {commit.strip()}, {time.strftime('%-d %B %Y')}, {driver}"


def measured(table: Table, keys: tuple[Key, ...]) -> Iterator[tuple[Key, list[str]]]:
    """The rows of maps that are here."""
    for key in keys:
        if is_there(key[0]):
            yield key, table.row(*key)


def rewrite(table: Table) -> list[str]:
    """Write a table into its page; returns the rows that differ from those before."""
    path = DOCS.parent / table.page
    before = rows_of(path.read_text("utf-8"), table)
    found = dict.fromkeys(table.keys, [])
    found.update({key: cells for key, cells in before.items() if key in found})
    for key, cells in measured(table, table.keys):
        found[key] = cells
        text = path.read_text("utf-8")  # row by row, so that a run that ends early has not worked in vain
        block = block_of(text, table.name)
        body = written(table, {key: cells for key, cells in found.items() if cells})
        end = f"<!-- end of numbers: python docs/numbers_of_pages.py --table {table.name}, {stamp()} -->"
        path.write_text(text.replace(block[0], f"{block[1]}{body}\n{end}"), "utf-8")
        print(table.name, *key, *cells, file=sys.stderr, flush=True)
    return [f"{' '.join(key)}: {before.get(key)} -> {found[key]}" for key in found if found[key] != before.get(key)]


PRINTED_IN = [*sorted(DOCS.glob("*.md")), DOCS.parent / "CONTRIBUTING.md", DOCS.parent / "benchmarks/open/README.md"]
PRINTED = re.compile(
    r"<!-- printed: (?P<command>[^\n]*) -->\n(?P<table>(?P<head>\|[^\n]*)\n.*?)<!-- end of printed: [^\n]* -->",
    re.DOTALL,
)


@cache
def tables_of(command: str) -> list[str]:
    """The tables that a command prints."""
    environment = os.environ | {"PYTHONPATH": str(DOCS.parent)} | ({"TERRAIN_GL_DEM": str(_folder)} if _folder else {})
    words = [sys.executable if word == "python" else word for word in shlex.split(command)]
    words = [str(_folder) if word == "$TERRAIN_GL_DEM" else word for word in words]
    words = [str(_folder / word) if _folder and (_folder / word).is_file() else word for word in words]
    print(command, file=sys.stderr, flush=True)
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=False, cwd=DOCS.parent, env=environment)
    return re.findall(r"(?:^\|.*\n)+", done.stdout, re.MULTILINE)


def reprint(page: Path, word: str) -> list[str]:
    """Write the tables of a page that benchmarks print; returns the rows that are new."""
    new = []
    for found in [*PRINTED.finditer(page.read_text("utf-8"))]:
        if word not in found["command"]:
            continue
        fresh = next((table for table in tables_of(found["command"]) if table.startswith(f"{found['head']}\n")), None)
        if not fresh:
            new.append(f"{found['command']}: NO TABLE with the first line {found['head']}")
            continue
        new += sorted({*fresh.splitlines()} - {*found["table"].splitlines()})
        block = f"<!-- printed: {found['command']} -->\n{fresh}<!-- end of printed: {stamp()} -->"
        page.write_text(page.read_text("utf-8").replace(found[0], block), "utf-8")
    return new


def main() -> None:
    """Write the chosen tables, and print what has changed."""
    global _folder
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", help="only tables of this page, such as README or hidden")
    parser.add_argument("--table", choices=[table.name for table in TABLES])
    parser.add_argument("--maps", type=Path, help="folder of the real maps")
    parser.add_argument("--pictures", action="store_true", help="also draw the pictures")
    parser.add_argument("--benchmarks", metavar="WORD", nargs="?", const="", help="also run benchmarks, with this word")
    args = parser.parse_args()
    _folder = args.maps.resolve() if args.maps else None
    for table in () if args.benchmarks else TABLES:
        if args.page in (None, Path(table.page).stem) and args.table in (None, table.name):
            print("\n".join(rewrite(table)))
    if args.benchmarks is not None:
        for page in PRINTED_IN:
            if args.page in (None, page.stem):
                print("\n".join(reprint(page, args.benchmarks)))
    if args.pictures:
        draw_pictures()


if __name__ == "__main__":
    main()
