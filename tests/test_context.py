"""Contexts from every back end, the reasons when there is none, and the same bytes from EGL and OSMesa."""

import os
import subprocess
import sys

import numpy as np
import pytest
from drivers import must_be_one_driver

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.gpu.context import backend_name, create_context, probe_backends
from terrain_gl.gpu.current import current, handle_of

FILL = """
#version 430 core
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Words { float word[]; };
void main() { word[gl_GlobalInvocationID.x] = sin(float(gl_GlobalInvocationID.x)) / 3.0; }
"""
VERTEX = """
#version 430 core
out vec2 v_at;
void main() { v_at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 3.7 - 1.3; gl_Position = vec4(v_at, 0, 1); }
"""
FRAGMENT = """
#version 430 core
in vec2 v_at;
out vec4 out_color;
void main() { out_color = vec4(fract(sin(v_at * 9.1)), length(v_at), 1); }
"""


@pytest.fixture
def osmesa():
    try:
        ctx = create_context("osmesa")
    except TerrainError as error:
        pytest.skip(str(error))
    yield ctx
    ctx.release()


def work(ctx):
    """Bytes of a compute pass and of a picture, and the error state after them."""
    with ctx:
        words = ctx.buffer(reserve=4 * 4096)
        words.bind_to_storage_buffer(0)
        ctx.compute_shader(FILL).run(64)
        target = ctx.framebuffer([ctx.texture((200, 150), 4)])
        target.use()
        target.clear()
        ctx.vertex_array(ctx.program(VERTEX, FRAGMENT), []).render(ctx.TRIANGLES, vertices=3)
        return words.read(), target.read(components=4), ctx.error


def test_auto_gives_version_43_and_says_which_backend(ctx):
    with create_context() as auto:
        assert auto.version_code >= 430
        assert backend_name(auto) in ("egl", "osmesa", "glfw")
        assert auto.error == "GL_NO_ERROR"


def test_egl_and_osmesa_give_the_same_bytes(ctx, osmesa):
    if backend_name(ctx) != "egl":
        pytest.skip("no EGL here")
    must_be_one_driver(ctx, osmesa)
    ours, theirs = work(ctx), work(osmesa)
    assert ours == theirs
    assert ours[2] == "GL_NO_ERROR"
    assert np.frombuffer(ours[1], "u1").std() > 10  # not an empty picture


def test_hidden_window_gives_the_same_bytes(ctx):
    try:
        window = create_context("glfw")
    except TerrainError as error:
        pytest.skip(str(error))
    assert backend_name(window) == "glfw"
    must_be_one_driver(window, ctx)
    assert work(window) == work(ctx)
    window.release()


def test_contexts_interleave(ctx, osmesa):
    first = work(ctx)
    assert work(osmesa)[2] == "GL_NO_ERROR"
    assert work(ctx) == first


def test_a_renderer_is_made_and_draws_beside_osmesa(ctx, osmesa):
    """OSMesa answers with EGL's context when it is asked for its own."""
    must_be_one_driver(ctx, osmesa)  # zink beside OSMesa ends the process in Mesa 22.3
    heightmap = tg.Heightmap(np.arange(64.0).reshape(8, 8), 10.0)
    for mine in (ctx, osmesa):
        with mine, tg.Renderer(heightmap, (16, 16)) as renderer:
            renderer.render(tg.Camera.default(heightmap))
            assert handle_of(mine).is_current() and current() == handle_of(mine)


def test_each_context_keeps_its_own_objects(ctx, osmesa):
    """Each counts the names of its textures by itself."""
    with ctx:
        ours = [ctx.texture((1, 1), 4) for _ in range(3)]
    with osmesa:
        theirs = osmesa.texture((1, 1), 4)
    with ctx:
        assert ctx.texture((1, 1), 4).glo > ours[-1].glo > theirs.glo
        for texture in ours:
            texture.release()


