"""The mesh: the patches of a selection become triangles, in a picture or in a buffer.

A patch is drawn as one vertex. The control shader sets the tessellation levels. The evaluation shader puts vertices on
posts, and between posts where cells are cut (glsl/mesh/patch.tese). The last stage of every method ends with a call of
put_vertex_between() (glsl/mesh/vertex.glsl).
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from .basics.exceptions import TerrainError
from .gpu import gl
from .gpu.passes import NOTHING_MORE, DrawPass, Resources, State, Uniforms
from .lod import Selection
from .lod.surface import Surface
from .terrain import Terrain

MOST_CAPTURED = 2**31 - 1  # bytes; drivers count them in a signed 32-bit number, and crash if there are more
MOST_PATCH_VERTICES = 33**2 + 4 * 32  # of a patch of 32 segments whose edges have 64: lod/rings/place.comp
_VERTEX = np.dtype([("col", "f4"), ("row", "f4"), ("height_m", "f4")])


class MeshDraw:
    """A pass over a surface's triangles.

    Parameters
    ----------
    surface
        The surface to draw.
    to
        Where its vertices go: "PICTURE", "ABOVE" or "CAPTURE", as in glsl/mesh/to.glsl.
    varyings
        The outputs that a capture records for each vertex.
    defines
        Further macros.
    stages
        Further stages of the program, as `gpu.passes.DrawPass` takes them.
    """

    def __init__(
        self,
        surface: Surface,
        to: str,
        varyings: Sequence[str] = (),
        defines: Mapping[str, object] = MappingProxyType({}),
        **stages: str,
    ) -> None:
        self.ctx = surface.ctx
        self.surface = surface
        made_of = {"TO": to, **surface.terrain.defines, **surface.defines, **defines}
        self._pass = DrawPass(self.ctx, {**surface.stages, **stages}, made_of, varyings)

    def draw(
        self,
        selection: Selection,
        state: State,
        resources: Resources = NOTHING_MORE,
        uniforms: Uniforms = NOTHING_MORE,
        part: slice = slice(None),
    ) -> None:
        """Draw a selection, or a part of its commands; `resources` are those that the further stages read."""
        commands = range(selection.draws)[part]  # the whole map may be outside the picture
        mesh = selection.buffers
        read = {**self.surface.resources, **mesh.resources, **resources}
        self._pass.draw_indirect(state, read, uniforms, mesh.feed, mesh.commands, commands)

    def draw_hidden(self, selection: Selection, state: State) -> None:
        """Draw the patches that a selection leaves out because other land hides them."""
        at_once = gl.MOST_VERTICES // MOST_PATCH_VERTICES
        end = selection.patches + selection.hidden
        for first in range(selection.patches, end, at_once):
            number = min(at_once, end - first)
            self._pass.draw(state, self.surface.resources, NOTHING_MORE, selection.buffers.feed, number, first)

    def capture(self, selection: Selection, vertex_bytes: int) -> bytes:
        """The triangles that the GPU makes, as bytes: three vertices each."""
        if not selection.draws:
            return b""
        size = max(1, selection.most_triangles) * 3 * vertex_bytes
        if size > MOST_CAPTURED:
            raise TerrainError(f"{selection.triangles:,} triangles are too many to be captured: allow a larger error")
        out = self.ctx.buffer(reserve=size)
        mesh = selection.buffers
        read = {**self.surface.resources, **mesh.resources}
        try:
            triangles = self._pass.capture(out, read, NOTHING_MORE, mesh.feed, mesh.commands, selection.draws)
            return out.read(triangles * 3 * vertex_bytes)
        finally:
            out.release()

    def release(self) -> None:
        """Release GPU resources."""
        self._pass.release()


class MeshDraws:
    """One `MeshDraw` for each surface, made when it is first needed. Parameters are those of `MeshDraw`."""

    def __init__(self, to: str, defines: Mapping[str, object] = MappingProxyType({}), **stages: str) -> None:
        self._to = to
        self._defines = defines
        self._stages = stages
        self._made: dict[Surface, MeshDraw] = {}

    def of(self, surface: Surface) -> MeshDraw:
        """The `MeshDraw` for a surface."""
        if surface not in self._made:
            self._made[surface] = MeshDraw(surface, self._to, defines=self._defines, **self._stages)
        return self._made[surface]

    def release(self) -> None:
        """Release GPU resources."""
        while self._made:
            self._made.popitem()[1].release()


def vertex_heights(heights: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(...) float64 heights of vertices at (..., 2) columns and rows: heights of posts, bilinear between posts."""
    low = np.floor(places).astype(np.int64)
    west, north = np.moveaxis(low, -1, 0)
    east, south = np.moveaxis(np.ceil(places).astype(np.int64), -1, 0)
    s, t = np.moveaxis(places - low, -1, 0).astype(np.float64)
    upper = heights[north, west] * (1 - s) + heights[north, east] * s
    lower = heights[south, west] * (1 - s) + heights[south, east] * s
    between: np.ndarray = upper * (1 - t) + lower * t
    return between


def _stand_on_map(terrain: object, posts: np.ndarray, heights_m: np.ndarray) -> bool:
    """Whether vertices have the map's heights: exactly on posts, and up to rounding between posts.

    A paged map is not tested, because its posts may have heights of coarser pages.
    """
    if not isinstance(terrain, Terrain):
        return True
    relief_m = terrain.filled - np.float32(terrain.base_m)
    between = (posts != np.floor(posts)).any(-1)
    rounding_m = np.where(between, 2.0**-20 * np.abs(relief_m).max(initial=0.0), 0.0)
    return bool((np.abs(vertex_heights(relief_m, posts) - heights_m) <= rounding_m).all())


def captured_triangles(selection: Selection) -> tuple[np.ndarray, np.ndarray]:
    """Triangles as drawn, counter-clockwise seen from above; triangles without area are left out.

    Returns
    -------
    posts
        (n, 3, 2) float32 columns and rows of the triangles' corners. They are multiples of 1/64: whole numbers on
        posts, fractions where cells are cut (see `vertex_heights`).
    heights_m
        (n, 3) float32 metres above the terrain's base.

    Raises
    ------
    TerrainError
        The method puts vertices at the heights of the map, but the GPU drew a vertex at another height.
    """
    surface = selection.surface
    draw = MeshDraw(surface, "CAPTURE", varyings=("v_vertex",))
    try:
        data = draw.capture(selection, _VERTEX.itemsize)
    finally:
        draw.release()
    vertices = np.frombuffer(data, _VERTEX).reshape(-1, 3)
    posts = np.stack([vertices["col"], vertices["row"]], -1)
    if surface.on_heights and not _stand_on_map(surface.terrain, posts, vertices["height_m"]):
        raise TerrainError("the GPU drew vertices at wrong heights: this driver's tessellation is not exact")
    a, b, c = (64 * posts[:, i].astype(np.float64) for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return posts[area != 0], vertices["height_m"][area != 0]
