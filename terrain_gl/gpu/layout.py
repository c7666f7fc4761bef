"""Layouts of the GLSL blocks and buffer records as numpy dtypes, and sizes that depend on the map's size."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..basics.rect import nodes_along
from .gl import MOST_VERTICES
from .packing import ERROR_UNIT

MAX_LEVELS = 15  # a map of 16384 posts a side has levels 0 to 14
SIZES = 7  # patches have 2^0 to 2^6 segments a side
COUNT_TILE_LOG2 = 1  # log2 of the side, in nodes, of a tile of one class counter; one more on level 0, the cells
COUNT_TILE = 1 << COUNT_TILE_LOG2
CLASSES = 64  # error classes: glsl/blocks/terrain.glsl
WIDE_CLASSES = 4  # wide classes come first; narrow classes follow
NARROW_CLASSES = 56
NARROW_OCTAVES = 0.125  # octaves of a narrow class
LAST_OCTAVES = 1.75  # octaves of each of the last four classes
NARROW_CELLS = 16.0  # narrow classes begin at the width of this many cells of the map
SKY_TEXEL = 3  # in stores: cells along a side of a texel of the visible sky; each cell is two posts wide
MAX_WINDOWS = 16  # most windows around a page of a store; each is half as fine as the one before
FINE_LEVELS = 5  # one thread computes the errors of a node of at most this level; coarser nodes are cut into blocks
SECTORS = 1024  # of the horizon, all around the eye
# Places along a side of a cell that `verify.measure` compares. An odd number: where a cell is cut into 2^k parts, no
# place except the posts is a vertex. All are then at fifths of a part, where a bend is 24/25 of its top.
PLACES = 5
VOID = 1  # bits of a post's mark
WET = 2
HOLE = 4  # bits of a page's node: all its cells are holes
HOLED = 8  # at least one of its cells is a hole
CLASS_WORDS = CLASSES // 4  # words for a tile's counters, 8 bits each

# glsl/blocks/terrain.glsl
LEVEL = np.dtype(
    [
        ("size", "2i4"),
        ("first_node", "i4"),
        ("first_count", "i4"),
        ("first_page", "i4"),
        ("pad", "3i4"),
    ]
)
TERRAIN = np.dtype(
    [
        ("last_post", "2i4"),
        ("spacing_m", "2f4"),
        ("top_level", "i4"),
        ("low_m", "f4"),
        ("span_m", "f4"),
        ("has_voids", "i4"),
        ("beyond_m", "2f4"),
        ("pad", "2f4"),
        ("class_octaves", "4f4"),
        ("level", LEVEL, MAX_LEVELS),
    ]
)


def class_octaves(span_m: float, spacing_m: tuple[float, float]) -> np.ndarray:
    """Octaves from the span to the first narrow class; then octaves of one class above, among and below them."""
    cell_m = math.sqrt(spacing_m[0] * spacing_m[1])
    begin = max(2.0, math.log2(span_m / (NARROW_CELLS * cell_m)))
    return np.array([begin, begin / WIDE_CLASSES, NARROW_OCTAVES, LAST_OCTAVES], np.float32)


def class_limits_m(span_m: float, spacing_m: tuple[float, float]) -> np.ndarray:
    """Limits of all error classes in float32 metres, as the shaders compute them."""
    _, above, narrow, below = class_octaves(span_m, spacing_m)
    k = np.arange(1, CLASSES + 1, dtype=np.float32)
    octaves = np.minimum(k, np.float32(WIDE_CLASSES)) * above
    octaves += np.clip(k - WIDE_CLASSES, 0, NARROW_CLASSES, dtype=np.float32) * narrow
    octaves += np.maximum(k - WIDE_CLASSES - NARROW_CLASSES, np.float32(0)) * below
    return np.float32(span_m) * np.exp2(-octaves)


# glsl/error/nodes.glsl
NODE = np.dtype([("max_m", "f2"), ("rms_m", "f2")])
NODE_RANGE = np.dtype([("heights", "2u2")])  # lowest and highest; exchanged if there are voids


def unpack_nodes(records: np.ndarray, span_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Largest error and root mean square of records `NODE`, in metres, for a terrain with the block's `span_m`."""
    unit_m = span_m * ERROR_UNIT
    return records["max_m"].astype(np.float64) * unit_m, records["rms_m"].astype(np.float64) * unit_m


# glsl/blocks/view.glsl
VIEW = np.dtype(
    [
        ("clip_from_eye", "16f4"),
        ("right", "4f4"),
        ("up", "4f4"),
        ("forward", "4f4"),
        ("eye_post", "2i4"),
        ("eye_offset_m", "2f4"),
        ("half_extent", "2f4"),
        ("size_px", "2i4"),
        ("first_px", "2i4"),
        ("eye_z_m", "f4"),
        ("eye_z_rest_m", "f4"),
        ("focal_px", "f4"),
        ("tolerance_px", "f4"),
        ("metric", "i4"),
        ("cull", "i4"),
        ("bend_per_m", "f4"),
        ("sag_m", "f4"),
        ("bulge_m", "2f4"),
        ("piece_px", "4i4"),
        ("centre", "2f4"),
        ("aspect", "f4"),
        ("depth_span_m", "f4"),
        ("rounding_px", "4f4"),
    ]
)

