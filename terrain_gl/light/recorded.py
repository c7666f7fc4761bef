"""A summed-area table with the kernel that writes its values. The tables of heights and of lobes are of this kind."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import moderngl
import numpy as np

from ..basics.steps import Steps, drain
from ..gpu import gl
from ..gpu.passes import ComputePass, Resources, Uniforms
from ..gpu.shaders import Defines
from ..sat import SummedAreaTables, Table

PORTION = 2**17  # words of a layer that one step of `RecordedTable.build_steps` records


class RecordedTable(ABC):
    """A table of 32-bit words in its own buffer, and the kernel that writes the values to sum.

    `record` is the path of that compute shader, `defines` gives its macros. `name` stands in errors about memory.
    """

    def __init__(
        self, ctx: moderngl.Context, table: Table, record: str, name: str, defines: Callable[[], Defines] = dict
    ) -> None:
        self.ctx = ctx
        self.table = table
        self._sat = SummedAreaTables(ctx, 32)
        self._defines = defines
        self._path = record
        self._record: tuple[Defines, ComputePass] | None = None  # the macros of the last run, and its kernel
        self._name = name
        self.buffer = ctx.buffer(reserve=4)  # of the size of the table when that is built
        self._texture = gl.WordTexture(ctx)

    @property
    def texture(self) -> gl.WordTexture:
        """The buffer, seen as a texture."""
        return self._texture.of(self.buffer)

    @property
    def bytes(self) -> int:
        """GPU memory of the table; almost none before it is built."""
        return self.buffer.size

    def build(self) -> None:
        """Write all values and sum them."""
        drain(self.build_steps(self.table.width * self.table.height))

    def build_steps(self, words: int = PORTION) -> Steps[None]:
        """Incremental `build`, about `words` words of a layer a step; yields progress from 0 to 1.

        The old table stays in use until the end.
        """
        fresh = gl.reserve(self.ctx, 4 * self.table.words, self._name)
        height = self.table.height
        step = max(1, words // self.table.width)
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
        for resource in (self.buffer, self._texture, self._sat, *(self._record or ())[1:]):
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

    def _write(self, buffer: moderngl.Buffer, first: tuple[int, int], at: Table, rows: range | None = None) -> None:
        """Write the values of a rectangle, all layers, to the start of a buffer: all its rows, or only `rows`."""
        rows = rows or range(at.height)
        resources, uniforms = self._feed(buffer, {"first": first, "count": at[:2], "first_row": rows.start})
        self._kernel().run((-(-at.width // 64), len(rows), 1), resources, uniforms)
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _kernel(self) -> ComputePass:
        """The kernel for the macros of this moment."""
        defines = self._defines()
        if self._record is None or self._record[0] != defines:
            if self._record:
                self._record[1].release()
            self._record = defines, ComputePass(self.ctx, self._path, defines)
        return self._record[1]

    @abstractmethod
    def _feed(self, buffer: moderngl.Buffer, where: Uniforms) -> tuple[Resources, Uniforms]:
        """What the shader `record` reads, with the buffer that it writes; its uniforms, with its place in the table."""
