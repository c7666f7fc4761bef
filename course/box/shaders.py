"""Run a student's shaders in a separate process, so that an endless shader stops only that process."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

import glcontext
import moderngl
import numpy as np

COMPUTE, TESSELLATION = 430, 410  # versions of OpenGL: of compute shaders, and the last one of macOS
VERTICES = 3 * 65536  # room for what shaders make
TRANSFORM_FEEDBACK_BUFFER = 0x8C8E
PAST = 256  # words after the end of a buffer, to see whether a shader writes there


@cache
def context(version: int) -> moderngl.Context:
    """A context without a window, on the machine's driver or on Mesa's software renderer; `extra` finds functions."""
    linux = sys.platform.startswith("linux")
    backend = glcontext.get_backend_by_name("egl") if linux else glcontext.default_backend()
    libraries = {"libgl": "libGL.so.1", "libegl": "libEGL.so.1"} if linux else {}
    loader = backend(mode="standalone", glversion=version, **libraries)
    ctx = moderngl.create_context(version, standalone=True, context=loader)
    ctx.extra = loader
    return ctx


def _said(error: Exception) -> str:
    """The message of a compiler, in one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and "====" not in line]
    return "; ".join(line for line in lines if not line.endswith("_shader") and "Compiler failed" not in line)


def renderer(version: int) -> str:
    """Name of the driver."""
    return str(context(version).info["GL_RENDERER"])


