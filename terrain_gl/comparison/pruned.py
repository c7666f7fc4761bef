"""Quadtrees of quads in float64 numpy, pruned by the true error of every post in a view: a comparison for our meshes.

These trees know the true errors in the view. Our error tables do not know them, because they serve all views. But a
leaf of these trees is always two triangles, and only posts are measured. Our meshes also have fans, cut edges, and
vertices between posts. So our meshes can have a smaller error than these trees.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..camera import Camera
from ..reference.error import quad_errors
from ..reference.heightmap import world_m
from ..reference.nodes import node_axes, per_node, top_level
from ..reference.project import Pinhole, ScreenScale, screen_scale, shift_px, to_camera
from ..reference.tree import balance, existing, grow, neighbours, sum_children


class Allocation(NamedTuple):
    """The triangles and errors of the pruned quadtrees of a view, one number for each budget."""

    triangles: np.ndarray  # at most the budget, unless the coarsest tree has more
    rms_px: np.ndarray


def view_of(camera: Camera, size: tuple[int, int], near_m: float) -> Pinhole:
    """A camera and its picture as a `Pinhole` of the reference."""
    lens = camera.centre, camera.aspect(size), camera.is_orthographic
    extent = camera.half_extent(size)
    seen = np.asarray(camera.eye), camera.axes, camera.focal_px(size[1]), extent, near_m, camera.bend_per_m
    return Pinhole(*seen, *lens)


def pruned_quads(
    heights: np.ndarray,
    spacing_m: tuple[float, float],
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
    triangles: Sequence[int],
    void: np.ndarray | None = None,
    weights: np.ndarray | None = None,
) -> tuple[Allocation, Allocation]:
    """RMS screen error over posts of pruned quadtrees with given numbers of triangles: restricted and unrestricted.

    A leaf is two triangles with the better diagonal; its error is the true error of its posts in the picture. The tree
    that minimises error² + λ · triangles is found from the leaves up: a node is split if its best subtree costs less
    (Breiman, Friedman, Olshen, Stone 1984; Chou, Lookabaugh, Gray 1989). λ is found by bisection. Without restriction,
    no other quadtree of quads with as few triangles has a smaller error. The restricted tree is that tree, balanced
    afterwards: neighbours then differ by at most one level (Von Herzen, Barr 1987), and one more triangle on each edge
    with a finer neighbour closes all cracks. It may not be the best restricted tree.

    `weights` (rows, cols) are those of the posts in the mean and in the minimised sum, 1 by default.
    """
    view = view_of(camera, size, near_m)
    scale = _seen_posts(heights, spacing_m, view, void)
    seen = nodes_in_picture(heights, spacing_m, view)
    scale = scale._replace(px_m=scale.px_m * np.sqrt(weights)) if weights is not None else scale
    squares = [np.zeros(seen[0].shape)] + [_squares_px(heights, scale, j) for j in range(1, len(seen))]
    posts = max(1.0, float(np.sum(scale.seen if weights is None else weights[scale.seen])))

    def plain(log_lambda: float) -> tuple[int, float]:
        return _prune(squares, seen, 2.0**log_lambda)[1:]

    def restricted(log_lambda: float) -> tuple[int, float]:
        tree = _restricted(_prune(squares, seen, 2.0**log_lambda)[0])
        return _count(tree, seen), _error_of(tree, squares)

    found = []
    for curve in (restricted, plain):
        counts, errors = _at_budgets(curve, triangles)
        found.append(Allocation(counts, np.sqrt(errors / posts)))
    return found[0], found[1]


def _restricted(coarse: list[np.ndarray]) -> list[np.ndarray]:
    """Split the nodes that are too coarse; then split further nodes until neighbours differ by at most one level."""
    tree = [np.zeros(level.shape, bool) for level in coarse]
    grow(tree, coarse)
    while balance(tree):
        grow(tree, coarse)
    return tree


def _seen_posts(
    heights: np.ndarray, spacing_m: tuple[float, float], view: Pinhole, void: np.ndarray | None
) -> ScreenScale:
    scale = screen_scale(view, world_m(heights, spacing_m))
    return scale if void is None else scale._replace(seen=scale.seen & ~void)


def _at(scale: ScreenScale, where: tuple[np.ndarray, np.ndarray]) -> ScreenScale:
    return ScreenScale(scale.px_m[where], scale.depth_m[where], scale.forward, scale.seen[where])


def _squares_px(heights: np.ndarray, scale: ScreenScale, level: int) -> np.ndarray:
    """Sum of squared true screen errors of each node, drawn as two triangles, over its own posts in the picture."""
    found = []
    for band in bands(heights, level):
        y, x = node_axes(heights[band].shape, level)
        own = y.own if band.stop == len(heights) else y.own & (y.post < y.post.max())
        part = ScreenScale(scale.px_m[band], scale.depth_m[band], scale.forward, scale.seen[band])
        here = _at(part, per_node(y, x))
        counts = here.seen & own[:, :, None, None] & x.own
        errors = quad_errors(heights[band], level)
        sums = (np.square(np.where(counts, shift_px(here, error), 0.0)).sum((1, 3)) for error in errors)
        found.append(np.minimum(*sums))
    return np.concatenate(found)


def nodes_in_picture(heights: np.ndarray, spacing_m: tuple[float, float], view: Pinhole) -> list[np.ndarray]:
    """For each level, the nodes whose box is not entirely outside one side of the frustum."""
    north = np.arange(len(heights))[::-1] * spacing_m[1]
    (tan_x, tan_y), (middle_x, middle_y) = view.half_extent, view.centre

    def seen(posts: np.ndarray, north: np.ndarray, level: int) -> np.ndarray:
        y, x = node_axes(posts.shape, level)
        inside = posts[per_node(y, x)]
        ends = itertools.product((x.low, x.high), (y.low, y.high), (inside.min((1, 3)), inside.max((1, 3))))
        beyond = np.ones((5, len(y.low), len(x.low)), bool)
        for cols, rows, z in ends:
            east, y_m = np.meshgrid(cols * spacing_m[0], north[rows])
            right, up, depth = to_camera(view, np.stack([east, y_m, z]))
            w = view.w_at(depth)
            right, up = right - middle_x * w, up - middle_y * w
            a, b = tan_x * w, tan_y * w
            beyond &= np.stack([right > a, -right > a, up > b, -up > b, depth < view.near_m])
        return ~np.logical_or.reduce(beyond)

    levels = range(top_level(heights.shape) + 1)
    return [np.concatenate([seen(heights[band], north[band], j) for band in bands(heights, j)]) for j in levels]


def bands(heights: np.ndarray, level: int, posts: int = 1 << 21) -> list[slice]:
    """Cut a map into bands of whole rows of nodes, of about `posts` posts. Neighbouring bands share a row of posts."""
    last = len(heights) - 1
    side = max(1, posts // heights.shape[1] >> level) << level
    return [slice(low, min(low + side, last) + 1) for low in range(0, last, side)]


def _prune(squares: list[np.ndarray], seen: list[np.ndarray], price: float) -> tuple[list[np.ndarray], int, float]:
    """The nodes to split (their best subtrees cost less), and the triangles and squared error of the best tree."""
    error = squares[0]
    count = 2 * seen[0].astype(np.int64)
    pays = [np.zeros(seen[0].shape, bool)]
    for level in range(1, len(seen)):
        parts = [sum_children(values, seen[level].shape) for values in (error, count)]
        leaf = squares[level], 2 * seen[level].astype(np.int64)
        pays.append(parts[0] + price * parts[1] < leaf[0] + price * leaf[1])
        error, count = (np.where(pays[level], *both) for both in zip(parts, leaf, strict=True))
    return pays, int(count.sum()), float(error.sum())


def _error_of(splits: list[np.ndarray], squares: list[np.ndarray]) -> float:
    levels = zip(existing(splits), splits, squares, strict=True)
    return sum(float(square[exists & ~split].sum()) for exists, split, square in levels)


_ENOUGH = 0.998  # share of a budget that a tree must have, to end the search


def _at_budgets(curve: Callable[[float], tuple[int, float]], triangles: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """The triangles and the squared error of the largest tree within each budget; triangles fall with log2 λ."""
    known = {at: curve(at) for at in (-60.0, 60.0)}
    found = []
    for budget in triangles:
        for step in range(40):
            low = max(at for at, (n, _) in known.items() if n > budget or at == -60)
            high = min(at for at, (n, _) in known.items() if n <= budget or at == 60)
            if high - low < 1e-3 or known[low][0] <= budget or _ENOUGH * budget <= known[high][0] <= budget:
                break
            # regula falsi on log n over log λ; every third step bisects
            too_many, few, aim = np.log2([known[low][0], max(1, known[high][0]), (1 + _ENOUGH) / 2 * budget])
            part = np.clip((too_many - aim) / (too_many - few), 0.02, 0.98) if step % 3 else 0.5
            at = float(low + part * (high - low))
            known[at] = curve(at)
        fits = [point for point in known.values() if point[0] <= budget]
        found.append(min(fits, key=lambda point: point[1]) if fits else known[60.0])
    return np.array([n for n, _ in found]), np.array([error for _, error in found])


def _count(splits: list[np.ndarray], seen: list[np.ndarray]) -> int:
    """Triangles: two for each leaf in the picture, and one more for each of its edges with a finer neighbour."""
    triangles = 0
    for exists, split, in_picture in zip(existing(splits), splits, seen, strict=True):
        leaves = exists & ~split & in_picture
        triangles += 2 * int(leaves.sum()) + sum(int((leaves & finer).sum()) for finer in neighbours(split))
    return triangles