def test_probe_tells_of_each_backend():
    records = probe_backends()
    assert [record.name for record in records] == ["egl", "osmesa", "glfw"]
    for record in records:
        assert record.version if record.works else record.reason
        assert "\n" not in record.reason


def test_unknown_backend_is_wrong_use():
    with pytest.raises(UsageError, match=r"'metal'.*expected one of auto, egl, osmesa, glfw"):
        create_context("metal")


def run(code, **environment):
    environment = os.environ | environment
    environment.pop("DISPLAY", None)
    environment.pop("WAYLAND_DISPLAY", None)
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return done.stdout


TELL = """
from terrain_gl.gpu.context import create_context
try:
    create_context({backend!r})
except Exception as error:
    print(type(error).__name__, error)
"""


def test_too_old_version_is_named_with_the_one_needed():
    told = run(TELL.format(backend="auto"), MESA_GL_VERSION_OVERRIDE="3.3")
    if not told:
        pytest.skip("this driver is not Mesa: its version cannot be overridden")
    assert told.startswith("TerrainError no OpenGL context: egl: found OpenGL 3.3 (")
    assert "needed 4.3" in told and told.count("\n") == 1


def test_no_display_is_said_for_glfw():
    told = run(TELL.format(backend="glfw"))
    assert told.startswith("TerrainError") and "no display" in told and "apt install" in told


LATER = """
import ctypes
import numpy as np
import terrain_gl as tg
from terrain_gl.gpu.current import current
renderer = tg.Renderer(tg.Heightmap(np.zeros((9, 9)), 10.0), (16, 16))
renderer.choose(tg.Camera.default(renderer.heightmap))
library = ctypes.CDLL("libOSMesa.so.8")
library.OSMesaCreateContext.restype = ctypes.c_void_p
library.OSMesaMakeCurrent.argtypes = ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int] * 3
pixels = (ctypes.c_ubyte * 1024)()
assert library.OSMesaMakeCurrent(library.OSMesaCreateContext(0x1908, None), pixels, 0x1401, 16, 16)
before = current()
renderer.choose(tg.Camera.default(renderer.heightmap))
print(before == current(), type(before).__name__)
"""


def test_a_library_that_is_loaded_later_is_seen(osmesa):
    """A renderer has entered its context before, and found that OSMesa is not there."""
    assert run(LATER) == "True _OSMesa\n"


LACKING = {"GALLIUM_DRIVER": "d3d12"}  # as WSL sets it


@pytest.mark.slow
def test_a_driver_that_mesa_lacks_ends_no_command():
    """OSMesa ends the process in that case, so it is tried in another process first."""
    if os.environ.get("MESA_LOADER_DRIVER_OVERRIDE"):
        pytest.skip("MESA_LOADER_DRIVER_OVERRIDE already names another driver")
    alone = "from terrain_gl.gpu.context import newest; newest('osmesa')"
    ended = subprocess.run([sys.executable, "-c", alone], env=os.environ | LACKING, capture_output=True)
    if ended.returncode >= 0:
        pytest.skip(f"no driver ends the process here: {ended.stderr[-200:]!r}")
    told = run(TELL.format(backend="osmesa"), **LACKING)
    assert "its driver ends the process (SIG" in told and "GALLIUM_DRIVER=d3d12: unset it" in told
    for words, status in ((("info",), 0), (("shot", "alpine", "-o", os.devnull + ".png"), 1)):
        command = [sys.executable, "-m", "terrain_gl", *words]
        done = subprocess.run(command, env=os.environ | LACKING, capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        assert "Traceback" not in done.stderr


def test_missing_library_is_named_with_its_package():
    hide = "import ctypes\ndef refuse(name, *_, **__): raise OSError(name + ': cannot open')\nctypes.CDLL = refuse\n"
    told = run("import moderngl, glfw\n" + hide + TELL.format(backend="osmesa"))
    assert "libOSMesa.so.8: cannot open" in told and "apt install libosmesa6" in told
