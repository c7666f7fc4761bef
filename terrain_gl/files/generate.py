"""Generated heightmaps: land of any size from a seed, from rolling hills to canyons, made by a compute shader.

Gradient noise in octaves, with domain warping, gives the large forms. Stripes along the slopes cut gullies. A staircase
over elevation makes benches and cliffs. A post's height depends only on its place, counted from the north-west corner;
neither the size of the map nor the bands in which it is made change it. The shader only adds, multiplies and compares
(glsl/generate/exact.glsl), and heights are rounded to steps. So one seed gives the same bytes on every driver.

Specification: `reference.land`.
"""

import math
import os
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import moderngl
import numpy as np

from ..basics.exceptions import UsageError
from ..gpu.passes import ComputePass
from ..heightmap import Heightmap
from .writers import FORMATS, format_of, heightmap_file, least_step

MAX_SIDE = 16384
MAX_OCTAVES = 16
MAX_SEED = 2**24 - 1  # larger seeds would collide with the noise's layers in the hash
RECIPES = ("canyon", "alpine")  # numbered as in glsl/generate/land.glsl
RELIEFS_PER_UNIT = 8  # length of the longest waves, as a multiple of the relief
FINER = 64  # a step of a PNG is 64 steps of a float file
GROUP = 64  # threads of a work group, as in glsl/generate
BAND_POSTS = 2**20  # posts of a band: 4 MiB of GPU memory, fast even in software

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Land:
    """The parameters of generated land. `UsageError` if a value is out of its range.

    Attributes
    ----------
    cols, rows, seed
        Posts, 2 to 16384; and a number from 0 to 16777215, each of which gives another land.
    cliffs
        From 0 (rolling hills) to 1 (tablelands cut by canyons).
    octaves
        Octaves of detail, 1 to 16; by default as many as the spacing can show. The first three are the large forms,
        which every land has. Gullies of the fourth are 1.6 times as wide as the relief is high, and those of each
        further octave half as wide.
    relief_m
        The largest possible height difference. All lengths grow with the relief, so slopes do not depend on it.
    spacing_m
        Metres between posts, at most the relief.
    recipe
        "canyon", or "alpine": ranges of ridges, which do not depend on the cliffs.
    """

    cols: int
    rows: int
    seed: int = 0
    cliffs: float = 0.5
    octaves: int | None = None
    relief_m: float = 1000.0
    spacing_m: float = 10.0
    recipe: str = RECIPES[0]

    def __post_init__(self) -> None:
        for side in self.cols, self.rows:
            _check("size", side, side in range(2, MAX_SIDE + 1), f"2 to {MAX_SIDE} posts a side")
        _check("seed", self.seed, 0 <= self.seed <= MAX_SEED, f"a whole number from 0 to {MAX_SEED}")
        _check("cliffs", self.cliffs, 0 <= self.cliffs <= 1, "a number from 0 to 1")
        few_or_many = self.octaves is None or 1 <= self.octaves <= MAX_OCTAVES
        _check("octaves", self.octaves, few_or_many, f"1 to {MAX_OCTAVES}")
        _check("relief", self.relief_m, 1e-3 <= self.relief_m <= 1e6, "0.001 to 1000000 metres")
        least_m = 1e-6 * self.relief_m
        spaced = least_m <= self.spacing_m <= self.relief_m
        _check("spacing", self.spacing_m, spaced, f"{least_m:g} to {self.relief_m:g} metres, the relief")
        _check("recipe", self.recipe, self.recipe in RECIPES, " or ".join(RECIPES))

    @property
    def octaves_made(self) -> int:
        """The requested octaves; by default those whose gullies are at least six posts wide."""
        shown = math.floor(math.log2(RELIEFS_PER_UNIT * self.relief_m / (2 * self.spacing_m)))
        return self.octaves or min(max(shown, 1), MAX_OCTAVES)

    @property
    def z_scale(self) -> float:
        """Metres per unit of a 16-bit file: 1, 2 or 5 times a power of ten, the smallest that covers the relief."""
        return least_step(self.relief_m, 65535)

    @property
    def words(self) -> str:
        """The options of `terrain-gl generate` that make this land."""
        detail = f"--octaves {self.octaves_made} --relief {self.relief_m:.12g} --spacing {self.spacing_m:.12g}"
        size = f"--size {self.cols}x{self.rows} --seed {self.seed} --cliffs {self.cliffs:.12g}"
        return f"{size} {detail} --recipe {self.recipe}"


