"""Shared by rings and quadtree: one record for each patch, and the shaders that turn it into triangles."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from ..camera.view import ViewBlock
from ..gpu import layout
from ..terrain import Terrain
from .selection import Selection


class OfPatches:
    """A `surface.Surface` of patches.

    Attributes
    ----------
    patches
        Records `layout.PATCH`.
    """

    stages: Mapping[str, str] = MappingProxyType(
        {"vertex": "mesh/patch.vert", "tess_control": "mesh/patch.tesc", "tess_evaluation": "mesh/patch.tese"}
    )
    defines: Mapping[str, object] = MappingProxyType({})
    on_heights = True
    mode = moderngl.PATCHES
    indices = None

    ctx: moderngl.Context
    terrain: Terrain
    view: ViewBlock
    patches: moderngl.Buffer
    draws: moderngl.Buffer

    @property
    def feed(self) -> list[tuple[Any, ...]]:
        """The vertex buffer: each patch is one vertex."""
        return [(self.patches, "4i4", "in_patch")]

    @cached_property
    def with_own_edges(self) -> OwnEdges:
        """The same patches without agreement on edges."""
        return OwnEdges(self)

    def chosen(self, selection: Selection) -> layout.Patches:
        """The patches of the last selection: the drawn ones, then the hidden ones."""
        size = (selection.patches + selection.hidden) * layout.PATCH.itemsize
        return layout.unpack_patches(np.frombuffer(self.patches.read(size) if size else b"", layout.PATCH))

    def bind(self) -> None:
        """Bind everything that the stages read."""
        self.terrain.bind()
        self.view.bind()


class OwnEdges:
    """A `surface.Surface`: each edge of a patch has the segments of that patch alone (glsl/mesh/patch.tesc).

    Attributes
    ----------
    agreed
        The patches with the edges that neighbours agreed on. Both surfaces share all buffers.
    """

    def __init__(self, agreed: OfPatches) -> None:
        self.agreed = agreed
        self.ctx = agreed.ctx
        self.terrain = agreed.terrain
        self.view = agreed.view
        self.stages = agreed.stages
        self.defines: Mapping[str, object] = {**agreed.defines, "OWN_EDGES": 1}
        self.on_heights = agreed.on_heights
        self.mode = agreed.mode
        self.indices = agreed.indices

    @property
    def feed(self) -> list[tuple[Any, ...]]:
        """A patch is one vertex."""
        return self.agreed.feed

    @property
    def draws(self) -> moderngl.Buffer:
        """Indirect draw commands."""
        return self.agreed.draws

    def bind(self) -> None:
        """Bind everything that the stages read."""
        self.agreed.bind()
