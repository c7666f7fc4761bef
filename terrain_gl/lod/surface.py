"""Surfaces: the interface that all methods share. Pictures, exports and measurement use only this interface.

A surface is the shaders that compute the vertices, and the buffers that they read. A method's `select` fills the
buffers for a camera; the module `mesh` then draws the surface into a picture, captures its triangles, or draws it from
above.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import moderngl

if TYPE_CHECKING:
    from ..camera.view import ViewBlock
    from ..gpu.passes import Resources
    from ..terrain import Terrain


class Surface(Protocol):
    """One method's way to draw a terrain.

    Attributes
    ----------
    terrain, view
        The map, and the camera of the last selection.
    stages
        Shaders by stage, as `gpu.passes.DrawPass` takes them; the last one calls put_vertex() of glsl/mesh/vertex.glsl.
        Vertices lie on posts or between them.
    defines
        Macros of those stages.
    on_heights
        Whether vertices have the heights of the map, exact on posts and bilinear between them.
    mode
        `moderngl.PATCHES` or `moderngl.TRIANGLES`.
    feed
        Vertex buffers with their formats and attributes, as `Context.vertex_array` takes them.
    indices
        Index buffer, if there is one.
    draws
        Indirect draw commands, 20 bytes each.
    """

    ctx: moderngl.Context
    terrain: Terrain
    view: ViewBlock
    stages: Mapping[str, str]
    defines: Mapping[str, object]
    on_heights: bool
    mode: int

    @property
    def draws(self) -> moderngl.Buffer: ...

    @property
    def feed(self) -> Sequence[tuple[Any, ...]]: ...

    @property
    def indices(self) -> moderngl.Buffer | None: ...

    @property
    def resources(self) -> Resources:
        """Everything that the stages read."""
