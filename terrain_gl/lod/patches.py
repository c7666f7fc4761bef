"""Patches: one record for each, and the shaders that turn it into triangles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, cast

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..camera.view import ViewBlock
from ..gpu import gl, layout
from ..gpu.buffer_pool import BufferPool, OwnedBuffer
from ..gpu.passes import Feed, Resources
from ..terrain import Terrain
from .goal import INFINITE_PX
from .selection import Selection
from .surface import MeshBuffers, Surface

# the output of the passes is read as storage, as commands, as vertices, as textures, and by Python
BARRIER = (
    moderngl.SHADER_STORAGE_BARRIER_BIT
    | moderngl.COMMAND_BARRIER_BIT
    | moderngl.VERTEX_ATTRIB_ARRAY_BARRIER_BIT
    | moderngl.BUFFER_UPDATE_BARRIER_BIT
    | moderngl.TEXTURE_FETCH_BARRIER_BIT
)


class PatchSurface:
    """A `surface.Surface` of patches."""

    stages: Mapping[str, str] = MappingProxyType(
        {"vertex": "mesh/patch.vert", "tess_control": "mesh/patch.tesc", "tess_evaluation": "mesh/patch.tese"}
    )
    defines: Mapping[str, object] = MappingProxyType({})
    on_heights = True
    cuts_edges = False  # whether neighbours may cut an edge into up to 64 segments

    ctx: moderngl.Context
    terrain: Terrain
    view: ViewBlock
    _patches: BufferPool  # of the records of all meshes
    _commands: BufferPool

    @cached_property
    def with_own_edges(self) -> Surface:
        """The same patches without agreement on edges."""
        return cast(Surface, OwnEdges(self))

    def chosen(self, selection: Selection) -> layout.Patches:
        """The patches of a selection: the drawn ones, then the hidden ones."""
        size = (selection.patches + selection.hidden) * layout.PATCH.itemsize
        data = selection.buffers.patches.read(size) if size else b""
        return layout.unpack_patches(np.frombuffer(data, layout.PATCH))

    def drawn(self, selection: Selection) -> np.ndarray:
        """Numbers of the patches that the commands of a selection draw."""
        data = selection.buffers.commands.read(selection.draws * gl.COMMAND_STRIDE) if selection.draws else b""
        spans = [np.arange(first, first + n) for n, _, first, *_ in np.frombuffer(data, "5u4").tolist()]
        return np.concatenate([np.zeros(0, int), *spans])

    def part_of(self, selection: Selection, kept: np.ndarray) -> Selection:
        """A mesh that draws only some patches of a selection, those with the numbers `kept`. Its counts are theirs."""
        size = (selection.patches + selection.hidden) * layout.PATCH.itemsize
        records = np.frombuffer(selection.buffers.patches.read(size), layout.PATCH)[np.sort(kept)]
        patches = layout.unpack_patches(records)
        counts = np.bincount(patches.side_log2 - patches.step_log2, minlength=layout.SIZES).tolist()
        commands = np.array([*commands_for(counts, self.most_vertices)], "u4")
        buffers = patch_buffers(self._patches.filled(records.tobytes()), self._commands.filled(commands.tobytes()))
        return replace(selection, buffers=buffers, draws=len(commands))

    @property
    def most_vertices(self) -> list[int]:
        """The most vertices of a patch of each size, as lod/place.glsl counts them."""
        return [(2**s + 1) ** 2 + more for s, more in enumerate(self._cut)]

    @property
    def _cut(self) -> list[int]:
        """For each size, how many more vertices a patch may have, because neighbours cut its edges."""
        return [4 * (64 - 2**s) if self.cuts_edges else 0 for s in range(layout.SIZES)]

    def selection_of(self, summary: np.void, buffers: MeshBuffers, settings: Mapping[str, Any]) -> Selection:
        """The mesh whose numbers are in a record `layout.RING_SUMMARY`."""
        counts = tuple(summary["count"][: layout.SIZES].tolist())
        draws = sum(-(-n // (gl.MOST_VERTICES // each)) for n, each in zip(counts, self.most_vertices, strict=True))
        most = sum(n * (2 * 4**s + more) for s, (n, more) in enumerate(zip(counts, self._cut, strict=True)))
        worst_px = float(summary["worst_px"])
        certified_px = worst_px if worst_px < INFINITE_PX else math.inf
        numbers = counts, int(summary["triangles"]), most, int(summary["splits"]), certified_px, draws
        return Selection(self, buffers, settings, *numbers)

    @property
    def resources(self) -> Resources:
        """Everything that the stages read."""
        return {**self.terrain.resources, **self.view.resources}

    def update(self, posts: Rect) -> None:
        """Follow an edit. There is nothing to do, because every selection reads the error tables again."""


def patch_buffers(patches: OwnedBuffer, commands: OwnedBuffer) -> MeshBuffers:
    """The buffers of a mesh of patches: records `layout.PATCH`, each a vertex, and draw commands."""
    feed = Feed([(patches.buffer, "4i4", "in_patch")], mode=moderngl.PATCHES)
    return MeshBuffers((patches, commands), feed, commands.buffer)


def commands_for(counts: Sequence[int], most_vertices: Sequence[int]) -> Iterator[tuple[int, int, int, int, int]]:
    """Draw commands for so many patches of each size; each command makes at most `gl.MOST_VERTICES` vertices."""
    first = 0
    for count, vertices in zip(counts, most_vertices, strict=True):
        most = gl.MOST_VERTICES // vertices
        for begin in range(0, count, most):
            yield min(most, count - begin), 1, first + begin, 0, 0
        first += count


class OwnEdges:
    """A `surface.Surface`: each edge of a patch has the segments of that patch alone (glsl/mesh/patch.tesc).

    Attributes
    ----------
    agreed
        The patches with the edges that neighbours agreed on. Everything but `defines` is theirs.
    """

    def __init__(self, agreed: PatchSurface) -> None:
        self.agreed = agreed
        self.defines = {**agreed.defines, "OWN_EDGES": 1}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.agreed, name)
