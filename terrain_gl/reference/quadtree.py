"""lod: the selection, a pure function of error tables and view.

    refine    from the root down, split each node that is over tolerance both as quad and as fan
    balance   split more nodes, until neighbours differ by at most one level
    agree     a leaf over tolerance asks to split some of its edges, or else to be split itself; balance; repeat
    leaf      draw each leaf in the picture as a quad or as a fan

With a price instead of a tolerance, refine splits each node whose parts are worth their triangles; agree is left out.
A level is an array over its nodes, (rows, cols). Edges have the order west, north, east, south.
"""

from typing import NamedTuple

import numpy as np

from .bound import cell_squares
from .curvature import drop_range_m, largest_sag_m, sag_gain_m2
from .error import max_children, node_errors, split_gains, wedge_errors
from .nodes import node_axes, per_node, top_level
from .project import BoxProjection, Pinhole, error_px, project_boxes
from .tree import balance, children_of, existing, grow, neighbours, unsplit


class Errors(NamedTuple):
    """The tables of a level's nodes, the same for all views: (rows, cols) and metres, if no comment says otherwise."""

    quad_max: np.ndarray
    fan_max: np.ndarray  # nested: at least the children's
    quad_rms: np.ndarray  # over the node's own posts; void posts count as exact
    fan_rms: np.ndarray  # nested too
    whole: np.ndarray  # (rows, cols, 4): largest error in each wedge of the fan with its edge whole
    split: np.ndarray  # and with its edge split
    low_m: np.ndarray  # the node's heights are between these
    high_m: np.ndarray
    solid: np.ndarray  # no void in the node, so that the RMS is known
    gain: np.ndarray  # squared error that a split removes for each triangle it adds, m²


class Screen(NamedTuple):
    """The errors of a level's nodes on the screen: pixels in the requested metric."""

    outside: np.ndarray  # not in the picture
    quad_px: np.ndarray
    whole_px: np.ndarray  # (rows, cols, 4)
    split_px: np.ndarray
    weight: np.ndarray  # n w², px²/m²
    across: np.ndarray  # width of a cell in pixels, seen from above
    sag_gain: np.ndarray  # squared error of the sag that a split removes for each triangle it adds, m²


class Leaves(NamedTuple):
    """The leaves of a view, for each level."""

    splits: list[np.ndarray]
    leaves: list[np.ndarray]  # drawn: leaves in the picture
    fans: list[np.ndarray]  # leaves drawn as fans
    edges: list[np.ndarray]  # (rows, cols, 4): a fan's edges that are split
    triangles: int
    certified_px: float


def tables_of(heights: np.ndarray, void: np.ndarray | None = None) -> list[Errors]:
    """Error tables of all levels of a map, (rows, cols) metres with voids filled."""
    hole = np.zeros(heights.shape, bool) if void is None else void
    gains = split_gains(heights, void)
    tables = [_cells(heights, hole)]
    for level in range(1, top_level(heights.shape) + 1):
        found = node_errors(heights, level, void)
        y, x = node_axes(heights.shape, level)
        gain = gains[level - 1]
        posts = y.own.sum(1)[:, None] * x.own.sum(1)
        closed = per_node(y, x)
        solid_posts = (~hole[closed] & y.own[:, :, None, None] & x.own).sum((1, 3))
        quad, fan = (np.sqrt(square * solid_posts / posts) for square in (found.quad_square, found.fan_square))
        below = tables[-1]
        tables.append(
            Errors(
                found.quad_max,
                np.maximum(found.fan_max, max_children(below.fan_max, gain.shape)),
                quad,
                np.maximum(fan, max_children(below.fan_rms, gain.shape)),
                *wedge_errors(heights, level, void),
                heights[closed].min((1, 3)),
                heights[closed].max((1, 3)),
                ~hole[closed].any((1, 3)),
                gain,
            )
        )
    ranges = (children_of(values, tables[0].solid.shape) for values in (tables[1].low_m, tables[1].high_m))
    return [tables[0]._replace(low_m=next(ranges), high_m=next(ranges)), *tables[1:]]


# Two more triangles turn a cell into a fan. It counts as n places, one of which is a post, where the error is 0. At the
# others, the two triangles remove (n − 1) (t²/90 − t²/1440).


def _cells(heights: np.ndarray, hole: np.ndarray) -> Errors:
    """Level 0: cells have no error at their posts. Their gain is for one place between posts and one triangle."""
    quad, fan = cell_squares(heights)
    none = np.zeros(quad.shape)
    four = np.zeros((*quad.shape, 4))
    solid = ~(hole[1:, 1:] | hole[1:, :-1] | hole[:-1, 1:] | hole[:-1, :-1])
    return Errors(none, none, none, none, four, four, none, none, solid, np.where(solid, (quad - fan) / 2, 0.0))


