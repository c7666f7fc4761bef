"""Patches that do not agree on edges: the mesh has cracks. It shows what agreement is for; nothing is certified.

Where two patches have different numbers of segments, the vertices of the finer one lie beside the straight edges of
the coarser one. From above the mesh is whole: a crack is a gap between two edges, one above the other.
"""

from dataclasses import replace

import numpy as np

from ..gpu import layout
from .patches import PatchSurface
from .selection import Selection


def with_cracks(selection: Selection) -> Selection:
    """The same patches without agreement on edges. It certifies nothing, and counts its cracks.

    A method without patches has no such edges: its mesh stays as it is, and its cracks are not counted.
    """
    surface = selection.surface
    if not isinstance(surface, PatchSurface):
        return replace(selection, certified_px=None)
    drawn = layout.Patches(*(each[: selection.patches] for each in surface.chosen(selection)))
    heightmap = surface.terrain.heightmap
    last = heightmap.cols - 1, heightmap.rows - 1
    return replace(
        selection,
        surface=surface.with_own_edges,
        certified_px=None,
        triangles=count_triangles(drawn, last),
        cracks=count_cracks(drawn, last),
    )


def count_cracks(patches: layout.Patches, last: tuple[int, int]) -> int:
    """Edges of patches on the map whose other side has more vertices: each is counted once, on its coarser side."""
    low, high = patches.corner, patches.corner + patches.size
    begin, end = np.maximum(low, 0), np.minimum(high, last)
    on_map = begin < end  # (n, 2): whether a part of the patch is on the map, along columns and along rows
    lines = np.stack([low[:, 0], low[:, 1], high[:, 0], high[:, 1]], -1)  # west, north, east, south
    limits = np.array([last[0], last[1], last[0], last[1]])
    inside = (lines > 0) & (lines < limits) & on_map[:, [1, 0, 1, 0]]
    own = patches.side_log2 - patches.step_log2
    return int(((patches.edges_log2 > own[:, None]) & inside).sum())


def count_triangles(patches: layout.Patches, last: tuple[int, int]) -> int:
    """Triangles of patches with their own edges, without those that have no area at the rims of the map."""
    step = np.exp2(patches.step_log2)[:, None]
    begin, end = np.maximum(patches.corner, 0), np.minimum(patches.corner + patches.size, last)
    first, after = np.floor((begin - patches.corner) / step), np.ceil((end - patches.corner) / step)
    across = np.maximum(after - first, 0).astype(np.int64)
    return int(2 * across.prod(1).sum())
