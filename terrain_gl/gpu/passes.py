"""Passes: a shader with its macros, and everything that a run of it reads, writes and needs.

    reduce = ComputePass(ctx, "sat/reduce.comp", {"BITS": 32})
    reduce.run((groups, 1, 1), {"Words": words, "StripSums": sums}, {"first": 0, "length": 300})

    shading = DrawPass(ctx, {"vertex": "shade/screen.vert", "fragment": "shade/lambert.frag"}, {"SAMPLES": 4})
    shading.draw(State(framebuffer, depth="=="), terrain.resources | view.resources, {"sun": (0, 0, 1)})

Nothing is left from before. A run names all its resources by the names that they have in GLSL: storage blocks, uniform
blocks, samplers and images; and all its uniforms, without their `u_`. It binds each of them, with the default sampler,
to the number that the shader declares. A draw also sets all state of OpenGL that affects it. A name that the shader's
text does not declare is an error, and so is a name that the compiled program uses and the run does not give. So an
object that holds resources, such as a terrain, gives all of them (`resources`) to all passes over it.

A program is compiled once in a context: passes with the same text, also of several renderers, share it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from ctypes import byref, c_int
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations
from operator import methodcaller
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias
from weakref import WeakKeyDictionary, WeakValueDictionary

import moderngl

from ..basics.exceptions import TerrainError
from . import gl, shaders
from .calls import calls
from .current import check_current
from .shaders import NO_DEFINES, Defines, ShaderError

Resource: TypeAlias = "moderngl.Buffer | moderngl.Texture | moderngl.TextureArray | gl.WordTexture"
Resources: TypeAlias = Mapping[str, Resource]
Uniforms: TypeAlias = Mapping[str, Any]
Box: TypeAlias = tuple[int, int, int, int]
NOTHING_MORE: Mapping[str, Any] = MappingProxyType({})
COMMAND_STRIDE = 20  # bytes between indirect commands, as in moderngl's render_indirect

# layout(std430, binding = 1) readonly buffer Boxes { ...
# layout(r32f, binding = 0) uniform writeonly image2D u_out;
# uniform vec2 u_size;
_DECLARATION = re.compile(
    r"\b(?P<storage>uniform|buffer)\s+(?P<after>(?:\w+\s+)*?)(?P<names>\w+(?:\s*,\s*\w+)*)\s*(?P<end>[{;[])"
)
_OPAQUE = ("image", "sampler", "PER_SAMPLE")  # words in types of resources; the last is a macro of glsl/shade/seen.glsl

_COMPARISONS = {"<": 0x201, "==": 0x202, "<=": 0x203, ">": 0x204, "!=": 0x205, ">=": 0x206, "1": 0x207}
_DEPTH_TEST, _DEPTH_CLAMP, _CULL_FACE, _BLEND, _SCISSOR_TEST = 0x0B71, 0x864F, 0x0B44, 0x0BE2, 0x0C11
_RASTERIZER_DISCARD, _MULTISAMPLE, _CLIP_DISTANCE0, _PATCH_VERTICES = 0x8C89, 0x809D, 0x3000, 0x8E72
_OFF = (  # what no pass uses
    0x0B90,  # STENCIL_TEST
    0x0BF2,  # COLOR_LOGIC_OP
    0x2A01,  # POLYGON_OFFSET_POINT
    0x2A02,  # POLYGON_OFFSET_LINE
    0x8037,  # POLYGON_OFFSET_FILL
    0x0B20,  # LINE_SMOOTH
    0x0B41,  # POLYGON_SMOOTH
    0x8F9D,  # PRIMITIVE_RESTART
    0x8D69,  # PRIMITIVE_RESTART_FIXED_INDEX
    0x809E,  # SAMPLE_ALPHA_TO_COVERAGE
    0x809F,  # SAMPLE_ALPHA_TO_ONE
    0x80A0,  # SAMPLE_COVERAGE
    0x8E51,  # SAMPLE_MASK
    0x8C36,  # SAMPLE_SHADING
    0x8DB9,  # FRAMEBUFFER_SRGB
)
_DITHER = 0x0BD0
_DRAW_BUFFER0 = 0x8825
_COLOR_ATTACHMENT0, _FRAMEBUFFER, _INDIRECT_BUFFER, _FEEDBACK_BUFFER = 0x8CE0, 0x8D40, 0x8F3F, 0x8C8E
_TRIANGLES, _UNSIGNED_INT, _COLOR, _DEPTH = 0x0004, 0x1405, 0x1800, 0x1801


class Declaration(NamedTuple):
    """A name that a shader's text declares."""

    kind: str  # "uniform", "uniform block", "storage block", "sampler" or "image"
    read: bool  # whether shaders read it, and whether they write it
    write: bool


