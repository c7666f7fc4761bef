"""Before the first picture, find out whether the driver's limits are too low or it computes wrongly, and say so.

A certificate is only as good as the arithmetic under it. So each driver has to pass these tests, once in a process:
summed-area tables of several sizes, made by the same kernels, whose loops then have other bounds; rounding to nearest;
products and sums that `precise` keeps apart and in order; quotients, square roots and powers of two as close as the
bounds assume (docs/precision.md, section 4); the triangles of tessellated patches (`pattern`).
"""

import os
from collections.abc import Callable, Iterator

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from . import gl, needs
from .passes import ComputePass, Resources
from .pattern import wrong_pattern

KERNEL = "driver/selftest.comp"
PHASES = ("reduce", "scan", "propagate")  # of prefix sums: glsl/sat
STRIP = 4  # words that one thread of a phase adds up, on a GPU
WHOLE = 2**15  # more than any line has: a processor sums whole lines
SIZES = ((64, 64), (300, 1), (1, 300))  # columns and rows: for the last, zink may take the loop bound of the first
OPERANDS = 256
RESULTS = 7  # of each operand: glsl/driver/selftest.comp
POWERS = 8  # operands that are powers of two, from 1/8 to 16
QUOTIENT = 3 * 2.0**-23  # largest relative error: GLSL allows 2.5 units in the last place
POWER = 2.0**-19  # class limits are compared with a slack of 2^-18
ROOT = 2.0**-20

Keep = Callable[[ComputePass], object]

_INLINE = "ZINK_INLINE_UNIFORMS"
_ADVICE = "update the graphics driver, or draw with software OpenGL: LIBGL_ALWAYS_SOFTWARE=1"
_passed: set[tuple[str, str]] = set()


def check_driver(ctx: moderngl.Context, keep: Keep = ComputePass.release) -> None:
    """Compare the limits of the current context's driver with our needs, and what it computes with the CPU.

    `keep` gets the kernels of summed-area tables; tables that are made while they exist share their programs.

    Raises
    ------
    TerrainError
        A limit is too low, or the driver computes something wrongly; one line says what, and what to do.
    """
    driver = ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"]
    if driver in _passed:
        return
    if inlines_uniforms(driver[0]):
        raise TerrainError(f"{driver[0]}: this driver may take loop bounds of an earlier run; set {_INLINE}=0")
    wrong = "; ".join(needs.lacking(gl.limits(ctx))) or next(faults(ctx, keep), None)
    if wrong:
        raise TerrainError(f"{driver[0]}: {wrong}; {_ADVICE}")
    _passed.add(driver)


def inlines_uniforms(renderer: str) -> bool:
    """Whether zink compiles values of uniforms into shaders, as it does by default on a processor.

    Then Mesa 22.3 sums up wrongly in some processes and rightly in others, so one trial does not show it.
    """
    return renderer.startswith("zink (llvmpipe") and os.environ.get(_INLINE) != "0"


def faults(ctx: moderngl.Context, keep: Keep = ComputePass.release) -> Iterator[str]:
    """Compute on the GPU and on the CPU; yields what is wrong, in a few words."""
    yield from _wrong_tables(ctx, keep)
    yield from _wrong_operations(ctx)
    yield from wrong_pattern(ctx)


def _wrong_tables(ctx: moderngl.Context, keep: Keep) -> Iterator[str]:
    whole = gl.wants_few_groups(ctx)
    macros = {"BITS": 32} | ({"WHOLE_LINES": 1} if whole else {})
    kernels = [ComputePass(ctx, f"sat/{phase}.comp", macros) for phase in (PHASES[2:] if whole else PHASES)]
    for columns, rows in SIZES:
        values = np.random.default_rng(columns).integers(0, 1000, (rows, columns)).astype("u4")
        words = ctx.buffer(values.tobytes())
        sums = ctx.buffer(reserve=words.size)
        tables = {"Words": words} | ({"Fours": words} if whole else {"StripSums": sums})
        strip = WHOLE if whole else STRIP
        _sum_lines(ctx, kernels, tables, strip, lines=rows, length=columns, line_step=columns, word_step=1)
        _sum_lines(ctx, kernels, tables, strip, lines=columns, length=rows, line_step=1, word_step=columns)
        table = np.frombuffer(words.read(), "u4").reshape(rows, columns)
        words.release()
        sums.release()
        if (table != values.cumsum(0).cumsum(1)).any():
            yield "this driver sums up wrongly, in loops whose bounds change"
            break
    for kernel in kernels:
        keep(kernel)


def _sum_lines(ctx: moderngl.Context, kernels: list[ComputePass], tables: Resources, strip: int, **lines: int) -> None:
    """Reduce, scan, propagate along parallel lines of words; a line of one strip needs no sums of strips."""
    strips = -(-lines["length"] // strip)
    phases = zip(kernels, (strips, 1, strips), strict=True) if strips > 1 else [(kernels[-1], 1)]
    for kernel, groups in phases:
        uniforms = {"first": 0, "strip": strip, "low_bits": 0x7FFFFFFF, **lines}
        kernel.run((-(-lines["lines"] // 64), groups, 1), tables, uniforms)
        ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)


def _operands() -> np.ndarray:
    """Operands x, y, z, w: z is almost −x y, so that x y + z shows whether x y was rounded. w is in [1/8, 16].

    The first `POWERS` operands have 1 for x and a power of two for w.
    """
    rng = np.random.default_rng(1)
    x, y = (rng.uniform(1, 2, (2, OPERANDS)) * 2.0 ** rng.integers(-3, 4, (2, OPERANDS))).astype("f4")
    w = np.exp2(rng.uniform(-3, 4, OPERANDS)).astype("f4")
    x[:POWERS], w[:POWERS] = 1.0, np.exp2(np.arange(-3, 5))
    return np.stack([x, y, -x * y, w], -1)


def _wrong_operations(ctx: moderngl.Context) -> Iterator[str]:
    operands = _operands()
    kernel = ComputePass(ctx, KERNEL)
    given = ctx.buffer(operands.tobytes())
    results = ctx.buffer(reserve=OPERANDS * RESULTS * 4)
    kernel.run((OPERANDS // 64, 1, 1), {"Operands": given, "Results": results})
    ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
    got = np.frombuffer(results.read(), "f4").reshape(-1, RESULTS)
    for resource in (kernel, given, results):
        resource.release()
    x, y, z, w = operands.T
    if (got[:, :2] != np.stack([x + y, x * y], -1)).any():
        yield "this driver does not round to the nearest float"
    if (got[:, 2] != x.astype("f8") + y - (x + y)).any():
        yield "this driver reorders sums and differences that are declared precise"
    if (got[:, 3] != x * y + z).any():
        yield "this driver fuses a product and a sum that are declared precise"
    exact = np.stack([x / w.astype("f8"), np.exp2(-w.astype("f8")), np.sqrt(w.astype("f8"))], -1)
    off = np.abs(got[:, 4:] / exact - 1).max(0)
    limits = {"quotients": QUOTIENT, "powers of two": POWER, "square roots": ROOT}
    for (name, most), error in zip(limits.items(), off, strict=True):
        if not error <= most:
            yield f"this driver computes {name} with a relative error of {error:.1e}, more than {most:.1e}"
    if (got[:POWERS, 4] != 1 / w[:POWERS]).any():
        yield "this driver computes reciprocals of powers of two that are not exact"
