"""Run a student's shaders in a process of their own: a shader that never ends ends that process alone."""

from __future__ import annotations

import sys
from functools import cache

import moderngl
import numpy as np


@cache
def context() -> moderngl.Context:
    """A context without a window: the driver's, or Mesa's software."""
    if sys.platform.startswith("linux"):
        return moderngl.create_context(
            standalone=True, backend="egl", require=430, libgl="libGL.so.1", libegl="libEGL.so.1"
        )
    return moderngl.create_context(standalone=True, require=430)


def renderer() -> str:
    """Name of the driver."""
    return str(context().info["GL_RENDERER"])


def prefix_table(texts: dict[str, str], values: np.ndarray) -> np.ndarray:
    """Summed-area table of (rows, cols) uint32 by the shaders reduce, scan and propagate."""
    ctx, (rows, cols) = context(), values.shape
    shaders = {name: ctx.compute_shader(text.strip()) for name, text in texts.items()}
    words = ctx.buffer(np.append(values.ravel(), np.full(256, 999, np.uint32)).tobytes())
    for lines, length, line_step, word_step in ((rows, cols, cols, 1), (cols, rows, 1, cols)):
        strips = -(-length // 64)
        sums = ctx.buffer(np.full(lines * strips, 77, np.uint32).tobytes())
        words.bind_to_storage_buffer(0)
        sums.bind_to_storage_buffer(1)
        for name in ("reduce", "scan", "propagate"):
            sizes = {"u_lines": lines, "u_length": length, "u_line_step": line_step, "u_word_step": word_step}
            for uniform, value in sizes.items():
                if uniform in shaders[name]:
                    shaders[name][uniform] = value
            shaders[name].run(-(-lines // 64), 1 if name == "scan" else strips)
            ctx.memory_barrier()
    found = np.frombuffer(words.read(), np.uint32)
    if (found[rows * cols :] != 999).any():
        raise ValueError("a shader writes past the end of the table")
    return found[: rows * cols].reshape(rows, cols)
