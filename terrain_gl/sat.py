"""Summed-area tables, exact at any size, built in place by prefix sums in compute shaders (Crow 1984).

A table is a rectangle of unsigned words in a storage buffer, row after row, layer after layer. Building turns values f
into sums, wrapped modulo 2^bits:

    word[y, x] = S(x + 1, y + 1),   S(x, y) = sum of f(i, j) for i < x, j < y

Differences of wrapped sums are exact: any box whose own sum is below 2^bits comes out right, however large the map.
Lookups in shaders: `glsl/sat/box.glsl`. Specification: `reference.sat`, `reference.box_sum`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import moderngl
import numpy as np

from .gpu import gl, shaders
from .steps import Steps

STRIP = 64  # words that one thread of a GPU adds up
WHOLE = 2**15  # longer than any line of a map; llvmpipe silently ends a thread's loops after 2^16 iterations
PORTION = 2**17  # words of a layer that one step of `RecordedTable.build_steps` records
GROUP = 64  # threads of a work group, as in glsl/sat
_WORD_DTYPES = {8: "<u1", 16: "<u2", 32: "<u4", 64: "<u8"}


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
        32, 64 (a uvec2, low half first), or 16 or 8: two or four independent sums side by side in a 32-bit word.
    strip
        Words that one thread adds up. By default `STRIP`, so that a GPU has many threads. For a software renderer,
        which has few cores, it is the whole line: this needs no sums of strips, and reads each word once, not twice.
    """

    def __init__(self, ctx: moderngl.Context, bits: int = 32, strip: int | None = None) -> None:
        if bits not in _WORD_DTYPES:
            raise ValueError(f"bits: expected 8, 16, 32 or 64, got {bits}")
        self.ctx, self.bits = ctx, bits
        self.strip = strip or (WHOLE if gl.is_software(ctx) else STRIP)
        self.word_bytes = max(bits, 32) // 8
        names = ("reduce", "scan", "propagate", "difference", "spread", "query")
        defines = {"BITS": bits, "STRIP": self.strip}
        self._kernels = {name: shaders.compute(ctx, f"sat/{name}.comp", defines) for name in names}

    def build(self, buffer: moderngl.Buffer, table: Table) -> None:
        """Turn the values in `buffer` into their table, in place: prefix sums along rows, then along columns."""
        self._check(buffer, table)
        width, height = table[:2]
        self._sum_lines(buffer, table, lines=height, length=width, line_step=width, word_step=1)
        self._sum_lines(buffer, table, lines=width, length=height, line_step=1, word_step=width)

    def build_steps(self, buffer: moderngl.Buffer, table: Table) -> Steps[None]:
        """Incremental `build`, a layer a step; yields progress from 0 to 1."""
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
        self._run("difference", blocks, (at.width, at.height, at.layers), **place)
        self.build(values, at)
        strips = -(-(table.height - y) // self.strip)
        self._run("spread", blocks, (table.width - x, strips, table.layers), **place)

    def box_sums(self, buffer: moderngl.Buffer, table: Table, boxes: np.ndarray, layer: int = 0) -> np.ndarray:
        """Sums over boxes (n, 4), each x0, y0, x1, y1, end excluded: (n,) words; (n, 32 / bits) below 32 bits."""
        corners = np.ascontiguousarray(boxes, "<i4")
        questions = self.ctx.buffer(corners.tobytes())
        answers = self.ctx.buffer(reserve=len(corners) * self.word_bytes)
        blocks = {"Words": buffer, "Boxes": questions, "Sums": answers}
        self._run("query", blocks, (len(corners), 1, 1), first=table.first, size=table[:2], layer=layer)
        sums = self._words(answers.read()).reshape(len(corners), -1)
        questions.release()
        answers.release()
        return sums if self.bits < 32 else sums[:, 0]

    def read(self, buffer: moderngl.Buffer, table: Table) -> np.ndarray:
        """Words of a table, (layers, height, width), and a last axis of 2 for 16 bits, of 4 for 8."""
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
        """Reduce, scan, propagate along parallel lines of words; a line that is one strip needs no sums of strips."""
        strips = -(-lines["length"] // self.strip)
        sums = self.ctx.buffer(reserve=lines["lines"] * strips * table.layers * self.word_bytes)
        blocks = {"Words": buffer, "StripSums": sums}
        phases = (("reduce", strips), ("scan", 1), ("propagate", strips))
        for phase, rows in phases if strips > 1 else phases[2:]:
            self._run(phase, blocks, (lines["lines"], rows, table.layers), first=table.first, **lines)
        sums.release()

    def _run(
        self, name: str, blocks: dict[str, moderngl.Buffer], threads: tuple[int, int, int], **uniforms: Any
    ) -> None:
        """Run one kernel over `threads`; blocks and uniforms that it does not declare are left out."""
        kernel: Any = self._kernels[name]
        for block, buffer in blocks.items():
            if gl.has(kernel, block):
                buffer.bind_to_storage_buffer(kernel[block].binding)
        gl.write_uniforms(kernel, **uniforms)
        kernel.run(-(-threads[0] // GROUP), *threads[1:])
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)

    def _check(self, buffer: moderngl.Buffer, table: Table) -> None:
        if min(table[:3]) < 1 or (table.first + table.words) * self.word_bytes > buffer.size:
            raise ValueError(f"{table} of {self.bits}-bit words does not fit a buffer of {buffer.size} bytes")


class RecordedTable(ABC):
    """A table of 32-bit words in its own buffer, and the kernel that writes the values it sums.

    Parameters
    ----------
    record
        Path of the compute shader that writes the values.
    name
        The table's name in an error message about memory.
    defines
        Macros for that shader.
    """

    def __init__(
        self, ctx: moderngl.Context, table: Table, record: str, name: str, defines: Mapping[str, object] | None = None
    ) -> None:
        self.ctx, self.table = ctx, table
        self._sat = SummedAreaTables(ctx, 32)
        self._record: Any = shaders.compute(ctx, record, dict(defines or {}))
        self.buffer = gl.reserve(ctx, 4 * table.words, name)
        self._texture = gl.WordTexture(ctx)

    @property
    def texture(self) -> gl.WordTexture:
        """The buffer, seen as a texture."""
        return self._texture.of(self.buffer)

    @property
    def bytes(self) -> int:
        """GPU memory of the table."""
        return self.buffer.size

    def build(self) -> None:
        """Write all values and sum them."""
        self._write(self.buffer, (0, 0), self.table)
        self._sat.build(self.buffer, self.table)

    def build_steps(self) -> Steps[None]:
        """Incremental `build`; yields progress from 0 to 1. The old table stays in use until the end."""
        fresh, height = gl.reserve(self.ctx, self.buffer.size, "a table that is built again"), self.table.height
        step = max(1, PORTION // self.table.width)
        try:
            for row in range(0, height, step):
                self._write(fresh, (0, 0), self.table, range(row, min(row + step, height)))
                yield 0.7 * row / height
            for share in self._sat.build_steps(fresh, self.table):
                yield 0.7 + 0.3 * share
            self.buffer, fresh = fresh, self.buffer
        finally:
            fresh.release()

    def values(self) -> np.ndarray:
        """(layers, height, width) values, recovered from the sums."""
        return self._sat.values(self.buffer, self.table)

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self.buffer, self._texture, self._sat, self._record):
            resource.release()

    def _rewrite(self, x: int, y: int, width: int, height: int) -> None:
        """Write a rectangle's values again; the table becomes the same as after `build`."""
        at = Table(width, height, self.table.layers)
        if at == self.table:
            self.build()
            return
        values = self.ctx.buffer(reserve=4 * at.words)
        self._write(values, (x, y), at)
        self._sat.edit(self.buffer, self.table, values, at, x, y)
        values.release()

    @abstractmethod
    def _write(self, buffer: moderngl.Buffer, first: tuple[int, int], at: Table, rows: range | None = None) -> None:
        """Write a rectangle's values, all layers, to the start of a buffer; all of its rows, or `rows` alone."""
