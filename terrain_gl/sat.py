"""Summed-area tables, exact at any size, built in place by prefix sums in compute shaders (Crow 1984).

A table is a rectangle of unsigned words in a storage buffer, row after row, layer after layer. Building turns values f
into sums, wrapped modulo 2^bits:

    word[y, x] = S(x + 1, y + 1),   S(x, y) = sum of f(i, j) for i < x, j < y

Differences of wrapped sums are exact: any box whose own sum is below 2^bits comes out right, however large the map.
Lookups in shaders: `glsl/sat/box.glsl`. Specification: `reference.sat`, `reference.box_sum`.
"""

from typing import NamedTuple

import moderngl
import numpy as np

from .basics.steps import Steps
from .gpu import gl
from .gpu.passes import ComputePass, Resources, Uniforms

STRIP = 64  # words that one thread of a GPU adds up
WHOLE = 2**15  # longer than any line of a map
INT64 = "GL_ARB_gpu_shader_int64"
LOOPS = 2**16 - 2  # iterations of a thread; llvmpipe silently ends a loop after one more iteration
BANDS = 8  # groups of threads that share the columns on a software renderer
SMALL = 2**12  # tables of at most so many words sum columns as they sum rows, which needs no other program
LARGE = 2**22  # likewise for tables of 64 bits; larger tables of any word sum four columns at a time
SIDE = 8  # threads of such a group, and rows that it sums at a time: THREADS and ROWS of glsl/sat/columns.comp
GROUP = 64  # threads of a work group, as in glsl/sat
LOW_BITS = {8: 0x7F7F7F7F, 32: 0x7FFFFFFF}  # u_low_bits of glsl/sat/word.glsl
_WORD_DTYPES = {8: "<u1", 32: "<u4", 64: "<u8"}


class Table(NamedTuple):
    """Where a table lies in its buffer: `width` × `height` words, `layers` times, from word `first` on."""

    width: int
    height: int
    layers: int = 1
    first: int = 0

    @property
    def words(self) -> int:
        """Words in all layers."""
        return self.width * self.height * self.layers


