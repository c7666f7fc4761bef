"""Every method side by side, after Fig. D.1 of the supplement of Li et al. 2021.

Of the very mesh that each method draws: its triangles, its screen error over every post in the picture
(`Renderer.measure`), and how far its picture is from the true one (`likeness`). The truth is every post of the map and
the bilinear surface between them (`bilinear`), each pixel drawn as 4 × 4 of 4 samples. The methods' pictures are drawn
as finely: so geometry alone differs, for shading reads the map whatever the mesh is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from .. import reference
from ..camera import Camera, screen_shift_px
from ..heightmap import Heightmap
from ..measure import posts_of
from ..methods.rivals import RIVALS
from ..renderer import NEAR, Renderer
from ..shade import UNLIT
from .likeness import difference_of, flip, rmse, skyline

LABELS = {"clipmap": "Geometry clipmaps", "tessellated": "Tessellated clipmap", "sat": "Summed-area tables"}
COMPARED = tuple(LABELS)
FINE = 4  # pixels drawn for one, along a side
BUDGETS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4)  # of the number of triangles asked for: the curves' points
EQUAL = 0.02  # numbers of triangles are equal that differ by no more than this share
FEWEST = 200  # triangles that it makes sense to ask any method for
_NUMBERS = (  # label, key of an entry's stats, format
    ("triangles", "triangles", ",d"),
    ("RMS screen error, px", "rms_error_px", ".3f"),
    ("largest screen error, px", "max_error_px", ".2f"),
    ("RMSE of the picture", "image_rmse", ".4f"),
    ("FLIP of the picture", "flip", ".4f"),
    ("skyline off, px", "skyline_px", ".3f"),
    ("frame, ms", "frame", ".0f"),
)
_INSET = 0.24  # of the picture's width and height
_SKY_IN_INSET = (0.08, 0.55)
_FRAMES = 3  # that are timed
_BLOCK = 256  # posts a side
Progress = Callable[[float], None]


@dataclass
class Truth:
    """What the view looks like.

    Attributes
    ----------
    image
        (height, width, 3) uint8 sRGB.
    sky
        (height, width) share of each pixel that is sky.
    stats
        Of the drawing of every post.
    """

    image: np.ndarray
    sky: np.ndarray
    stats: dict[str, Any]


@dataclass
class Entry:
    """One method's share.

    Attributes
    ----------
    stats
        Of its frame, with what it achieved, and `image_rmse`, `flip`, `skyline_px`, `max_skyline_px`: docs/stats.md.
    image
        (height, width, 3) uint8 sRGB.
    error_px
        (height, width) screen error of what each pixel shows; NaN for the sky.
    """

    method: str
    stats: dict[str, Any]
    image: np.ndarray
    error_px: np.ndarray


@dataclass
class Comparison:
    """What a figure shows.

    Attributes
    ----------
    truth
        (height, width, 3) uint8 sRGB.
    stats
        Of the truth.
    inset
        Rows and columns of the part that is worth a closer look.
    """

    truth: np.ndarray
    stats: dict[str, Any]
    entries: list[Entry]
    inset: tuple[slice, slice]


class Line(NamedTuple):
    """A line of a table: what it says of each method, and which of them is best."""

    label: str
    cells: list[str]
    best: list[bool]

    @classmethod
    def of(cls, label: str, values: Sequence[Any], style: str, compared: bool = True) -> Line:
        """From numbers, the least of which is best; None where there is none."""
        least = min((value for value in values if value is not None), default=None)
        cells = ["–" if value is None else format(value, style) for value in values]
        return cls(label, cells, [compared and value is not None and value == least for value in values])


@dataclass
class Study:
    """All that a comparison of one view gives.

    Attributes
    ----------
    triangles
        How many each method was to draw, if that was asked for.
    curves, ideal
        What `curve` and `ideal_curve` give, if they were asked for.
    max_error_px, needed
        The error asked for, if one was; by method, the stats with the fewest triangles that achieve it, None where
        nothing does.
    """

    comparison: Comparison
    curves: dict[str, list[dict[str, Any]]] | None = None
    ideal: Any = None
    max_error_px: float | None = None
    needed: dict[str, dict[str, Any] | None] | None = None
    triangles: int | None = None

    def uneven(self) -> dict[str, float]:
        """By how large a share methods are off the number of triangles they were to draw, where by more than EQUAL."""
        if not self.triangles:
            return {}
        off = {entry.method: entry.stats["triangles"] / self.triangles - 1 for entry in self.comparison.entries}
        return {method: share for method, share in off.items() if abs(share) > EQUAL}

    def table(self) -> list[Line]:
        """The numbers, for people."""
        entries = self.comparison.entries
        lines = []
        for label, key, style in _NUMBERS:
            values = [entry.stats["ms"]["frame"] if key == "frame" else entry.stats[key] for entry in entries]
            lines.append(Line.of(label, values, style, compared=key != "triangles"))
        if self.needed:
            needed = [self.needed[entry.method] for entry in entries]
            counts = [stats["triangles"] if stats else None for stats in needed]
            of_all = " RMS" if entries[0].stats["metric"] == "rms" else ""
            lines.append(Line.of(f"triangles to be within {self.max_error_px:g} px{of_all}", counts, ",d"))
        return lines

    def record(self) -> dict[str, Any]:
        """The numbers, for JSON: docs/stats.md."""
        found: dict[str, Any] = {"truth": self.comparison.stats}
        found["methods"] = [entry.stats for entry in self.comparison.entries]
        if self.triangles:
            found["triangles"] = self.triangles
        if self.curves:
            found["curves"] = self.curves
            points = zip(self.ideal.triangles, self.ideal.rms_px, strict=True)
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
    **options: Any,
) -> Study:
    """Compare all methods in one view.

    Parameters
    ----------
    triangles
        For each method, or as many as all of them can draw (`drawable`); with `max_error_px` as many as it takes to
        certify that.
    with_curves
        Also at other numbers of triangles, `BUDGETS` of this one.
    fine, progress, options
        As for `compare`.
    """
    certified = {"method": "sat", "max_error_px": max_error_px} | options
    own = measured(renderer, camera, **certified) if max_error_px else None
    triangles = max(own["triangles"], FEWEST) if own else drawable(renderer, camera, triangles, **options)
    details = {method: detail_of(renderer, camera, method, triangles, **options) for method in COMPARED}
    if own:
        details["sat"] = {"max_error_px": max_error_px}
    parts = 1 + with_curves + bool(own)
    comparison = compare(renderer, camera, details, fine, part(progress, 0, parts), **options)
    found = Study(comparison, max_error_px=max_error_px, triangles=triangles)
    most = comparison.stats["triangles"]
    if with_curves:
        budgets = [max(FEWEST, round(triangles * share)) for share in BUDGETS if triangles * share < most]
        found.ideal = ideal_curve(renderer, camera, budgets, options.get("near_m"))
        found.curves = curve(renderer, camera, COMPARED, budgets, part(progress, 1, parts), **options)
    if own and max_error_px:
        found.needed = {"sat": own}
        for method in COMPARED:
            if method != "sat":
                found.needed[method] = fewest(renderer, camera, method, max_error_px, triangles, most, **options)
    if progress:
        progress(1.0)
    return found


def compare(
    renderer: Renderer,
    camera: Camera,
    details: dict[str, dict[str, Any]],
    fine: int = FINE,
    progress: Progress | None = None,
    **options: Any,
) -> Comparison:
    """Draw the truth, and each method; measure all.

    Parameters
    ----------
    details
        For each method the options that say how finely it draws, such as {"triangles": 100_000}.
    fine
        Pixels drawn for one in the pictures that are compared, along a side.
    progress
        Called with the part that is done, 0 to 1.
    options
        Further fields of `Drawing`, the same for all.
    """
    parts = len(details) + 1
    truth = truth_of(renderer, camera, fine, part(progress, 0, parts), **options)
    entries = [
        entry_of(renderer, camera, truth, method, fine, part(progress, i, parts), **detail, **options)
        for i, (method, detail) in enumerate(details.items(), 1)
    ]
    return Comparison(truth.image, truth.stats, entries, inset_of(truth, [entry.image for entry in entries]))


def truth_of(
    renderer: Renderer, camera: Camera, fine: int = FINE, progress: Progress | None = None, **options: Any
) -> Truth:
    """Draw every post, and each pixel as fine × fine."""
    return Truth(*_picture(renderer, camera, fine, progress, method="truth", **options))


def entry_of(
    renderer: Renderer,
    camera: Camera,
    truth: Truth,
    method: str,
    fine: int = FINE,
    progress: Progress | None = None,
    **drawing: Any,
) -> Entry:
    """Draw and measure one method; `drawing` are fields of `Drawing`."""
    times = [renderer.render(camera, method=method, **drawing).stats["ms"] for _ in range(_FRAMES)]
    stats = dict(renderer.measure())
    stats["ms"] = {stage: median(ms[stage] for ms in times) for stage in times[0]}
    error_px = renderer.error_map()
    image, likeness = likeness_of(renderer, camera, truth, fine, progress, method=method, **drawing)
    return Entry(method, stats | likeness, image, error_px)


def likeness_of(
    renderer: Renderer, camera: Camera, truth: Truth, fine: int, progress: Progress | None = None, **drawing: Any
) -> tuple[np.ndarray, dict[str, Any]]:
    """A picture, (height, width, 3) uint8, drawn as finely as the truth, and how far it is from it."""
    image, sky, _ = _picture(renderer, camera, fine, progress, **drawing)
    off = skyline(truth.sky, sky)
    shapes = {"skyline_px": off.mean_px, "max_skyline_px": off.max_px}
    return image, {"image_rmse": rmse(truth.image, image), "flip": flip(truth.image, image)} | shapes


def measured(renderer: Renderer, camera: Camera, **drawing: Any) -> dict[str, Any]:
    """Stats of one frame with what it achieved."""
    renderer.draw(camera, **(drawing | {"style": UNLIT}))
    return renderer.measure()


def detail_of(renderer: Renderer, camera: Camera, method: str, triangles: int, **options: Any) -> dict[str, Any]:
    """Options with which a method draws so many triangles: its own best parameters, found by trying."""
    if method not in RIVALS:
        return {"triangles": triangles}
    return {"parameters": renderer.best_parameters(camera, method, triangles, **options)}


def drawable(renderer: Renderer, camera: Camera, triangles: int, **options: Any) -> int:
    """So many triangles; where that is more than every post has, as many as the method that then draws fewest."""
    most = renderer.choose(camera, method="full", **options)["triangles"]
    if not 0 < most < triangles:
        return triangles
    counts = []
    for method in COMPARED:
        detail = _details(renderer, camera, method, most, options.get("near_m"))[0]
        counts.append(renderer.choose(camera, method=method, **detail, **options)["triangles"])
    return max(1, min(counts))


def curve(
    renderer: Renderer,
    camera: Camera,
    methods: Sequence[str],
    budgets: Sequence[int],
    progress: Progress | None = None,
    **options: Any,
) -> dict[str, list[dict[str, Any]]]:
    """What each method achieves with so many triangles: stats by method, a list as long as the budgets."""
    achieved: dict[str, list[dict[str, Any]]] = {method: [] for method in methods}
    for i, triangles in enumerate(budgets):
        for method in methods:
            detail = detail_of(renderer, camera, method, triangles, **options)
            achieved[method].append(measured(renderer, camera, method=method, **detail, **options))
        if progress:
            progress((i + 1) / len(budgets))
    return achieved


def ideal_curve(renderer: Renderer, camera: Camera, budgets: Sequence[int], near_m: float | None = None) -> Any:
    """The least RMS error of any restricted quadtree with so many triangles: `reference.ideal_allocation`."""
    heightmap = renderer.heightmap
    near_m = near_m or NEAR * min(heightmap.spacing_m)
    rows, cols = _seen_part(heightmap, camera, renderer.size, near_m)
    moved = np.multiply([-cols.start, rows.stop - heightmap.rows], heightmap.spacing_m)
    eye, target = ((x + moved[0], y + moved[1], z) for x, y, z in (camera.eye, camera.target))
    filled = renderer.terrain.filled[rows, cols].astype(np.float64)
    void = np.isnan(heightmap.heights[rows, cols]) if heightmap.voids else None
    near = replace(camera, eye=eye, target=target)
    return reference.ideal_allocation(filled, heightmap.spacing_m, near, renderer.size, near_m, budgets, void)[0]


def fewest(
    renderer: Renderer, camera: Camera, method: str, max_error_px: float, start: int, most: int, **options: Any
) -> dict[str, Any] | None:
    """Stats with the fewest triangles, within 2 %, that a method needs to *achieve* an error; None if it cannot.

    Parameters
    ----------
    start
        Triangles to begin with: doubled until they are enough.
    most
        Triangles beyond which no more are tried: those of every post.
    """

    error = f"{options.get('metric', 'max')}_error_px"

    def holds(triangles: float) -> dict[str, Any] | None:
        for detail in _details(renderer, camera, method, round(triangles), options.get("near_m")):
            stats = measured(renderer, camera, method=method, **detail, **options)
            if stats[error] <= max_error_px:
                return dict(stats)
        return None

    low, high = float(FEWEST), float(start)
    while (best := holds(high)) is None:
        if high >= most:
            return None
        low, high = high, min(2 * high, float(most))
    while high > (1 + EQUAL) * low:
        middle = (low * high) ** 0.5
        stats = holds(middle)
        low, high, best = (low, middle, stats) if stats else (middle, high, best)
    return best


def _seen_part(heightmap: Heightmap, camera: Camera, size: tuple[int, int], near_m: float) -> tuple[slice, slice]:
    """Rows and columns of the blocks of the map that have posts in the picture: what else there is costs time only.

    Blocks are nodes of the whole map's quadtree; larger ones are no leaves of an ideal tree worth drawing.
    """
    seen = []
    for row in range(0, heightmap.rows, _BLOCK):
        points = posts_of(heightmap, (0, row, heightmap.cols, min(_BLOCK, heightmap.rows - row)))
        _, in_picture = screen_shift_px(camera, size, points, np.zeros(len(points)), near_m)
        at = np.flatnonzero(in_picture.reshape(-1, heightmap.cols).any(0))
        seen += [(row, at[0], at[-1])] if len(at) else []
    if not seen:
        return slice(0, heightmap.rows), slice(0, heightmap.cols)
    first, last = seen[0][0], seen[-1][0] + _BLOCK + 1
    left = min(west for _, west, _ in seen) // _BLOCK * _BLOCK
    right = max(east for _, _, east in seen) // _BLOCK * _BLOCK + _BLOCK + 1
    return slice(first, min(last, heightmap.rows)), slice(int(left), int(min(right, heightmap.cols)))


def _details(
    renderer: Renderer, camera: Camera, method: str, triangles: int, near_m: float | None
) -> list[dict[str, Any]]:
    """Options, each of which gives a method so many triangles."""
    if method not in RIVALS:
        return [{"triangles": triangles}]
    return [{"parameters": parameters} for parameters in renderer.candidates(camera, method, triangles, near_m)]


def part(progress: Progress | None, i: int, parts: int) -> Progress | None:
    """Progress of part i of some, as progress of the whole."""
    return (lambda done: progress((i + done) / parts)) if progress else None


def _picture(
    renderer: Renderer, camera: Camera, fine: int, progress: Progress | None, **drawing: Any
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """A supersampled picture, (height, width, 3) uint8, the sky's share of its pixels, and its stats."""
    width, height = renderer.size
    image, sky = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32)
    stats: dict[str, Any] = {}
    for piece, frame in renderer.pieces(camera, renderer.size, fine=fine, **drawing):
        share = renderer.picture.sky_share()
        image[piece.rows, piece.cols] = frame.image[..., :3]
        sky[piece.rows, piece.cols] = share.reshape(piece.size[1], fine, piece.size[0], fine).mean((1, 3))
        stats = frame.stats
        if progress:
            progress(piece.share_done)
    return image, sky, stats


def inset_of(truth: Truth, images: Sequence[np.ndarray]) -> tuple[slice, slice]:
    """Where the pictures differ most from the truth, with some of the skyline if there is any."""
    height, width = (max(1, round(_INSET * side)) for side in truth.sky.shape)
    squares = sum((np.square(difference_of(truth.image, image)) for image in images), np.zeros(truth.sky.shape))
    off = _box_means(squares, height, width)
    share = _box_means(truth.sky, height, width)
    fits = (share >= _SKY_IN_INSET[0]) & (share <= _SKY_IN_INSET[1])
    best = np.argmax(np.where(fits, off, -1.0) if fits.any() else off)
    row, col = int(best) // off.shape[1], int(best) % off.shape[1]
    return slice(row, row + height), slice(col, col + width)


def _box_means(values: np.ndarray, height: int, width: int) -> np.ndarray:
    """Mean over every box of the picture, by its first row and column."""
    sums = np.pad(values.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    east, west = sums[:, width:], sums[:, :-width]
    return (east[height:] - east[:-height] - west[height:] + west[:-height]) / (height * width)
