"""What can draw a terrain: the one shape that all methods have. Pictures, exports and measurement know no method.

A surface is shaders up to the last vertex, and what feeds them. Its `select` chooses triangles for a camera; `mesh`
takes what was selected into the picture, into a buffer, or looks at it from straight above.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import moderngl

if TYPE_CHECKING:
    from .terrain import Terrain
    from .view import View


class Surface(Protocol):
    """One method's way to draw a terrain.

    Attributes
    ----------
    terrain, view
        The map, and the camera that was selected for last.
    stages
        Shaders by stage, as `shaders.program` takes them; the last one ends in put_vertex() of glsl/mesh/vertex.glsl.
        Vertices stand on posts, or amid four.
    defines
        What those stages want defined.
    on_heights
        Whether vertices have the very heights of their posts.
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
    view: View
    stages: Mapping[str, str]
    defines: Mapping[str, object]
    on_heights: bool
    mode: int
    draws: moderngl.Buffer

    @property
    def feed(self) -> Sequence[tuple[Any, ...]]: ...

    @property
    def indices(self) -> moderngl.Buffer | None: ...

    def bind(self) -> None:
        """Make all that the stages read visible to them."""
