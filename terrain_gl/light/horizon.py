"""Visibility: the shares of the sky's lobes and of the sun that each place sees, in summed-area tables.

The light of the sky is soft. So a sweep over every second post finds the horizons in 16 azimuths
(glsl/horizon/sweep.comp). From the horizons we compute the visible share of each sky lobe, one texel for 2 × 2 cells
(fold.comp). The sun has its own horizon, of every post, and its own table (sunlit.comp). If the sun moves, only its
horizon and its table are built again. Python twins: `reference.horizon`.
"""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..basics.steps import Steps, drain
from ..camera import Vector
from ..gpu import gl
from ..gpu.passes import ComputePass, Resources, Uniforms
from ..gpu.session import Resource
from ..heightmap import Heightmap
from ..sat import SummedAreaTables, Table
from ..terrain import Terrain
from .gaussians import SUN_RADIUS_DEG
from .moments import COSINES, SINES, Direction, open_shares, sector_moments
from .recorded import RecordedTable

AZIMUTHS = 16  # azimuths of the sky's horizons
TEXEL = 2  # the sky is swept over every second post, so a texel has 2 × 2 cells of the map
PORTION = 2**19  # posts that one step of `Visibility.follow_steps` sweeps
FOLDED = PORTION // 64  # texels that one step folds
SUN_LAYERS = 5  # glsl/horizon/disc.glsl
SUN_STEPS = 8191  # the integer for a value of 1 in the table of sunlight
FULL = 4095  # the integer for a share of 1; the sum of 2^20 texels fits into a word
SUN_RADIUS = math.radians(SUN_RADIUS_DEG)
HULL_BYTES = 2**26  # the most scratch memory that a sweep takes
_HULL_POINT = 8
_BARRIER = moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT


def sky_table(cols: int, rows: int, lobes: int) -> Table:
    """The size of the tables of the visible sky."""
    return Table(-(-(cols - 1) // TEXEL), -(-(rows - 1) // TEXEL), lobes)


def sun_table(cols: int, rows: int) -> Table:
    """The size of the table of sunlight."""
    return Table(cols // 2, rows // 2, SUN_LAYERS)


class Sweep:
    """Horizons of all posts of a map towards one azimuth at a time."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._pass = ComputePass(ctx, "horizon/sweep.comp")
        self._hulls: moderngl.Buffer | None = None  # scratch memory, kept until `rest`, because new memory is slow

    def run(self, terrain: Terrain, towards: Direction, into: moderngl.TextureArray, layer: int = 0) -> None:
        """Write the horizons' sines in the lattice direction `towards` (see `lattice_direction`) to a layer."""
        drain(self.run_steps(terrain, towards, into, layer, into.width * into.height))
        self.rest()

    def run_steps(
        self,
        terrain: Terrain,
        towards: Direction,
        into: moderngl.TextureArray,
        layer: int = 0,
        posts: int = PORTION,
    ) -> Steps[None]:
        """Incremental `run`, about `posts` posts a step; yields progress from 0 to 1."""
        cols, rows = into.size[:2]
        by_column = abs(towards[0]) >= abs(towards[1])
        steps, places = (cols, rows) if by_column else (rows, cols)
        slide = -towards[1] if by_column else -towards[0]
        drift = math.ceil(abs(slide) * (steps - 1))
        first = -drift if slide > 0 else 0
        lines = places + drift
        at_once = min(lines, max(128, min(posts * lines // places, HULL_BYTES // _HULL_POINT) // steps))
        hulls = self._reserve(_HULL_POINT * steps * at_once)
        for start in range(0, lines, at_once):
            count = min(at_once, lines - start)
            where = {"towards": towards, "layer": layer, "first_line": first + start, "lines": count}
            self._pass.run((-(-count // 64), 1, 1), {**terrain.resources, "u_horizon": into, "Hulls": hulls}, where)
            self.ctx.memory_barrier(_BARRIER)  # the next lines use the same memory
            yield (start + count) / lines

    def rest(self) -> None:
        """Release the scratch memory until the next run."""
        if self._hulls:
            self._hulls.release()
        self._hulls = None

    def release(self) -> None:
        """Release GPU resources."""
        self.rest()
        self._pass.release()

    def _reserve(self, size: int) -> moderngl.Buffer:
        if self._hulls is None or self._hulls.size < size:
            self.rest()
            self._hulls = gl.reserve(self.ctx, size, "hulls of horizons")
        return self._hulls


class SkyVisibility:
    """Tables of the visible share of each sky lobe; `axes` are (K, 3). They depend on the map alone."""

    def __init__(self, terrain: Terrain, axes: np.ndarray, sharpness: np.ndarray, printed: int = 0) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        self.axes = np.asarray(axes, "f8")
        self.sharpness = np.asarray(sharpness, "f8")
        self.table = sky_table(terrain.heightmap.cols, terrain.heightmap.rows, len(self.axes))
        self.directions = lattice_directions(AZIMUTHS)
        defines = {"LOBES": len(self.axes), "SINES": SINES, "COSINES": COSINES, "AZIMUTHS": AZIMUTHS, "TEXEL": 1}
        self._fold = ComputePass(self.ctx, "horizon/fold.comp", defines | {"FULL": f"{FULL}.0", "PRINTED": printed})
        self._printed = printed
        self._sweep = Sweep(self.ctx)
        self._sat = SummedAreaTables(self.ctx, 32)
        self.buffer = self.ctx.buffer(reserve=4)  # this and `packed` have the size of the table when that is built
        self.packed = self._texture((1, 1))
        self.texture = gl.WordTexture(self.ctx)

    @property
    def bytes(self) -> int:
        """GPU memory of the sums, and of the shares themselves; almost none before they are built."""
        return self.buffer.size + 16 * self.packed.width * self.packed.height

    def build(self) -> None:
        """Sweep, fold and sum."""
        drain(self.build_steps(self.terrain.heightmap.rows * self.terrain.heightmap.cols))

    def build_steps(self, posts: int = PORTION) -> Steps[None]:
        """Incremental `build`, about `posts` posts a step; yields progress from 0 to 1.

        The old tables stay in use until the last step.
        """
        at_once = max(1, FOLDED * posts // PORTION // self.table.width)
        fresh = gl.reserve(self.ctx, 4 * self.table.words, "tables of the visible sky")
        packed = self._texture(self.table[:2])
        spacing_m = self.terrain.heightmap.spacing_m
        tables = fold_tables(self.ctx, self.axes, self.sharpness, self.directions, spacing_m, self._printed)
        thin = thinned(self.terrain)
        horizons = horizon_texture(thin, AZIMUTHS)
        read = {**thin.resources, **tables, "u_horizons": horizons, "Shares": fresh, "u_packed": packed}
        try:
            for layer, towards in enumerate(self.directions):
                for share in self._sweep.run_steps(thin, towards, horizons, layer, posts):
                    yield 0.5 * (layer + share) / AZIMUTHS
            for row in range(0, self.table.height, at_once):
                count = min(at_once, self.table.height - row)
                self._fold_rows(row, count, read)
                yield 0.5 + 0.48 * (row + count) / self.table.height
            for _ in self._sat.build_steps(fresh, self.table):
                yield 0.998
            self.buffer, fresh = fresh, self.buffer
            self.packed, packed = packed, self.packed
        finally:
            self._sweep.rest()
            scratch: list[Resource] = [thin, horizons, fresh, packed, *tables.values()]
            for resource in scratch:
                resource.release()
        yield 1.0

    def read(self) -> np.ndarray:
        """(K, rows, cols) visible shares of each texel, 0 to 1, recovered from the sums."""
        return self._sat.values(self.buffer, self.table) / FULL

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self._fold, self._sweep, self._sat, self.buffer, self.packed, self.texture):
            resource.release()

    def _texture(self, size: tuple[int, int]) -> moderngl.Texture:
        texture = self.ctx.texture(size, 4, dtype="u4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _fold_rows(self, row: int, count: int, read: Resources) -> None:
        where = {"texels": self.table[:2], "first_row": row, "first_cell": (0, 0), "corner": (0, 0)}
        uniforms = fold_uniforms(self.axes, self.directions) | where
        self._fold.run((-(-self.table.width // 64), count, 1), read, uniforms)
        self.ctx.memory_barrier(_BARRIER)


class SunVisibility(RecordedTable):
    """The sun's horizon at every post, and the table of the sunlight that reaches the cells."""

    def __init__(self, terrain: Terrain, printed: int = 0) -> None:
        size = sun_table(terrain.heightmap.cols, terrain.heightmap.rows)
        super().__init__(terrain.ctx, size, "horizon/sunlit.comp", "a table of sunlight", lambda: {"PRINTED": printed})
        self.terrain = terrain
        self.horizon = self.ctx.texture_array((1, 1, 1), 1, dtype="nu2")  # of the map's size when that is swept
        self.towards: Direction = (1.0, 0.0)
        self._sweep = Sweep(self.ctx)

    def follow(self, sun: Vector, radius: float = SUN_RADIUS) -> None:
        """Build for a sun in a direction (unit vector east, north, up), with an angular radius in radians."""
        drain(self.follow_steps(sun, radius, self.terrain.heightmap.rows * self.terrain.heightmap.cols))

    def follow_steps(self, sun: Vector, radius: float = SUN_RADIUS, posts: int = PORTION) -> Steps[None]:
        """Incremental `follow`, about `posts` posts a step; yields progress. The old table is used until the end."""
        towards = lattice_direction(sun, self.terrain.heightmap.spacing_m)
        horizon = horizon_texture(self.terrain, 1)
        try:
            for share in self._sweep.run_steps(self.terrain, towards, horizon, 0, posts):
                yield 0.6 * share
            self._wanted = horizon, towards, sun, radius
            for share in self.build_steps():
                yield 0.6 + 0.4 * share
            self.towards = towards
            self.horizon, horizon = horizon, self.horizon
        finally:
            self._sweep.rest()
            horizon.release()

    def _feed(self, buffer: moderngl.Buffer, where: Uniforms) -> tuple[Resources, Uniforms]:
        horizon, towards, sun, radius = self._wanted
        read = {**self.terrain.resources, "u_horizons": horizon, "Sunlit": buffer}
        uniforms = {**sun_uniforms(sun, radius), "towards": towards, "sun": sun}
        return read, {**uniforms, "first_row": where["first_row"]}  # it always writes the whole table

    def read(self) -> np.ndarray:
        """(5, rows, cols) means over texels of 2 × 2 cells, recovered from the sums: see glsl/horizon/sunlit.comp."""
        return self.values().view("i4") / SUN_STEPS

    def release(self) -> None:
        """Release GPU resources."""
        super().release()
        self.horizon.release()
        self._sweep.release()


class Visibility:
    """Shadows for shading: tables over the map for the sky's lobes and for the sun, built when first used.

    An edit changes the horizons of all places that see the edited ground. So after an edit, whole tables are built
    again when they are next used. For comparison only, `printed` 1 and 2 mean the supplement's visibility, equation A.5
    (benchmarks/glsl/prefilter/printed.frag).
    """

    def __init__(self, terrain: Terrain, lobe_axes: np.ndarray, lobe_sharpness: np.ndarray, printed: int = 0) -> None:
        self.sky = SkyVisibility(terrain, lobe_axes, lobe_sharpness, printed)
        self.sun = SunVisibility(terrain, printed)
        self._edits = 0  # number of edits; more may come while tables are built in steps
        self._sky_of = self._sun_of = -1  # number of edits that each table includes
        self._at: tuple[Vector, float] | None = None

    @property
    def bytes(self) -> int:
        """GPU memory of the tables."""
        return self.sky.bytes + self.sun.bytes + 2 * self.sun.horizon.width * self.sun.horizon.height

    @property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include horizon/visible.glsl."""
        return {"LOBES": len(self.sky.axes), "TEXEL": TEXEL, "FULL": f"{FULL}.0"}

    def follow(self, sun: Vector, radius: float = SUN_RADIUS) -> None:
        """Build missing tables for a sun, given as a unit vector and the disc's angular radius in radians."""
        heightmap = self.sky.terrain.heightmap
        drain(self.follow_steps(sun, radius, heightmap.rows * heightmap.cols))

    def follow_steps(self, sun: Vector, radius: float = SUN_RADIUS, posts: int = PORTION) -> Steps[None]:
        """Incremental `follow`, about `posts` posts a step; yields progress 0 to 1, or nothing if none is missing."""
        edits = self._edits
        if self._at is None or self._at != (sun, radius) or self._sun_of != edits:
            for share in self.sun.follow_steps(sun, radius, posts):
                yield 0.1 * share
            self._at = (sun, radius)
            self._sun_of = edits
        edits = self._edits
        if self._sky_of != edits:
            for share in self.sky.build_steps(posts):
                yield 0.1 + 0.9 * share
            self._sky_of = edits

    @property
    def is_there(self) -> bool:
        """Whether there are tables. They may still be those of an earlier sun, or of the map before an edit."""
        return self._sky_of >= 0

    def update(self, posts: Rect) -> None:
        """Follow an edit of posts, (x0, y0, x1, y1): tables are built again when they are next used."""
        self._edits += 1

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of horizon/visible.glsl."""
        assert self._at
        return {**sun_uniforms(*self._at), "sun_towards": self.sun.towards}

    @property
    def resources(self) -> Resources:
        """The tables, for shaders that include horizon/visible.glsl."""
        sky = self.sky
        sun = self.sun
        sums: Resources = {"Shares": sky.buffer, "Sunlit": sun.buffer}
        unsummed: Resources = {"u_packed": sky.packed, "u_sun_horizon": sun.horizon}
        return {**sums, **unsummed, "u_shares": sky.texture.of(sky.buffer), "u_sunlit": sun.texture}

    def release(self) -> None:
        """Release GPU resources."""
        self.sky.release()
        self.sun.release()


def thinned(terrain: Terrain) -> Terrain:
    """A map of every second post (`TEXEL`), with voids filled; its last column and row are those of the map."""
    rows, cols = (np.minimum(np.arange(0, n - 1 + TEXEL, TEXEL), n - 1) for n in terrain.filled.shape)
    east, north = terrain.heightmap.spacing_m
    heights = np.ascontiguousarray(terrain.filled[np.ix_(rows, cols)])
    return Terrain(terrain.ctx, Heightmap(heights, (TEXEL * east, TEXEL * north)))


def fold_tables(
    ctx: moderngl.Context,
    axes: np.ndarray,
    sharpness: np.ndarray,
    directions: list[Direction],
    spacing_m: tuple[float, float],
    printed: int = 0,
) -> Resources:
    """The tables that fold.comp reads besides horizons, by name in the shader."""
    moments = sector_moments(axes, sharpness, directions, spacing_m)
    azimuths, sines, lobes, _ = moments.shape
    texture = ctx.texture((lobes, azimuths * sines), 4, moments.astype("f4").tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    above = moments[:, SINES // 2, :, 3].sum(0)  # share of each lobe above the horizontal
    opened = np.repeat(above[:, None], COSINES + 1, 1) if printed else open_shares(sharpness)
    return {"u_moments": texture, "Open": ctx.buffer(opened.astype("f4").tobytes())}


def fold_uniforms(axes: np.ndarray, directions: list[Direction]) -> dict[str, Any]:
    """Uniforms of fold.comp."""
    return {"axes": [tuple(axis) for axis in axes.astype("f4").tolist()], "directions": directions}


def horizon_texture(terrain: Terrain, layers: int) -> moderngl.TextureArray:
    """A texture for horizons: two bytes for each post and layer."""
    heightmap = terrain.heightmap
    texture = terrain.ctx.texture_array((heightmap.cols, heightmap.rows, layers), 1, dtype="nu2")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def sun_uniforms(sun: Vector, radius: float) -> dict[str, float]:
    """Uniforms of horizon/disc.glsl."""
    return {"sun_elevation": math.asin(max(-1.0, min(1.0, sun[2]))), "sun_radius": max(radius, 1e-4)}


def lattice_direction(towards: Vector, spacing_m: tuple[float, float]) -> Direction:
    """Columns and rows of a step towards a direction of the world; the larger of both is ±1. Straight up gives east."""
    along, down = towards[0] / spacing_m[0], -towards[1] / spacing_m[1]
    most = max(abs(along), abs(down))
    return (along / most, down / most) if most > 1e-9 * abs(towards[2]) else (1.0, 0.0)


def lattice_directions(count: int) -> list[Direction]:
    """`count` directions, counter-clockwise from the east; `count` is a multiple of 8.

    A direction is a step in columns and rows; the larger of both is 1. Therefore many posts lie exactly on lines.
    """
    fine = count // 8
    eighth = [(1.0, i / fine) for i in range(fine)]
    quarter = eighth + [(i / fine, 1.0) for i in range(fine, 0, -1)]
    half = quarter + [(-y, x) for x, y in quarter]
    return [(x, -y) for x, y in half] + [(-x, y) for x, y in half]
