"""Passes that colour pixels: one for each style and kind of pixels, compiled when it is first needed."""

from typing import Any, NamedTuple

import moderngl

from ..camera.view import ViewBlock
from ..gpu.passes import ComputePass, DrawPass, Resources, State
from ..gpu.shaders import Defines
from . import surroundings

KINDS = {"ANY": 0, "SKY": 1, "NEAR": 2, "MIXED": 3, "OPEN": 4}  # kinds of pixels: glsl/shade/kind.glsl


class Wanted(NamedTuple):
    """Settings that all passes which colour one picture share.

    Attributes
    ----------
    light
        Macros of the light.
    uniforms
        By name without `u_`. A pass takes those that its shader declares.
    wet
        Whether there may be water: a level, or lakes and the sea of the map. Its code takes time where none is seen.
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


class PixelPasses:
    """The passes over the pixels of a view, which have a number of samples; `defines` are the macros of the map."""

    def __init__(self, view: ViewBlock, samples: int, defines: Defines) -> None:
        self.ctx = view.block.ctx
        self.samples = samples
        self._view = view
        self._defines = defines
        self._made: dict[tuple[object, ...], ComputePass | DrawPass] = {}

    def __len__(self) -> int:
        return len(self._made)

    def draw(self, fragment: str, kind: str, wanted: Wanted, state: State, offered: Resources) -> None:
        """Run a fragment shader over all pixels of one of `KINDS`; it takes what it declares of `offered`."""
        each = self._of(fragment, kind, wanted)
        assert isinstance(each, DrawPass)
        each.draw(state, *_taken(each, offered, wanted))

    def run_listed(self, fragment: str, wanted: Wanted, listed: moderngl.Buffer, offered: Resources) -> None:
        """Run the same code over the pixels of the kind "MIXED", which are in a list, as a compute shader."""
        each = self._of(fragment, "MIXED", wanted)
        assert isinstance(each, ComputePass)
        each.run_indirect(listed, *_taken(each, offered, wanted))

    def release(self) -> None:
        """Release GPU resources."""
        while self._made:
            self._made.popitem()[1].release()

    def _of(self, fragment: str, kind: str, wanted: Wanted) -> ComputePass | DrawPass:
        light, _, wet, edge, *extras = wanted
        if edge:  # then an eye that crosses the map's rim needs only a new program of shade/kind.frag, which is small
            edge = surroundings.OF_KIND.get(kind, edge)
        key = fragment, kind, self._view.is_orthographic, wet, edge, *extras, *light.values()
        if key not in self._made:
            self._made[key] = self._compiled(fragment, kind, wanted._replace(edge=edge))
        return self._made[key]

    def _compiled(self, fragment: str, kind: str, wanted: Wanted) -> ComputePass | DrawPass:
        defines: dict[str, object] = {"SAMPLES": self.samples, "WATER": wanted.wet, "PIXELS": KINDS[kind]}
        defines |= {"EDGE": wanted.edge, "GRAIN": wanted.grained, "CONTOURS": wanted.contours, **wanted.light}
        defines |= ({"EXACT": 1} if wanted.exact else {}) | {"CLEAR": wanted.clear}
        defines["PARALLEL"] = "true" if self._view.is_orthographic else "false"
        defines |= self._defines
        if kind == "MIXED":
            return ComputePass(self.ctx, fragment, defines | {"LISTED": 1})
        return DrawPass(self.ctx, {"vertex": "shade/screen.vert", "fragment": fragment}, defines)


def _taken(each: ComputePass | DrawPass, offered: Resources, wanted: Wanted) -> tuple[Resources, dict[str, Any]]:
    """What a shader declares of the resources and uniforms that a picture offers to all its shaders."""
    resources = {name: offered[name] for name in each.declares if name in offered}
    return resources, {name: wanted.uniforms[name] for name in each.declares_uniforms if name in wanted.uniforms}
