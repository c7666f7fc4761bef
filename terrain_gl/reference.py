"""Every stage in plain numpy, a few lines each: the specification, and what the tests compare with.

The sections follow the stages: sat → error → lod → mesh → shade, then light, horizon and generate.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .camera import Camera

# --- sat ---------------------------------------------------------------------------------------------------------


def sat(values: np.ndarray) -> np.ndarray:
    """Summed-area table of unsigned `values` (rows, cols, ...), wrapped to their dtype: table[y, x] = S(x + 1, y + 1).

    S(x, y) = sum of values[j, i] over i < x, j < y (Crow 1984).
    """
    return values.cumsum(1, dtype=values.dtype).cumsum(0, dtype=values.dtype)


def box_sum(table: np.ndarray, a: tuple[int, int], b: tuple[int, int]) -> int:
    """Sum over columns a[0] to b[0] and rows a[1] to b[1], ends outside; exact while below 2^bits of the table."""

    def S(x: int, y: int) -> int:
        return int(table[y - 1, x - 1]) if x and y else 0

    return (S(*b) - S(a[0], b[1]) - S(b[0], a[1]) + S(*a)) % 2 ** (8 * table.itemsize)


# --- error -------------------------------------------------------------------------------------------------------


class Nodes(NamedTuple):
    """The nodes of one level along one axis of n posts: node i covers posts low[i] to high[i], clamped to the last."""

    low: np.ndarray  # (nodes,)
    mid: np.ndarray  # (nodes,)
    high: np.ndarray  # (nodes,)
    post: np.ndarray  # (nodes, up to 2^level + 1), the last one again where the map ends before the node
    own: np.ndarray  # whether the post is this node's: not its last, unless that is the map's, and not again


class DrawingErrors(NamedTuple):
    """Metres between the truth and each node of a level as drawn, (rows, cols) of nodes."""

    quad_max: np.ndarray
    fan_max: np.ndarray
    quad_square: np.ndarray  # means over the node's own posts, voids aside
    fan_square: np.ndarray


def split_gains(heights: np.ndarray, void: np.ndarray | None = None) -> list[np.ndarray]:
    """What splitting a node takes from the squared error for each triangle that it adds, m²; of each level from 1 on.

    Nested: never below the gains of the node's children; fans' squares are nested, too, as means.
    """
    gains: list[np.ndarray] = []
    parts = nested = fan_mean = np.zeros([n - 1 for n in heights.shape])
    for level in range(1, max(1, int(max(heights.shape) - 2).bit_length()) + 1):
        y, x = (nodes_along(n, level) for n in heights.shape)
        posts = y.own.sum(1)[:, None] * x.own.sum(1)
        quad, fan = squared_errors(heights, level, void)
        children = _sum_children(np.ones(parts.shape), quad.shape)
        fan_mean = np.maximum(fan / posts, _max_children(fan_mean, quad.shape))
        fan_triangles = 4.0 - (y.mid == y.high)[:, None] - (x.mid == x.high)
        own = _split_gain(quad, fan_mean * posts, fan_triangles, _sum_children(parts, quad.shape), 2 * children)
        nested = np.maximum(own, _max_children(nested, quad.shape))
        gains.append(nested)
        parts = quad
    return gains


def _split_gain(
    quad: np.ndarray, fan: np.ndarray, fan_triangles: np.ndarray, parts: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """Below which price the parts are cheaper than both leaves (glsl/error/gain.glsl)."""
    for_quad = (quad - parts) / np.maximum(triangles - 2, 1)
    fan_pays = (quad - fan) / np.maximum(fan_triangles - 2, 1)
    for_fan = (fan - parts) / np.maximum(triangles - fan_triangles, 1)
    return np.maximum(np.where((for_quad >= fan_pays) | (triangles <= fan_triangles), for_quad, for_fan), 0)


def squared_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Sums of the squared errors in metres of each node's own posts, voids aside: as quads, and as fans."""
    own = _own(heights, level, void)
    errors = quad_errors(heights, level), fan_errors(heights, level)
    quad, fan = (np.square(np.maximum(*map(np.abs, pair)) * own).sum((1, 3)) for pair in errors)
    return quad, fan


