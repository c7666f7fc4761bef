"""The sweep over the windows around a page: the sun's horizon of its posts, and the visible sky.

Shaders: glsl/horizon/around.comp, keep.comp, fold.comp. Python twin: `reference.windowed_sines`.
"""

from typing import Any

import moderngl
import numpy as np

from ..basics.steps import Steps
from ..gpu import gl, layout
from ..gpu.passes import ComputePass, Resources
from ..light.gaussians import SKY_AXES, SKY_SHARPNESS
from ..light.horizon import AZIMUTHS, FULL, fold_tables, fold_uniforms, lattice_directions
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
        self._windows: dict[str, Any] = {}  # uniforms about the windows that were sent
        self._inside: dict[str, Any] = {}
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
        shift = np.zeros((layout.MAX_WINDOWS, 2), "i4")
        within = np.zeros((layout.MAX_WINDOWS, 4), "i4")
        shift[:count] = windows.shift
        within[:count] = windows.inside
        self._windows = {"windows": count, "shift": list(map(tuple, shift.tolist()))}
        self._windows["within"] = list(map(tuple, within.tolist()))
        self._inside = {"inside": tuple(windows.inside[0].tolist())}

    def sun_steps(self, slot: int, towards: Direction) -> Steps[None]:
        """The sun's horizon of a page whose windows were sent; yields progress from 0 to 1."""
        self._sweep(towards, 0, self._tile)
        side = self._tile + 1
        corner = slot % self.terrain.across * side, slot // self.terrain.across * side
        where = {"towards": towards, "corner": corner, "side": side, "apron": (self._side - self._tile) // 2}
        read = {**self._window, "u_horizons": self._horizons, "u_kept": self.sun}
        self._keep.run((-(-side // 64), side, 1), read, self._inside | where)
        self.ctx.memory_barrier(_BARRIER)
        yield 1.0

    def sky_steps(self, slot: int) -> Steps[None]:
        """The visible sky of a page whose windows from 1 on were sent; yields progress from 0 to 1."""
        texels = sky_side(self._tile)
        corner = slot % self.terrain.across * texels, slot // self.terrain.across * texels
        first = (self._side - self._tile // 2) // 2 - BORDER * layout.SKY_TEXEL
        for layer, towards in enumerate(self._directions):
            self._sweep(towards, layer, self._tile // 2)
            yield 0.5 * layer / AZIMUTHS
        where = {"texels": (texels, texels), "first_cell": (first, first), "corner": corner}
        uniforms = fold_uniforms(SKY_AXES, self._directions) | self._inside | where
        read = {**self._window, **self._tables, "u_horizons": self._horizons, "u_packed": self.sky}
        at_once = -(-texels // 4)
        for row in range(0, texels, at_once):
            rows = min(at_once, texels - row)
            self._fold.run((-(-texels // 64), rows, 1), read, {**uniforms, "first_row": row})
            self.ctx.memory_barrier(_BARRIER)
            yield 0.5 + 0.5 * (row + rows) / texels

    def release(self) -> None:
        """Release GPU resources."""
        parts = (self.sun, self.sky, self._heights, self._block, self._horizons, self._hulls, *self._tables.values())
        for resource in (*parts, self._around, self._fold, self._keep):
            resource.release()

    @property
    def _window(self) -> Resources:
        """The windows, which take the place of the map (glsl/blocks/terrain.glsl)."""
        return {"Terrain": self._block, "u_heights": self._heights}

    def _sweep(self, towards: Direction, layer: int, cells: int) -> None:
        """Compute horizons in one azimuth, at the posts of a page of `cells` cells a side and of its margin."""
        low, high = (self._side - cells) // 2 - MARGIN, (self._side + cells) // 2 + MARGIN
        ahead, aside = towards if abs(towards[0]) >= abs(towards[1]) else towards[::-1]
        steps = (self._side - high, self._side - low) if ahead > 0 else (low, high)  # glsl/horizon/lines.glsl
        drift = sorted(-aside * step for step in steps)
        first, end = low - int(np.ceil(drift[1])) - 1, high - int(np.floor(drift[0])) + 1
        count = end - first + 1
        where = {"towards": towards, "layer": layer, "first_line": first, "lines": count, "core": (low, high)}
        read = {**self._window, "u_horizon": self._horizons, "Hulls": self._hulls}
        self._around.run((-(-count // 64), 1, 1), read, self._windows | self._inside | where)
        self.ctx.memory_barrier(_BARRIER)

    def _make_kernels(self) -> None:
        window = {"WINDOW": 1, "LOBES": len(SKY_AXES), "FULL": f"{FULL}.0"}
        tables = {"SINES": SINES, "COSINES": COSINES, "AZIMUTHS": AZIMUTHS, "TEXEL": layout.SKY_TEXEL}
        self._around, self._keep = (
            ComputePass(self.ctx, f"horizon/{name}.comp", window) for name in ("around", "keep")
        )
        self._fold = ComputePass(self.ctx, "horizon/fold.comp", window | tables)

    def _make_scratch(self) -> None:
        heightmap = self.terrain.heightmap
        posts = self._side + 1
        count = most_windows(heightmap)
        self._heights = gl.texel_texture(self.ctx, (posts, posts * count), "f4")
        self._block = self.ctx.buffer(reserve=layout.TERRAIN.itemsize)
        self._horizons = self.ctx.texture_array((posts, posts, AZIMUTHS), 1, dtype="nu2")
        self._hulls = gl.reserve(self.ctx, hull_bytes(heightmap), "hulls of horizons")
        shares = self.ctx.buffer(reserve=4 * len(SKY_AXES) * sky_side(self._tile) ** 2)
        tables = fold_tables(self.ctx, SKY_AXES, SKY_SHARPNESS, self._directions, heightmap.spacing_m)
        self._tables: dict[str, Any] = {"Shares": shares, **tables}
