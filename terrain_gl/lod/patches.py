"""Patches: one record for each, and the shaders that turn it into triangles."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, cast

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..camera.view import ViewBlock
from ..gpu import gl, layout
from ..gpu.buffer_pool import OwnedBuffer
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

    @cached_property
    def with_own_edges(self) -> Surface:
        """The same patches without agreement on edges."""
        return cast(Surface, OwnEdges(self))

    def chosen(self, selection: Selection) -> layout.Patches:
        """The patches of a selection: the drawn ones, then the hidden ones."""
        size = (selection.patches + selection.hidden) * layout.PATCH.itemsize
        data = selection.buffers.patches.read(size) if size else b""
        return layout.unpack_patches(np.frombuffer(data, layout.PATCH))

    def selection_of(self, summary: np.void, buffers: MeshBuffers, settings: Mapping[str, Any]) -> Selection:
        """The mesh whose numbers are in a record `layout.RING_SUMMARY`."""
        counts = tuple(summary["count"][: layout.SIZES].tolist())
        cut = [4 * (64 - 2**s) if self.cuts_edges else 0 for s in range(layout.SIZES)]
        vertices = [(2**s + 1) ** 2 + more for s, more in enumerate(cut)]  # of a patch, as lod/place.glsl counts them
        draws = sum(-(-n // (gl.MOST_VERTICES // each)) for n, each in zip(counts, vertices, strict=True))
        most = sum(n * (2 * 4**s + more) for s, (n, more) in enumerate(zip(counts, cut, strict=True)))
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