def prefix_table(texts: dict[str, str], values: np.ndarray) -> np.ndarray:
    """Summed-area table of (rows, cols) uint32 by the shaders reduce, scan and propagate."""
    ctx, (rows, cols) = context(COMPUTE), values.shape
    shaders = {}
    for name, text in texts.items():
        try:
            shaders[name] = ctx.compute_shader(text.strip())
        except moderngl.Error as error:
            raise ValueError(f"{name}: {_said(error)}") from None
    words = ctx.buffer(np.append(values.ravel(), np.full(PAST, 999, np.uint32)).tobytes())
    for lines, length, line_step, word_step in ((rows, cols, cols, 1), (cols, rows, 1, cols)):
        strips = -(-length // 64)
        sums = ctx.buffer(np.full(lines * strips + PAST, 77, np.uint32).tobytes())
        words.bind_to_storage_buffer(0)
        sums.bind_to_storage_buffer(1)
        for name in ("reduce", "scan", "propagate"):
            sizes = {"u_lines": lines, "u_length": length, "u_line_step": line_step, "u_word_step": word_step}
            for uniform, value in sizes.items():
                if uniform in shaders[name]:
                    shaders[name][uniform] = value
            shaders[name].run(-(-lines // 64), 1 if name == "scan" else strips)
            ctx.memory_barrier()
            if (np.frombuffer(sums.read(), np.uint32)[lines * strips :] != 77).any():
                raise ValueError(f"the shader {name} writes past the end of the strips' sums: has it a line?")
    found = np.frombuffer(words.read(), np.uint32)
    if (found[rows * cols :] != 999).any():
        raise ValueError("a shader writes past the end of the table")
    return found[: rows * cols].reshape(rows, cols)


VERTEX = """
#version 410
in ivec4 in_square;
in ivec4 in_edges;
in int in_inner;
out ivec4 v_square;
out ivec4 v_edges;
out int v_inner;
void main() { v_square = in_square; v_edges = in_edges; v_inner = in_inner; gl_Position = vec4(0.0); }
"""
LEVELS = """
#version 410
layout(quads, equal_spacing, ccw, point_mode) in;
out vec4 v_outer;
out vec2 v_inner;
out float v_patch;
void main() {
    v_outer = vec4(gl_TessLevelOuter[0], gl_TessLevelOuter[1], gl_TessLevelOuter[2], gl_TessLevelOuter[3]);
    v_inner = vec2(gl_TessLevelInner[0], gl_TessLevelInner[1]);
    v_patch = float(gl_PrimitiveID);
    gl_Position = vec4(0.0);
}
"""
UNIFORM = """
#version 410
layout(vertices = 1) out;
in ivec4 v_square[];
in int v_inner[];
patch out ivec4 p_square;
void main() {
    p_square = v_square[0];
    for (int i = 0; i < 4; i++) gl_TessLevelOuter[i] = float(v_inner[0]);
    for (int i = 0; i < 2; i++) gl_TessLevelInner[i] = float(v_inner[0]);
}
"""


def levels(control: str, squares: np.ndarray, edges: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Levels that a control shader sets for each patch, (n, 6): four outer, two inner; 0 for patches not drawn."""
    varyings = {"v_outer": 4, "v_inner": 2, "v_patch": 1}
    told = _captured(control, LEVELS, moderngl.POINTS, varyings, squares, edges, inner, {})
    found = np.zeros((len(squares), 6), np.float32)
    found[told[:, 6].astype(int)] = told[:, :6]  # all vertices of a patch tell the same
    return found


def mesh(
    control: str | None,
    evaluation: str,
    heights: np.ndarray,
    squares: np.ndarray,
    edges: np.ndarray,
    inner: np.ndarray,
) -> np.ndarray:
    """Triangles that both shaders make from patches, (m, 3, 3): column, row, height of each vertex."""
    ctx = context(TESSELLATION)
    texture = ctx.texture(heights.shape[::-1], 1, np.ascontiguousarray(heights, np.float32).tobytes(), dtype="f4")
    textures, varyings = {"u_heights": texture}, {"v_place": 3}
    told = _captured(control or UNIFORM, evaluation, moderngl.TRIANGLES, varyings, squares, edges, inner, textures)
    return told.reshape(-1, 3, 3)


def _captured(
    control: str,
    evaluation: str,
    mode: int,
    varyings: dict[str, int],
    squares: np.ndarray,
    edges: np.ndarray,
    inner: np.ndarray,
    textures: dict[str, moderngl.Texture],
) -> np.ndarray:
    """What the evaluation shader writes at each vertex of each primitive, (vertices, floats): transform feedback."""
    ctx = context(TESSELLATION)
    try:
        program = ctx.program(
            vertex_shader=VERTEX.strip(),
            tess_control_shader=control.strip(),
            tess_evaluation_shader=evaluation.strip(),
            varyings=tuple(varyings),
        )
    except moderngl.Error as error:
        name = next((name for name in ("control", "evaluation") if f"tess_{name}_shader" in str(error)), "shaders")
        raise ValueError(f"{name}: {_said(error)}") from None
    data = {"in_square": (squares, "4i"), "in_edges": (edges, "4i"), "in_inner": (inner, "1i")}
    content = [
        (ctx.buffer(np.ascontiguousarray(values, np.int32).tobytes()), kind, name)
        for name, (values, kind) in data.items()
        if name in program
    ]
    for unit, (name, texture) in enumerate(textures.items()):
        texture.use(unit)
        if name in program:
            program[name] = unit
    ctx.patch_vertices = 1
    ctx.simple_framebuffer((1, 1)).use()
    words = sum(varyings.values())
    out = ctx.buffer(reserve=4 * words * VERTICES)
    array, counted = ctx.vertex_array(program, content), ctx.query(primitives=True)
    array.render(moderngl.PATCHES, vertices=0)  # binds the program and the array: moderngl captures no patches itself
    with counted:
        _call(ctx, "glBindBufferBase", TRANSFORM_FEEDBACK_BUFFER, 0, out.glo)
        _call(ctx, "glBeginTransformFeedback", mode)
        _call(ctx, "glDrawArrays", moderngl.PATCHES, 0, len(squares))
        _call(ctx, "glEndTransformFeedback")
    if ctx.error != "GL_NO_ERROR":
        raise ValueError("evaluation: it makes no triangles: look at its layout")
    count = min(counted.primitives * (3 if mode == moderngl.TRIANGLES else 1), VERTICES)
    return np.frombuffer(out.read(4 * words * count), np.float32).reshape(-1, words)


def _call(ctx: moderngl.Context, name: str, *words: int) -> None:
    """Call a function of OpenGL whose arguments are whole numbers."""
    ctypes.CFUNCTYPE(None, *[ctypes.c_uint] * len(words))(ctx.extra.load(name))(*words)