@cache
def declarations(text: str) -> dict[str, Declaration]:
    """All uniforms, blocks, samplers and images in a text, also those that macros leave out, by name."""
    found = _DECLARATION.finditer(text)
    return {name.strip(): _declaration(match) for match in found for name in match["names"].split(",")}


def _declaration(match: re.Match[str]) -> Declaration:
    before = match.string[: match.start()].rpartition("\n")[2].rpartition(";")[2]
    words = (before.rpartition(")")[2] + " " + match["after"]).split()
    types = [word for opaque in _OPAQUE for word in words if opaque in word]
    kind = "uniform" if not types else "image" if "image" in types[0] else "sampler"
    if match["end"] == "{":
        kind = "storage block" if match["storage"] == "buffer" else "uniform block"
    return Declaration(kind, "writeonly" not in words, "readonly" not in words)


@dataclass(frozen=True)
class State:
    """The state of OpenGL in which a draw differs from others. All other state is the same in every draw.

    Attributes
    ----------
    framebuffer
        Where to draw; None if nothing is drawn.
    viewport, scissor
        Column and row of the lower left corner, width, height. By default, the whole framebuffer, and no scissor.
    depth
        How depths are compared, as in OpenGL: "<", ">=", "==" and so on, or "1" for always. Depths that pass are
        written. By default, there is no depth test. Clip-space depth runs from 0 to 1, as reversed depth needs.
    least_depth
        Depths of fragments are clamped to the range from here to 1; by default, triangles are clipped instead.
    clips
        Whether shaders cut triangles by gl_ClipDistance[0].
    culls
        Whether triangles that are clockwise on screen are left out.
    colours
        How many of the framebuffer's colours the shader writes, the first ones; by default all.
    blends, stays_opaque
        Whether colours are mixed by their alpha; and whether the picture below then keeps its own alpha of 1.
    """

    framebuffer: moderngl.Framebuffer | None
    viewport: Box | None = None
    scissor: Box | None = None
    depth: str | None = None
    least_depth: float | None = None
    clips: bool = False
    culls: bool = False
    blends: bool = False
    stays_opaque: bool = False
    colours: int | None = None


@dataclass(frozen=True, eq=False)
class Feed:
    """What feeds a vertex shader.

    Attributes
    ----------
    buffers
        Vertex buffers with their formats and attributes, as `Context.vertex_array` takes them.
    indices, index_bytes
        Index buffer, if there is one, and bytes of an index.
    mode
        `moderngl.TRIANGLES`, or `moderngl.PATCHES` of one vertex each, or `moderngl.LINES` and so on.
    """

    buffers: Sequence[tuple[Any, ...]] = ()
    indices: moderngl.Buffer | None = None
    index_bytes: int = 4
    mode: int = moderngl.TRIANGLES


_KEPT_ARRAYS = 4
SCREEN = Feed()  # the vertex shader makes vertices from their numbers


class _Compiled:
    """A program and the values of its uniforms, for all passes of a context with the same text."""

    def __init__(self, program: Any) -> None:
        self.program = program
        self.values: dict[str, Any] = {}  # of the last run, because writing takes long
        self.users = 0


_compiled: WeakKeyDictionary[moderngl.Context, WeakValueDictionary[tuple[str, ...], _Compiled]] = WeakKeyDictionary()


