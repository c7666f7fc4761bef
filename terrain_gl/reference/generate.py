"""generate: terrain from a seed.

Large forms (noise with warped coordinates), then gullies that run down the slope, octave by octave, then rock layers.
Points p are (2, rows, cols), in units of 8 times the relief, east and south; heights are shares of the relief, 0 to 1.
Operations have the same order as in glsl/generate, so float32 points give the same bits as the GPU.
"""

import itertools
from typing import NamedTuple

import numpy as np

_AMPLITUDES = (1.0, 0.55, 0.3, 0.17)
_WARPS = (0.22, 0.07, 0.03)


class LandRecipe(NamedTuple):
    """The parameters of generated land; see `terrain_gl.files.generate`."""

    seed: int
    cliffs: float
    octaves: int
    alpine: bool = False


def land(p: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    """Heights at the points p, as shares of the relief, 0 to 1."""
    seed = recipe.seed
    cliffs = np.full((1, 1), recipe.cliffs, p.dtype)
    h, slope = _forms_and_slope(p, recipe, cliffs)
    hillside = smooth_step(0, 1, dot2(slope, slope))
    carving = blend(0.07, 0.13, np.minimum(1, 1.5 * cliffs)) * smooth_step(0, 5, h)
    rough = np.zeros_like(h)
    for k in range(3, recipe.octaves):
        frequency = 5.0 * 2 ** (k - 3)
        wavelength = p.dtype.type(0.2) * p.dtype.type(0.5 ** (k - 3))
        square = dot2(slope, slope)
        inverse = inverse_sqrt(square + 0.1)
        steep = np.minimum(square * inverse, 4)
        across = np.stack([-slope[1], slope[0]]) * inverse
        at = p * frequency
        height, rising = stripes(at, across, seed, 40 + k)
        depth = carving * steep * smooth_step(0, 1, steep)
        h = h + depth * wavelength * height
        rough = rough + (0.02 + 0.03 * steep) * wavelength * noise(1.7 * at, seed, 60 + k)
        slope = slope + 5 * depth * rising * across
    h = strata(h, p, 6, 16, np.minimum(1, 1.2 * cliffs) * hillside, seed, 80)
    h = strata(h, p, 27, 5, 0.6 * cliffs * hillside, seed, 90)
    return np.clip(0.02 + 0.92 * (h + rough), 0, 1)


def _forms_and_slope(p: np.ndarray, recipe: LandRecipe, cliffs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The large forms, and their slope east and south by differences over 1/256."""
    beside = np.array([0, 1 / 256], p.dtype)[:, None, None]
    h, east, south = (_forms(p + d, recipe, cliffs) for d in (0 * beside, beside[::-1], beside))
    return h, (np.stack([east, south]) - h) * 256


def _forms(p: np.ndarray, recipe: LandRecipe, cliffs: np.ndarray) -> np.ndarray:
    q = _warp(p, recipe.seed)
    up = smooth_step(-0.85, 1, noise(0.43 * q, recipe.seed, 7) + 0.3 * noise(0.93 * q, recipe.seed, 8))
    if recipe.alpine:
        valleys = _above_valleys(q, np.full((1, 1), 0.2, p.dtype), recipe)
        return 0.05 + 0.08 * valleys + 0.1 * up + (0.05 + 0.3 * up) * _ridges(1.6 * q, recipe)
    t = _above_valleys(q, blend(0.25, 0.12, cliffs), recipe)
    hills = 0.06 + 0.24 * up + (0.36 + 0.24 * up) * t
    eaten = (0.45 + 2.2 * t) * _branches(q, recipe) - 0.2 * (1 - up)
    table = (0.38 + 0.12 * up) * smooth_step(0.03, 4, eaten) + 0.22 * smooth_step(0.34, 5, eaten)
    return blend(hills, 0.08 + 0.08 * t + table, cliffs * cliffs)


def _warp(p: np.ndarray, seed: int) -> np.ndarray:
    q = p
    at = 1.07 * p
    for i, reach in enumerate(_WARPS):
        q = q + reach * np.stack([noise(at, seed, 2 * i), noise(at + 0.5, seed, 2 * i + 1)])
        at = 1.4 * finer(at)
    return q


def _above_valleys(q: np.ndarray, softness: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    total = np.zeros_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: recipe.octaves]):
        held = np.minimum(1, 2 * total) if i else np.ones_like(total)
        total = total + held * amplitude * soft_abs(noise(q, recipe.seed, 10 + i), softness * amplitude)
        q = finer(q)
    return total


def _branches(q: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    nearest = np.ones_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: min(3, recipe.octaves)]):
        start = q.dtype.type(0.07) * q.dtype.type(i)
        here = soft_abs(noise(q, recipe.seed, 10 + i), np.full((1, 1), 0.06, q.dtype))
        nearest = soft_min(nearest, start + amplitude * here)
        q = finer(q)
    return nearest


def _ridges(q: np.ndarray, recipe: LandRecipe) -> np.ndarray:
    total = np.zeros_like(q[0])
    held = np.ones_like(q[0])
    for i, amplitude in enumerate(_AMPLITUDES[: recipe.octaves]):
        crest = 1 - soft_abs(noise(q, recipe.seed, 20 + i), np.full((1, 1), 0.1, q.dtype))
        rise = held * crest * crest
        total = total + amplitude * rise
        held = np.minimum(1, 1.5 * rise)
        q = finer(q)
    return total


def strata(
    h: np.ndarray, p: np.ndarray, layers: int, edge: float, strength: np.ndarray, seed: int, kind: int
) -> np.ndarray:
    """Cut heights into benches and cliffs by layers of rock; the hardest cliffs are `edge` times as steep."""
    tilt = 0.9 * noise(0.6 * p, seed, kind) + 0.15 * noise(5.0 * p, seed, kind + 1)
    level = h * layers + tilt
    layer = np.floor(level)
    own = pcg3d(layer, np.full_like(layer, kind), seed)
    hard = smooth_step(-0.5, 1, 0.6 * signed_unit(own[1], h.dtype) + noise(1.3 * p, seed, kind + 2))
    x = level - layer - (0.55 + 0.2 * signed_unit(own[0], h.dtype))
    t = np.clip(x * blend(2, edge, hard) + 0.5, 0, 1)
    step = 0.3 * (level - layer) + 0.7 * t * t * (2 - t)
    return blend(h, (layer + step - tilt) * (h.dtype.type(1) / h.dtype.type(layers)), strength * (0.3 + 0.7 * hard))


def stripes(p: np.ndarray, across: np.ndarray, seed: int, layer: int) -> np.ndarray:
    """Height and rise, (2, rows, cols), of waves along the unit vectors `across`, from a pivot in each cell around."""
    home = np.floor(p)
    total = np.zeros_like(p)
    for j, i in itertools.product((-1, 0, 1), repeat=2):
        cell = home + np.array([i, j], p.dtype)[:, None, None]
        h = _cell_hash(cell, seed, layer)
        d = p - cell - (0.5 + 0.3 * np.stack([signed_unit(h[0], p.dtype), signed_unit(h[1], p.dtype)]))
        weight = np.maximum(0, 1 - 0.6944444 * dot2(d, d))
        turns = dot2(d, across)
        total = total + weight * weight * np.stack([_wave(turns), _wave(turns + 0.25)])
    return total * inverse_sqrt(dot2(total, total) + 0.02)


def _wave(turns: np.ndarray) -> np.ndarray:
    x = 2 * np.abs(turns - np.floor(turns + 0.5))
    return 1 - 2 * x * x * (3 - 2 * x)


def noise(p: np.ndarray, seed: int, layer: int) -> np.ndarray:
    """Gradient noise (Perlin 1985, 2002), about −1 to 1."""
    c = np.floor(p)
    f = p - c
    u, v = f * f * f * (f * (f * 6 - 15) + 10)
    west, east, southwest, southeast = (_corner_ramp(c + d, f - d, seed, layer) for d in _corners(p.dtype))
    return 1.5 * blend(blend(west, east, u), blend(southwest, southeast, u), v)


def _corner_ramp(cell: np.ndarray, d: np.ndarray, seed: int, layer: int) -> np.ndarray:
    h = _cell_hash(cell, seed, layer)
    t = signed_unit(h[0], d.dtype)
    k = 1 - t * t * (0.5 - 0.2071068 * t * t)
    g = np.where(h[1] & 0x10000, np.stack([k * t, k]), np.stack([k, k * t]))
    return np.where(h[2] & 0x10000, -dot2(g, d), dot2(g, d))


def _corners(dtype: np.dtype) -> np.ndarray:
    """The corners of a cell, row by row, (4, 2, 1, 1)."""
    return np.array([(0, 0), (1, 0), (0, 1), (1, 1)], dtype)[..., None, None]


def finer(p: np.ndarray) -> np.ndarray:
    """Points of the next octave: twice the frequency, turned by atan(3/4)."""
    return np.stack([1.6 * p[0] - 1.2 * p[1] + 0.37, 1.2 * p[0] + 1.6 * p[1] + 0.71])


def _cell_hash(cell: np.ndarray, seed: int, layer: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return pcg3d(cell[0], cell[1], seed * 256 + layer)


def pcg3d(x: np.ndarray, y: np.ndarray, z: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hash of three whole numbers to three uint32 arrays (Jarzynski, Olano 2020)."""
    x, y, w = (np.asarray(v).astype(np.int64).astype(np.uint32) for v in (x, y, np.full_like(x, z, np.int64)))
    x, y, w = (v * np.uint32(1664525) + np.uint32(1013904223) for v in (x, y, w))
    x = x + y * w
    y = y + w * x
    w = w + x * y
    x, y, w = (v ^ v >> 16 for v in (x, y, w))
    x = x + y * w
    y = y + w * x
    return x, y, w + x * y


def signed_unit(bits: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Number from −1 to 1, from the 24 highest bits."""
    return (bits >> 8).astype(dtype) / 8388608 - 1


def blend(a: float | np.ndarray, b: float | np.ndarray, t: np.ndarray) -> np.ndarray:
    """Interpolate from a to b as t goes from 0 to 1."""
    a = np.asarray(a, t.dtype)
    return a + t * (np.asarray(b, t.dtype) - a)


def dot2(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product over the first axis, of length 2."""
    return a[0] * b[0] + a[1] * b[1]


def smooth_step(low: float, steepness: float, x: np.ndarray) -> np.ndarray:
    """3t² − 2t³ of t = (x − low) · steepness, clamped to 0 and 1."""
    t = np.clip((x - low) * steepness, 0, 1)
    return t * t * (3 - 2 * t)


def soft_abs(x: np.ndarray, softness: np.ndarray) -> np.ndarray:
    """x² / √(x² + softness²): |x|, rounded near 0."""
    square = x * x
    return square * inverse_sqrt(square + softness * softness)


def soft_min(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Minimum of two, rounded where they are within 0.1 of each other."""
    near = np.maximum(0.1 - np.abs(a - b), 0)
    return np.minimum(a, b) - 2.5 * near * near


def inverse_sqrt(x: np.ndarray) -> np.ndarray:
    """1 / √x by three Newton steps: y ← y (3/2 − x y² / 2)."""
    y = (np.uint32(0x5F375A86) - (x.astype(np.float32).view(np.uint32) >> 1)).view(np.float32).astype(x.dtype)
    half = 0.5 * x
    for _ in range(3):
        y = y * (1.5 - half * y * y)
    return y