def on_screen(
    spacing_m: tuple[float, float], tables: list[Errors], view: Pinhole | None, metric: str = "max"
) -> list[Screen]:
    """Project the tables of all levels; metric "max" or "rms" in pixels, or "metres" without a view."""
    shape = tuple(n + 1 for n in tables[0].solid.shape)
    return [_screen(shape, spacing_m, errors, level, view, metric) for level, errors in enumerate(tables)]


def _screen(
    shape: tuple[int, ...],
    spacing_m: tuple[float, float],
    errors: Errors,
    level: int,
    view: Pinhole | None,
    metric: str,
) -> Screen:
    if view is None:
        one = np.ones(errors.solid.shape)
        return Screen(one < 0, errors.quad_max, errors.whole, errors.split, one, one, 0 * one)
    y, x = node_axes(shape, level)
    low, high = (
        np.stack(np.broadcast_arrays(cols * spacing_m[0], (shape[0] - 1 - rows)[:, None] * spacing_m[1], z))
        for cols, rows, z in ((x.low, y.high, errors.low_m), (x.high, y.low, errors.high_m))
    )
    least_m, most_m = drop_range_m(low, high, view.eye, view.bend_per_m)
    low[2], high[2] = low[2] - most_m, high[2] - least_m
    p = project_boxes(view, low, high)
    sag = largest_sag_m(level, spacing_m, view.bend_per_m)
    each = BoxProjection(*(field[..., None] for field in p))
    quad_rms = np.where(errors.solid, errors.quad_rms, errors.quad_max)
    quad_px = metric_px(view, p, errors.quad_max + sag, quad_rms + sag, metric)
    fan_rms = np.where(errors.solid, errors.fan_rms, errors.fan_max)[..., None]
    wedges = (errors.whole, errors.split) if metric == "max" else [errors.fan_max[..., None].repeat(4, -1)] * 2
    whole_px, split_px = (
        metric_px(view, each, wedge + sag, np.minimum(fan_rms, wedge) + sag, metric) for wedge in wedges
    )
    across = view.focal_px / p.middle_m * np.sqrt(spacing_m[0] * spacing_m[1])
    weight = np.maximum(1.0, across) * np.square(view.focal_px * p.stretch / p.nearest_m)
    gain = sag_gain_m2(sag, y.own.sum(1)[:, None] * x.own.sum(1))
    return Screen(p.outside, quad_px, whole_px, split_px, weight, across, gain)


# If a node is partly outside the picture, its RMS says nothing about the visible part. We use the maximum instead.


def metric_px(view: Pinhole, p: BoxProjection, max_m: np.ndarray, rms_m: np.ndarray, metric: str) -> np.ndarray:
    """Bound in pixels in the metric; 0 for boxes outside the picture."""
    size_m = np.where(p.inside, rms_m, max_m) if metric == "rms" else max_m
    return np.where(p.outside, 0.0, error_px(view, p, size_m, max_m))


def select(screens: list[Screen], shape: tuple[int, ...], tolerance_px: float, metric: str = "max") -> Leaves:
    """Select the leaves for a tolerance, over a map of (rows, cols) posts."""
    splits = unsplit(shape, len(screens) - 1)
    cuts = [(np.zeros_like(level), np.zeros_like(level)) for level in splits]
    grow(splits, [~s.outside & ((_least_px(s, metric) > tolerance_px) | (tolerance_px == 0)) for s in screens])
    balance(splits)
    while metric != "rms" and tolerance_px > 0 and agree(splits, cuts, screens, shape, tolerance_px):
        balance(splits)
    quads = [s.quad_px <= tolerance_px for s in screens]
    return _leaves(splits, cuts, screens, shape, quads)


def _least_px(s: Screen, metric: str) -> np.ndarray:
    """Bound of the best way to draw a node. For "rms" that is the fan's: it is nested, and the quad's is not."""
    fan_px = np.minimum(s.whole_px, s.split_px).max(-1)
    return fan_px if metric == "rms" else np.minimum(fan_px, s.quad_px)


# At a price of λ px² a triangle: split where n w² gain > λ; draw a fan where n w² (Q − F) / (added triangles) > λ.
# n: weight of a post; w: pixels for one metre of error; Q, F: sums of squared errors in m², as a quad and as a fan.


