"""A good guest: in contexts, threads and processes of others, pictures are right and everything is as it was."""

import contextlib
import ctypes
import os
from concurrent.futures import ThreadPoolExecutor

import moderngl
import numpy as np
import pytest
from maps import rough
from test_draw_into import look_at, perspective
from test_renderer import in_turns

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import gl, passes, state
from terrain_gl.gpu.context import create_context
from terrain_gl.gpu.current import current, kept
from terrain_gl.store.build import build
from terrain_gl.store.opened import StoredMap

SIZE = (160, 90)


@pytest.fixture(scope="module")
def land():
    return tg.Heightmap(rough(97, 129, relief=40.0), 10.0, "land")


@pytest.fixture(scope="module")
def stored(land, tmp_path_factory):
    path = tmp_path_factory.mktemp("guest") / "s"
    build(land.heights, path, tile=16, shard=64, spacing_m=10.0)
    return StoredMap(path)


@pytest.fixture(scope="module")
def camera(land):
    return tg.Camera((640.0, 150.0, 120.0), (640.0, 600.0, 0.0))  # over the land: its underside is left out


class Dirt:
    """State that a program may leave on, each kind by itself, with objects that live until the end of the test."""

    def __init__(self, ctx):
        self.ctx = ctx
        self.sampler = ctx.sampler(filter=(moderngl.LINEAR, moderngl.LINEAR))
        self.texture = ctx.texture((4, 4), 4, os.urandom(64))
        self.shares = ctx.texture((4, 4), 1, dtype="u4")
        self.buffer = ctx.buffer(os.urandom(1 << 12))
        self.framebuffer = ctx.framebuffer([ctx.texture((8, 8), 4)], ctx.depth_renderbuffer((8, 8)))
        self.program = ctx.program(
            "#version 430\nvoid main() { gl_Position = vec4(0.0); }",
            "#version 430\nout vec4 o; void main() { o = vec4(1.0); }",
        )
        self.array = ctx.vertex_array(self.program, [])

    def call(self, name, *arguments):
        """Call an OpenGL function with whole numbers and floats."""
        types = [ctypes.c_float if isinstance(each, float) else ctypes.c_uint for each in arguments]
        gl.function(self.ctx, name, None, *types)(*arguments)

    def bind_everything(self):
        for i in range(8):
            self.buffer.bind_to_storage_buffer(i)
            self.buffer.bind_to_uniform_block(i)
            self.shares.bind_to_image(i)
        for i in range(16):
            self.texture.use(i)
            self.sampler.use(i)
        for target in (0x8892, 0x8F3F, 0x90EE, 0x8F36, 0x8F37, 0x8A11, 0x90D2, 0x8C8E):
            self.call("glBindBuffer", target, self.buffer.glo)
        self.call("glBindBufferBase", 0x8C8E, 0, self.buffer.glo)
        self.call("glUseProgram", self.program.glo)
        self.call("glBindVertexArray", self.array.glo)

    def move_pixels(self):
        for first in (0x0CF0, 0x0D00):
            for i, value in enumerate((1, 1, 7, 2, 3, 8)):
                self.call("glPixelStorei", first + i, value)
        for name in (0x806B, 0x806C, 0x806D, 0x806E):
            self.call("glPixelStorei", name, 5)
        self.call("glBindBuffer", 0x88EB, self.buffer.glo)
        self.call("glBindBuffer", 0x88EC, self.buffer.glo)


def enable(number):
    return lambda dirt: dirt.call("glEnable", number)


