"""Geometry clipmaps: nested regular grids around the eye, each twice as coarse as the one inside it.

    ┌───────────────┐     Losasso, Hoppe 2004, "Geometry clipmaps: terrain rendering using nested regular grids",
    │   ┌───────┐   │     SIGGRAPH; Asirvatham, Hoppe 2005, "Terrain rendering using GPU-based geometry clipmaps",
    │   │ ┌───┐ │   │     GPU Gems 2, chapter 2.
    │   │ │eye│ │   │
    │   │ └───┘ │   │     A ring of level j has `ring` vertices a side, 2^j posts apart. Heights come from a
    │   └───────┘   │     filtered pyramid (pyramid.py); towards its border each ring blends into the coarser one
    └───────────────┘     (glsl/comparison/clipmap/ring.vert). Levels much smaller than the eye's height are left out.

The mesh depends on the position of the eye and not on the land, so a clipmap certifies no error. Rings are cut into
blocks, and blocks outside the picture are left out. Levels below 0 cut the cells of the map into parts. Their heights
are bilinear between posts. Our own methods have such vertices, too.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, NamedTuple

import numpy as np

from ..basics.exceptions import UsageError
from ..camera import Camera, boxes_in_picture
from ..gpu import layout
from ..gpu.buffer_pool import BufferPool
from ..gpu.passes import Feed, Resources
from ..heightmap import Heightmap
from ..lod import Goal, Selection
from ..lod.surface import MeshBuffers
from ..renderer.methods import Selectors
from .baselines import Baseline

SMALLEST_RING = 13
FINEST = -6  # the finest level: vertices are on 64ths of a post
FINEST_TRIED = -3  # the finest level that `candidates` tries
BLOCK = 8  # cells a side of a block
HIGH = 2.5  # a level is left out if its side is smaller than this times the eye's height above the ground
_DRAW = 1024  # most blocks in one draw command
_BLOCK = np.dtype([("cells", "4i4"), ("border", "4i4"), ("level", "i4")])
CLIPMAP = np.dtype(
    [("reach", "2f4"), ("transition", "2f4"), ("middle", "2i4"), ("middle_m", "2f4"), ("coarsest", "i4"), ("_", "3i4")]
)


@dataclass(frozen=True)
class Rings:
    """The parameters of a clipmap, which trade triangles for accuracy.

    Attributes
    ----------
    ring
        Vertices along a ring's side. If the number is even, some sides have one vertex more or less.
    finest
        The finest level; by default the first whose side is at least `HIGH` times the eye's height above the ground.
        If it is below 0, each side of a cell of the map is cut into 2^-finest parts.
    transition
        The part of a ring's side over which it blends into the coarser ring. GPU Gems 2 takes a tenth.
    """

    method: ClassVar[str] = "clipmap"
    ring: int = 255
    finest: int | None = None
    transition: float = 0.1

    def __post_init__(self) -> None:
        if not SMALLEST_RING <= self.ring < 2**20:
            raise UsageError(f"ring must be a number of vertices from {SMALLEST_RING} on, got {self.ring}")
        if self.finest is not None and not FINEST <= self.finest < layout.MAX_LEVELS:
            raise UsageError(f"finest level must be from {FINEST} to {layout.MAX_LEVELS - 1}, got {self.finest}")
        if not 0 <= self.transition <= 0.25:
            raise UsageError(f"transition must be from 0 to 0.25 of a ring's side, got {self.transition:g}")


class ClipmapRing(NamedTuple):
    """One level's part of the mesh: rectangles (west, north, east, south) of vertices on the level's lattice."""

    level: int
    outline: np.ndarray  # the whole ring, hole included
    hole: np.ndarray  # the part that the finer ring covers; without area if there is no finer ring
    border: np.ndarray  # the outline's sides next to a coarser ring; -1 for sides on the map's rim


def rings_of(heightmap: Heightmap, eye: tuple[float, ...], cells: np.ndarray, finest: int) -> list[ClipmapRing]:
    """The rings around an eye, from level `finest` up. `cells` is a ring's size: even numbers of columns and rows.

    The last ring is the first that covers the whole map.
    """
    last = np.array([heightmap.cols - 1, heightmap.rows - 1])
    at = np.array([0, last[1]]) + np.array([eye[0], -eye[1]]) / heightmap.spacing_m
    top = max(1, int(max(last) - 1).bit_length())
    rings = []
    hole = np.zeros(4, int)
    for level in range(min(finest, top), top + 1):
        rim = rim_of(last, level)
        low = 2 * np.round((at / 2**level - cells / 2) / 2).astype(int)
        high = low + cells
        if level == top:
            low, high = np.zeros(2, int), rim
        outline = np.concatenate([np.clip(low, 0, rim), np.clip(high, 0, rim)])
        if (outline[:2] < outline[2:]).all():
            border = np.where(np.concatenate([low > 0, high < rim]), outline, -1)
            rings.append(ClipmapRing(level, outline, hole, border))
            hole = np.concatenate([outline[:2] // 2, (outline[2:] + 1) // 2])
        if (low <= 0).all() and (high >= rim).all():
            break
    return rings


def rim_of(last: np.ndarray, level: int) -> np.ndarray:
    """Last column and row of a level's lattice, (2,); `last` are those of the posts."""
    return -(-last // 2**level) if level >= 0 else last * 2**-level


def blocks_of(ring: ClipmapRing) -> np.ndarray:
    """The ring's blocks, (n,) records of north-west vertex and size. Cuts are along every `BLOCK`-th lattice line.

    ┌─────────────┐
    ├───┬─────┬───┤     first, the ring around the hole is cut into four rectangles
    │   └─────┘   │
    └─────────────┘
    """
    west, north, east, south = ring.outline
    hole_west, hole_north, hole_east, hole_south = ring.hole
    parts = [(west, north, east, south)]
    if hole_west < hole_east:
        parts = [
            (west, north, east, hole_north),
            (west, hole_north, hole_west, hole_south),
            (hole_east, hole_north, east, hole_south),
            (west, hole_south, east, south),
        ]
    corners = np.concatenate([_cut(*part) for part in parts])
    blocks = np.zeros(len(corners), _BLOCK)
    blocks["cells"] = corners
    blocks["border"] = ring.border
    blocks["level"] = ring.level
    return blocks


def _cut(west: int, north: int, east: int, south: int) -> np.ndarray:
    """Blocks (n, 4) of a rectangle: column, row, columns, rows."""
    x, width = _spans(west, east)
    y, height = _spans(north, south)
    columns, rows = len(x), len(y)
    return np.stack([np.tile(x, rows), y.repeat(columns), np.tile(width, rows), height.repeat(columns)], -1)


def _spans(low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
    if low >= high:
        return np.zeros(0, int), np.zeros(0, int)
    cuts = np.concatenate([[low], np.arange((low // BLOCK + 1) * BLOCK, high, BLOCK), [high]])
    return cuts[:-1], np.diff(cuts)


def triangles_of(blocks: np.ndarray, rims: np.ndarray) -> np.ndarray:
    """Triangles of each block: two for each cell, minus one for each odd vertex of the border.

    Such a vertex moves onto its even neighbour (glsl/comparison/clipmap/ring.vert), and one triangle disappears.
    `rims` are the last column and row of each block's level. Vertices on the rim do not move.
    """
    x, y, width, height = blocks["cells"].T
    west, north, east, south = blocks["border"].T
    moved = [_odd_places(at, size, rim) for at, size, rim in ((x, width, rims[:, 0]), (y, height, rims[:, 1]))]
    along_x = (north == y).astype(int) + (south == y + height)
    along_y = (west == x).astype(int) + (east == x + width)
    return 2 * width * height - along_x * moved[0] - along_y * moved[1]


def _odd_places(at: np.ndarray, size: np.ndarray, rim: np.ndarray) -> np.ndarray:
    """How many odd numbers there are from at + 1 to at + size, without the rim."""
    end = at + size
    return (end + 1) // 2 - (at + 1) // 2 - ((end == rim) & (end % 2 == 1))


class Clipmap(Baseline):
    """A clipmap of a terrain."""

    stages: Mapping[str, str] = MappingProxyType({"vertex": "comparison/clipmap/ring.vert"})
    defines: Mapping[str, object] = MappingProxyType({"BLOCK": BLOCK})

    def __init__(self, selectors: Selectors) -> None:
        super().__init__(selectors)
        self._indices = self.ctx.buffer(_grid_indices().tobytes())
        self._described = BufferPool(self.ctx, CLIPMAP.itemsize)
        self._blocks = BufferPool(self.ctx, _BLOCK.itemsize)

    @property
    def bytes(self) -> int:
        """GPU memory of the blocks and their grid."""
        return self._indices.size + self._blocks.made_bytes + self.commands.made_bytes

    @property
    def resources(self) -> Resources:
        """Everything that the stages read, beside the buffers of a mesh."""
        return {**self.pyramid.resources, **self.view.resources}

    def choose(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the blocks in the picture."""
        rings: Rings = goal.parameters or Rings()
        settings = {"tolerance_px": goal.tolerance_px, "cull": goal.cull}
        self.view.write(self.terrain, camera, size, near_m, **settings)
        chosen, blocks = self._blocks_in(camera, size, near_m, rings, goal.cull)
        buffers = self._buffers_of(blocks, rings, chosen[-1].level)
        draws = -(-len(blocks) // _DRAW)
        most = 2 * BLOCK**2 * len(blocks)
        return Selection(self, buffers, settings, (len(blocks),), self._count(blocks), most, 0, None, draws)

    def candidates(
        self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, between: bool = False
    ) -> list[Rings]:
        """Few wide rings, or more and narrower rings, judged by each level's mean error over the map.

        Levels below 0 have vertices between posts. Candidates that miss the number by more than 2 per cent are left out
        if there are better ones.
        """
        found = []
        for finest in range(FINEST_TRIED if between else 0, len(self.terrain.levels)):
            rings, off = self._fit_ring(camera, size, near_m, triangles, finest)
            _, blocks = self._blocks_in(camera, size, near_m, rings, cull=True)
            found.append((max(off, 0.02), self._expected(camera, blocks), rings.finest, rings))
            if off > 0.02 and finest > 0:
                break  # at this level, even the whole map has fewer triangles
        best = min(found)[0]
        return [each[-1] for each in sorted(found) if each[0] == best]

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self._indices, self._described, self._blocks, self.commands):
            resource.release()

    def _fit_ring(
        self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, finest: int
    ) -> tuple[Rings, float]:
        """The ring size with about `triangles` triangles, from level `finest` up; and the relative difference."""

        def count(ring: int) -> int:
            return self._count(self._blocks_in(camera, size, near_m, Rings(ring, finest), cull=True)[1])

        low, high = SMALLEST_RING, 2 * SMALLEST_RING
        widest = 2 ** (len(self.terrain.levels) + 2)
        while high < widest and count(high) < triangles:  # step by step, because counting wide rings takes long
            low, high = high + 1, 2 * high
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if count(middle) >= triangles else (middle + 1, high)
        # the count does not always grow with the ring, because of culling
        near = range(max(SMALLEST_RING, low - 4), low + 5)
        off, ring = min((abs(count(ring) / triangles - 1), ring) for ring in near)
        return Rings(ring, finest), off

    def _expected(self, camera: Camera, blocks: np.ndarray) -> float:
        """Expected squared screen error: the mean over the blocks' area of (mean error of the level / distance)²."""
        low, high = self._boxes(blocks)
        nearest_m = self._spacing_m() * 2.0 ** blocks["level"]
        distance_m = np.maximum(np.linalg.norm((low + high) / 2 - camera.eye, axis=1), nearest_m)
        area = (high - low)[:, :2].prod(1)
        errors_m = self.pyramid.errors_m()[np.maximum(blocks["level"], 0)]
        return float((area * (errors_m / distance_m) ** 2).sum() / max(area.sum(), 1e-30))

    def _count(self, blocks: np.ndarray) -> int:
        last = np.array(self.pyramid.sizes[0]) - 1
        rims = np.array([rim_of(last, level) for level in range(FINEST, len(self.pyramid.sizes))])
        return int(triangles_of(blocks, rims[blocks["level"] - FINEST]).sum())

    def _finest(self, camera: Camera, ring: int) -> int:
        """The first level whose side is at least `HIGH` times the eye's height above the ground."""
        height = camera.eye[2] - self._ground_m(camera)
        return max(0, math.ceil(math.log2(max(HIGH * height, 1e-9) / ((ring - 1) * self._spacing_m()))))

    def _blocks_in(
        self, camera: Camera, size: tuple[int, int], near_m: float, rings: Rings, cull: bool
    ) -> tuple[list[ClipmapRing], np.ndarray]:
        finest = self._finest(camera, rings.ring) if rings.finest is None else rings.finest
        chosen = rings_of(self.terrain.heightmap, camera.eye, self._cells(rings.ring), finest)
        blocks = np.concatenate([blocks_of(each) for each in chosen])
        if cull:
            blocks = blocks[boxes_in_picture(camera, size, near_m, *self._boxes(blocks))]
        return chosen, blocks

    def _cells(self, ring: int) -> np.ndarray:
        """Number of columns and rows of a ring's cells, both even. Both sides have about the same length in metres."""
        half = (ring - 1) / 2 * self._spacing_m() / np.array(self.terrain.heightmap.spacing_m)
        # halves are rounded up on one axis only, so that the number of cells grows in small steps
        whole = np.floor(half + [0.5, 0.499]).astype(int)
        return 2 * np.maximum(whole, SMALLEST_RING // 2)

    def _spacing_m(self) -> float:
        return math.sqrt(math.prod(self.terrain.heightmap.spacing_m))

    def _ground_m(self, camera: Camera) -> float:
        """Height of the post nearest to the eye."""
        heightmap = self.terrain.heightmap
        col = round(np.clip(camera.eye[0] / heightmap.spacing_m[0], 0, heightmap.cols - 1))
        row = heightmap.rows - 1 - round(np.clip(camera.eye[1] / heightmap.spacing_m[1], 0, heightmap.rows - 1))
        return float(self.terrain.filled[row, col])

    def _boxes(self, blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World boxes around the blocks: smallest and largest corners, (n, 3) metres."""
        first = blocks["cells"][:, :2]
        last = blocks["cells"][:, :2] + blocks["cells"][:, 2:]
        step = blocks["level"]
        ranges = self.pyramid.ranges(first // BLOCK, step + BLOCK.bit_length() - 1)
        side = 2.0 ** step[:, None]
        # a vertex on a border may be moved by one place
        return self.terrain.boxes(first // 2 * 2 * side, last * side, ranges)

    def _buffers_of(self, blocks: np.ndarray, rings: Rings, coarsest: int) -> MeshBuffers:
        """Upload blocks, draw commands and the sizes of the rings. A block is an instance of one grid."""
        cells = self._cells(rings.ring)
        described = np.zeros((), CLIPMAP)
        described["reach"] = cells / 2
        described["coarsest"] = coarsest
        described["middle"], described["middle_m"], _ = self.view.eye
        # blending must begin outside the finer ring, whose border is half-way
        described["transition"] = np.clip(rings.transition * cells, 0.01, np.maximum(cells / 4 - 1.6, 0.01))
        commands = np.array(list(_commands(len(blocks))) or [(0,) * 5], "u4")
        kept = (pool.filled(data.tobytes()) for pool, data in ((self._described, described), (self._blocks, blocks)))
        owned = (*kept, self.commands.filled(commands.tobytes()))
        sizes, instances, drawn = (each.buffer for each in owned)
        feed = Feed([(instances, "4i4 4i4 1i4 /i", "in_cells", "in_border", "in_level")], self._indices)
        return MeshBuffers(owned, feed, drawn, {"Clipmap": sizes})


def _commands(blocks: int) -> Iterator[tuple[int, ...]]:
    for first in range(0, blocks, _DRAW):
        yield 6 * BLOCK**2, min(_DRAW, blocks - first), 0, 0, first


def _grid_indices() -> np.ndarray:
    """Two triangles for each cell of a block, counter-clockwise from above; diagonals run from north-west."""
    corner = np.add.outer(np.arange(BLOCK) * (BLOCK + 1), np.arange(BLOCK)).reshape(-1, 1)
    south, east = BLOCK + 1, 1
    return (corner + [0, south, south + east, 0, south + east, east]).astype("u4")
