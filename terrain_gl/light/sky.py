"""The sky: radiance in every direction, computed or read from a picture, and the lobes that approximate it."""

import math
import os
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from ..basics.exceptions import TerrainError
from ..image import read_image
from . import atmosphere
from .atmosphere import LUMINANCE
from .gaussians import (
    SKY_AXES,
    SKY_SHARPNESS,
    SUN_RADIUS_DEG,
    Lights,
    directions_of,
    lobes,
    non_negative_least_squares,
    sun_sharpness,
)
from .ground import towards_sun

SUNLIGHT = 20.0  # irradiance of the sun above the air, in the units of all radiance here
NIGHT = np.array([0.9, 1.2, 1.8]) * 2e-4  # light of stars and airglow, brighter than in reality
BARE_ALBEDO = 0.2  # of the ground of a body without air
SHAPE = (192, 128)  # rows and columns of a computed dome
SHAPE_READ = (512, 1024)  # the same for a dome that is read from a picture
MOST_PIXELS = 1 << 25  # most pixels of such a picture: 8192 x 4096
NO_SUN = lobes(np.array([[0.0, 0.0, 1.0]]), np.array([sun_sharpness()]), np.zeros((1, 3)))[0]
_SUN_TIMES_MEDIAN = 100.0  # a spot that is this many times brighter than the median is the sun


@dataclass(frozen=True)
class Sky:
    """Light from all directions.

    Attributes
    ----------
    radiance
        (rows, cols, 3) linear RGB without the sun's disc. Columns go clockwise, south, west, north, east: north is in
        the middle. Rows go from the zenith down to the nadir; their elevations are those of `dome`.
    sun
        A record `LOBE` (light/gaussians.py); `NO_SUN` if there is no sun.
    """

    radiance: np.ndarray
    sun: np.ndarray

    @cached_property
    def lights(self) -> Lights:
        """The lobes that approximate this sky; their amplitudes are found by non-negative least squares."""
        return self._fit[0]

    @cached_property
    def fit_error(self) -> float:
        """Largest error of the lobes' light on ground, over the slopes of `fit`, relative to the largest light."""
        return self._fit[1]

    @cached_property
    def _fit(self) -> tuple[Lights, float]:
        directions, weights = dome(*self.radiance.shape[:2])
        light = self.radiance.reshape(-1, 3)
        amplitude, error = fit(directions, weights, light)
        below = directions[:, 2] < 0
        ground = np.average(light[below], axis=0, weights=weights[below])
        fitted = lobes(SKY_AXES, SKY_SHARPNESS, amplitude[:-1])
        fitted["hidden"] = _white_amplitudes()[:-1, None] * ground
        return Lights(self.sun, fitted, amplitude[-1]), error