DIRT = {
    **{name: enable(number) for name, number in state.SWITCHES.items() if name != "MULTISAMPLE"},
    "no multisampling": lambda dirt: dirt.call("glDisable", state.SWITCHES["MULTISAMPLE"]),
    "no dither": lambda dirt: dirt.call("glDisable", state.SWITCHES["DITHER"]),
    "no depth test": lambda dirt: dirt.call("glDisable", state.SWITCHES["DEPTH_TEST"]),
    "wireframe": lambda dirt: setattr(dirt.ctx, "wireframe", True),
    "clockwise fronts": lambda dirt: setattr(dirt.ctx, "front_face", "cw"),
    "culled fronts": lambda dirt: (setattr(dirt.ctx, "cull_face", "front"), dirt.ctx.enable(moderngl.CULL_FACE)),
    "polygon offset": lambda dirt: setattr(dirt.ctx, "polygon_offset", (3.0, 1000.0)),
    "offset of points": lambda dirt: (dirt.call("glEnable", 0x2A01), dirt.call("glPolygonOffset", 30.0, 1e5)),
    "offset of lines": lambda dirt: (dirt.call("glEnable", 0x2A02), dirt.call("glPolygonOffset", 30.0, 1e5)),
    "scissor": lambda dirt: (dirt.call("glEnable", 0x0C11), dirt.call("glScissor", 1, 2, 3, 4)),
    "one viewport": lambda dirt: dirt.call("glViewportIndexedf", 3, 1.0, 2.0, 3.0, 4.0),
    "viewport": lambda dirt: dirt.call("glViewport", 5, 6, 7, 8),
    "depth mask": lambda dirt: dirt.call("glDepthMask", 0),
    "colour mask": lambda dirt: dirt.call("glColorMask", 0, 1, 0, 0),
    "one colour mask": lambda dirt: dirt.call("glColorMaski", 1, 0, 0, 0, 0),
    "depth function": lambda dirt: setattr(dirt.ctx, "depth_func", "<"),
    "depth range": lambda dirt: dirt.call("glDepthRangef", 0.75, 0.25),
    "blending": lambda dirt: (
        dirt.ctx.enable(moderngl.BLEND),
        setattr(dirt.ctx, "blend_func", (moderngl.ZERO, moderngl.ONE)),
        setattr(dirt.ctx, "blend_equation", moderngl.MAX),
    ),
    "clip control": lambda dirt: dirt.call("glClipControl", 0x8CA2, 0x935E),
    "provoking vertex": lambda dirt: setattr(dirt.ctx, "provoking_vertex", moderngl.FIRST_VERTEX_CONVENTION),
    "patch vertices": lambda dirt: setattr(dirt.ctx, "patch_vertices", 4),
    "logic op": lambda dirt: (dirt.call("glEnable", 0x0BF2), dirt.call("glLogicOp", 0x150A)),
    "stencil": lambda dirt: (dirt.call("glEnable", 0x0B90), dirt.call("glStencilFunc", 0x0200, 0, 255)),
    "sample coverage": lambda dirt: (dirt.call("glEnable", 0x80A0), dirt.call("glSampleCoverage", 0.0, 0)),
    "sample shading": lambda dirt: (dirt.call("glEnable", 0x8C36), dirt.call("glMinSampleShading", 1.0)),
    "primitive restart": lambda dirt: (dirt.call("glEnable", 0x8F9D), dirt.call("glPrimitiveRestartIndex", 5)),
    "sample mask": lambda dirt: (dirt.call("glEnable", 0x8E51), dirt.call("glSampleMaski", 0, 0)),
    "framebuffer": lambda dirt: dirt.framebuffer.use(),
    "everything bound": Dirt.bind_everything,
    "pixel store": Dirt.move_pixels,
}


@pytest.fixture(params=["map", "store"])
def shared(request, ctx, land, stored, camera):
    """A context of the caller, a renderer in it, and its picture; the other kind of map has drawn there before."""
    maps = {"map": land, "store": stored}
    first = maps.pop(request.param)
    with tg.Renderer(next(iter(maps.values())), SIZE, ctx=ctx) as other:
        other.render(camera, 1.0)
        with tg.Renderer(first, SIZE, ctx=ctx) as renderer:
            yield renderer


def seen(renderer, camera):
    """Bytes of a picture, of its mesh, and what is achieved; another picture is drawn last, and must not come back."""
    away = tg.Camera(tuple(np.add(camera.eye, (50, 40, 30))), camera.target)
    frame = renderer.render(camera, 0.4, style="shaded", wires=True, water_m=5.0)
    found = frame.image.tobytes(), renderer.triangles().tobytes(), renderer.measure()["max_error_px"]
    renderer.render(away, 3.0, style="lambert")
    return found


@pytest.fixture
def cleaned(ctx):
    """All state as it was, after the test has changed it."""
    before = state.state_of(ctx)
    found = before.found()
    yield
    before.give_back(found)
    ctx.detect_framebuffer(0).use()
    for setting in ("wireframe", False), ("front_face", "ccw"), ("cull_face", "back"), ("polygon_offset", (0.0, 0.0)):
        setattr(ctx, *setting)
    ctx.depth_func, ctx.provoking_vertex = "<", moderngl.LAST_VERTEX_CONVENTION
    ctx.enable_only(moderngl.NOTHING)


