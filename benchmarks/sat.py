"""Time summed-area tables of a 4096² map, and compare with numpy's cumulative sums and with the speed of the memory.

Run: python benchmarks/sat.py [SIZE]. Each number is the best of five in one run: compare ratios, not milliseconds.
"""

import sys
import time

import numpy as np
from table import head, row

from terrain_gl.gpu.context import create_context
from terrain_gl.sat import SummedAreaTables, Table


def best_ms(work, finish=lambda: None, repeats=5):
    """Shortest time of `work` in milliseconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        finish()
        times.append(time.perf_counter() - start)
    return min(times) * 1e3


def measure(ctx, size, bits):
    """Milliseconds of the table, of numpy, and of copies of as many bytes as the kernels move."""
    values = np.random.default_rng(0).integers(0, 65536, (size, size), dtype=f"u{bits // 8}")
    buffer, tables = ctx.buffer(values.tobytes()), SummedAreaTables(ctx, bits)
    table = best_ms(lambda: tables.build(buffer, Table(size, size)), ctx.finish)
    numpy = best_ms(lambda: values.cumsum(1, values.dtype).cumsum(0, values.dtype))
    copied = ctx.buffer(reserve=buffer.size)
    copy = best_ms(lambda: ctx.copy_buffer(copied, buffer), ctx.finish)
    floor = 2 * copy  # rows, then columns: every word is read and written once in each direction
    for each in (buffer, copied, tables):
        each.release()
    return table, numpy, floor


def main():
    """Print one line per word size."""
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    ctx = create_context()
    print(f"{size} x {size} on {ctx.info['GL_RENDERER']}")
    head("bits", "table", "numpy", "floor", "table / numpy", "table / floor")
    for bits in (32, 64):
        table, numpy, floor = measure(ctx, size, bits)
        times = (f"{ms:.0f} ms" for ms in (table, numpy, floor))
        row(bits, *times, f"{table / numpy:.2f}", f"{table / floor:.1f}")


if __name__ == "__main__":
    main()
