"""Programs that colour pixels: one for each style and kind of pixels, compiled when it is first needed."""

from typing import Any, NamedTuple

import moderngl

from ..gpu import gl, shaders
from . import surroundings

KINDS = {"ANY": 0, "SKY": 1, "NEAR": 2, "MIXED": 3, "OPEN": 4}  # kinds of pixels: glsl/shade/kind.glsl


class Wanted(NamedTuple):
    """Settings that all programs which colour one picture share.

    Attributes
    ----------
    light
        Macros of the light.
    uniforms
        By name without `u_`. A program may lack some of them.
    edge
        The surroundings: `surroundings.NONE`, `PLAIN` or `WALLS`.
    exact
        Colours are linear light, or the data of the styles "normals" and "depth", for a target of floats.
    clear
        Alpha is 0 where there is only sky.
    """

    light: dict[str, object]
    uniforms: dict[str, Any]
    wet: bool = False
    edge: int = surroundings.NONE
    grained: bool = False
    contours: bool = False
    exact: bool = False
    clear: bool = False


class PixelPrograms:
    """The programs over a picture's pixels, which have a number of samples."""

    def __init__(self, ctx: moderngl.Context, samples: int) -> None:
        self.ctx = ctx
        self.samples = samples
        self._made: dict[tuple[object, ...], tuple[Any, Any]] = {}

    def __len__(self) -> int:
        return len(self._made)

    def of(self, fragment: str, kind: str, wanted: Wanted) -> tuple[Any, Any]:
        """The program of a fragment shader for one of `KINDS` with its uniforms set, and its vertex array.

        For the kind "MIXED", it is a compute shader over the listed pixels, without a vertex array.
        """
        light, uniforms, wet, edge, *extras = wanted
        if edge:  # then an eye that crosses the map's rim needs only a new program of shade/kind.frag, which is small
            edge = surroundings.OF_KIND.get(kind, edge)
        key = fragment, kind, wet, edge, *extras, *light.values()
        if key not in self._made:
            self._made[key] = self._compiled(fragment, kind, wanted._replace(edge=edge))
        program, vao = self._made[key]
        gl.write_uniforms(program, **uniforms)
        return program, vao

    def release(self) -> None:
        """Release GPU resources."""
        for program, vao in self._made.values():
            program.release()
            if vao:
                vao.release()
        self._made.clear()

    def _compiled(self, fragment: str, kind: str, wanted: Wanted) -> tuple[Any, Any]:
        defines: dict[str, object] = {"SAMPLES": self.samples, "WATER_LEVEL": wanted.wet, "PIXELS": KINDS[kind]}
        defines |= {"EDGE": wanted.edge, "GRAIN": wanted.grained, "CONTOURS": wanted.contours, **wanted.light}
        defines |= ({"EXACT": 1} if wanted.exact else {}) | {"CLEAR": wanted.clear}
        if kind == "MIXED":
            return shaders.compute(self.ctx, fragment, defines | {"LISTED": 1}), None
        program = shaders.program(self.ctx, vertex="shade/screen.vert", fragment=fragment, defines=defines)
        return program, self.ctx.vertex_array(program, [])