@pytest.mark.slow
def test_every_state_may_be_dirty_and_is_the_same_afterwards(shared, ctx, camera, cleaned):
    expected = seen(shared, camera)
    dirt, saved = Dirt(ctx), state.state_of(ctx)
    clean = saved.found()
    for name, make in DIRT.items():
        make(dirt)
        assert ctx.error == "GL_NO_ERROR", name
        before = saved.found()
        assert seen(shared, camera) == expected, name
        assert saved.found() == before, name
        assert ctx.error == "GL_NO_ERROR", name
        saved.give_back(clean)
        ctx.detect_framebuffer(0).use()
        ctx.wireframe, ctx.front_face, ctx.cull_face, ctx.polygon_offset = False, "ccw", "back", (0.0, 0.0)


def with_method(renderer, camera):
    """A mesh with indices."""
    return renderer.render(camera, method="clipmap").image.tobytes()


def with_bar(renderer, camera):
    """A picture whose first pass writes alpha."""
    return renderer.render(camera, 1.0, style="error").image.tobytes()


def drawn_into(renderer, camera):
    """The colours of a framebuffer of the caller with the format sRGB and a stencil."""
    ctx, names = renderer.ctx, (ctypes.c_uint * 1)()
    target = ctx.framebuffer([ctx.texture(SIZE, 4, internal_format=0x8C43)], ctx.depth_texture(SIZE))
    call = Dirt(ctx).call
    gl.function(ctx, "glGenRenderbuffers", None, ctypes.c_int, ctypes.c_void_p)(1, names)
    call("glBindRenderbuffer", 0x8D41, names[0])
    call("glRenderbufferStorage", 0x8D41, 0x88F0, *SIZE)
    call("glBindFramebuffer", 0x8D40, target.glo)
    call("glFramebufferRenderbuffer", 0x8D40, 0x821A, 0x8D41, names[0])  # in the place of the depth texture
    target.clear(depth=1.0)
    renderer.draw_into(target, look_at(camera.eye, camera.target), perspective(60.0, SIZE, 1.0, 5000.0), 1.0)
    found = target.read(components=4)
    target.release()
    return found


NEEDED = {  # calls of a pass, or switches, and dirt that spoils the picture without them, or a scene of its own
    "BindFramebuffer": "framebuffer",
    "BlendEquation": "blending",
    "BlendFuncSeparate": "blending",
    "ClipControl": "clip control",
    "ColorMask": "colour mask",
    "CullFace": "culled fronts",
    "DepthFunc": "depth function",
    "DepthMask": "depth mask",
    "DepthRangef": "depth range",
    "FrontFace": "clockwise fronts",
    "PatchParameteri": "patch vertices",
    "PolygonMode": "wireframe",
    "ProvokingVertex": "provoking vertex",
    "Scissor": "scissor",
    "Viewport": "viewport",
    0x0BE2: "blending",
    0x0C11: "scissor",
    **{state.SWITCHES[name]: name for name in ("CULL_FACE", "RASTERIZER_DISCARD", "SAMPLE_ALPHA_TO_COVERAGE")},
    **{state.SWITCHES[f"CLIP_DISTANCE{i}"]: f"CLIP_DISTANCE{i}" for i in (4, 5)},
    state.SWITCHES["COLOR_LOGIC_OP"]: "logic op",
    state.SWITCHES["POLYGON_OFFSET_FILL"]: "polygon offset",
    state.SWITCHES["MULTISAMPLE"]: "no multisampling",
    state.SWITCHES["SAMPLE_MASK"]: "sample mask",
    state.SWITCHES["DEPTH_TEST"]: "no depth test",
    state.SWITCHES["POLYGON_OFFSET_POINT"]: "offset of points",
    state.SWITCHES["POLYGON_OFFSET_LINE"]: "offset of lines",
    state.SWITCHES["SAMPLE_COVERAGE"]: "sample coverage",
    state.SWITCHES["SAMPLE_SHADING"]: "sample shading",
    state.SWITCHES["PRIMITIVE_RESTART"]: ("primitive restart", with_method),
    state.SWITCHES["SAMPLE_ALPHA_TO_ONE"]: ("SAMPLE_ALPHA_TO_ONE", with_bar),
    state.SWITCHES["STENCIL_TEST"]: ("stencil", drawn_into),
    state.SWITCHES["FRAMEBUFFER_SRGB"]: ("FRAMEBUFFER_SRGB", drawn_into),
}