class _Pass:
    """A program, and the names that it declares and uses. `make` compiles it, if no pass has the same `texts`."""

    def __init__(self, ctx: moderngl.Context, make: Callable[[], Any], where: str, texts: tuple[str, ...]) -> None:
        self.ctx = ctx
        made = _compiled.setdefault(ctx, WeakValueDictionary())
        self._compiled = made.get(texts) or _Compiled(make())
        made[texts] = self._compiled
        self._compiled.users += 1
        self._is_released = False
        self._forget = partial(made.pop, texts, None)
        self._program = program = self._compiled.program
        self._values = self._compiled.values
        self._where = where
        self._calls = calls(ctx)
        self._binders: dict[str, Callable[[Any], None]] = {}
        self._uniforms: set[str] = set()
        places: dict[tuple[str, int], list[str]] = {}
        known = declarations("".join(texts))
        for name in program:
            member = program[name]
            if not isinstance(member, moderngl.Uniform | moderngl.UniformBlock | moderngl.StorageBlock):
                continue  # attributes and varyings
            kind = known[name].kind
            if kind == "uniform":
                self._uniforms.add(name.removeprefix("u_"))
                continue
            number = self._unit(member) if isinstance(member, moderngl.Uniform) else int(member.binding)
            self._binders[name] = self._binder(known[name], number)
            places.setdefault((kind, number), []).append(name)
        self._shared = [pair for names in places.values() for pair in combinations(names, 2)]
        self.uses = frozenset(self._binders)
        self.declares = frozenset(name for name, (kind, *_) in known.items() if kind != "uniform")
        self.declares_uniforms = frozenset(
            name.removeprefix("u_") for name, (kind, *_) in known.items() if kind == "uniform"
        )

    def release(self) -> None:
        """Release GPU resources, those of the program with the last pass that has it."""
        if self._is_released:
            return
        self._is_released = True
        self._compiled.users -= 1
        if not self._compiled.users:
            self._forget()
            self._program.release()

    def _prepare(self, resources: Resources, uniforms: Uniforms) -> None:
        """Bind all resources, and set all uniforms.

        Raises
        ------
        ShaderError
            A name is unknown or missing, or two different resources have the same place.
        """
        check_current(self.ctx)
        _check(self._where, "resources", resources, self._binders.keys(), self.declares)
        _check(self._where, "uniforms", uniforms, self._uniforms, self.declares_uniforms)
        for one, other in self._shared:
            if resources[one] is not resources[other]:
                raise ShaderError(f"{self._where}: {one} and {other} have the same binding point")
        for name, bind in self._binders.items():
            bind(resources[name])
        for name in self._uniforms:
            value = uniforms[name]
            if name not in self._values or self._values[name] != value:
                is_array_of_one = isinstance(value, list) and len(value) == 1  # to moderngl, it is no array
                self._program[f"u_{name}"] = value[0] if is_array_of_one else value
                self._values[name] = value

    def _unit(self, member: moderngl.Uniform) -> int:
        """The unit of a sampler or an image; moderngl does not know those of all types."""
        found = c_int()
        self._calls.GetUniformiv(self._program.glo, member.location, byref(found))
        return found.value

    def _binder(self, declared: Declaration, number: int) -> Callable[[Any], None]:
        """A function that binds a resource to a number."""
        kind, read, write = declared
        if kind == "storage block":
            return methodcaller("bind_to_storage_buffer", number)
        if kind == "uniform block":
            return methodcaller("bind_to_uniform_block", number)
        if kind == "image":
            return lambda texture: texture.bind_to_image(number, read=read, write=write)

        def use(texture: Any) -> None:
            self._calls.BindSampler(number, 0)  # the texture's own filter, not that of a sampler object
            texture.use(number)

        return use


def _check(where: str, what: str, given: Mapping[str, Any], used: Set[str], declared: frozenset[str]) -> None:
    if not given.keys() <= declared:
        raise ShaderError(f"{where} has no {what} {_list(given.keys() - declared)}; it declares {_list(declared)}")
    if not used <= given.keys():
        raise ShaderError(f"{where} also reads the {what} {_list(used - given.keys())}")


def _list(names: Set[str]) -> str:
    return ", ".join(sorted(names)) or "none"


class ComputePass(_Pass):
    """A compute shader with its macros.

    Parameters
    ----------
    path
        The file in glsl/.
    defines
        Its macros.
    """

    def __init__(self, ctx: moderngl.Context, path: str, defines: Defines = NO_DEFINES) -> None:
        text = shaders.source(path, defines)
        super().__init__(ctx, lambda: shaders.compute(ctx, path, defines), f"glsl/{path}", (text,))

    def run(self, groups: Sequence[int], resources: Resources, uniforms: Uniforms = NOTHING_MORE) -> None:
        """Run some `groups` of threads along x, y and z. The caller sets the memory barrier after it."""
        self._prepare(resources, uniforms)
        self._program.run(*groups)

    def run_indirect(
        self, commands: moderngl.Buffer, resources: Resources, uniforms: Uniforms = NOTHING_MORE, offset: int = 0
    ) -> None:
        """Run the groups whose numbers are in a buffer, `offset` bytes from its beginning."""
        self._prepare(resources, uniforms)
        self._program.run_indirect(commands, offset)


