"""The ground's merged lobes: summed-area tables over normals, half-vectors and albedo. A texel is 2 × 2 cells.

Values: glsl/light/record.comp. Lookups in shaders: glsl/light/merged.glsl. Specification: `reference.lobe_values`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import moderngl
import numpy as np

from ..gpu.bindings import bind
from ..heightmap import Heightmap
from ..sat import RecordedTable, Table
from ..terrain import Rect, Terrain
from .ground import HeightSums

LAYERS = 9
HOLLOW = 8  # a cell's cover depends on the posts so far around it: glsl/shade/cover.glsl looks at boxes up to 16 wide
_GREENNESS = 0.27, 0.42  # hypsometric integrals between which land turns from green to arid: glsl/shade/character.glsl
_GRID = 64  # the hypsometric integral is rounded to 1/64: small edits then change no cover


class Character(NamedTuple):
    """What kind of land a map shows; glsl/shade/character.glsl chooses its cover by this."""

    hypsometric: float
    rms_slope: float

    @classmethod
    def of(cls, heightmap: Heightmap) -> Character:
        """Measure at most about 512 × 512 posts, evenly spread, and round: most edits then change nothing."""
        step = max(1, min(heightmap.rows, heightmap.cols) // 512)
        low, high = heightmap.range_m
        heights = heightmap.heights[::step, ::step].astype(np.float64)
        slopes = [np.diff(heights, axis=i) / (step * heightmap.spacing_m[1 - i]) for i in (0, 1)]
        mean_square = sum(float(np.nanmean(s * s)) for s in slopes if np.isfinite(s).any())
        hypsometric = (float(np.nanmean(heights)) - low) / max(high - low, 1e-30)
        return cls(round(hypsometric * _GRID) / _GRID, _rounded(math.sqrt(mean_square)))


def _rounded(slope: float) -> float:
    """Round to an eighth of the power of two below."""
    step = 2.0 ** (math.floor(math.log2(max(slope, 1e-9))) - 3)
    return round(slope / step) * step


class Cover:
    """What covers the ground: what the map's character suggests, or a picture of the ground."""

    def __init__(self, ctx: moderngl.Context, heightmap: Heightmap) -> None:
        self.ctx, self.character = ctx, Character.of(heightmap)
        self.picture: moderngl.Texture | None = None
        self._none = ctx.texture((1, 1), 3)

    def take_picture(self, albedo: np.ndarray | None) -> None:
        """Use a picture of linear albedo, north up, over the whole map; None: the map's own cover.

        Parameters
        ----------
        albedo
            (rows, cols, 3); or (rows, cols, 4), with the share of a texel that the picture covers.
        """
        if self.picture:
            self.picture.release()
        self.picture = None
        if albedo is not None:
            rows, cols, channels = albedo.shape
            self.picture = self.ctx.texture(
                (cols, rows), channels, np.ascontiguousarray(albedo, "f2").tobytes(), dtype="f2", alignment=1
            )
            self.picture.build_mipmaps()
            self.picture.repeat_x = self.picture.repeat_y = False
            self.picture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)

    @property
    def defines(self) -> dict[str, object]:
        """Macros for a program that serves this cover alone, and leaves the code for others out."""
        low, high = _GREENNESS
        kinds = {"GREEN": self.character.hypsometric < high, "ARID": self.character.hypsometric > low}
        return {name: str(is_so).lower() for name, is_so in {"PICTURED": self.picture is not None, **kinds}.items()}

    def bind(self, program: moderngl.Program | moderngl.ComputeShader) -> None:
        """Bind the cover to a program that includes glsl/shade/cover.glsl."""
        for name, value in (self.character._asdict() | {"pictured": self.picture is not None}).items():
            if f"u_{name}" in program:
                program[f"u_{name}"] = value
        bind("shade/cover.glsl", u_albedo=self.picture or self._none)

    def release(self) -> None:
        """Release GPU resources."""
        self.take_picture(None)
        self._none.release()


class LobeTables(RecordedTable):
    """The summed-area tables of nine values of each block: 9 bytes a post."""

    def __init__(self, terrain: Terrain, sums: HeightSums, cover: Cover, build: bool = True) -> None:
        size = Table(terrain.heightmap.cols // 2, terrain.heightmap.rows // 2, LAYERS)
        super().__init__(terrain.ctx, size, "light/record.comp", "tables of lobes")
        self.terrain, self.sums, self.cover = terrain, sums, cover
        if build:
            self.build()

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        last = self.table.width - 1, self.table.height - 1
        x0, y0 = (max(0, (posts[i] - HOLLOW - 1) // 2) for i in (0, 1))
        x1, y1 = (min(last[i], (posts[i + 2] + HOLLOW) // 2) for i in (0, 1))
        self._rewrite(x0, y0, x1 - x0 + 1, y1 - y0 + 1)

    def read(self) -> np.ndarray:
        """(9, rows, cols) values of the blocks, taken out of the sums."""
        return self.values().view("i4") / 32767.0

    def _write(self, buffer: moderngl.Buffer, first: tuple[int, int], at: Table, rows: range | None = None) -> None:
        rows = rows or range(at.height)
        self.terrain.bind()
        bind("light/record.comp", HeightSums=self.sums.buffer, Values=buffer)
        self.cover.bind(self._record)
        self._record["u_first"], self._record["u_count"], self._record["u_first_row"] = first, at[:2], rows.start
        self._record.run(-(-at.width // 64), len(rows))
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