UNSEEN = {  # switches that change no bytes on llvmpipe, on or off, so OpenGL is asked; and why other drivers need them
    "DEPTH_CLAMP": "a depth extrapolated to below 0 would be the sky: docs/guarantee.md, section 5",
    "LINE_SMOOTH": "no lines are drawn; with wireframe left on, llvmpipe may crash",
    "PRIMITIVE_RESTART_FIXED_INDEX": "no index of a map is 2³² - 1; a program's window may have one of 2¹⁶ - 1",
    "POLYGON_SMOOTH": "drivers may smooth polygons where there is one sample a pixel",
    "DITHER": "drivers may dither",
    **{f"CLIP_DISTANCE{i}": "it is undefined where a shader does not write it" for i in (0, 1, 2, 3, 6, 7)},
}


def test_each_switch_is_needed_or_has_a_reason():
    assert {name for name, number in state.SWITCHES.items() if number not in NEEDED} == set(UNSEEN)


class Lacking:
    """The functions of a context, without one of them, or without one switch."""

    def __init__(self, whole, lacks):
        self._whole, self._lacks = whole, lacks

    def __getattr__(self, name):
        def call(*arguments):
            switched = arguments[0] if name in ("Enable", "Disable") else None
            if self._lacks not in (name, switched):
                getattr(self._whole, name)(*arguments)

        return self._whole.has_clip_control if name == "has_clip_control" else call


def lack(monkeypatch, lacks):
    """Take a call, or a switch, away from what passes set."""
    set_all, whole = passes._set, passes.calls

    def set_most(ctx, asked):
        with monkeypatch.context() as patch:
            patch.setattr(passes, "calls", lambda ctx: Lacking(whole(ctx), lacks))
            set_all(ctx, asked)

    monkeypatch.setattr(passes, "_set", set_most)


DECLARED = {"DEPTH_CLAMP": lambda asked: asked.least_depth is not None, "CLIP_DISTANCE0": lambda asked: asked.clips}
DECLARED |= {"DITHER": lambda asked: True}  # the other switches are off in every draw


@pytest.mark.parametrize("name", UNSEEN)
def test_at_each_draw_opengl_has_the_switch_that_is_declared(ctx, land, camera, cleaned, monkeypatch, name):
    """OpenGL itself is asked, between the pass and its draw. Without the pass's call, it has the caller's switch."""
    number, states, found = state.SWITCHES[name], [], []
    is_enabled = gl.function(ctx, "glIsEnabled", ctypes.c_ubyte, ctypes.c_uint)
    begin, declared = passes.DrawPass._begin, DECLARED.get(name, lambda asked: False)
    monkeypatch.setattr(passes.DrawPass, "_begin", lambda *given: (states.append(given[1]), begin(*given)))

    def asking(draw):
        def asked(*given, **more):
            found.append((bool(is_enabled(number)), declared(states[-1])))
            return draw(*given, **more)

        return asked

    for draw in (moderngl.VertexArray.render, moderngl.VertexArray.render_indirect):
        monkeypatch.setattr(moderngl.VertexArray, draw.__name__, asking(draw))

    with tg.Renderer(land, SIZE, ctx=ctx) as renderer:
        for is_lacking in (False, True):
            if is_lacking:
                lack(monkeypatch, number)
            for left_on in (False, True):
                found.clear()
                Dirt(ctx).call("glEnable" if left_on else "glDisable", number)
                seen(renderer, camera)
                assert len(found) > 5
                assert all(is_on == (left_on if is_lacking else asked) for is_on, asked in found)


@pytest.mark.parametrize("lacks", NEEDED)
def test_without_a_state_that_passes_set_dirt_spoils_the_picture(ctx, land, camera, cleaned, monkeypatch, lacks):
    dirt, scene = needed if isinstance(needed := NEEDED[lacks], tuple) else (needed, seen)
    with tg.Renderer(land, SIZE, ctx=ctx) as renderer:
        expected = scene(renderer, camera)
        lack(monkeypatch, lacks)
        DIRT[dirt](Dirt(ctx))
        assert scene(renderer, camera) != expected


def full_life(land, ctx, camera):
    """What a renderer writes and reads: a picture, its mesh and error, and an edited map in floats."""
    with tg.Renderer(land, SIZE, ctx=ctx) as renderer:
        found = seen(renderer, camera)
        renderer.edit(slice(20, 30), slice(14, 25), 12.0)
        return found, renderer.render(camera, 1.0, exact=True).image.tobytes()