def dome(rows: int, cols: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (rows · cols, 3) of a dome's pixels, and the solid angle of each; read in glsl/light/dome.glsl.

    Rows are denser near the horizon, where skies change fast. A row at v, from -1 (nadir) to 1 (zenith), has the
    elevation 90° · v·|v|.
    """
    edges = np.linspace(1, -1, rows + 1)
    rims = np.sin(np.pi / 2 * edges * np.abs(edges))
    middles = 0.5 * (edges[1:] + edges[:-1])
    elevation = (np.pi / 2 * middles * np.abs(middles))[:, None]
    azimuth = ((np.arange(cols) + 0.5) / cols * 2 - 1)[None] * np.pi
    weights = np.repeat((rims[:-1] - rims[1:]) * 2 * np.pi / cols, cols)
    return directions_of(azimuth, elevation).reshape(-1, 3), weights


def fit(directions: np.ndarray, weights: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, float]:
    """Fit the amplitudes, at least 0, of the sky's lobes, and the radiance of the surrounding land.

    The fit minimises the relative error of the light on ground of 128 orientations, computed as glsl/light/lit.glsl
    shades it. The error of the radiance itself has a small weight.

    Returns the amplitudes (10, 3), the last row for the surrounding land; and the largest error of the light on ground,
    relative to the largest light. `directions` are unit vectors (n, 3), `weights` their solid angles.
    """
    normals = slopes(128)
    above = directions[:, 2:] >= 0
    values = np.concatenate([np.exp(SKY_SHARPNESS * (directions @ SKY_AXES.T - 1)) * above, ~above], 1)  # (n, 10)
    weighted = light * (weights / np.pi)[:, None]
    some = np.split(normals, 16)  # in parts, whose cosines fit into the processor's cache
    lit = np.concatenate([np.maximum(facing @ directions.T, 0) @ weighted for facing in some])
    shaded = shaded_light(normals)
    roots = 0.03 * np.sqrt(weights / (4 * np.pi))[:, None]
    rooted = values * roots
    amplitude = np.zeros((shaded.shape[1], 3))
    for channel, (of, radiance) in enumerate(zip(lit.T, light.T, strict=True)):
        share = of.mean() / np.maximum(of, 1e-3 * of.mean() + 1e-30)[:, None] / 16
        system = [shaded * share, rooted]
        right = [of * share[:, 0], radiance * roots[:, 0]]
        amplitude[:, channel] = non_negative_least_squares(np.concatenate(system), np.concatenate(right))
    return amplitude, float(np.abs(shaded @ amplitude - lit).max() / max(lit.max(), 1e-30))


def shaded_light(normals: np.ndarray) -> np.ndarray:
    """(n, 10) radiance of white ground with normals (n, 3), shaded under each lobe with an amplitude of 1.

    The last column is for uniform light from below the horizon: (1 - n_z) / 2.
    """
    unit = lobes(SKY_AXES, SKY_SHARPNESS, np.ones((len(SKY_AXES), 3)))
    length = unit["mean_length"].astype(float)
    c = length * (normals @ SKY_AXES.T)
    width = np.where(length < 0.75, 0.5 + 0.5 * np.sqrt(np.maximum(1 - 4 / 3 * length**2, 0)), 0)
    width = np.where(length < 0.75, width, np.sqrt(3 * length * (1 - length)))
    mean = np.where(np.abs(c) >= width, np.maximum(c, 0), (c + width) ** 2 / (4 * width))
    return np.concatenate([unit["integral"] / np.pi * mean, 0.5 - 0.5 * normals[:, 2:]], 1)


def slopes(count: int, steepest_deg: float = 80.0) -> np.ndarray:
    """Normals of ground, (count, 3): slopes are even from 0 to `steepest_deg`, azimuths follow the golden angle."""
    i = np.arange(count) + 0.5
    tilt = np.radians(steepest_deg) * i / count
    turn = math.pi * (1 + 5**0.5) * i
    return np.stack([np.sin(tilt) * np.sin(turn), np.sin(tilt) * np.cos(turn), np.cos(tilt)], -1)


def clear_sky(azimuth_deg: float, elevation_deg: float, sun_radius_deg: float = SUN_RADIUS_DEG) -> Sky:
    """A clear sky and its sun; azimuth clockwise from north. If the sun is below the horizon, it is dusk or night."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    sun = np.array([0.0, math.cos(elevation), math.sin(elevation)])
    half = SHAPE[1] // 2  # the sky is symmetric about the sun's meridian
    directions, _ = dome(SHAPE[0], 2 * half)
    western = directions.reshape(SHAPE[0], 2 * half, 3)[:, half:]
    one_side = atmosphere.sky_radiance(western, sun)
    around = np.concatenate([one_side[:, ::-1], one_side], 1)
    turned = _turn(around, azimuth / (2 * np.pi) * 2 * half)
    direction = np.array(towards_sun(azimuth_deg, elevation_deg))
    risen = _part_above_horizon(elevation_deg, sun_radius_deg)
    irradiance = SUNLIGHT * risen * atmosphere.sunlight(max(elevation_deg, 0.0))
    return Sky(SUNLIGHT * turned + NIGHT, _sun(direction, irradiance, sun_radius_deg))


def black_sky(azimuth_deg: float, elevation_deg: float, sun_radius_deg: float = SUN_RADIUS_DEG) -> Sky:
    """The sky of a body without air: a sun, a black sky, and below the horizon the light of its ground."""
    direction = np.array(towards_sun(azimuth_deg, elevation_deg))
    irradiance = SUNLIGHT * _part_above_horizon(elevation_deg, sun_radius_deg) * np.ones(3)
    radiance = np.full((*SHAPE, 3), NIGHT)
    radiance[SHAPE[0] // 2 :] += BARE_ALBEDO / np.pi * irradiance * max(direction[2], 0.0)
    return Sky(radiance, _sun(direction, irradiance, sun_radius_deg))


def read_sky(path: str | os.PathLike[str], north_deg: float = 0.0) -> Sky:
    """A sky from an equirectangular picture of light, HDR or EXR.

    The middle column looks north, `north_deg` clockwise from the grid's north, to the nearest column. Azimuth grows to
    the right, and the first row is the zenith. A spot more than 100
    times brighter than the median is cut out and becomes the sun. Without such a spot the sky has no sun.

    Raises
    ------
    TerrainError
        The file is not a readable picture or not twice as wide as high; or it has 8-bit colours, or values that are
        negative or not finite.
    """
    pixels = read_image(path, MOST_PIXELS)
    rows, cols = pixels.shape[:2]
    if cols != 2 * rows or rows < 2:
        raise TerrainError(f"{path}: an equirectangular sky is twice as wide as high, got {cols}x{rows}")
    if pixels.dtype.kind != "f":
        raise TerrainError(f"{path}: holds {pixels.dtype} colours, which are too dark for a sun: use .hdr or .exr")
    light = pixels[..., :3].astype(np.float64)
    light = np.repeat(light[..., :1], 3, -1) if light.shape[2] < 3 else light
    if not np.isfinite(light).all():
        raise TerrainError(f"{path}: has values that are not finite: correct the picture")
    if light.min() < 0:
        raise TerrainError(f"{path}: has negative light, down to {light.min():.3g}: correct the picture")
    light = np.roll(light, round(cols * north_deg / 360), 1)
    light, sun = _take_sun(light)
    light = light.repeat(-(-SHAPE[1] // cols), 1)  # lobes cannot be fitted to a dome of few pixels
    shape = min(max(rows, SHAPE[0]), SHAPE_READ[0]), min(light.shape[1], SHAPE_READ[1])
    return Sky(_dome_of_equirectangular(light, shape), sun)


def _take_sun(light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Separate an equirectangular picture into the sky without its sun, and the sun."""
    rows, cols = light.shape[:2]
    luminance = light @ LUMINANCE
    peak = np.unravel_index(luminance.argmax(), luminance.shape)
    if luminance[peak] <= _SUN_TIMES_MEDIAN * max(float(np.median(luminance)), 1e-30):
        return light, NO_SUN
    elevation = (0.5 - (np.arange(rows) + 0.5) / rows)[:, None] * np.pi
    azimuth = ((np.arange(cols) + 0.5) / cols * 2 - 1)[None] * np.pi
    directions = directions_of(azimuth, elevation)
    near = directions @ directions[peak] > math.cos(math.radians(6))
    spot = near & (luminance > 0.05 * luminance[peak])
    around = np.median(light[near & ~spot], axis=0) if (near & ~spot).any() else np.zeros(3)
    weights = (np.cos(elevation) * (np.pi / rows) * (2 * np.pi / cols) + 0 * azimuth)[spot]
    extra = np.maximum(light[spot] - around, 0) * weights[:, None]
    direction = (directions[spot] * (extra @ LUMINANCE)[:, None]).sum(0)
    # a spot of a few pixels may look smaller than the sun is
    radius_deg = max(SUN_RADIUS_DEG, math.degrees(math.sqrt(float(weights.sum()) / math.pi)))
    rest = light.copy()
    rest[spot] = around
    return rest, _sun(direction / np.linalg.norm(direction), extra.sum(0), radius_deg)


def _dome_of_equirectangular(light: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Sample a picture's rows at a dome's elevations. If the picture has more columns, average neighbours."""
    rows, cols = light.shape[:2]
    step = max(1, cols // shape[1])
    narrow = light[:, : step * (cols // step)].reshape(rows, -1, step, 3).mean(2)
    v = 1 - 2 * (np.arange(shape[0]) + 0.5) / shape[0]
    row = np.clip((0.5 - 0.5 * v * np.abs(v)) * rows - 0.5, 0, rows - 1)
    above = np.minimum(row.astype(int), rows - 2)
    t = (row - above)[:, None, None]
    return narrow[above] * (1 - t) + narrow[above + 1] * t


def _turn(around: np.ndarray, columns: float) -> np.ndarray:
    """Turn a dome clockwise by a number of columns, with linear interpolation."""
    whole = math.floor(columns)
    t = columns - whole
    return np.roll(around, whole, 1) * (1 - t) + np.roll(around, whole + 1, 1) * t


def _sun(direction: np.ndarray, irradiance: np.ndarray, radius_deg: float) -> np.ndarray:
    sharpness = sun_sharpness(radius_deg)
    amplitude = irradiance * sharpness / (2 * math.pi)
    return lobes(direction[None], np.array([sharpness]), amplitude[None])[0]


def _part_above_horizon(elevation_deg: float, radius_deg: float) -> float:
    """Share of a disc's area above a straight horizon."""
    x = min(1.0, max(-1.0, elevation_deg / radius_deg))
    return 0.5 + (x * math.sqrt(1 - x * x) + math.asin(x)) / math.pi


@cache
def _white_amplitudes() -> np.ndarray:
    """Amplitudes (10,) of the lobes and the land that approximate the same light from all directions."""
    directions = atmosphere.spread(4000)
    white = np.ones((4000, 3))
    return fit(directions, np.full(4000, 4 * math.pi / 4000), white)[0][:, 0]
