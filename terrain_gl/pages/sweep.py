"""The sweep over the windows around a page: the sun's horizon of its posts, and the visible sky.

Shaders: glsl/horizon/around.comp, keep.comp, fold.comp, pack.comp. Python twin: `reference.windowed_sines`.
"""

from typing import Any

import moderngl
import numpy as np

from ..basics.steps import Steps
from ..gpu import gl, layout, shaders
from ..gpu.bindings import bind
from ..light.gaussians import SKY_AXES, SKY_SHARPNESS
from ..light.horizon import AZIMUTHS, BATCH, FULL, fold_tables, lattice_directions
from ..light.moments import COSINES, SINES, Direction
from .terrain import PagedTerrain
from .windows import BORDER, MARGIN, PageWindows, hull_bytes, most_windows, scratch_bytes, side_of, sky_side

_BARRIER = moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT


class PageSweep:
    """Makes the light of one page after another, in pools that have a place for each slot."""

    def __init__(self, terrain: PagedTerrain) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        tile = self._tile = terrain.heightmap.tile
        self._side = side_of(tile)
        across = terrain.across
        # Of each slot: sines of the sun's horizon of its posts; visible shares of the sky's lobes, with a border of one
        # texel.
        self.sun = self.ctx.texture((across * (tile + 1),) * 2, 1, dtype="nu2")
        self.sky = self.ctx.texture((across * sky_side(tile),) * 2, 4, dtype="u4")
        for texture in (self.sun, self.sky):
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._directions = lattice_directions(AZIMUTHS)
        self._make_kernels()
        self._make_scratch()

    @property
    def bytes(self) -> int:
        """GPU memory of the pools, and of the scratch memory for one page."""
        pools = 2 * self.sun.width * self.sun.height + 16 * self.sky.width * self.sky.height
        return pools + scratch_bytes(self.terrain.heightmap)

    def send(self, windows: PageWindows, level: int) -> None:
        """Copy windows to the GPU; `level` is that of the first one."""
        count = len(windows.heights)
        posts = self._side + 1
        self._heights.write(np.ascontiguousarray(windows.heights), viewport=(0, 0, posts, posts * count))
        block = np.zeros((), layout.TERRAIN)
        spacing = self.terrain.heightmap.spacing_m
        block["last_post"] = self._side
        block["spacing_m"] = (spacing[0] * 2**level, spacing[1] * 2**level)
        self._block.write(block.tobytes())
        shift, within = np.zeros((2, layout.MAX_WINDOWS, 4), "i4")
        shift[:count, :2] = windows.shift
        within[:count] = windows.inside
        self._around["u_shift"].write(np.ascontiguousarray(shift[:, :2]).tobytes())  # type: ignore[union-attr]
        self._around["u_within"].write(within.tobytes())  # type: ignore[union-attr]
        self._around["u_windows"] = count
        inside = tuple(windows.inside[0].tolist())
        for kernel in (self._around, self._fold, self._keep):
            gl.write_uniforms(kernel, inside=inside)

    def sun_steps(self, slot: int, towards: Direction) -> Steps[None]:
        """The sun's horizon of a page whose windows were sent; yields progress from 0 to 1."""
        self._sweep(towards, 0, self._tile)
        side = self._tile + 1
        bind("horizon/keep.comp", u_horizons=self._horizons, u_kept=self.sun)
        corner = slot % self.terrain.across * side, slot // self.terrain.across * side
        gl.write_uniforms(self._keep, towards=towards, corner=corner, side=side, apron=(self._side - self._tile) // 2)
        self._keep.run(-(-side // 64), side)
        self.ctx.memory_barrier(_BARRIER)
        yield 1.0

    def sky_steps(self, slot: int) -> Steps[None]:
        """The visible sky of a page whose windows from 1 on were sent; yields progress from 0 to 1."""
        texels = sky_side(self._tile)
        first = (self._side - self._tile // 2) // 2 - BORDER * layout.SKY_TEXEL
        for batch in range(AZIMUTHS // BATCH):
            directions = self._directions[batch * BATCH : (batch + 1) * BATCH]
            for layer, towards in enumerate(directions):
                self._sweep(towards, layer, self._tile // 2)
                yield (batch + layer / BATCH) * BATCH / AZIMUTHS
            self._bind_window()
            bind("horizon/fold.comp", u_horizons=self._horizons, **self._tables)
            gl.write_uniforms(self._fold, texels=(texels, texels), first_row=0, first_cell=(first, first))
            gl.write_uniforms(self._fold, directions=directions, batch=batch, is_last=batch == AZIMUTHS // BATCH - 1)
            self._fold.run(-(-texels // 64), texels)
            self.ctx.memory_barrier(_BARRIER)
            yield (batch + 1) * BATCH / AZIMUTHS
        bind("horizon/pack.comp", Shares=self._tables["Shares"], u_packed=self.sky)
        corner = slot % self.terrain.across * texels, slot // self.terrain.across * texels
        gl.write_uniforms(self._pack, texels=(texels, texels), corner=corner)
        self._pack.run(-(-texels // 64), texels)
        self.ctx.memory_barrier(_BARRIER)
        yield 1.0

    def release(self) -> None:
        """Release GPU resources."""
        parts = (self.sun, self.sky, self._heights, self._block, self._horizons, self._hulls, *self._tables.values())
        for resource in (*parts, self._around, self._fold, self._pack, self._keep):
            resource.release()

    def _bind_window(self) -> None:
        bind("blocks/terrain.glsl", Terrain=self._block, u_heights=self._heights)

    def _sweep(self, towards: Direction, layer: int, cells: int) -> None:
        """Compute horizons in one azimuth, at the posts of a page of `cells` cells a side and of its margin."""
        low, high = (self._side - cells) // 2 - MARGIN, (self._side + cells) // 2 + MARGIN
        ahead, aside = towards if abs(towards[0]) >= abs(towards[1]) else towards[::-1]
        steps = (self._side - high, self._side - low) if ahead > 0 else (low, high)  # glsl/horizon/lines.glsl
        drift = sorted(-aside * step for step in steps)
        first, end = low - int(np.ceil(drift[1])) - 1, high - int(np.floor(drift[0])) + 1
        self._bind_window()
        bind("horizon/around.comp", u_horizon=self._horizons, Hulls=self._hulls)
        gl.write_uniforms(self._around, towards=towards, layer=layer, first_line=first, lines=end - first + 1)
        gl.write_uniforms(self._around, core=(low, high))
        self._around.run(-(-(end - first + 1) // 64))
        self.ctx.memory_barrier(_BARRIER)

    def _make_kernels(self) -> None:
        window = {"WINDOW": 1, "LOBES": len(SKY_AXES), "FULL": f"{FULL}.0"}
        tables = {"SINES": SINES, "COSINES": COSINES, "BATCH": BATCH, "TEXEL": layout.SKY_TEXEL}
        self._around, self._keep, self._pack = (
            shaders.compute(self.ctx, f"horizon/{name}.comp", window) for name in ("around", "keep", "pack")
        )
        self._fold = shaders.compute(self.ctx, "horizon/fold.comp", window | tables)
        axes = self._fold["u_axes"]
        assert isinstance(axes, moderngl.Uniform)
        axes.write(SKY_AXES.astype("f4").tobytes())

    def _make_scratch(self) -> None:
        heightmap = self.terrain.heightmap
        posts = self._side + 1
        count = most_windows(heightmap)
        self._heights = gl.texel_texture(self.ctx, (posts, posts * count), "f4")
        self._block = self.ctx.buffer(reserve=layout.TERRAIN.itemsize)
        self._horizons = self.ctx.texture_array((posts, posts, BATCH), 1, dtype="nu2")
        self._hulls = gl.reserve(self.ctx, hull_bytes(heightmap), "hulls of horizons")
        shares = self.ctx.buffer(reserve=4 * len(SKY_AXES) * sky_side(self._tile) ** 2)
        tables = fold_tables(self.ctx, SKY_AXES, SKY_SHARPNESS, self._directions, heightmap.spacing_m)
        self._tables: dict[str, Any] = {"Shares": shares, **tables}