class DrawPass(_Pass):
    """A program over triangles, with its macros.

    Parameters
    ----------
    stages
        Files in glsl/ by stage: vertex, tess_control, tess_evaluation, geometry, fragment.
    defines
        The macros of all stages.
    varyings
        The outputs that `capture` records for each vertex.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        stages: Mapping[str, str],
        defines: Defines = NO_DEFINES,
        varyings: Sequence[str] = (),
    ) -> None:
        where = " + ".join(f"glsl/{path}" for path in stages.values())
        texts = *stages, *varyings, *(shaders.source(path, defines) for path in stages.values())
        super().__init__(ctx, lambda: shaders.program(ctx, **stages, defines=defines, varyings=varyings), where, texts)
        self._made: dict[tuple[int, ...], tuple[moderngl.VertexArray, list[Any]]] = {}

    def draw(
        self,
        state: State,
        resources: Resources,
        uniforms: Uniforms = NOTHING_MORE,
        feed: Feed = SCREEN,
        vertices: int = 3,
        first: int = 0,
        instances: int = 1,
    ) -> None:
        """Draw some `vertices`, or indices, from `first` on, for each of some instances."""
        self._begin(state, resources, uniforms)
        self._vertex_array(feed).render(feed.mode, vertices, first=first, instances=instances)

    def draw_indirect(
        self,
        state: State,
        resources: Resources,
        uniforms: Uniforms,
        feed: Feed,
        commands: moderngl.Buffer,
        part: range,
    ) -> None:
        """Draw a `part` of the commands in a buffer.

        A command has 20 bytes: vertex count, instances, first vertex, first instance, unused; or with indices: index
        count, instances, first index, base vertex, first instance.
        """
        if part:
            self._begin(state, resources, uniforms)
            self._vertex_array(feed).render_indirect(commands, feed.mode, count=len(part), first=part.start)

    def capture(
        self,
        out: moderngl.Buffer,
        resources: Resources,
        uniforms: Uniforms,
        feed: Feed,
        commands: moderngl.Buffer,
        count: int,
    ) -> int:
        """Record the triangles that the GPU makes in `out`, by transform feedback; returns their number.

        The pass's `varyings` are written for three vertices a triangle. `commands` are those of `draw_indirect`.

        Raises
        ------
        TerrainError
            `out` is too small for all triangles.
        """
        vao = self._vertex_array(feed)
        call = self._calls
        with _nowhere(self.ctx) as nowhere:
            self._begin(State(nowhere), resources, uniforms)
            call.Enable(_RASTERIZER_DISCARD)
            call.UseProgram(self._program.glo)
            call.BindVertexArray(vao.glo)
            call.BindBufferBase(_FEEDBACK_BUFFER, 0, out.glo)
            call.BindBuffer(_INDIRECT_BUFFER, commands.glo)
            try:
                with gl.triangles_made(self.ctx) as made, gl.triangles_written(self.ctx) as written:
                    call.BeginTransformFeedback(_TRIANGLES)  # moderngl's draws would call glUseProgram: an error now
                    if feed.indices is None:
                        call.MultiDrawArraysIndirect(feed.mode, 0, count, COMMAND_STRIDE)
                    else:
                        call.MultiDrawElementsIndirect(feed.mode, _UNSIGNED_INT, 0, count, COMMAND_STRIDE)
                    call.EndTransformFeedback()
            finally:
                call.Disable(_RASTERIZER_DISCARD)
                call.BindBufferBase(_FEEDBACK_BUFFER, 0, 0)
        if written.value < made.value:
            raise TerrainError(f"capture buffer too small: holds {written.value} of {made.value} triangles")
        return written.value

    def release(self) -> None:
        """Release GPU resources."""
        self._let_go()
        super().release()

    def _begin(self, state: State, resources: Resources, uniforms: Uniforms) -> None:
        self._prepare(resources, uniforms)
        _set(self.ctx, state)

    def _vertex_array(self, feed: Feed) -> moderngl.VertexArray:
        """The vertex array over the feed's buffers. Those of a few feeds are kept, because meshes take turns."""
        fed = [feed.indices, *(each[0] for each in feed.buffers)]
        key = tuple(map(id, fed))
        if key not in self._made:
            if len(self._made) == _KEPT_ARRAYS:
                self._let_go()
            array = self.ctx.vertex_array(
                self._program, list(feed.buffers), index_buffer=feed.indices, index_element_size=feed.index_bytes
            )
            self._made[key] = array, fed  # `fed` keeps the buffers' numbers from being used again
        return self._made[key][0]

    def _let_go(self) -> None:
        while self._made:
            self._made.popitem()[1][0].release()