def nodes_along(n: int, level: int) -> Nodes:
    """Cut an axis of n posts into nodes of a level."""
    side, last = 1 << level, n - 1
    low = np.arange(0, last, side)
    high = np.minimum(low + side, last)
    post = low[:, None] + np.arange(min(side, last) + 1)
    own = (post < high[:, None]) | (post == last)
    return Nodes(low, np.minimum(low + side // 2, last), high, np.minimum(post, last), own)


def drawing_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> DrawingErrors:
    """Errors of every node of a level ≥ 1, posts (rows, cols) in metres; at void posts heights are drawn, not measured.

    Fan maxima are those of the level alone: the table's are nested, the maximum with those of the children.
    """
    y, x = nodes_along(heights.shape[0], level), nodes_along(heights.shape[1], level)
    seen = np.ones(heights.shape, bool) if void is None else ~void
    measured = seen[_per_node(y, x)]
    quad = np.maximum(*map(np.abs, quad_errors(heights, level))) * measured
    fan = np.maximum(*map(np.abs, fan_errors(heights, level))) * measured
    posts = np.maximum(_own(heights, level, void).sum((1, 3)), 1)
    squares = [sums / posts for sums in squared_errors(heights, level, void)]
    return DrawingErrors(quad.max((1, 3)), fan.max((1, 3)), *squares)


def _own(heights: np.ndarray, level: int, void: np.ndarray | None) -> np.ndarray:
    """Which posts are each node's own, voids aside: (node rows, posts, node cols, posts)."""
    y, x = (nodes_along(n, level) for n in heights.shape)
    seen = np.ones(heights.shape, bool) if void is None else ~void
    return seen[_per_node(y, x)] & y.own[:, :, None, None] & x.own


def quad_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Drawn minus true height at each post of each node, as two triangles, for either diagonal.

    Arrays (node rows, posts, node cols, posts).
    """
    h = heights.astype(np.float64)
    y, x = nodes_along(h.shape[0], level), nodes_along(h.shape[1], level)
    t = ((x.post - x.low[:, None]) / (x.high - x.low)[:, None])[None, None]
    s = ((y.post - y.low[:, None]) / (y.high - y.low)[:, None])[:, :, None, None]
    nw, ne, sw, se = (_at_nodes(h, rows, cols) for rows in (y.low, y.high) for cols in (x.low, x.high))
    falling = np.where(t >= s, nw + (ne - nw) * t + (se - ne) * s, nw + (sw - nw) * s + (se - sw) * t)
    rising = np.where(s + t <= 1, nw + (ne - nw) * t + (sw - nw) * s, se + (sw - se) * (1 - t) + (ne - se) * (1 - s))
    truth = h[_per_node(y, x)]
    return falling - truth, rising - truth


def fan_errors(heights: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Like `quad_errors` for a fan around the node's centre, for edges drawn whole and drawn in halves."""
    h = heights.astype(np.float64)
    y, x = nodes_along(h.shape[0], level), nodes_along(h.shape[1], level)
    across, weight_y = _wedges(h, y, x)
    along, weight_x = _wedges(h.T, x, y)
    north_or_south = weight_y <= weight_x.transpose(2, 3, 0, 1)
    truth = h[_per_node(y, x)]
    whole, halves = (
        np.where(north_or_south, a, b.transpose(2, 3, 0, 1)) - truth for a, b in zip(across, along, strict=True)
    )
    return whole, halves


def wedge_errors(heights: np.ndarray, level: int, void: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Largest error in each wedge of each node's fan, west, north, east and south, (rows, cols, 4) of nodes.

    Returns
    -------
    whole, split
        With the wedge's edge drawn whole, and in halves.
    """
    y, x = nodes_along(heights.shape[0], level), nodes_along(heights.shape[1], level)
    (north, weight_y), (west, weight_x) = _from_middle(y), _from_middle(x)
    north_or_south = weight_y[:, :, None, None] <= weight_x
    wedge = np.where(north_or_south, np.where(north[:, :, None, None], 1, 3), np.where(west, 0, 2))
    measured = np.ones(wedge.shape, bool) if void is None else ~void[_per_node(y, x)]
    whole, split = (
        np.stack([(np.abs(errors) * (measured & (wedge == k))).max((1, 3)) for k in range(4)], -1)
        for errors in fan_errors(heights, level)
    )
    return whole, split


def _wedges(h: np.ndarray, y: Nodes, x: Nodes) -> tuple[list[np.ndarray], np.ndarray]:
    """Heights in the fans' wedges north and south of the centre, edge whole and in halves, and the centre's weight."""
    north, weight = _from_middle(y)
    north, weight = north[:, :, None, None], weight[:, :, None, None]
    a, m, b = (np.where(north, _at_nodes(h, y.low, c), _at_nodes(h, y.high, c)) for c in (x.low, x.mid, x.high))
    before, after = (x.mid - x.low)[:, None], (x.high - x.mid)[:, None]
    at = (x.post - x.mid[:, None]) / np.where(weight < 1, 1 - weight, 1)  # where the ray from the centre meets the edge
    whole = a + (b - a) * (at + before) / (before + after)
    halves = m + np.where(at <= 0, (m - a) * at / before, (b - m) * at / np.maximum(after, 1))
    return [weight * _at_nodes(h, y.mid, x.mid) + (1 - weight) * edge for edge in (whole, halves)], weight


def _from_middle(axis: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Whether a post is at or before its node's middle, and its weight: 1 there, 0 at both ends, (nodes, posts)."""
    to = axis.post - axis.mid[:, None]
    before, after = (axis.mid - axis.low)[:, None], (axis.high - axis.mid)[:, None]
    return to <= 0, 1 - np.abs(to) / np.where(to <= 0, before, np.maximum(after, 1))


def _per_node(y: Nodes, x: Nodes) -> tuple[np.ndarray, np.ndarray]:
    """Index that spreads an array of posts out to (node rows, posts, node cols, posts)."""
    return y.post[:, :, None, None], x.post[None, None]


def _at_nodes(h: np.ndarray, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    return h[rows[:, None, None, None], cols[None, None, :, None]]


# --- lod ---------------------------------------------------------------------------------------------------------


class Quadtree(NamedTuple):
    """A quadtree over a map for one view."""

    splits: list[np.ndarray]  # of each level (rows, cols) bool, none at level 0
    seen: list[np.ndarray]  # nodes that are in the picture
    triangles: int  # two for each leaf in the picture, and one more for each of its edges where the neighbour is finer


def ideal_quadtrees(
    heights: np.ndarray,
    spacing_m: tuple[float, float],
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
    tolerance_px: float,
    void: np.ndarray | None = None,
) -> tuple[Quadtree, Quadtree]:
    """The coarsest restricted quadtree that holds a view's tolerance, and the same without the restriction.

    A node is drawn as two triangles through its corners if every post of it in the picture is then within the
    tolerance, by its true error, for either diagonal; else it is split. Restricted (Von Herzen, Barr 1987): neighbours
    are within one level, so that a triangle more on each edge with a finer neighbour closes all cracks.
    """
    sizes = [tuple(-(-(n - 1) >> j) for n in heights.shape) for j in range(15)]
    top = max(1, sizes.index((1, 1)))
    picture = _posts_in_picture(heights, spacing_m, camera, size, near_m)
    picture = picture._replace(seen=picture.seen & ~void) if void is not None else picture
    seen = _nodes_in_picture(heights, spacing_m, camera, size, near_m, top)
    coarse = [np.zeros(sizes[0], bool)]
    coarse += [(_worst_px(heights, picture, j) > tolerance_px) & seen[j] for j in range(1, top + 1)]
    plain = [np.zeros(shape, bool) for shape in sizes[: top + 1]]
    _split(plain, coarse)
    restricted = [level.copy() for level in plain]
    while _balance(restricted):
        _split(restricted, coarse)
    return _count(restricted, seen), _count(plain, seen, extra=0)


class Picture(NamedTuple):
    """What a view does to an error of one metre at each post, (rows, cols)."""

    px_m: np.ndarray  # pixels times metres of depth, for each metre
    depth_m: np.ndarray
    forward: float  # depth for each metre up
    seen: np.ndarray


def _posts_in_picture(
    heights: np.ndarray, spacing_m: tuple[float, float], camera: Camera, size: tuple[int, int], near_m: float
) -> Picture:
    rows, cols = np.indices(heights.shape)
    x, y, z = _to_camera(camera, cols * spacing_m[0], (len(heights) - 1 - rows) * spacing_m[1], heights)
    tan_x, tan_y = camera.half_extent(size)
    seen = (z >= near_m) & (np.abs(x) <= tan_x * z) & (np.abs(y) <= tan_y * z)
    right, up, forward = camera.axes[:, 2]
    z = np.where(seen, z, 1.0)
    stretch = np.hypot(right - x / z * forward, up - y / z * forward)
    return Picture(camera.focal_px(size[1]) * stretch, z, forward, seen)


def _to_camera(camera: Camera, east: np.ndarray, north: np.ndarray, up: np.ndarray) -> np.ndarray:
    """World metres to the camera's axes: right, up, depth."""
    x, y, z = camera.eye
    return np.tensordot(camera.axes, np.stack([east - x, north - y, up - z]), 1)


def _worst_px(heights: np.ndarray, picture: Picture, level: int) -> np.ndarray:
    """Largest true error on the screen of each node as two triangles, over its posts in the picture."""
    where = _per_node(nodes_along(heights.shape[0], level), nodes_along(heights.shape[1], level))
    px_m, depth_m, seen = (array[where] for array in (picture.px_m, picture.depth_m, picture.seen))
    worst = np.zeros((1, 1))
    for error in quad_errors(heights, level):
        moved = depth_m + error * picture.forward
        px = np.where(moved > 0, px_m * np.abs(error) / np.where(moved > 0, moved, 1.0), np.inf)
        worst = np.maximum(worst, np.where(seen, px, 0.0).max((1, 3)))
    return worst


def _nodes_in_picture(
    heights: np.ndarray, spacing_m: tuple[float, float], camera: Camera, size: tuple[int, int], near_m: float, top: int
) -> list[np.ndarray]:
    """Of each level, nodes whose box is not wholly beyond one side of the frustum."""
    north = np.arange(len(heights))[::-1] * spacing_m[1]

    def seen(posts: np.ndarray, north: np.ndarray, level: int) -> np.ndarray:
        y, x = nodes_along(posts.shape[0], level), nodes_along(posts.shape[1], level)
        inside = posts[_per_node(y, x)]
        ends = itertools.product((x.low, x.high), (y.low, y.high), (inside.min((1, 3)), inside.max((1, 3))))
        beyond = np.ones((5, len(y.low), len(x.low)), bool)
        for cols, rows, z in ends:
            east, y_m = np.meshgrid(cols * spacing_m[0], north[rows])
            right, up, depth = _to_camera(camera, east, y_m, z)
            a, b = tan_x * depth, tan_y * depth
            beyond &= np.stack([right > a, -right > a, up > b, -up > b, depth < near_m])
        return ~np.logical_or.reduce(beyond)

    tan_x, tan_y = camera.half_extent(size)
    return [
        np.concatenate([seen(heights[band], north[band], j) for band in _bands(heights, j)]) for j in range(top + 1)
    ]


def _bands(heights: np.ndarray, level: int, posts: int = 1 << 21) -> list[slice]:
    """Cut a map into bands of whole node rows of about so many posts; neighbours share a row of posts."""
    last, side = len(heights) - 1, max(1, posts // heights.shape[1] >> level) << level
    return [slice(low, min(low + side, last) + 1) for low in range(0, last, side)]


class Allocation(NamedTuple):
    """What the best quadtrees of a view achieve with so many triangles, one number for each budget."""

    triangles: np.ndarray  # at most the budget, unless the coarsest tree has more
    rms_px: np.ndarray


def ideal_allocation(
    heights: np.ndarray,
    spacing_m: tuple[float, float],
    camera: Camera,
    size: tuple[int, int],
    near_m: float,
    triangles: Sequence[int],
    void: np.ndarray | None = None,
    weights: np.ndarray | None = None,
) -> tuple[Allocation, Allocation]:
    """Least root mean square screen error of a quadtree with so many triangles: restricted, and without restriction.

    A leaf is two triangles, by the better diagonal; its error is the true one, of every post of it in the picture.
    The tree that minimises error² + λ · triangles is found from the leaves up: a node is split if its best subtree
    costs less than itself (Breiman, Friedman, Olshen, Stone 1984; Chou, Lookabaugh, Gray 1989), λ by bisection.
    Unrestricted this is the optimum on the lower convex hull. Restricted: that tree, balanced as in `ideal_quadtrees`.

    Parameters
    ----------
    heights, void
        (rows, cols) metres with voids filled, and where those are.
    triangles
        Budgets.
    weights
        (rows, cols) how many times each post counts, in what is made small and in the mean; once by default.
    """
    top = max(1, int(max(heights.shape) - 2).bit_length())
    picture = _posts_in_picture(heights, spacing_m, camera, size, near_m)
    picture = picture._replace(seen=picture.seen & ~void) if void is not None else picture
    picture = picture._replace(px_m=picture.px_m * np.sqrt(weights)) if weights is not None else picture
    seen = _nodes_in_picture(heights, spacing_m, camera, size, near_m, top)
    squares = [np.zeros(seen[0].shape)] + [_squares_px(heights, picture, j) for j in range(1, top + 1)]
    posts = max(1.0, float(np.sum(picture.seen if weights is None else weights[picture.seen])))

    def plain(log_lambda: float) -> tuple[int, float]:
        return _prune(squares, seen, 2.0**log_lambda)[1:]

    def restricted(log_lambda: float) -> tuple[int, float]:
        pays = _prune(squares, seen, 2.0**log_lambda)[0]
        tree = [np.zeros(level.shape, bool) for level in pays]
        _split(tree, pays)
        while _balance(tree):
            _split(tree, pays)
        return _count(tree, seen).triangles, _error_of(tree, squares)

    curves = [_at_budgets(curve, triangles) for curve in (restricted, plain)]
    return tuple(Allocation(n, np.sqrt(error / posts)) for n, error in curves)  # type: ignore[return-value]


def post_weights(
    heights: np.ndarray, spacing_m: tuple[float, float], camera: Camera, size: tuple[int, int], near_m: float
) -> np.ndarray:
    """How many times each post counts in a budget of triangles, (rows, cols).

    Once; near the eye, where it covers many pixels, as often as it is pixels across when seen from straight above.
    """
    depth_m = _posts_in_picture(heights, spacing_m, camera, size, near_m).depth_m
    return np.maximum(1.0, camera.focal_px(size[1]) / depth_m * np.sqrt(spacing_m[0] * spacing_m[1]))


def cell_squares(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean squared distances in metres from the bilinear surface over each cell, (rows - 1, cols - 1): as quad, as fan.

    Of the cell cut along either diagonal, and of a fan around its middle at the mean height of its corners.
    """
    twist = heights[:-1, :-1] - heights[:-1, 1:] - heights[1:, :-1] + heights[1:, 1:]
    return np.square(twist) / 90, np.square(twist) / 1440


def _squares_px(heights: np.ndarray, picture: Picture, level: int) -> np.ndarray:
    """Sum of squared true screen errors of each node as two triangles, over its own posts in the picture."""
    found = []
    for band in _bands(heights, level):
        y, x = nodes_along(len(heights[band]), level), nodes_along(heights.shape[1], level)
        own = y.own if band.stop == len(heights) else y.own & (y.post < y.post.max())
        where = _per_node(y, x)
        px_m, depth_m, seen = (a[band][where] for a in (picture.px_m, picture.depth_m, picture.seen))
        counts = seen & own[:, :, None, None] & x.own
        sums = []
        for error in quad_errors(heights[band], level):
            moved = depth_m + error * picture.forward
            px = np.where(moved > 0, px_m * np.abs(error) / np.where(moved > 0, moved, 1.0), np.inf)
            sums.append(np.square(np.where(counts, px, 0.0)).sum((1, 3)))
        found.append(np.minimum(*sums))
    return np.concatenate(found)


def _prune(squares: list[np.ndarray], seen: list[np.ndarray], price: float) -> tuple[list[np.ndarray], int, float]:
    """Which nodes are dearer than their best subtrees, and triangles and error² of the best tree."""
    error, count = squares[0], 2 * seen[0].astype(np.int64)
    pays = [np.zeros(seen[0].shape, bool)]
    for level in range(1, len(seen)):
        parts = [_sum_children(values, seen[level].shape) for values in (error, count)]
        leaf = squares[level], 2 * seen[level].astype(np.int64)
        pays.append(parts[0] + price * parts[1] < leaf[0] + price * leaf[1])
        error, count = (np.where(pays[level], *both) for both in zip(parts, leaf, strict=True))
    return pays, int(count.sum()), float(error.sum())


def _sum_children(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    padded = np.zeros((2 * shape[0], 2 * shape[1]), values.dtype)
    padded[: values.shape[0], : values.shape[1]] = values
    return padded.reshape(shape[0], 2, shape[1], 2).sum((1, 3))


def _max_children(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    padded = np.zeros((2 * shape[0], 2 * shape[1]))
    padded[: values.shape[0], : values.shape[1]] = values
    return padded.reshape(shape[0], 2, shape[1], 2).max((1, 3))


def _error_of(splits: list[np.ndarray], squares: list[np.ndarray]) -> float:
    total, exists = 0.0, np.ones((1, 1), bool)
    for level in range(len(splits) - 1, 0, -1):
        total += float(squares[level][exists & ~splits[level]].sum())
        rows, cols = splits[level - 1].shape
        exists = splits[level].repeat(2, 0).repeat(2, 1)[:rows, :cols]
    return total


def _at_budgets(
    curve: Callable[[float], tuple[int, float]], triangles: Sequence[int], enough: float = 0.998
) -> tuple[np.ndarray, np.ndarray]:
    """Points of a falling curve log2 λ → (triangles, error²), just within each budget."""
    known = {at: curve(at) for at in (-60.0, 60.0)}
    found = []
    for budget in triangles:
        for step in range(40):
            low = max(at for at, (n, _) in known.items() if n > budget or at == -60)
            high = min(at for at, (n, _) in known.items() if n <= budget or at == 60)
            if high - low < 1e-3 or known[low][0] <= budget or enough * budget <= known[high][0] <= budget:
                break
            # the chord of log n over log λ, and halves now and then
            too_many, few, aim = np.log2([known[low][0], max(1, known[high][0]), (1 + enough) / 2 * budget])
            part = np.clip((too_many - aim) / (too_many - few), 0.02, 0.98) if step % 3 else 0.5
            at = float(low + part * (high - low))
            known[at] = curve(at)
        fits = [point for point in known.values() if point[0] <= budget]
        found.append(min(fits, key=lambda point: point[1]) if fits else known[60.0])
    return np.array([n for n, _ in found]), np.array([error for _, error in found])


def _split(splits: list[np.ndarray], coarse: list[np.ndarray]) -> None:
    """From the root down, split the nodes that exist and are too coarse."""
    exists = np.ones((1, 1), bool)
    for level in range(len(splits) - 1, 0, -1):
        splits[level] |= exists & coarse[level]
        rows, cols = splits[level - 1].shape
        exists = splits[level].repeat(2, 0).repeat(2, 1)[:rows, :cols]


def _balance(splits: list[np.ndarray]) -> bool:
    """Where a node is split, split the parents of its neighbours; whether any was."""
    before = sum(int(level.sum()) for level in splits)
    for level in range(1, len(splits) - 1):
        around = splits[level] | np.logical_or.reduce(_neighbours(splits[level]))
        rows, cols = splits[level + 1].shape
        padded = np.zeros((2 * rows, 2 * cols), bool)
        padded[: around.shape[0], : around.shape[1]] = around
        splits[level + 1] |= padded.reshape(rows, 2, cols, 2).any((1, 3))
    return sum(int(level.sum()) for level in splits) > before


def _neighbours(nodes: np.ndarray) -> list[np.ndarray]:
    """Each node's neighbours to the west, north, east and south; False beyond the map."""
    padded = np.pad(nodes, 1)
    return [padded[1:-1, :-2], padded[:-2, 1:-1], padded[1:-1, 2:], padded[2:, 1:-1]]


def _count(splits: list[np.ndarray], seen: list[np.ndarray], extra: int = 1) -> Quadtree:
    triangles, exists = 0, np.ones((1, 1), bool)
    for level in range(len(splits) - 1, -1, -1):
        leaves = exists & ~splits[level] & seen[level]
        triangles += 2 * int(leaves.sum()) + extra * sum(
            int((leaves & finer).sum()) for finer in _neighbours(splits[level])
        )
        if level:
            rows, cols = splits[level - 1].shape
            exists = splits[level].repeat(2, 0).repeat(2, 1)[:rows, :cols]
    return Quadtree(splits, seen, triangles)


# --- shade -------------------------------------------------------------------------------------------------------


def relief(
    heights: np.ndarray, post: tuple[float, float], extent: tuple[float, float], spacing_m: tuple[float, float]
) -> tuple[float, np.ndarray]:
    """Mean height and mean slope (east, north) under a box `extent` posts wide around `post`, (column, row).

    Every post's height holds for a square of one post around it; the box ends at the map's rim. The slope is the
    difference between the means of the box's two halves, in units of what it is for a ramp: exact for planes.
    """
    sums = np.pad(heights.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    size = np.array(heights.shape[::-1], float)
    a, c = (np.clip(np.array(post) + 0.5 + side * np.array(extent) / 2, 0, size) for side in (-1, 1))
    b = (a + c) / 2
    total, east, south = _halves(sums, a, b, c)
    ramps = [_halves(np.pad(ramp.cumsum(0).cumsum(1), ((1, 0), (1, 0))), a, b, c) for ramp in np.indices(heights.shape)]
    rise = np.array([east / ramps[1][1], south / ramps[0][2]])
    aside = np.array(post) - [ramps[1][0], ramps[0][0]]
    return total + float(rise @ aside), rise / spacing_m * [1, -1]


def _halves(sums: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[float, float, float]:
    """Mean over the box from a to c; eastern half less western, southern less northern. Sums have a rim of zeros."""

    def S(x: float, y: float) -> float:
        i, j = min(int(x), sums.shape[1] - 2), min(int(y), sums.shape[0] - 2)
        rows = sums[j : j + 2, i] * (1 - x + i) + sums[j : j + 2, i + 1] * (x - i)
        return float(rows[0] * (1 - y + j) + rows[1] * (y - j))

    def mean(x0: float, y0: float, x1: float, y1: float) -> float:
        return (S(x1, y1) - S(x0, y1) - S(x1, y0) + S(x0, y0)) / ((x1 - x0) * (y1 - y0))

    east = mean(b[0], a[1], c[0], c[1]) - mean(a[0], a[1], b[0], c[1])
    south = mean(a[0], b[1], c[0], c[1]) - mean(a[0], a[1], c[0], b[1])
    return mean(*a, *c), east, south


def spline_relief(
    heights: np.ndarray, post: tuple[float, float], spacing_m: tuple[float, float]
) -> tuple[float, np.ndarray]:
    """Height and slope (east, north) at `post` of the uniform cubic B-spline over the heights, clamped at the rim."""
    i, j = int(np.floor(post[0])), int(np.floor(post[1]))
    rows = np.clip(np.arange(j - 1, j + 3), 0, heights.shape[0] - 1)
    cols = np.clip(np.arange(i - 1, i + 3), 0, heights.shape[1] - 1)
    h = heights[rows[:, None], cols].astype(np.float64)
    basis = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6

    def weights(t: float) -> np.ndarray:
        return np.array([1, t, t * t, t**3]) @ basis

    def slopes(t: float) -> np.ndarray:
        return np.array([0, 1, 2 * t, 3 * t * t]) @ basis

    x, y = post[0] - i, post[1] - j
    slope = np.array([weights(y) @ h @ slopes(x), -(slopes(y) @ h @ weights(x))])
    return float(weights(y) @ h @ weights(x)), slope / spacing_m


# --- light -------------------------------------------------------------------------------------------------------

# A spherical Gaussian SG(w) = a e^(sharpness (w . axis - 1)) is (axis (3,), sharpness, a); directions are unit vectors.


def sg_integral(sharpness: float) -> float:
    """Integral over the sphere of a Gaussian of amplitude 1 (Wang et al. 2009)."""
    return 4 * np.pi if sharpness == 0 else -2 * np.pi * np.expm1(-2 * sharpness) / sharpness


def sg_product(
    axis: np.ndarray, sharpness: float, other_axis: np.ndarray, other_sharpness: float
) -> tuple[np.ndarray, float, float]:
    """Axis, sharpness and amplitude of the product of two Gaussians of amplitude 1."""
    s = sharpness * np.asarray(axis, float) + other_sharpness * np.asarray(other_axis, float)
    product = float(np.linalg.norm(s))
    return s / product, product, float(np.exp(product - sharpness - other_sharpness))


def mean_length(sharpness: float) -> float:
    """Length of the mean vector of a von Mises-Fisher lobe: coth k - 1/k."""
    k = sharpness
    return k / 3 - k**3 / 45 if k < 1e-3 else 1 / np.tanh(k) - 1 / k


def sharpness_of_length(length: float) -> float:
    """Inverse of `mean_length`, by bisection; equation C.1 of the paper is within 5 % of it."""
    low, high = 0.0, 1e9
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_length(middle) < length else (low, middle)
    return 0.5 * (low + high)


def cubic_length(sharpness: float) -> float:
    """Length that equation C.1, k = (3r - r^3) / (1 - r^2), belongs to: its one root from 0 to 1."""
    roots = np.roots([1.0, -sharpness, -3.0, sharpness])
    return float(next(root.real for root in roots if abs(root.imag) < 1e-9 and 0 <= root.real < 1))


def merged(r: np.ndarray, weights: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Axis and sharpness of the one lobe that stands for lobes of mean vectors r (n, 3): equation C.3."""
    mean = np.average(np.asarray(r, float), axis=0, weights=weights)
    length = float(np.linalg.norm(mean))
    return mean / length, sharpness_of_length(length)


def cosine_mean(c: float, r: float) -> float:
    """Mean of max(l . n, 0) over normals of mean vector length r with component c towards l: glsl/light/brdf.glsl."""
    w = 0.5 + 0.5 * np.sqrt(1 - 4 / 3 * r * r) if r < 0.75 else np.sqrt(3 * r * (1 - r))
    return max(c, 0.0) if abs(c) >= w else (c + w) ** 2 / (4 * w)


def reflection_lobe(axis: np.ndarray, sharpness: float, towards_eye: np.ndarray) -> tuple[np.ndarray, float]:
    """Axis and sharpness of the light that these half-vectors mirror to the eye (Wang et al. 2009, section 4)."""
    slant = float(np.dot(axis, towards_eye))
    return 2 * slant * np.asarray(axis) - towards_eye, sharpness / (4 * max(abs(slant), 0.05))


def normals_of(heights: np.ndarray, spacing_m: tuple[float, float]) -> np.ndarray:
    """Unit normals in the middle of each cell, (rows - 1, cols - 1, 3), east, north, up."""
    h = np.asarray(heights, float)
    east = (h[:-1, 1:] - h[:-1, :-1] + h[1:, 1:] - h[1:, :-1]) / (2 * spacing_m[0])
    north = (h[:-1, :-1] - h[1:, :-1] + h[:-1, 1:] - h[1:, 1:]) / (2 * spacing_m[1])
    n = np.stack([-east, -north, np.ones_like(east)], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def lean(slope: np.ndarray, variance: float, towards_eye: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean weight W, and lean: the line W (1 - lean . (s - slope)) that is closest to what facets of slope s fill.

    They fill max(o_z - o_h . s, 0) of a picture (Dupuy et al. 2013); s is Gaussian, of so much variance a side.
    """
    across = float(np.hypot(*towards_eye[:2])) * variance**0.5
    t = float(towards_eye[2] - towards_eye[:2] @ slope) / across
    share = 0.5 * (1 + math.erf(t / 2**0.5))
    weight = across * (t * share + math.exp(-0.5 * t * t) / (2 * np.pi) ** 0.5)
    return weight, towards_eye[:2] * share / weight


# --- horizon -----------------------------------------------------------------------------------------------------


def bilinear_heights(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights at columns x and rows y inside the map."""
    rows, cols = heights.shape
    i, j = np.clip(x.astype(int), 0, cols - 2), np.clip(y.astype(int), 0, rows - 2)
    fx, fy = x - i, y - j
    north = heights[j, i] * (1 - fx) + heights[j, i + 1] * fx
    south = heights[j + 1, i] * (1 - fx) + heights[j + 1, i + 1] * fx
    return north * (1 - fy) + south * fy


def horizon_sines(
    heights: np.ndarray, posts: np.ndarray, towards: tuple[float, float], spacing_m: tuple[float, float]
) -> np.ndarray:
    """Sine of the horizon's height above level, by marching in quarters of a post; -1 where only sky lies ahead.

    Parameters
    ----------
    posts
        (..., 2) columns and rows from which one looks.
    towards
        Columns and rows of a step, the larger of them 1 or -1.
    """
    h, x, y = heights.astype(np.float64), posts[..., 0].astype(np.float64), posts[..., 1].astype(np.float64)
    last_y, last_x = np.array(h.shape) - 1
    own, slope = bilinear_heights(h, x, y), np.full(x.shape, -np.inf)
    step_m = float(np.hypot(towards[0] * spacing_m[0], towards[1] * spacing_m[1]))
    for steps in np.arange(0.25, max(h.shape), 0.25):
        at_x, at_y = x + steps * towards[0], y + steps * towards[1]
        inside = (at_x >= 0) & (at_x <= last_x) & (at_y >= 0) & (at_y <= last_y)
        rise = bilinear_heights(h, np.clip(at_x, 0, last_x), np.clip(at_y, 0, last_y)) - own
        slope = np.where(inside, np.maximum(slope, rise / (steps * step_m)), slope)
    seen = np.where(np.isinf(slope), 0.0, slope)
    return np.where(np.isinf(slope), -1.0, seen / np.hypot(1, seen))


def disc_share(elevation: np.ndarray, horizon: np.ndarray, radius: float) -> np.ndarray:
    """Share of a disc over a straight horizon, all in radians: a segment of a circle."""
    x = np.clip((np.asarray(elevation) - horizon) / radius, -1, 1)
    return 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi


def middles_of_cells(heights: np.ndarray) -> np.ndarray:
    """(rows - 1, cols - 1, 2) columns and rows."""
    y, x = np.indices((heights.shape[0] - 1, heights.shape[1] - 1)) + 0.5
    return np.stack([x, y], -1)


def sunlit(
    heights: np.ndarray, sun: np.ndarray, radius: float, towards: tuple[float, float], spacing_m: tuple[float, float]
) -> np.ndarray:
    """(rows - 1, cols - 1) share of the sun's disc that each cell's middle sees, times the cosine."""
    horizon = np.arcsin(horizon_sines(heights, middles_of_cells(heights), towards, spacing_m))
    cosine = np.maximum(normals_of(heights, spacing_m) @ np.asarray(sun), 0)
    return disc_share(np.arcsin(sun[2]), horizon, radius) * cosine


def skylit(
    heights: np.ndarray, axis: np.ndarray, sharpness: float, spacing_m: tuple[float, float], azimuths: int = 32
) -> tuple[np.ndarray, np.ndarray]:
    """What cells get of a lobe, with and without all horizons but their own planes: means of V <n, w> over SG(w)."""
    n, middles = normals_of(heights, spacing_m), middles_of_cells(heights)
    z = -1 + (np.arange(100) + 0.5) / 50
    got, of_all, total = np.zeros(n.shape[:2]), np.zeros(n.shape[:2]), 0.0
    for azimuth in (np.arange(azimuths) + 0.5) * 2 * np.pi / azimuths:
        east, north = np.cos(azimuth), np.sin(azimuth)
        step = np.array([east / spacing_m[0], -north / spacing_m[1]])
        horizon = horizon_sines(heights, middles, tuple(step / np.abs(step).max()), spacing_m)
        for w in np.stack([np.sqrt(1 - z * z) * east, np.sqrt(1 - z * z) * north, z], -1):
            gaussian = np.exp(sharpness * (w @ np.asarray(axis) - 1))
            cosine = gaussian * np.maximum(n @ w, 0)
            got, of_all, total = got + cosine * (w[2] > horizon), of_all + cosine, total + gaussian
    return got / total, of_all / total


def lobe_values(heights: np.ndarray, spacing_m: tuple[float, float], albedo: float, roughness: float) -> np.ndarray:
    """What the tables of merged lobes sum for ground of one material: (9, rows, cols) of blocks of 2 x 2 cells.

    Normals weighted by albedo, half-vectors' mean vectors, albedo three times; see glsl/light/lobes.glsl.
    """
    normals = normals_of(heights, spacing_m)
    rows, cols = (-(-n // 2) for n in normals.shape[:2])
    padded = np.full((2 * rows, 2 * cols, 3), np.nan)
    padded[: normals.shape[0], : normals.shape[1]] = normals
    mean = np.nanmean(padded.reshape(rows, 2, cols, 2, 3), axis=(1, 3)).transpose(2, 0, 1)
    length = mean_length(2 / roughness**4)
    return np.concatenate([albedo * mean, length * mean, np.full((3, rows, cols), albedo)])


def box_mean(values: np.ndarray, a: np.ndarray, c: np.ndarray) -> float:
    """Mean of (rows, cols) over the box from a to c, (column, row), texels being constant: any place, any size."""

    def weights(low: float, high: float, count: int) -> np.ndarray:
        i = np.arange(count)
        return np.clip(np.minimum(high, i + 1) - np.maximum(low, i), 0, 1)

    across, down = (weights(a[i], c[i], values.shape[1 - i]) for i in (0, 1))
    return float(down @ values @ across / (down.sum() * across.sum()))


# --- generate ----------------------------------------------------------------------------------------------------

# Operation for operation as in glsl/generate: with float32 points every bit is the GPU's. Points p: (2, rows, cols).

_AMPLITUDES = (1.0, 0.55, 0.3, 0.17)
_WARPS = (0.22, 0.07, 0.03)


class LandRecipe(NamedTuple):
    """What makes one land differ from another; `terrain_gl.generate.Land` says more."""

    seed: int
    cliffs: float
    octaves: int
    alpine: bool = False


def land(p: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    """Height at the points `p`, 0 to 1 of the relief; p is in units of 8 reliefs, east and south."""
    seed, cliffs = recipe.seed, np.full((1, 1), recipe.cliffs, p.dtype)
    h, slope = _forms_and_slope(p, recipe, cliffs)
    hillside = smooth_step(0, 1, dot2(slope, slope))
    carving = blend(0.07, 0.13, np.minimum(1, 1.5 * cliffs)) * smooth_step(0, 5, h)
    rough = np.zeros_like(h)
    for k in range(3, recipe.octaves):
        frequency, wavelength = 5.0 * 2 ** (k - 3), p.dtype.type(0.2) * p.dtype.type(0.5 ** (k - 3))
        square = dot2(slope, slope)
        inverse = inverse_sqrt(square + 0.1)
        steep = np.minimum(square * inverse, 4)
        across = np.stack([-slope[1], slope[0]]) * inverse
        at = p * frequency
        height, rising = stripes(at, across, seed, 40 + k)
        depth = carving * steep * smooth_step(0, 1, steep)
        h = h + depth * wavelength * height
        rough = rough + (0.02 + 0.03 * steep) * wavelength * noise(1.7 * at, seed, 60 + k)
        slope = slope + 5 * depth * rising * across
    h = strata(h, p, 6, 16, np.minimum(1, 1.2 * cliffs) * hillside, seed, 80)
    h = strata(h, p, 27, 5, 0.6 * cliffs * hillside, seed, 90)
    return np.clip(0.02 + 0.92 * (h + rough), 0, 1)


def _forms_and_slope(p: np.ndarray, recipe: LandRecipe, cliffs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The great forms, and how they rise east and south."""
    beside = np.array([0, 1 / 256], p.dtype)[:, None, None]
    h, east, south = (_forms(p + d, recipe, cliffs) for d in (0 * beside, beside[::-1], beside))
    return h, (np.stack([east, south]) - h) * 256


def _forms(p: np.ndarray, recipe: LandRecipe, cliffs: np.ndarray) -> np.ndarray:
    q = _warp(p, recipe.seed)
    up = smooth_step(-0.85, 1, noise(0.43 * q, recipe.seed, 7) + 0.3 * noise(0.93 * q, recipe.seed, 8))
    if recipe.alpine:
        valleys = _above_valleys(q, np.full((1, 1), 0.2, p.dtype), recipe)
        return 0.05 + 0.08 * valleys + 0.1 * up + (0.05 + 0.3 * up) * _ridges(1.6 * q, recipe)
    t = _above_valleys(q, blend(0.25, 0.12, cliffs), recipe)
    hills = 0.06 + 0.24 * up + (0.36 + 0.24 * up) * t
    eaten = (0.45 + 2.2 * t) * _branches(q, recipe) - 0.2 * (1 - up)
    table = (0.38 + 0.12 * up) * smooth_step(0.03, 4, eaten) + 0.22 * smooth_step(0.34, 5, eaten)
    return blend(hills, 0.08 + 0.08 * t + table, cliffs * cliffs)


def _warp(p: np.ndarray, seed: int) -> np.ndarray:
    q, at = p, 1.07 * p
    for i, reach in enumerate(_WARPS):
        q = q + reach * np.stack([noise(at, seed, 2 * i), noise(at + 0.5, seed, 2 * i + 1)])
        at = 1.4 * finer(at)
    return q


def _above_valleys(q: np.ndarray, softness: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    total = np.zeros_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: recipe.octaves]):
        held = np.minimum(1, 2 * total) if i else np.ones_like(total)
        total = total + held * amplitude * soft_abs(noise(q, recipe.seed, 10 + i), softness * amplitude)
        q = finer(q)
    return total


def _branches(q: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    nearest = np.ones_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: min(3, recipe.octaves)]):
        start = q.dtype.type(0.07) * q.dtype.type(i)
        here = soft_abs(noise(q, recipe.seed, 10 + i), np.full((1, 1), 0.06, q.dtype))
        nearest = soft_min(nearest, start + amplitude * here)
        q = finer(q)
    return nearest


def _ridges(q: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    total, held = np.zeros_like(q[0]), np.ones_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: recipe.octaves]):
        crest = 1 - soft_abs(noise(q, recipe.seed, 20 + i), np.full((1, 1), 0.1, q.dtype))
        rise = held * crest * crest
        total = total + amplitude * rise
        held = np.minimum(1, 1.5 * rise)
        q = finer(q)
    return total


def strata(
    h: np.ndarray, p: np.ndarray, layers: int, edge: float, strength: np.ndarray, seed: int, kind: int
) -> np.ndarray:
    """Heights with the steps that layers of hard and soft rock make."""
    tilt = 0.9 * noise(0.6 * p, seed, kind) + 0.15 * noise(5.0 * p, seed, kind + 1)
    level = h * layers + tilt
    layer = np.floor(level)
    own = pcg3d(layer, np.full_like(layer, kind), seed)
    hard = smooth_step(-0.5, 1, 0.6 * signed_unit(own[1], h.dtype) + noise(1.3 * p, seed, kind + 2))
    x = level - layer - (0.55 + 0.2 * signed_unit(own[0], h.dtype))
    t = np.clip(x * blend(2, edge, hard) + 0.5, 0, 1)
    step = 0.3 * (level - layer) + 0.7 * t * t * (2 - t)
    return blend(h, (layer + step - tilt) * (h.dtype.type(1) / h.dtype.type(layers)), strength * (0.3 + 0.7 * hard))


def stripes(p: np.ndarray, across: np.ndarray, seed: int, layer: int) -> np.ndarray:
    """Height and rise of waves along the unit vectors `across`, spread from a pivot in every cell: (2, rows, cols)."""
    home, total = np.floor(p), np.zeros_like(p)
    for j, i in itertools.product((-1, 0, 1), repeat=2):
        cell = home + np.array([i, j], p.dtype)[:, None, None]
        h = _cell_hash(cell, seed, layer)
        d = p - cell - (0.5 + 0.3 * np.stack([signed_unit(h[0], p.dtype), signed_unit(h[1], p.dtype)]))
        weight = np.maximum(0, 1 - 0.6944444 * dot2(d, d))
        turns = dot2(d, across)
        total = total + weight * weight * np.stack([_wave(turns), _wave(turns + 0.25)])
    return total * inverse_sqrt(dot2(total, total) + 0.02)


def _wave(turns: np.ndarray) -> np.ndarray:
    x = 2 * np.abs(turns - np.floor(turns + 0.5))
    return 1 - 2 * x * x * (3 - 2 * x)


def noise(p: np.ndarray, seed: int, layer: int) -> np.ndarray:
    """Gradient noise (Perlin 1985 and 2002), about -1 to 1."""
    c = np.floor(p)
    f = p - c
    u, v = f * f * f * (f * (f * 6 - 15) + 10)
    west, east, southwest, southeast = (_corner_ramp(c + d, f - d, seed, layer) for d in _corners(p.dtype))
    return 1.5 * blend(blend(west, east, u), blend(southwest, southeast, u), v)


def _corner_ramp(cell: np.ndarray, d: np.ndarray, seed: int, layer: int) -> np.ndarray:
    h = _cell_hash(cell, seed, layer)
    t = signed_unit(h[0], d.dtype)
    k = 1 - t * t * (0.5 - 0.2071068 * t * t)
    g = np.where(h[1] & 0x10000, np.stack([k * t, k]), np.stack([k, k * t]))
    return np.where(h[2] & 0x10000, -dot2(g, d), dot2(g, d))


def _corners(dtype: np.dtype) -> np.ndarray:
    """The corners of a cell, row by row, (4, 2, 1, 1)."""
    return np.array([(0, 0), (1, 0), (0, 1), (1, 1)], dtype)[..., None, None]


def finer(p: np.ndarray) -> np.ndarray:
    """Points of the next octave: twice as dense, turned by atan(3/4)."""
    return np.stack([1.6 * p[0] - 1.2 * p[1] + 0.37, 1.2 * p[0] + 1.6 * p[1] + 0.71])


def _cell_hash(cell: np.ndarray, seed: int, layer: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return pcg3d(cell[0], cell[1], seed * 256 + layer)


def pcg3d(x: np.ndarray, y: np.ndarray, z: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three random-looking uint32 arrays, of whole numbers (Jarzynski and Olano 2020)."""
    x, y, w = (np.asarray(v).astype(np.int64).astype(np.uint32) for v in (x, y, np.full_like(x, z, np.int64)))
    x, y, w = (v * np.uint32(1664525) + np.uint32(1013904223) for v in (x, y, w))
    x = x + y * w
    y = y + w * x
    w = w + x * y
    x, y, w = (v ^ v >> 16 for v in (x, y, w))
    x = x + y * w
    y = y + w * x
    return x, y, w + x * y


def signed_unit(bits: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """-1 to 1, of the 24 highest bits."""
    return (bits >> 8).astype(dtype) / 8388608 - 1


def blend(a: float | np.ndarray, b: float | np.ndarray, t: np.ndarray) -> np.ndarray:
    """From a to b as t goes from 0 to 1."""
    a = np.asarray(a, t.dtype)
    return a + t * (np.asarray(b, t.dtype) - a)


def dot2(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product over the first axis, of length 2."""
    return a[0] * b[0] + a[1] * b[1]


def smooth_step(low: float, steepness: float, x: np.ndarray) -> np.ndarray:
    """0 below `low`, 1 from low + 1 / steepness on, smooth between."""
    t = np.clip((x - low) * steepness, 0, 1)
    return t * t * (3 - 2 * t)


def soft_abs(x: np.ndarray, softness: np.ndarray) -> np.ndarray:
    """|x|, round where it is below `softness`."""
    square = x * x
    return square * inverse_sqrt(square + softness * softness)


def soft_min(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The lesser of two, round where they are within 0.1 of each other."""
    near = np.maximum(0.1 - np.abs(a - b), 0)
    return np.minimum(a, b) - 2.5 * near * near


def inverse_sqrt(x: np.ndarray) -> np.ndarray:
    """1 / sqrt(x), to the 11 digits that three steps of Newton give."""
    y = (np.uint32(0x5F375A86) - (x.astype(np.float32).view(np.uint32) >> 1)).view(np.float32).astype(x.dtype)
    half = 0.5 * x
    for _ in range(3):
        y = y * (1.5 - half * y * y)
    return y


# --- Clipmaps ---------------------------------------------------------------------------------------------------------


def halve(heights: np.ndarray, weights: tuple[float, float, float]) -> np.ndarray:
    """Every second sample of a symmetric filter, along both axes; the last sample stands on the last post.

    g(i) = w_0 f(2i) + w_1 (f(2i - 1) + f(2i + 1)) + w_2 (f(2i - 2) + f(2i + 2)); near the rim pairs of taps move in.
    """
    for axis in (0, 1):
        lines = np.moveaxis(heights.astype(np.float64), axis, 0)
        last = len(lines) - 1
        middle = np.minimum(2 * np.arange(-(-last // 2) + 1), last)
        reach = [np.minimum(d, np.minimum(middle, last - middle)) for d in (1, 2)]
        halved = weights[0] * lines[middle]
        for weight, d in zip(weights[1:], reach, strict=True):
            halved += weight * (lines[middle - d] + lines[middle + d])
        heights = np.moveaxis(halved, 0, axis)
    return heights