class SummedAreaTables:
    """The kernels that build, edit and query tables of one word size.

    Parameters
    ----------
    bits
        32, 64 (a uvec2, low half first), or 8: four independent sums side by side in a 32-bit word.
    strip
        Words that one thread adds up. By default `STRIP`, so that a GPU has many threads. For a software renderer,
        which has few cores, it is `WHOLE`: one thread sums a row, and few groups walk down the columns.
    """

    def __init__(self, ctx: moderngl.Context, bits: int = 32, strip: int | None = None) -> None:
        if bits not in _WORD_DTYPES:
            raise ValueError(f"bits: expected 8, 32 or 64, got {bits}")
        self.ctx = ctx
        self.bits = bits
        self.strip = strip or (WHOLE if gl.wants_few_groups(ctx) else STRIP)
        self.word_bytes = max(bits, 32) // 8
        self._has_whole_lines = self.strip == WHOLE and (bits < 64 or INT64 in ctx.extensions)
        self._kernels: dict[str, ComputePass] = {}

    def build(self, buffer: moderngl.Buffer, table: Table) -> None:
        """Turn the values in `buffer` into their table, in place: prefix sums along rows, then along columns."""
        self._check(buffer, table)
        width, height = table[:2]
        if self._has_whole_lines:
            rows = {"first": table.first, "lines": height, "length": width, "line_step": width, "word_step": 1}
            self._run("propagate WHOLE_LINES", _words(buffer), (height, 1, table.layers), GROUP, rows)
            if table.words <= (LARGE if self.bits == 64 else SMALL):
                columns = {"first": table.first, "lines": width, "length": height, "line_step": 1, "word_step": width}
                self._run("propagate WHOLE_LINES", _words(buffer), (width, 1, table.layers), GROUP, columns)
            else:
                self._sum_columns(buffer, table)
            return
        self._sum_lines(buffer, table, lines=height, length=width, line_step=width, word_step=1)
        self._sum_lines(buffer, table, lines=width, length=height, line_step=1, word_step=width)

    def build_steps(self, buffer: moderngl.Buffer, table: Table) -> Steps[None]:
        """Incremental `build`, one layer in each step; yields progress from 0 to 1."""
        for layer in range(table.layers):
            self.build(buffer, table._replace(layers=1, first=table.first + layer * table.width * table.height))
            yield (layer + 1) / table.layers

    def edit(self, buffer: moderngl.Buffer, table: Table, values: moderngl.Buffer, at: Table, x: int, y: int) -> None:
        """Give a rectangle new values; the table becomes the same, bit for bit, as after a rebuild.

        Parameters
        ----------
        values
            New values of the rectangle, all layers; overwritten.
        at
            Size of the rectangle, as a table of its own with `first` 0.
        x, y
            Column and row of the rectangle's corner.
        """
        self._check(buffer, table)
        if x < 0 or y < 0 or x + at.width > table.width or y + at.height > table.height or at.layers != table.layers:
            raise ValueError(f"edit: {at} at ({x}, {y}) does not lie in {table}")
        blocks = {"Words": buffer, "Edits": values}
        place = {"size": table[:2], "edit_at": (x, y), "edit_size": at[:2], "first": table.first}
        self._run("difference", blocks, (at.width, at.height, at.layers), GROUP, place)
        self.build(values, at)
        strips = -(-(table.height - y) // self.strip)
        self._run("spread", blocks, (table.width - x, strips, table.layers), GROUP, place)

    def box_sums(self, buffer: moderngl.Buffer, table: Table, boxes: np.ndarray, layer: int = 0) -> np.ndarray:
        """Sums over boxes (n, 4): (n,) words; with 8 bits (n, 4).

        A row of `boxes` is x0, y0, x1, y1. This box has the columns x0 to x1 − 1 and the rows y0 to y1 − 1.
        """
        corners = np.ascontiguousarray(boxes, "<i4")
        questions = self.ctx.buffer(corners.tobytes())
        answers = self.ctx.buffer(reserve=len(corners) * self.word_bytes)
        blocks = {"Words": buffer, "Boxes": questions, "Sums": answers}
        place = {"boxes": len(corners), "first": table.first, "size": table[:2], "layer": layer}
        self._run("query", blocks, (len(corners), 1, 1), GROUP, place)
        sums = self._words(answers.read()).reshape(len(corners), -1)
        questions.release()
        answers.release()
        return sums if self.bits < 32 else sums[:, 0]

    def read(self, buffer: moderngl.Buffer, table: Table) -> np.ndarray:
        """Words of a table, (layers, height, width); with 8 bits there is a last axis of 4."""
        data = buffer.read(table.words * self.word_bytes, offset=table.first * self.word_bytes)
        shape = (table.layers, table.height, table.width)
        return self._words(data).reshape(shape + (32 // self.bits,) if self.bits < 32 else shape)

    def values(self, buffer: moderngl.Buffer, table: Table) -> np.ndarray:
        """(layers, height, width) values, recovered from the differences in a table of 32 or 64 bits."""
        sums = np.pad(self.read(buffer, table), ((0, 0), (1, 0), (1, 0)))
        return np.diff(np.diff(sums, axis=1), axis=2)

    def release(self) -> None:
        """Release GPU resources."""
        for kernel in self._kernels.values():
            kernel.release()

    def _words(self, data: bytes) -> np.ndarray:
        return np.frombuffer(data, _WORD_DTYPES[self.bits])

    def _sum_lines(self, buffer: moderngl.Buffer, table: Table, **lines: int) -> None:
        """Reduce, scan and propagate along parallel lines of words. Lines of a single strip need only propagate."""
        strips = -(-lines["length"] // self.strip)
        sums = self.ctx.buffer(reserve=lines["lines"] * strips * table.layers * self.word_bytes)
        blocks = {"Words": buffer, "StripSums": sums}
        phases = (("reduce", strips), ("scan", 1), ("propagate", strips))
        for phase, rows in phases if strips > 1 else phases[2:]:
            self._run(phase, blocks, (lines["lines"], rows, table.layers), GROUP, lines | {"first": table.first})
        sums.release()

    def _sum_columns(self, buffer: moderngl.Buffer, table: Table) -> None:
        """Sum whole columns, band by band, in runs that are shorter than llvmpipe's limit of a loop."""
        words = 4 if table.words > LARGE and table.width % 4 == table.first % 4 == 0 else 1
        width, height = table.width // words, table.height
        band = -(-width // (SIDE * BANDS)) * SIDE
        lines = {"first": table.first // words, "lines": width, "length": height, "line_step": 1, "word_step": width}
        rows = LOOPS // (band // SIDE + 2) * SIDE  # llvmpipe also counts the test that ends an inner loop
        for row in range(1, height, rows):
            lines |= {"band": band, "row": row, "end": min(row + rows, height)}
            name = "columns WHOLE_LINES FOURS" if words == 4 else "columns WHOLE_LINES"
            self._run(name, _words(buffer), (width, 1, table.layers), band, lines)

    def _run(
        self, name: str, resources: Resources, threads: tuple[int, int, int], group: int, uniforms: Uniforms
    ) -> None:
        """Run one kernel over `threads`."""
        kernel = self._kernel(name)
        own = {"strip": self.strip, "low_bits": LOW_BITS.get(self.bits)}
        uniforms = {**uniforms, **{key: own[key] for key in own.keys() & kernel.declares_uniforms}}
        kernel.run((-(-threads[0] // group), *threads[1:]), resources, uniforms)
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)

    def _kernel(self, name: str) -> ComputePass:
        """Return the kernel `name`, compiled at its first use.

        `name` is a file of glsl/sat without its ending, then the macros that the kernel is compiled with.
        """
        if name not in self._kernels:
            file, *macros = name.split()
            defines = {"BITS": max(32, self.bits), **dict.fromkeys(macros, 1)}
            self._kernels[name] = ComputePass(self.ctx, f"sat/{file}.comp", defines)
        return self._kernels[name]

    def _check(self, buffer: moderngl.Buffer, table: Table) -> None:
        if min(table[:3]) < 1 or (table.first + table.words) * self.word_bytes > buffer.size:
            raise ValueError(f"{table} of {self.bits}-bit words does not fit a buffer of {buffer.size} bytes")


def _words(buffer: moderngl.Buffer) -> Resources:
    """The words one by one and four by four: glsl/sat/lines.glsl."""
    return {"Words": buffer, "Fours": buffer}