# glsl/mesh/shape.glsl
PATCH = np.dtype([("corner", "2i4"), ("shape", "u4"), ("bound_px", "f4")])
EDGE_BITS = 11, 14, 17, 20  # first bit of each edge in a shape: west, north, east, south


class Patches(NamedTuple):
    """Decoded patch records, one entry a patch."""

    corner: np.ndarray  # (n, 2) column and row of the north-west post; may lie beyond the map
    side_log2: np.ndarray  # log2 of the posts along a side
    step_log2: np.ndarray  # log2 of the posts between vertices: negative if cells are cut
    edges_log2: np.ndarray  # (n, 4) log2 of the segments of the west, north, east and south edge
    bound_px: np.ndarray  # negative if the patch has no bound

    @property
    def size(self) -> np.ndarray:
        """Columns and rows of posts that each patch covers, (n, 1)."""
        return 1 << self.side_log2[:, None]


def shape_word(side_log2: int, step_log2: int, edges_log2: int) -> int:
    """The shape of a patch whose four edges have equally many segments."""
    return side_log2 | step_log2 + 16 << 5 | sum(edges_log2 << first for first in EDGE_BITS)


def unpack_patches(records: np.ndarray) -> Patches:
    """Decode records `PATCH`, (n,)."""
    shape = records["shape"].astype(np.int64)
    edges = np.stack([shape >> first & 7 for first in EDGE_BITS], -1)
    corner = records["corner"].astype(np.int64)
    return Patches(corner, shape & 31, (shape >> 5 & 63) - 16, edges, records["bound_px"].astype(float))


class Level(NamedTuple):
    """Sizes of one level of nodes, and where its entries begin in the tables; the first fields of `LEVEL`."""

    size: tuple[int, int]
    first_node: int
    first_count: int

    @property
    def nodes(self) -> int:
        """Number of nodes of the level."""
        return self.size[0] * self.size[1]

    @property
    def counts(self) -> tuple[int, int]:
        """Columns and rows of class counters."""
        return -(-self.size[0] // self.count_tile), -(-self.size[1] // self.count_tile)

    @property
    def count_tile(self) -> int:
        """Nodes along a side of the tile that one class counter covers."""
        return COUNT_TILE if self.first_count else 2 * COUNT_TILE


def levels_over(cols: int, rows: int, least_top: int = 1) -> list[Level]:
    """Levels of nodes over a map of cols × rows posts, from its cells to one node over the whole map.

    There are at least `least_top` levels above the cells.
    """
    top = max(least_top, (max(cols, rows) - 2).bit_length())
    levels: list[Level] = []
    node = count = 0
    for j in range(top + 1):
        size = (nodes_along(cols, j), nodes_along(rows, j))
        levels.append(Level(size, node, count))
        count += levels[j].counts[0] * levels[j].counts[1] * CLASS_WORDS
        if j:  # cells have no record
            node += levels[j].nodes
    return levels


# Sizes that shaders share with Python. The loader writes them into every shader.
DEFINES = {
    "MAX_LEVELS": MAX_LEVELS,
    "SIZES": SIZES,
    "MOST_VERTICES": MOST_VERTICES,
    "COUNT_TILE_LOG2": COUNT_TILE_LOG2,
    "CLASSES": CLASSES,
    "WIDE_CLASSES": WIDE_CLASSES,
    "NARROW_CLASSES": NARROW_CLASSES,
    "FINE_LEVELS": FINE_LEVELS,
    "SECTORS": SECTORS,
    "PLACES": PLACES,
    "MAX_WINDOWS": MAX_WINDOWS,
    "VOID": VOID,
    "WET": WET,
    "HOLE": HOLE,
    "HOLED": HOLED,
}

# glsl/lod/rings/rings.glsl
RING = np.dtype([("origin", "2i4"), ("blocks", "2i4"), ("level", "i4"), ("first_block", "i4"), ("pad", "2i4")])
RINGS = np.dtype(
    [("rings", "i4"), ("most_blocks", "i4"), ("first_stamp", "u4"), ("pad", "i4"), ("ring", RING, MAX_LEVELS)]
)

WORK = np.dtype([("groups", "u4"), ("one", "2u4"), ("count", "u4")])
RING_QUEUES = 8
RING_WORK = np.dtype(
    [
        ("round", WORK, 3),
        ("seen", WORK),
        ("all", WORK),
        ("leaves", WORK),
        ("queue", WORK, RING_QUEUES),
    ]
)
RING_BLOCK = np.dtype([("origin", "2i4"), ("unit_log2", "i4"), ("ring", "i4"), ("known_log2", "i4"), ("pad", "i4")])
LISTED = np.dtype([("leaf", "u4"), ("in_queue", "2u4"), ("stamp", "u4"), ("seen_block", "u4")])

# glsl/lod/rings/shapes.glsl
RING_SUMMARY = np.dtype(
    [
        ("count", "u4", 8),
        ("triangles", "u4"),
        ("splits", "u4"),
        ("worst_px", "f4"),
        ("blocks", "u4"),
        ("unagreed", "u4"),
        ("hidden", "u4"),
        ("written", "u4"),
        ("squares", "<u8"),
        ("land", "<u8"),
    ]
)
