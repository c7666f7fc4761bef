"""Surfaces: the interface that all methods share. Pictures, exports and measurement use only this interface.

A surface is the shaders that compute the vertices. A method's `select` chooses a mesh for a camera: a
`selection.Selection`, with buffers of its own. The module `mesh` then draws it into a picture, captures its triangles,
or draws it from above.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import moderngl

from ..gpu.buffer_pool import OwnedBuffer
from ..gpu.passes import Feed, Resources

if TYPE_CHECKING:
    from ..camera.view import ViewBlock
    from ..terrain import Terrain


@dataclass(frozen=True)
class MeshBuffers:
    """What the GPU reads of one mesh. The buffers may be used again when nobody holds this object.

    Attributes
    ----------
    owned
        All buffers of this mesh.
    feed
        What feeds the vertex shader.
    commands
        Indirect draw commands, 20 bytes each.
    resources
        Further blocks, by name.
    """

    owned: tuple[OwnedBuffer, ...]
    feed: Feed
    commands: moderngl.Buffer
    resources: Resources = field(default_factory=dict)

    @property
    def patches(self) -> moderngl.Buffer:
        """The first vertex buffer; for a surface of patches, records `layout.PATCH`."""
        first: moderngl.Buffer = self.feed.buffers[0][0]
        return first


class Surface(Protocol):
    """One method's way to draw a terrain.

    Attributes
    ----------
    terrain, view
        The map, and the camera that looks at it.
    stages
        Shaders by stage, as `gpu.passes.DrawPass` takes them; the last calls put_vertex_between() (mesh/vertex.glsl).
        Vertices lie on posts or between them.
    defines
        Macros of those stages.
    on_heights
        Whether vertices have the heights of the map, exact on posts and bilinear between them.
    """

    ctx: moderngl.Context
    terrain: Terrain
    view: ViewBlock
    stages: Mapping[str, str]
    defines: Mapping[str, object]
    on_heights: bool

    @property
    def resources(self) -> Resources:
        """Everything that the stages read, beside the buffers of a mesh."""