@pytest.mark.parametrize(
    "unset", ["PIXEL_UNPACK_BUFFER_BINDING", "UNPACK_SWAP_BYTES", "UNPACK_ROW_LENGTH", "PACK_SWAP_BYTES"]
)
def test_without_a_rule_for_pixels_dirt_spoils_maps_or_pictures(ctx, land, camera, cleaned, monkeypatch, unset):
    """Not tried: numbers with which drivers read or write beyond the memory of the pixels."""
    expected, dirt, rules = full_life(land, ctx, camera), Dirt(ctx), dict(state.PIXELS)
    _, name, *before = rules.pop(unset)
    value = dirt.buffer.glo if "BINDING" in unset else 1 if "SWAP" in unset else 7
    dirt.call(f"gl{name}", *before, value)
    monkeypatch.setattr(state, "PIXELS", rules)
    with contextlib.suppress(TerrainError, moderngl.Error, FloatingPointError):
        assert full_life(land, ctx, camera) != expected
    assert ctx.error in ("GL_NO_ERROR", "GL_INVALID_OPERATION")  # of a buffer without room
    dirt.call(f"gl{name}", *before, 0)


def test_all_states_may_be_dirty_at_once(shared, ctx, camera, cleaned):
    expected = seen(shared, camera)
    dirt = Dirt(ctx)
    for make in DIRT.values():
        make(dirt)
    before = state.state_of(ctx).found()
    assert seen(shared, camera) == expected
    assert state.state_of(ctx).found() == before and ctx.error == "GL_NO_ERROR"


def test_moderngl_still_knows_the_framebuffer_of_the_program(shared, ctx, camera, cleaned):
    """It binds that one again whenever it has cleared or read another."""
    dirt, other = Dirt(ctx), ctx.simple_framebuffer((4, 4))
    dirt.framebuffer.use()
    shared.render(camera, 1.0)
    other.clear()
    bound = dict((name, at) for name, (*at,) in state.state_of(ctx).found() if name == "BindFramebuffer")
    assert bound["BindFramebuffer"][-1] == dirt.framebuffer.glo


def test_state_is_given_back_after_an_exception(shared, ctx, camera, cleaned):
    Dirt(ctx).bind_everything()
    before = state.state_of(ctx).found()

    def fail(*_):
        raise RuntimeError("in the middle")

    with pytest.raises(RuntimeError, match="in the middle"):
        for _ in shared.draw_steps(camera, 1.0, size=SIZE, receive=fail):
            pass
    assert state.state_of(ctx).found() == before


# --- Contexts ---------------------------------------------------------------------------------------------------------


def test_the_context_of_a_program_stays_current(ctx, land, camera):
    """While a renderer is made, draws, fails and is released, and between the steps of its work."""
    mine = current()
    assert mine
    renderer = tg.Renderer(land, SIZE)
    assert current() == mine
    renderer.render(camera, 1.0)
    steps = renderer.render_steps(camera, 1.0)
    next(steps)
    assert current() == mine
    del steps
    with pytest.raises(tg.TerrainError):
        renderer.render(camera, -1.0)
    assert current() == mine
    renderer.release()
    assert current() == mine
    with pytest.raises(TerrainError, match="has been released"):
        renderer.render(camera)
    assert current() == mine


def test_renderers_draw_in_turns(land, stored, camera):
    with tg.Renderer(land, SIZE) as one, tg.Renderer(stored, SIZE) as other:
        expected = [each.render(camera, 1.0, style="normals").image for each in (one, other)]
        found = in_turns(*(each.render_steps(camera, 1.0, style="normals") for each in (one, other)))
        assert all(np.array_equal(each.image, image) for each, image in zip(found, expected, strict=True))


def test_what_is_on_the_gpu_says_where_it_may_be_read(land, camera):
    with tg.Renderer(land, SIZE) as renderer:
        image = renderer.render(camera, 1.0).image
        with pytest.raises(TerrainError, match="put this into `with renderer.session:`"):
            renderer.picture.read()
        with renderer.session:
            assert np.array_equal(renderer.picture.read(), image)


def test_a_context_that_another_thread_holds_is_an_error_that_names_the_thread(ctx, land, camera):
    with tg.Renderer(land, SIZE, ctx=ctx) as renderer, ThreadPoolExecutor(1, "worker") as pool:
        expected = renderer.render(camera, 1.0).image
        with pytest.raises(TerrainError, match="no OpenGL context in thread worker"):
            pool.submit(renderer.render, camera, 1.0).result(60)
        assert np.array_equal(renderer.render(camera, 1.0).image, expected)


def test_a_new_context_is_current_and_may_be_put_aside():
    before = current()
    with kept():
        ctx = create_context()
        assert current() and current() != before
    assert current() == before
    ctx.release()
    assert current() == before or before is None
