"""Layouts of the GLSL blocks and buffer records as numpy dtypes, and the sizes that follow from a map's size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MAX_LEVELS = 15  # a map of 16384 posts a side has levels 0 to 14
TILE = 32  # nodes a side of the tile that one work group turns into patches
COUNT_TILE = 4  # nodes a side of the tile that one class counter stands for
CLASSES = 40  # error classes, half an octave each

# glsl/blocks/terrain.glsl
LEVEL = np.dtype(
    [
        ("size", "2i4"),
        ("first_node", "i4"),
        ("first_word", "i4"),
        ("tiles", "2i4"),
        ("first_tile", "i4"),
        ("first_count", "i4"),
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
        ("level", LEVEL, MAX_LEVELS),
    ]
)

# glsl/error/nodes.glsl
NODE = np.dtype([("max_m", "2f2"), ("rms_m", "2f2"), ("range", "2u2"), ("whole", "4u1"), ("split", "4u1")])

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
    ]
)

# glsl/mesh/lattice.glsl
PATCH = np.dtype([("corner", "2u2"), ("shape", "u4")])


class Level(NamedTuple):
    """Sizes of one level of the quadtree, and where it begins in the tables; fields as in `LEVEL`."""

    size: tuple[int, int]
    first_node: int
    first_word: int
    tiles: tuple[int, int]
    first_tile: int
    first_count: int

    @property
    def nodes(self) -> int:
        """Nodes of the level."""
        return self.size[0] * self.size[1]

    @property
    def words(self) -> int:
        """Words of 32 bits that hold one bit of each node, every row beginning a new one."""
        return -(-self.size[0] // 32) * self.size[1]

    @property
    def counts(self) -> tuple[int, int]:
        """Columns and rows of class counters."""
        return -(-self.size[0] // COUNT_TILE), -(-self.size[1] // COUNT_TILE)


def quadtree(cols: int, rows: int) -> list[Level]:
    """Levels of the quadtree over a map of cols × rows posts, from its cells to one node over all of it."""
    top = max(1, (max(cols, rows) - 2).bit_length())
    levels: list[Level] = []
    node = word = tile = count = 0
    for j in range(top + 1):
        size = (-(-(cols - 1) >> j), -(-(rows - 1) >> j))
        tiles = (-(-size[0] // TILE), -(-size[1] // TILE))
        levels.append(Level(size, node, word, tiles, tile, count))
        tile += tiles[0] * tiles[1]
        if j:  # cells have no error and do not split
            node += levels[j].nodes
            word += levels[j].words
            count += levels[j].counts[0] * levels[j].counts[1] * CLASSES // 2
    return levels


SIZES = 6  # patches have 2^0 to 2^5 segments a side

# glsl/lod/summary.glsl
SUMMARY = np.dtype(
    [
        ("count", "u4", 8),
        ("triangles", "u4"),
        ("splits", "u4"),
        ("worst_px", "f4"),
        ("price", "f4"),
        ("groups", "4u4", MAX_LEVELS),
        ("groups_of_words", "4u4"),
        ("cheap", "2f4"),
        ("dear", "2f4"),
        ("budget", "u4"),
        ("rounds", "u4"),
        ("side", "i4"),
        ("asked", "u4"),
    ]
)
