"""Clipmaps with hardware tessellation: nested rings of patches, whose edges are cut by their length on the screen.

    ┌───┬───┬───┬───┐     Song, Yang, Ji 2017, "Geometry clipmaps terrain rendering using hardware tessellation", IEICE
    ├───┼─┬─┼─┬─┼───┤     Transactions on Information and Systems E100-D (2); levels of edges after Cantlay 2011,
    │   ├─┼─┼─┼─┤   │     "DirectX 11 terrain tessellation", NVIDIA.
    ├───┼─┼─┼─┼─┼───┤
    │   ├─┼─┼─┼─┤   │     A patch of level j is patch · 2^j posts wide; a ring is `ring` patches a side. An edge between
    ├───┼─┴─┼─┴─┼───┤     two rings has as many segments as both finer edges beside it together
    └───┴───┴───┴───┘     (glsl/comparison/tessellated/levels.comp).

The mesh depends on the view and hardly on the land, so no error is certified.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, ClassVar

import moderngl
import numpy as np

from ..basics.exceptions import UsageError
from ..camera import Camera, boxes_in_picture
from ..gpu import gl
from ..gpu.buffer_pool import BufferPool, OwnedBuffer
from ..gpu.passes import ComputePass, Feed, Resources
from ..lod import Goal, Selection
from ..lod.surface import MeshBuffers
from ..renderer.methods import Selectors
from .baselines import Baseline
from .clipmap import ClipmapRing, rings_of

MOST = 32  # segments of an edge, as in glsl/comparison/tessellated/levels.comp
_PLACE = np.dtype([("at", "2i4"), ("level", "i4"), ("finer", "i4")])
MEASURES = np.dtype([("middle_m", "3f4"), ("edge", "f4"), ("middle", "2i4"), ("parts", "i4"), ("_", "i4")])
_BARRIER = (
    moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.VERTEX_ATTRIB_ARRAY_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT
)


@dataclass(frozen=True)
class Edges:
    """The parameters of a tessellated clipmap, which trade triangles for accuracy.

    Attributes
    ----------
    edge_px
        The target length of a triangle's edge on the screen.
    patch
        Posts along a side of the finest patches, a power of two.
    ring
        Patches along a ring's side, even.
    parts
        The most parts that a side of a cell of the map is cut into. The heights are bilinear between posts. With 1, all
        vertices are on posts.
    """

    method: ClassVar[str] = "tessellated"
    edge_px: float = 8.0
    patch: int = 16
    ring: int = 128
    parts: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.edge_px < 1e9:
            raise UsageError(f"edge must be more than 0 and less than 1e9 pixels, got {self.edge_px:g}")
        if self.patch not in (4, 8, 16, 32):
            raise UsageError(f"patch must be 4, 8, 16 or 32 posts, got {self.patch}")
        if self.ring % 2 or not 8 <= self.ring < 2**16:
            raise UsageError(f"ring must be an even number of patches from 8 on, got {self.ring}")
        if not 1 <= self.parts <= MOST:
            raise UsageError(f"parts of a cell must be from 1 to {MOST}, got {self.parts}")


_CANDIDATES = ((16, 128), (8, 128), (16, 64))  # posts along a patch, patches along a ring
_BETWEEN = ((16, 128), (8, 128), (4, 128))  # the same with vertices between posts: MOST segments a side of a patch
_TRIES = 30  # bisections of the range of edge lengths


def _patches_in_draw(edges: Edges) -> int:
    """Patches in one draw. Inner tessellation levels are means of opposite edges, and an edge may have two halves."""
    inner = MOST if edges.parts == 1 else 2 * MOST  # on posts, both halves together have no more segments than posts
    return gl.MOST_VERTICES // ((inner - 1) ** 2 + 4 * 2 * MOST)


def places_of(ring: ClipmapRing) -> np.ndarray:
    """The ring's patches, (n,) records: place on its lattice, and edges where the neighbour is finer.

    Edges are bits: west, north, east, south.
    """
    west, north, east, south = ring.outline
    hole = ring.hole
    x, y = (v.ravel() for v in np.meshgrid(np.arange(west, east), np.arange(north, south)))
    across, down = (x >= hole[0]) & (x < hole[2]), (y >= hole[1]) & (y < hole[3])
    finer = np.stack([(x == hole[2]) & down, (y == hole[3]) & across, (x == hole[0] - 1) & down])
    finer = np.vstack([finer, [(y == hole[1] - 1) & across]])
    places = np.zeros(len(x), _PLACE)
    places["at"] = np.stack([x, y], -1)
    places["level"] = ring.level
    places["finer"] = (finer << np.arange(4)[:, None]).sum(0)
    return places[~(across & down)]


class Tessellated(Baseline):
    """A tessellated clipmap of a terrain."""

    stages: Mapping[str, str] = MappingProxyType(
        {
            "vertex": "mesh/patch.vert",
            "tess_control": "comparison/tessellated/patch.tesc",
            "tess_evaluation": "comparison/tessellated/patch.tese",
        }
    )

    def __init__(self, selectors: Selectors) -> None:
        super().__init__(selectors)
        self._levels = ComputePass(self.ctx, "comparison/tessellated/levels.comp")
        self._places = self.ctx.buffer(reserve=_PLACE.itemsize)
        self._measures = BufferPool(self.ctx, MEASURES.itemsize)
        self._cuts = BufferPool(self.ctx, 16)
        self._count = self.ctx.buffer(reserve=4)

    @property
    def bytes(self) -> int:
        """GPU memory of the patches."""
        return self._places.size + self._cuts.made_bytes + self.commands.made_bytes

    @property
    def resources(self) -> Resources:
        """Everything that the stages read, beside the buffers of a mesh."""
        return {**self.pyramid.resources, **self.view.resources}

    def choose(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose and cut the patches in the picture."""
        edges: Edges = goal.parameters or Edges()
        places = self._look(camera, size, near_m, edges, goal)
        triangles, cuts, measures = self._cut(len(places), edges)
        most = _patches_in_draw(edges)
        commands = [(min(most, len(places) - first), 1, first, 0, 0) for first in range(0, len(places), most)]
        drawn = self.commands.filled(np.array(commands or [(0,) * 5], "u4").tobytes())
        feed = Feed([(cuts.buffer, "4u4", "in_patch")], mode=moderngl.PATCHES)
        buffers = MeshBuffers((cuts, measures, drawn), feed, drawn.buffer, {"Tessellated": measures.buffer})
        numbers = (len(places),), triangles, triangles + 4 * MOST * len(places), 0, None, len(commands)
        return Selection(self, buffers, _settings(goal), *numbers)

    def candidates(
        self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, between: bool = False
    ) -> list[Edges]:
        """Many small patches first, which fit the land better; then fewer large ones."""
        tried = [Edges(patch=n, ring=ring) for n, ring in _CANDIDATES]
        tried += [Edges(patch=n, ring=ring, parts=MOST // n) for n, ring in _BETWEEN] if between else []
        return [self._fit(camera, size, near_m, triangles, each) for each in tried]

    def _fit(self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, edges: Edges) -> Edges:
        """The length of edges that gives about `triangles` triangles in the picture."""
        patches = len(self._look(camera, size, near_m, edges, Goal()))
        short = 1e-3
        long = 1e6
        tried = []
        for _ in range(_TRIES):
            middle = replace(edges, edge_px=math.sqrt(short * long))
            count = self._cut(patches, middle)[0]
            tried.append((abs(count - triangles), middle))
            if abs(count - triangles) <= 0.002 * triangles:
                break
            short, long = (middle.edge_px, long) if count > triangles else (short, middle.edge_px)
        return min(tried, key=lambda each: each[0])[1]

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self._levels, self._measures, self._places, self._cuts, self._count, self.commands):
            resource.release()

    def _look(self, camera: Camera, size: tuple[int, int], near_m: float, edges: Edges, goal: Goal) -> np.ndarray:
        """Find the patches in the picture, and upload them and the view."""
        self.view.write(self.terrain, camera, size, near_m, **_settings(goal))
        cells = np.array([edges.ring, edges.ring])
        finest = edges.patch.bit_length() - 1
        rings = rings_of(self.terrain.heightmap, camera.eye, cells, finest)
        places = np.concatenate([places_of(ring) for ring in rings])
        if goal.cull:
            places = places[boxes_in_picture(camera, size, near_m, *self._boxes(places))]
        self._places = gl.at_least(self.ctx, self._places, places.nbytes)
        self._places.write(places.tobytes())
        return places

    def _boxes(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World boxes around the patches: smallest and largest corners, (n, 3) metres."""
        low = places["at"]
        level = places["level"]
        return self.terrain.boxes(low << level[:, None], low + 1 << level[:, None], self.pyramid.ranges(low, level))

    def _cut(self, patches: int, edges: Edges) -> tuple[int, OwnedBuffer, OwnedBuffer]:
        """Compute the levels of all edges; returns the number of triangles, the cut patches and their measures."""
        middle, offset_m, z_m = self.view.eye
        measures = np.array(((*offset_m, z_m), edges.edge_px / self.view.focal_px, middle, edges.parts, 0), MEASURES)
        cuts, measured = self._cuts.own(16 * patches), self._measures.filled(measures.tobytes())
        self._count.write(bytes(4))
        resources: Resources = {
            **self.terrain.resources,
            **self.view.resources,
            "Tessellated": measured.buffer,
            "Places": self._places,
            "Cuts": cuts.buffer,
            "Count": self._count,
        }
        self._levels.run((max(1, -(-patches // 64)), 1, 1), resources, {"patches": patches})
        self.ctx.memory_barrier(_BARRIER)
        return int(np.frombuffer(self._count.read(), "u4")[0]), cuts, measured


def _settings(goal: Goal) -> dict[str, Any]:
    return {"tolerance_px": goal.tolerance_px, "cull": goal.cull}