def clear(framebuffer: moderngl.Framebuffer, depth: float | None = None, colour: Sequence[float] | None = None) -> None:
    """Fill a framebuffer's depths, its first colours (red, green, blue, alpha), or both."""
    ctx = framebuffer.ctx
    _set(ctx, State(framebuffer))
    call = calls(ctx)
    if depth is not None:
        call.DepthMask(1)
        call.ClearBufferfv(_DEPTH, 0, gl.floats(depth))
    if colour is not None:
        call.ClearBufferfv(_COLOR, 0, gl.floats(*colour))


def _set(ctx: moderngl.Context, state: State) -> None:
    """Set all state that affects a draw. moderngl knows nothing of it: its own record stays that of the caller."""
    call = calls(ctx)
    framebuffer = state.framebuffer
    assert framebuffer
    call.BindFramebuffer(_FRAMEBUFFER, framebuffer.glo)
    if framebuffer.glo:
        attached = len(framebuffer.color_attachments) if state.colours is None else state.colours
        call.DrawBuffers(attached, gl.numbers(*range(_COLOR_ATTACHMENT0, _COLOR_ATTACHMENT0 + attached)))
    call.Viewport(*(state.viewport or (0, 0, *framebuffer.size)))
    _switch(call, _SCISSOR_TEST, state.scissor is not None)
    if state.scissor:
        call.Scissor(*state.scissor)
    _switch(call, _DEPTH_TEST, state.depth is not None)
    call.DepthFunc(_COMPARISONS[state.depth or "1"])
    call.DepthMask(1)
    _switch(call, _DEPTH_CLAMP, state.least_depth is not None)
    call.DepthRangef(state.least_depth or 0.0, 1.0)
    if call.has_clip_control:
        call.ClipControl(0x8CA1, 0x935F)  # LOWER_LEFT, ZERO_TO_ONE
    for i in range(8):
        _switch(call, _CLIP_DISTANCE0 + i, state.clips and not i)
    _switch(call, _CULL_FACE, state.culls)
    call.CullFace(0x0405)  # BACK
    call.FrontFace(0x0901)  # CCW
    _switch(call, _BLEND, state.blends)
    # SRC_ALPHA or ONE, ONE_MINUS_SRC_ALPHA
    call.BlendFuncSeparate(0x0302, 0x0303, 0x0001 if state.stays_opaque else 0x0302, 0x0303)
    call.BlendEquation(0x8006)  # FUNC_ADD
    call.ColorMask(1, 1, 1, 1)
    call.PolygonMode(0x0408, 0x1B02)  # FRONT_AND_BACK, FILL
    call.ProvokingVertex(0x8E4E)  # LAST_VERTEX_CONVENTION
    call.PatchParameteri(_PATCH_VERTICES, 1)
    call.Enable(_MULTISAMPLE)
    call.Enable(_DITHER)
    call.Disable(_RASTERIZER_DISCARD)
    for each in _OFF:
        call.Disable(each)


def _switch(call: Any, what: int, on: bool) -> None:
    (call.Enable if on else call.Disable)(what)


@contextmanager
def _nowhere(ctx: moderngl.Context) -> Iterator[moderngl.Framebuffer]:
    """A framebuffer of one pixel: drivers need a complete one even if nothing is drawn."""
    pixels = ctx.renderbuffer((1, 1))
    framebuffer = ctx.framebuffer([pixels])
    try:
        yield framebuffer
    finally:
        framebuffer.release()
        pixels.release()


@contextmanager
def drawn_colours_kept(framebuffer: moderngl.Framebuffer) -> Iterator[None]:
    """Give a framebuffer of the caller back the colours that it draws to: this choice is a part of the framebuffer."""
    call = calls(framebuffer.ctx)
    found = [c_int() for _ in range(8)]
    call.BindFramebuffer(_FRAMEBUFFER, framebuffer.glo)
    for i, each in enumerate(found):
        call.GetIntegerv(_DRAW_BUFFER0 + i, byref(each))
    try:
        yield
    finally:
        call.BindFramebuffer(_FRAMEBUFFER, framebuffer.glo)
        if framebuffer.glo:
            call.DrawBuffers(len(found), gl.numbers(*(each.value for each in found)))
