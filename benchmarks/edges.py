"""What a budget of triangles would gain if neighbours agreed to split edges, as they do with a tolerance: an estimate.

The trees that have the least error² + λ · triangles are grown from the leaves up with the true error of every post as
seen from the eye, and balanced. A leaf is a quad or a fan whose edges are split towards finer neighbours; and, for the
estimate, where a fan and its neighbour of the same size together lose more than 2 λ of squared error by it. Printed are
the triangles of the one and of the other at one root mean square error.

Run: python benchmarks/edges.py MAP [--spacing M ...] [--view NAME]
"""

import argparse

import numpy as np

from terrain_gl import reference
from terrain_gl.cli import options
from terrain_gl.comparison import ideal
from terrain_gl.options import near_plane_m

PRICES = 2.0 ** np.arange(9, -9, -1.0)
WEST, NORTH, EAST, SOUTH = range(4)
_POSTS = 1 << 19  # looked at together


class Errors:
    """Squared errors in px² of each level's nodes, over their own posts in the picture.

    Attributes
    ----------
    quad
        (rows, cols), the mean of both diagonals.
    whole, split
        (rows, cols, 4), of a fan's wedges, by how the edge is drawn.
    worse
        (rows, cols), of the fan, each post as the worse of both: what the error table knows.
    """

    def __init__(self, heights, pixels_m, level):
        quad, whole, split, worse = [], [], [], []
        for band in ideal.bands(heights, level, _POSTS):
            h = heights[band]
            y, x = (reference.nodes_along(n, level) for n in h.shape)
            own = y.own if band.stop == len(heights) else y.own & (y.post < y.post.max())
            weight = np.square(pixels_m[band][reference.error.per_node(y, x)]) * (own[:, :, None, None] & x.own)
            quad.append(sum((np.square(e) * weight).sum((1, 3)) for e in reference.quad_errors(h, level)) / 2)
            fans = [np.square(e) * weight for e in reference.fan_errors(h, level)]
            wedge = reference.error.wedges_of_posts(h, level)
            for found, fan in zip((whole, split), fans, strict=True):
                found.append(np.stack([(fan * (wedge == k)).sum((1, 3)) for k in range(4)], -1))
            worse.append(np.maximum(*fans).sum((1, 3)))
        self.quad, self.whole, self.split, self.worse = map(np.concatenate, (quad, whole, split, worse))


def grow(errors, seen, price, agreeing):
    """The balanced tree of a price: which nodes are split."""
    cost, pays = 2 * price * seen[0], [np.zeros(seen[0].shape, bool)]
    for e, in_picture in zip(errors, seen[1:], strict=True):
        fan = np.minimum(e.whole, e.split + price).sum(-1) if agreeing else e.worse
        leaf = np.where(in_picture, np.minimum(e.quad + 2 * price, fan + 4 * price), 0)
        parts = reference.error.sum_children(cost, in_picture.shape)
        pays.append(parts < leaf)
        cost = np.minimum(parts, leaf)
    tree = [np.zeros(level.shape, bool) for level in pays]
    reference.tree.grow(tree, pays)
    while reference.tree.balance(tree):
        reference.tree.grow(tree, pays)
    return tree


def leaves(tree, seen):
    """Of each level from 1 on, leaves in the picture and which of their edges have finer neighbours; how many cells."""
    exists, found = np.ones((1, 1), bool), []
    for splits, in_picture in zip(reversed(tree), reversed(seen), strict=True):
        found.append((exists & ~splits & in_picture, np.stack(reference.tree.neighbours(splits), -1)))
        exists = splits.repeat(2, 0).repeat(2, 1)
        if len(found) < len(tree):
            rows, cols = tree[-1 - len(found)].shape
            exists = exists[:rows, :cols]
    cells = int(found.pop()[0].sum())
    return found[::-1], cells


def agreed(e, fan, finer, price):
    """Edges split: towards finer neighbours, and between fans where both lose more than two triangles' price."""
    gain, cut = e.whole - e.split, finer.copy()
    east = fan[:, :-1] & fan[:, 1:] & (gain[:, :-1, EAST] + gain[:, 1:, WEST] > 2 * price)
    south = fan[:-1] & fan[1:] & (gain[:-1, :, SOUTH] + gain[1:, :, NORTH] > 2 * price)
    cut[:, :-1, EAST] |= east
    cut[:, 1:, WEST] |= east
    cut[:-1, :, SOUTH] |= south
    cut[1:, :, NORTH] |= south
    return cut


def drawn(errors, tree, seen, price, agreeing):
    """Triangles, and squared error."""
    found, cells = leaves(tree, seen)
    triangles, square = 2 * cells, 0.0
    for e, (leaf, finer) in zip(errors, found, strict=True):
        alone, cut = ~finer.any(-1), finer
        fan = leaf & ~(alone & (e.quad - e.worse <= 2 * price))
        if agreeing:
            fan = leaf & ~(alone & (e.quad - np.minimum(e.whole, e.split + price).sum(-1) <= 2 * price))
            for _ in range(2):  # fans that nobody agreed with may be better off as quads
                cut = agreed(e, fan, finer, price)
                fan &= cut.any(-1) | (e.quad - e.whole.sum(-1) > 2 * price)
        quad = leaf & ~fan
        triangles += 2 * int(quad.sum()) + int((4 + cut.sum(-1))[fan].sum())
        square += float(e.quad[quad].sum()) + float(np.where(cut, e.split, e.whole).sum(-1)[fan].sum())
    return triangles, square


def main():
    """Grow both trees for every price, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_map(parser)
    options.add_rendering(parser)
    args = parser.parse_args()
    scene = options.open_scene(args)
    heightmap, near_m = scene.heightmap, near_plane_m(scene.heightmap, args.near_m)
    view = ideal.view_of(scene.camera, args.size, near_m)
    with options.make_renderer(args, scene) as renderer:
        heights = renderer.terrain.filled.astype(np.float64)
    picture = reference.screen_scale(view, reference.world_m(heights, heightmap.spacing_m))
    measured = picture.seen & ~np.isnan(heightmap.heights)
    pixels_m = np.where(measured, picture.px_m / picture.depth_m, 0)
    top = max(1, int(max(heights.shape) - 2).bit_length())
    seen = ideal.nodes_in_picture(heights, heightmap.spacing_m, view)
    errors = [Errors(heights, pixels_m, level) for level in range(1, top + 1)]

    curves = []
    for agreeing in (False, True):
        curve = [drawn(errors, grow(errors, seen, price, agreeing), seen, price, agreeing) for price in PRICES]
        curves.append(np.array([(n, (square / measured.sum()) ** 0.5) for n, square in curve]))
    one, other = curves
    print(f"{'rms px':>10}{'triangles':>12}{'agreed':>12}{'share':>8}")
    for triangles, rms_px in one:
        fewer = np.exp(np.interp(-np.log(rms_px), -np.log(other[:, 1]), np.log(other[:, 0])))
        print(f"{rms_px:10.4f}{triangles:12,.0f}{fewer:12,.0f}{fewer / triangles:8.3f}")


if __name__ == "__main__":
    main()
