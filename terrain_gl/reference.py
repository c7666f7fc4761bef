"""Every stage in plain numpy, a few lines each: the specification, and what the tests compare with.

The sections follow the stages: sat → error → lod → mesh → shade.
"""

from __future__ import annotations

import itertools
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
    own = measured & y.own[:, :, None, None] & x.own
    posts = np.maximum(own.sum((1, 3)), 1)
    squares = [np.square(e * own).sum((1, 3)) / posts for e in (quad, fan)]
    return DrawingErrors(quad.max((1, 3)), fan.max((1, 3)), *squares)


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
    tan_x, tan_y = camera.half_extent(size)
    seen = []
    for level in range(top + 1):
        y, x = nodes_along(heights.shape[0], level), nodes_along(heights.shape[1], level)
        posts = heights[_per_node(y, x)]
        ends = itertools.product((x.low, x.high), (y.low, y.high), (posts.min((1, 3)), posts.max((1, 3))))
        beyond = np.ones((5, len(y.low), len(x.low)), bool)
        for cols, rows, z in ends:
            east, north = np.meshgrid(cols * spacing_m[0], (len(heights) - 1 - rows) * spacing_m[1])
            right, up, depth = _to_camera(camera, east, north, z)
            a, b = tan_x * depth, tan_y * depth
            beyond &= np.stack([right > a, -right > a, up > b, -up > b, depth < near_m])
        seen.append(~np.logical_or.reduce(beyond))
    return seen


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


def shadow_heights(heights: np.ndarray, sun: tuple[float, float, float], spacing_m: tuple[float, float]) -> np.ndarray:
    """Height of the plane of shadow over each post, -inf where nothing stands towards the sun; `sun` is a unit vector.

    Line after line away from the sun: shadow(p) = max(shadow(q), h(q)) - fall, q where the ray from p towards the sun
    crosses the line before, blended between two posts.
    """
    towards = np.array([sun[0] / spacing_m[0], -sun[1] / spacing_m[1]])
    if abs(towards[0]) >= abs(towards[1]):  # lines are columns: turn the map, so that they are rows
        turned = shadow_heights(heights.T, (-sun[1], -sun[0], sun[2]), spacing_m[::-1])
        return turned.T
    h = heights.astype(np.float64)[:: 1 if towards[1] < 0 else -1]
    shift, fall = towards[0] / abs(towards[1]), sun[2] / abs(towards[1])
    shadow = np.full(h.shape, -np.inf)
    crossing = np.arange(h.shape[1]) + shift
    inside = np.flatnonzero((crossing >= 0) & (crossing <= h.shape[1] - 1))
    for i in range(1, len(h)):
        top = np.maximum(shadow[i - 1], h[i - 1])
        shadow[i, inside] = np.interp(crossing[inside], np.arange(len(top)), top) - fall
    return shadow[:: 1 if towards[1] < 0 else -1]
