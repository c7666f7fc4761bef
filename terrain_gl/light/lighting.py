"""Light on the GPU: the block of lobes, the sky's dome, the ground's merged lobes, and the visibility of the sky."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Rect
from ..basics.steps import Steps, drain
from ..gpu import gl
from ..gpu.passes import Resource, Resources
from ..heightmap import Heightmap
from ..readers.georeference import Georeference
from ..sat import Table
from ..terrain import Terrain
from .atmosphere import LUMINANCE
from .climate import AUTO, is_of_earth
from .gaussians import LIGHTS, SKY_AXES, SKY_SHARPNESS
from .ground import HeightSums
from .horizon import PORTION, Visibility, sky_table, sun_table
from .laid import Draped, read_ground, read_values
from .lobes import LAYERS, Cover, LobeTables, lobe_table
from .ramps import Ground, Photo, Ramp, Values
from .sky import Sky, black_sky, clear_sky, read_sky

# Exposure times irradiance in full light: with it, the log mean of the bundled default view is 0.18, mid-grey.
KEY = 13.0
ADAPTATION = 0.83  # strength of the eye's adaptation to the light; with 1, night would look as bright as noon
NO_HAZE_M = 1e18
DUSK = 2.0  # irradiance when the sun has just set
FULL_LIGHT = 22.0  # irradiance at which the picture is exposed by KEY alone


class Version(NamedTuple):
    """A version of a file: its path, time and size."""

    path: str
    written_ns: int = 0
    size: int = 0

    @classmethod
    def of(cls, path: str) -> Version:
        """The version now on disk. A missing file is no error here: the reader reports it."""
        try:
            state = os.stat(path)
        except OSError:
            return cls(path)
        return cls(path, state.st_mtime_ns, state.st_size)


def tables_of(cols: int, rows: int) -> dict[str, Table]:
    """The tables that light needs for a map in memory, by their names in messages."""
    return {
        "tables of lobes": lobe_table(cols, rows),
        "tables of sunlight": sun_table(cols, rows),
        "sums of heights": Table(cols, rows),
        "tables of the visible sky": sky_table(cols, rows, len(SKY_AXES)),
    }


def check_room(ctx: moderngl.Context, heightmap: Heightmap) -> None:
    """Raise `TerrainError` if the light's tables of a map are more than this driver's storage blocks hold."""
    most = gl.storage_block_bytes(ctx)
    for what, table in tables_of(heightmap.cols, heightmap.rows).items():
        if 4 * table.words > most:
            takes = f"take {4 * table.words >> 20} MiB, and this driver's storage blocks hold {most >> 20}"
            advice = "draw it from a store (terrain-gl build), or give --style lambert"
            raise TerrainError(f"{heightmap.name}: needs light, whose {what} {takes}: {advice}")


class Lighting:
    """Everything that shades a map, except its heights and their sums.

    For comparison only, `printed` 1 and 2 are steps towards the supplement's light (benchmarks/glsl/prefilter).
    """

    has_lobes = True  # whether there are tables of the ground's lobes
    missing = 0  # for a paged map: number of pages in the picture that have no light of their own
    is_coming = False  # whether more light will come without a change of the look

    def __init__(self, terrain: Terrain, sums: HeightSums, printed: int = 0) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        self.sums = sums
        most_words = LAYERS * terrain.heightmap.rows * terrain.heightmap.cols // 4
        self._words = {"WORDS_IN_TEXTURES": 1} if most_words <= gl.limits(self.ctx)["texture_buffer_texels"] else {}
        self._printed = printed
        self.cover = Cover(terrain)
        self.visibility = self._visibility()
        self.block = self.ctx.buffer(reserve=LIGHTS.itemsize)
        self.lobes: LobeTables | None = None
        self.dome: moderngl.Texture | None = None
        self.sky: Sky | None = None
        self.fills: np.ndarray | None = None  # (rows, cols, 4) of polygons that colour the ground over its picture
        self._material: tuple[Version | None, Ground | None, int] = None, None, id(None)
        self._lobes_wanted = 1  # the version of the lobes that is needed; then the one that exists
        self._lobes_of = 0

    def _visibility(self) -> Visibility:
        return Visibility(self.terrain, SKY_AXES, SKY_SHARPNESS, self._printed)

    @property
    def bytes(self) -> int:
        """GPU memory that grows with the map: without the sky and a picture of the ground."""
        return self.visibility.bytes + (self.lobes.bytes if self.lobes else 0)

    @property
    def has_air(self) -> bool:
        """Whether there is air over the land: the Earth has some, the Moon has none."""
        return is_of_earth(self.terrain.heightmap)

    @property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include glsl/light/lit.glsl."""
        printed = {"PRINTED": self._printed} if self._printed else {}
        return self.visibility.defines | self.cover.defines | self._words | printed

    def update(self, posts: Rect) -> None:
        """Follow an edit of posts, (x0, y0, x1, y1), after the sums of heights did."""
        self.visibility.update(posts)
        everywhere = posts == (0, 0, self.terrain.heightmap.cols - 1, self.terrain.heightmap.rows - 1)
        if everywhere or self._lobes_of != self._lobes_wanted:
            self._lobes_wanted += 1
        elif self.lobes:
            self.lobes.update(posts)

    def follow(
        self,
        sun: tuple[float, float],
        sky: str | None = None,
        material: Ground | None = None,
        look: str | Ramp = AUTO,
    ) -> None:
        """Make the missing light for a sun (azimuth, elevation), a sky's file, a picture of the ground and a look."""
        heightmap = self.terrain.heightmap
        self._run(self.follow_steps(sun, sky, material, look, heightmap.rows * heightmap.cols))

    def _run(self, steps: Steps[None]) -> None:
        drain(steps)

    def follow_steps(
        self,
        sun: tuple[float, float],
        sky: str | None = None,
        material: Ground | None = None,
        look: str | Ramp = AUTO,
        posts: int = PORTION,
    ) -> Steps[None]:
        """Incremental `follow`, about `posts` posts a step; yields progress 0 to 1, or nothing if none is missing."""
        self._lobes_wanted += self.cover.take_look(look)
        version = material and Version.of(material.path), material, id(self.fills)
        place = self.terrain.heightmap.georeference
        if version != self._material:
            ground = None if material is None else ground_seen(material, place)
            self.cover.take_picture(ground if self.fills is None else filled(ground, self.fills))
            self._material = version
            self._lobes_wanted += 1
            yield 0.01
        if (wanted := self._lobes_wanted) != self._lobes_of and self.has_lobes:
            self.lobes = self.lobes or LobeTables(self.terrain, self.sums, self.cover, False)
            for share in self.lobes.build_steps():
                yield 0.01 + 0.07 * share
            self._lobes_of = wanted
        lit_by = self._sky_of(sun, sky)
        if lit_by is None:
            return
        if lit_by is not self.sky:
            self._hang(lit_by.radiance)
            self.sky = lit_by
            yield 0.1
        east, north, up = (float(v) for v in lit_by.sun["axis"])
        for share in self.visibility.follow_steps((east, north, up), posts=posts):
            yield 0.1 + 0.9 * share

    def _sky_of(self, sun: tuple[float, float], path: str | None) -> Sky | None:
        """The sky of a sun or of a file; None if it is not ready yet."""
        return sky_seen(sun, path, self.has_air, self.north_deg)

    @property
    def north_deg(self) -> float:
        """Direction of true north, from which azimuths count, in degrees clockwise from the grid's."""
        return self.terrain.heightmap.north_deg

    @property
    def is_there(self) -> bool:
        """Whether there is light to draw with. It may still be that of an earlier sun, or of the map before an edit."""
        return self.sky is not None and self.visibility.is_there

    def rehearse(self) -> bool:
        """Run all passes that make light once, so that they are compiled; returns whether they ran.

        Only a paged map needs this: otherwise a flight that never waits would compile these passes on its way. Other
        maps have light before their first picture.
        """
        return False

    def describe(self, haze_m: float, water_m: float | None) -> None:
        """Fill the block of lights; without air there is no haze."""
        assert self.sky
        haze_m = haze_m if self.has_air else NO_HAZE_M
        water_m = -1e30 if water_m is None else water_m - self.terrain.base_m
        lights = self.sky.lights
        block = np.zeros((), LIGHTS)
        block["sun"] = lights.sun
        block["sky"] = lights.sky
        block["around"] = lights.around
        block["exposure"] = exposure(self.sky)
        block["haze_m"] = haze_m
        block["water_m"] = water_m
        self.block.write(block.tobytes())

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of shaders that include glsl/light/lit.glsl."""
        return self.cover.uniforms | self.visibility.uniforms

    @property
    def resources(self) -> Resources:
        """All light, for shaders that include light/lit.glsl; without the tables that are not made yet."""
        found: dict[str, Resource] = {"Lights": self.block, **self.cover.resources, **self.visibility.resources}
        if self.lobes:
            found |= {"Lobes": self.lobes.buffer, "u_lobe_sums": self.lobes.texture}
        if self.dome:
            found["u_dome"] = self.dome
        return found

    def release(self) -> None:
        """Release GPU resources."""
        for part in (self.cover, self.visibility, self.block, self.lobes, self.dome):
            if part:
                part.release()

    def _hang(self, radiance: np.ndarray) -> None:
        """Make the dome's texture; OpenGL's first row is the nadir."""
        if self.dome:
            self.dome.release()
        rows, cols = radiance.shape[:2]
        # the largest half float is 65,504
        texels = np.ones((rows, cols, 4), "f2")
        texels[..., :3] = np.minimum(radiance[::-1], 6e4)
        self.dome = self.ctx.texture((cols, rows), 4, texels.tobytes(), dtype="f2")
        self.dome.build_mipmaps()
        self.dome.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
        self.dome.repeat_y = False


def exposure(sky: Sky) -> float:
    """The factor from light to displayed brightness. Like the pupil of an eye, it is smaller in bright light."""
    lights = sky.lights
    from_sun = float(lights.sun["integral"] * lights.sun["amplitude"] @ LUMINANCE)
    from_sky = float((lights.sky["integral"] * (lights.sky["amplitude"] @ LUMINANCE)).sum())
    light = max(from_sun + from_sky, 1e-6)
    dim = min(light / DUSK, 1.0)  # in less light than at dusk, the eye adapts less, so nights stay dark
    return KEY / FULL_LIGHT * (FULL_LIGHT / light) ** ADAPTATION * dim ** (0.5 * ADAPTATION)


def sky_seen(sun: tuple[float, float], path: str | None, has_air: bool = True, north_deg: float = 0.0) -> Sky:
    """The clear sky of a sun, or the sky of a file with its own sun, over the grid of a map. Needs no OpenGL.

    `north_deg` is the direction of true north, clockwise from the grid's: azimuths and skies count from true north.
    """
    if path is not None:
        return _sky_in(Version.of(path), north_deg)
    return _computed_sky(round(float(sun[0]) + north_deg, 6), round(float(sun[1]), 6), has_air)


def ground_seen(ground: Ground, onto: Georeference | None = None) -> np.ndarray:
    """A picture of the ground as linear albedo, in half floats: see `read_ground`. Needs no OpenGL."""
    if isinstance(ground, Values):
        values = _values_of(Version.of(ground.path), onto)
        return values.coloured(values.ramp(ground.ramp, ground.range))
    return _ground_of(Version.of(ground.path), ground, onto)


def filled(ground: np.ndarray | None, fills: np.ndarray) -> np.ndarray:
    """Fills over a picture of the ground, both as `read_ground` returns them; the picture has the size of the fills."""
    if ground is None:
        return fills
    rows, cols = (np.arange(n) * m // n for n, m in zip(fills.shape[:2], ground.shape[:2], strict=True))
    under = ground[rows][:, cols].astype("f4")
    under = under if under.shape[2] == 4 else np.concatenate([under, np.ones_like(under[..., :1])], -1)
    with np.errstate(under="ignore"):
        return (fills + (1 - fills[..., 3:].astype("f4")) * under).astype("f2")


def ramp_seen(ground: Values, onto: Georeference | None = None) -> Ramp:
    """The ramp that colours values on the ground, with the range that it shows."""
    return _values_of(Version.of(ground.path), onto).ramp(ground.ramp, ground.range)


@lru_cache(maxsize=1)
def _values_of(file: Version, onto: Georeference | None) -> Draped:
    return read_values(file.path, onto)


@lru_cache(maxsize=1)
def _ground_of(_: Version, ground: Photo, onto: Georeference | None) -> np.ndarray:
    return read_ground(ground.path, onto, asked=ground.range)


@lru_cache(maxsize=2)
def _sky_in(file: Version, north_deg: float) -> Sky:
    return read_sky(file.path, north_deg)


@lru_cache(maxsize=8)
def _computed_sky(azimuth_deg: float, elevation_deg: float, has_air: bool) -> Sky:
    return (clear_sky if has_air else black_sky)(azimuth_deg, elevation_deg)
