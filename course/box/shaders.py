"""Run a student's shaders in a separate process, so that an endless shader stops only that process."""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import moderngl
import numpy as np

PAST = 256  # words after the end of a buffer, to see whether a shader writes there


@cache
def context() -> moderngl.Context:
    """A context without a window, on the machine's driver or on Mesa's software renderer."""
    if sys.platform.startswith("linux"):
        libraries: dict[str, Any] = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
        return moderngl.create_context(standalone=True, require=430, **libraries)
    return moderngl.create_context(standalone=True, require=430)


def _said(error: Exception) -> str:
    """The message of a compiler, in one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and "====" not in line]
    return "; ".join(line for line in lines if not line.endswith("_shader") and "Compiler failed" not in line)


def renderer() -> str:
    """Name of the driver."""
    return str(context().info["GL_RENDERER"])


def prefix_table(texts: dict[str, str], values: np.ndarray) -> np.ndarray:
    """Summed-area table of (rows, cols) uint32 by the shaders reduce, scan and propagate."""
    ctx, (rows, cols) = context(), values.shape
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
#version 430
in ivec4 in_square;
in ivec4 in_edges;
in int in_inner;
out ivec4 v_square;
out ivec4 v_edges;
out int v_inner;
void main() { v_square = in_square; v_edges = in_edges; v_inner = in_inner; gl_Position = vec4(0.0); }
"""
LEVELS = """
#version 430
layout(quads, equal_spacing, ccw) in;
layout(std430, binding = 0) buffer Levels { float level[]; };
void main() {
    for (int i = 0; i < 4; i++) level[gl_PrimitiveID * 6 + i] = gl_TessLevelOuter[i];
    for (int i = 0; i < 2; i++) level[gl_PrimitiveID * 6 + 4 + i] = gl_TessLevelInner[i];
    gl_Position = vec4(0.0);
}
"""
UNIFORM = """
#version 430
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
CAPTURE = """
#version 430
layout(triangles) in;
layout(points, max_vertices = 1) out;
layout(std430, binding = 0) buffer Triangles { uint count; float place[]; };
in vec3 v_place[];
void main() {
    uint at = atomicAdd(count, 1u) * 9u;
    for (int i = 0; i < 9; i++) if (at + i < place.length()) place[at + i] = v_place[i / 3][i % 3];
}
"""


def levels(control: str, squares: np.ndarray, edges: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Levels that a control shader sets for each patch, (n, 6): four outer, two inner; 0 for patches not drawn."""
    out = context().buffer(bytes(4 * 6 * len(squares)))
    _draw(control, LEVELS, None, squares, edges, inner, out, {})
    return np.frombuffer(out.read(), np.float32).reshape(-1, 6)


def mesh(
    control: str | None,
    evaluation: str,
    heights: np.ndarray,
    squares: np.ndarray,
    edges: np.ndarray,
    inner: np.ndarray,
) -> np.ndarray:
    """Triangles that both shaders make from patches, (m, 3, 3): column, row, height of each vertex."""
    texture = context().texture(heights.shape[::-1], 1, np.ascontiguousarray(heights, np.float32).tobytes(), dtype="f4")
    out = context().buffer(bytes(4 + 36 * 65536))
    _draw(control or UNIFORM, evaluation, CAPTURE, squares, edges, inner, out, {"u_heights": texture})
    count = int(np.frombuffer(out.read(4), np.uint32)[0])
    return np.frombuffer(out.read(36 * min(count, 65536), offset=4), np.float32).reshape(-1, 3, 3)


def _draw(
    control: str,
    evaluation: str,
    geometry: str | None,
    squares: np.ndarray,
    edges: np.ndarray,
    inner: np.ndarray,
    out: moderngl.Buffer,
    textures: dict[str, moderngl.Texture],
) -> None:
    """Draw patches without a picture; the shaders write to a buffer."""
    ctx = context()
    try:
        program = ctx.program(
            vertex_shader=VERTEX.strip(),
            tess_control_shader=control.strip(),
            tess_evaluation_shader=evaluation.strip(),
            geometry_shader=geometry.strip() if geometry else None,
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
    out.bind_to_storage_buffer(0)
    ctx.vertex_array(program, content).render(moderngl.PATCHES, vertices=len(squares))
    ctx.memory_barrier()