def generate(ctx: moderngl.Context, land: Land) -> Heightmap:
    """Make the land in memory, with the heights of a float file."""
    bands = [stored(band, land, ".tif") for band in bands_of(ctx, land)]
    return Heightmap(np.concatenate(bands), land.spacing_m, land.words)


def write_land(
    ctx: moderngl.Context, land: Land, path: str | os.PathLike[str], progress: Progress | None = None
) -> tuple[float, float]:
    """Write the land to a file, band by band, so that memory stays small; returns the lowest and highest height.

    Parameters
    ----------
    path
        `.png`: 16 bits, in steps of `land.z_scale` metres; `.tif`, `.tiff`, `.exr`: metres. The file's description has
        the options for opening it.

    Raises
    ------
    TerrainError, UsageError
        The file cannot be written, or its name has an unknown ending.
    """
    suffix = format_of(path)
    unit = land.z_scale if FORMATS[suffix] == "uint16" else 1.0
    low, high = math.inf, -math.inf
    about = f"terrain-gl generate {land.words}, read with {open_options(land, suffix)}"
    with heightmap_file(path, land.cols, land.rows, about) as write:
        for band in bands_of(ctx, land, progress):
            rows = stored(band, land, suffix)
            low, high = min(low, float(rows.min())), max(high, float(rows.max()))
            write(rows)
    return low * unit, high * unit


def open_options(land: Land, suffix: str) -> str:
    """The options with which other commands read the right heights."""
    scale = land.z_scale if FORMATS[suffix] == "uint16" else 1
    return f"--spacing {land.spacing_m:.12g} --z-scale {scale:g} --z-offset 0"


def shot_command(land: Land, path: str) -> str:
    """The command that draws a picture of the file."""
    picture = os.path.splitext(path)[0] + "-shot.png"
    return f"terrain-gl shot {shlex.quote(path)} {open_options(land, format_of(path))} -o {shlex.quote(picture)}"


def bands_of(
    ctx: moderngl.Context, land: Land, progress: Progress | None = None, posts: int = BAND_POSTS
) -> Iterator[np.ndarray]:
    """Yield bands from north to south: float32 (rows, cols), heights as parts of the relief, 0 to 1."""
    kernel = ComputePass(ctx, "generate/heights.comp")
    rows = max(1, posts // land.cols)
    buffer = ctx.buffer(reserve=4 * land.cols * min(rows, land.rows))
    try:
        for first in range(0, land.rows, rows):
            size = land.cols, min(rows, land.rows - first)
            uniforms = {"size": size, "first_row": first, "step": step_of(land), "seed": land.seed}
            uniforms |= {"cliffs": land.cliffs, "octaves": land.octaves_made, "recipe": RECIPES.index(land.recipe)}
            kernel.run((-(-size[0] // GROUP), size[1], 1), {"Heights": buffer}, uniforms)
            ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
            yield np.frombuffer(buffer.read(4 * size[0] * size[1]), "<f4").reshape(size[::-1])
            if progress:
                progress((first + size[1]) / land.rows)
    finally:
        buffer.release()
        kernel.release()


def stored(band: np.ndarray, land: Land, suffix: str) -> np.ndarray:
    """Convert parts of the relief to the file's values: whole steps in 16 bits, or metres in 64 times finer steps."""
    steps = band.astype(np.float64) * (land.relief_m / land.z_scale)
    if FORMATS[suffix] == "uint16":
        return np.rint(steps).astype(np.uint16)
    return (np.rint(steps * FINER) * (land.z_scale / FINER)).astype(np.float32)


def step_of(land: Land) -> float:
    """The distance between posts, in the units of the noise."""
    return land.spacing_m / (RELIEFS_PER_UNIT * land.relief_m)


def _check(name: str, value: object, valid: bool, expected: str) -> None:
    if not valid:
        raise UsageError(f"{name} must be {expected}, got {value}")