def select_at_price(tables: list[Errors], screens: list[Screen], shape: tuple[int, ...], price: float) -> Leaves:
    """Select the leaves that minimise Σ weight · error² + price · triangles."""
    splits = unsplit(shape, len(screens) - 1)
    cuts = [(np.zeros_like(level), np.zeros_like(level)) for level in splits]
    pays = [
        ~s.outside & (s.weight * (errors.gain + s.sag_gain) > price) for s, errors in zip(screens, tables, strict=True)
    ]
    grow(splits, pays)
    balance(splits)
    cells = screens[0].weight * np.maximum(1 - 1 / screens[0].across, 0) * tables[0].gain
    quads = [~(cells > price) | screens[0].outside]
    for level in range(1, len(screens)):
        y, x = node_axes(shape, level)
        posts = y.own.sum(1)[:, None] * x.own.sum(1)
        added = 2.0 - _on_rim(shape, level).sum(-1)
        removed = (np.square(tables[level].quad_rms) - np.square(tables[level].fan_rms)) * posts
        quads.append(~(screens[level].weight * removed > price * added) | (added <= 0))
    return _leaves(splits, cuts, screens, shape, quads)


def price_for(
    tables: list[Errors], screens: list[Screen], shape: tuple[int, ...], triangles: int, steps: int = 40
) -> float:
    """Lowest price with at most a given number of triangles, by bisection of its logarithm."""
    low, high = -60.0, 126.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        fits = select_at_price(tables, screens, shape, 2.0**middle).triangles <= triangles
        low, high = (low, middle) if fits else (middle, high)
    return float(2.0**high)


Cuts = list[tuple[np.ndarray, np.ndarray]]  # for each level: nodes with a cut west edge, with a cut north edge


def agree(
    splits: list[np.ndarray], cuts: Cuts, screens: list[Screen], shape: tuple[int, ...], tolerance_px: float
) -> bool:
    """Let each leaf over tolerance request edges or a split, then grant all requests; returns whether any asked."""
    asked = False
    edges = [split_edges(splits[level], *cuts[level]) for level in range(len(splits))]
    for level, exists in list(enumerate(existing(splits)))[1:]:
        s = screens[level]
        inner = ~_on_rim(shape, level)[..., [1, 0, 1, 0]]
        quad = (s.quad_px <= tolerance_px) & ~edges[level].any(-1)
        leaf = (exists & ~splits[level] & ~s.outside & ~quad)[..., None]
        own = edges[level] & inner
        open_ = np.stack(neighbours(exists), -1) & inner
        lacking = leaf & (s.whole_px > tolerance_px) & ~own
        helpless = leaf & (s.split_px > tolerance_px) & (own | lacking) | lacking & ~open_
        split = helpless.any(-1)
        west, north, east, south = np.moveaxis(lacking & ~split[..., None], -1, 0)
        splits[level] |= split
        cuts[level][0][:] |= west | np.pad(east, ((0, 0), (1, 0)))[:, :-1]
        cuts[level][1][:] |= north | np.pad(south, ((1, 0), (0, 0)))[:-1]
        asked |= bool(lacking.any() | helpless.any())
    return asked


def split_edges(splits: np.ndarray, cut_west: np.ndarray, cut_north: np.ndarray) -> np.ndarray:
    """Edges of each node that are split, (rows, cols, 4): towards a finer neighbour, or by agreement."""
    cut_east = np.pad(cut_west, ((0, 0), (0, 1)))[:, 1:]
    cut_south = np.pad(cut_north, ((0, 1), (0, 0)))[1:]
    return np.stack(neighbours(splits), -1) | np.stack([cut_west, cut_north, cut_east, cut_south], -1)


def _on_rim(shape: tuple[int, ...], level: int) -> np.ndarray:
    """Whether the middle of each node is on the map's last column, and on its last row: (rows, cols, 2)."""
    y, x = node_axes(shape, level)
    return np.stack(np.broadcast_arrays(x.mid == x.high, (y.mid == y.high)[:, None]), -1) & (level > 0)


# A quad has 2 triangles. A fan has 4, one more for each split edge, and one less for each rim that its middle is on.


def _leaves(
    splits: list[np.ndarray], cuts: Cuts, screens: list[Screen], shape: tuple[int, ...], quads: list[np.ndarray]
) -> Leaves:
    leaves: list[np.ndarray] = []
    fans: list[np.ndarray] = []
    edges: list[np.ndarray] = []
    triangles = 0
    worst_px = 0.0
    for level, exists in enumerate(existing(splits)):
        s = screens[level]
        rim = _on_rim(shape, level)
        edge = split_edges(splits[level], *cuts[level])
        leaf = exists & ~splits[level] & ~s.outside
        fan = leaf & (edge.any(-1) | ~quads[level])
        edge &= fan[..., None] & ~rim[..., [1, 0, 1, 0]]
        fan_px = np.where(edge, s.split_px, s.whole_px).max(-1)
        worst_px = max(worst_px, float(np.where(fan, fan_px, s.quad_px)[leaf].max(initial=0.0)))
        triangles += 2 * int((leaf & ~fan).sum()) + int((4 + edge.sum(-1) - rim.sum(-1))[fan].sum())
        for found, value in ((leaves, leaf), (fans, fan), (edges, edge)):
            found.append(value)
    return Leaves(splits, leaves, fans, edges, triangles, worst_px)
