"""Make the bundled heightmaps: grow mountains and canyons from noise, by uplift and running water (see erosion.py).

    python heightmaps/make_heightmaps.py            # every map, and maps.json
    python heightmaps/make_heightmaps.py canyon     # the maps of one land

Each landscape starts on a coarse grid, where the large valleys form. Then the grid is refined and eroded further: finer
grids add the gullies between them. Two of the grids become maps: so both show the same peaks and valleys. Random
numbers come from seeds: the same numpy makes the same landscape again.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from erosion import Rock, evolve

FOLDER = Path(__file__).parent


# ---------------------------------------------------------------------------------------------- tools


def noise(shape, seed, longest, shortest, slope):
    """Smooth noise of mean 0 and standard deviation 1: the same at every resolution, and repeating from edge to edge.

    Spectral synthesis: random waves between two wavelengths (fractions of the map), amplitude ~ wavelength^(1 + slope).
    """
    rng = np.random.default_rng(seed)
    k = np.arange(-round(1 / shortest), round(1 / shortest) + 1)
    frequency = np.hypot(k[:, None], k)
    wave = rng.standard_normal(frequency.shape) + 1j * rng.standard_normal(frequency.shape)
    wave *= np.where((frequency >= 1 / longest) & (frequency <= k[-1]), np.maximum(frequency, 1) ** -(1 + slope), 0)
    y, x = np.linspace(0, 1, shape[0]), np.arange(shape[1]) / shape[1]
    field = (np.exp(2j * np.pi * np.outer(y, k)) @ wave @ np.exp(2j * np.pi * np.outer(k, x))).real
    return (field - field.mean()) / field.std()


def smoothstep(low, high, x):
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def midpoints(h):
    """Values half-way between rows 1..n-2 of `h`, by four-point interpolation."""
    return (9 * (h[1:-2] + h[2:-1]) - h[:-3] - h[3:]) / 16


def refine(height):
    """Twice the resolution: n + 1 rows become 2n + 1, n wrapped columns become 2n."""
    rows, cols = height.shape
    wide = np.empty((rows, 2 * cols))
    wide[:, ::2], wide[:, 1::2] = height, midpoints(np.pad(height, ((0, 0), (1, 2)), mode="wrap").T).T
    fine = np.empty((2 * rows - 1, 2 * cols))
    fine[::2], fine[1::2] = wide, midpoints(np.pad(wide, ((1, 1), (0, 0)), mode="reflect", reflect_type="odd"))
    return fine


def warp(height, seed, rms):
    """Shift the land by smooth random distances of `rms` cells, so that no valley keeps the direction of a grid."""
    rows, cols = height.shape
    east, south = (rms * noise(height.shape, seed + i, 72 / cols, 24 / cols, 1.0) for i in (0, 1))
    y = np.clip(np.arange(rows)[:, None] + south, 0, rows - 1)
    x = np.arange(cols) + east
    row, col = np.minimum(y.astype(int), rows - 2), np.floor(x).astype(int)
    fy, fx, left, right = y - row, x - col, col % cols, (col + 1) % cols
    upper = (1 - fx) * height[row, left] + fx * height[row, right]
    lower = (1 - fx) * height[row + 1, left] + fx * height[row + 1, right]
    return (1 - fy) * upper + fy * lower


def finer(height, spacing, rms, rng):
    """The start of the next finer grid: twice the cells, warped, with a little roughness where gullies can begin."""
    cells = 2 * height.shape[1]
    height = warp(refine(height), cells, rms)
    return height + 0.02 * spacing * rng.standard_normal(height.shape)


# ---------------------------------------------------------------------------------------------- alpine


def alpine_rock(shape):
    """A range that rises in the north, hills before it, and a plain that does not rise."""
    y = np.linspace(1, 0, shape[0])[:, None] + 0.055 * noise(shape, 11, 1 / 2, 1 / 9, 1.0)
    mountains = smoothstep(0.22, 0.66, y) ** 1.6 * (1 - 0.55 * smoothstep(0.78, 1.05, y))
    massifs = np.exp(0.38 * noise(shape, 12, 1 / 2, 1 / 10, 0.6))
    uplift = 1.1e-3 * (mountains * massifs + 0.06 * smoothstep(0.16, 0.30, y))
    hardness = np.exp(0.40 * noise(shape, 13, 1 / 4, 1 / 40, 0.3))
    faces, crags = noise(shape, 14, 1 / 8, 1 / 128, -0.2), noise(shape, 16, 1 / 40, max(2 / shape[1], 1 / 400), -0.3)
    max_slope = np.clip(1.02 + 0.25 * faces + 0.11 * crags, 0.55, 1.9)
    return Rock(uplift, 3.6e-6 / hardness, max_slope, deposition=0.6, creep=0.004, area_exponent=0.5)


def aggrade(height, spacing):
    """Fill low valleys with gravel, up to a plain that rises gently northwards: flat floors between steep walls."""
    y = np.arange(height.shape[0])[::-1, None] * spacing
    plain = 60 + 0.018 * y + 8 * noise(height.shape, 15, 1 / 3, 1 / 12, 0.5)
    rounding = 12.0  # metres over which the walls' feet are rounded
    return rounding * np.logaddexp(height / rounding, plain / rounding)


def alpine():
    """A mountain range of 31 km with its foothills and plain; yields the spacing and the heights of each grid."""
    rng, shape = np.random.default_rng(7), (129, 128)
    height = 120 * noise(shape, 1, 1 / 2, 1 / 64, 0.3) + 30 * rng.standard_normal(shape)
    height[-1], height[0] = 0, 700
    for spacing, years, steps in [(240, 6e6, 300), (120, 8e5, 80), (60, 2e5, 40), (30, 8e4, 30), (15, 3e4, 20)]:
        if spacing < 240:
            height = finer(height, spacing, 2.0, rng)
        rock = alpine_rock(height.shape)
        height = evolve(height, spacing, lambda _, rock=rock: rock, years, steps, rng)
        if spacing <= 60:
            height = aggrade(height, spacing)
        yield spacing, np.roll(height, height.shape[1] // 4, axis=1)  # the highest massif away from the edge


# ---------------------------------------------------------------------------------------------- canyon

PLATEAU_M, MOUTH_M = 1500.0, 900.0
STRATA = np.array(  # from the plateau down: thickness in metres, relative erodibility, steepest slope
    [
        (70, 0.10, 3.5),
        (90, 1.60, 0.55),
        (60, 0.15, 3.0),
        (60, 1.30, 0.50),
        (110, 0.12, 4.0),
        (130, 1.80, 0.45),
        (80, 0.15, 3.0),
        (400, 1.00, 0.60),
    ]
)


def canyon_rock(height, dip):
    """The layer of rock at each height; `dip` (metres) bends the layers."""
    thickness, erodibility, max_slope = STRATA.T
    depth = PLATEAU_M + dip - height
    layer = np.minimum(np.searchsorted(np.cumsum(thickness), depth), len(STRATA) - 1)
    return Rock(0.0, 2.2e-5 * erodibility[layer], max_slope[layer], deposition=0.3, creep=5e-4, area_exponent=0.4)


def river_course(y):
    """Where the large river runs, as fractions of the map: distance from the western edge, y from the northern edge."""
    return 0.5 + 0.14 * np.sin(2 * np.pi * (1.25 * y + 0.1)) + 0.05 * np.sin(2 * np.pi * (2.9 * y + 0.3))


def canyon():
    """A river from far away has cut a plateau of hard and soft layers; yields the spacing and the heights of grids."""
    rng, shape = np.random.default_rng(5), (129, 128)
    y, x = np.arange(shape[0])[:, None] / 128, np.arange(shape[1]) / 128
    aside = np.abs(x - river_course(y))
    height = PLATEAU_M + 8 * noise(shape, 21, 1 / 2, 1 / 32, 1.0) + rng.standard_normal(shape)
    height -= 60 * np.exp(-((aside / 0.03) ** 2)) + 25 * aside
    for spacing, years, steps in [(60, 6e5, 240), (30, 8e4, 50), (15, 4e4, 40), (7.5, 1.5e4, 20), (3.75, 6e3, 16)]:
        if spacing < 60:
            height = finer(height, spacing, 1.0, rng)
        cells = height.shape[1]
        outlet, inflow = np.zeros(height.shape, bool), np.zeros(height.shape)
        mouth, source = round(cells * river_course(1.0)), round(cells * river_course(0.0))
        outlet[-1, mouth], inflow[0, source], height[-1, mouth] = True, 3e9, MOUTH_M
        dip = 10 * noise(height.shape, 22, 1 / 2, 1 / 6, 1.0)
        rock_at = lambda z, dip=dip: canyon_rock(z, dip)  # noqa: E731
        height = evolve(height, spacing, rock_at, years, steps, rng, outlet, inflow)
        yield spacing, height


# ---------------------------------------------------------------------------------------------- files


@dataclass(frozen=True)
class Land:
    """How a land is made and stored: height = value * z_scale + z_offset_m. `look` is how it is coloured."""

    make: Callable[[], Iterator[tuple[float, np.ndarray]]]
    z_scale: float
    z_offset_m: float
    look: str


@dataclass(frozen=True)
class Map:
    """One of the grids of a land, and the first view of it."""

    land: str
    spacing_m: float
    view: dict


LANDS = {"alpine": Land(alpine, 0.06, 0, "alpine"), "canyon": Land(canyon, 0.02, 800, "arid")}
MAPS = {
    "alpine": Map("alpine", 15, dict(eye=[19500, 9000, 1500], target=[23300, 21000, 1350], fov=42, sun=[262, 16])),
    "canyon": Map("canyon", 3.75, dict(eye=[4350, 650, 1700], target=[3750, 4700, 1080], fov=48, sun=[245, 20])),
    "alpine-30m": Map("alpine", 30, dict(eye=[19500, 9000, 1500], target=[23300, 21000, 1350], fov=42, sun=[262, 16])),
    "canyon-15m": Map("canyon", 15, dict(eye=[4350, 650, 1700], target=[3750, 4700, 1080], fov=48, sun=[245, 20])),
}


def write_png(path, height, z_scale, z_offset_m):
    """Write heights as 16-bit grey. The first column follows again after the last, as the map repeats to the east."""
    value = np.rint((np.hstack([height, height[:, :1]]) - z_offset_m) / z_scale)
    if not (value.min() >= 0 and value.max() <= 65535):
        raise SystemExit(f"{path}: heights {height.min():.0f} to {height.max():.0f} m do not fit 16 bits")
    spec = oiio.ImageSpec(value.shape[1], value.shape[0], 1, "uint16")
    spec["png:compressionLevel"], spec["png:filter"] = 9, 0xF8
    buffer = oiio.ImageBuf(spec)
    buffer.set_pixels(oiio.ROI(), value.astype(np.uint16)[..., None])
    if not buffer.write(str(path)):
        raise SystemExit(f"{path}: {buffer.geterror()}")


def describe(maps):
    """The text of maps.json: one line per map."""
    lines = []
    for name, each in maps.items():
        land = LANDS[each.land]
        facts = dict(spacing_m=each.spacing_m, z_scale=land.z_scale, z_offset_m=land.z_offset_m, look=land.look)
        lines.append(f'  "{name}": {json.dumps(dict(file=f"{name}.png", **facts, view=each.view))}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main():
    """Make the maps of the lands named on the command line, or of all."""
    parser = argparse.ArgumentParser(description="Make the bundled heightmaps.")
    parser.add_argument("lands", nargs="*", metavar="LAND", help=f"{', '.join(LANDS)}; without a name, all of them")
    lands = parser.parse_args().lands or list(LANDS)
    if unknown := set(lands) - set(LANDS):
        parser.error(f"no land is called {', '.join(sorted(unknown))}; there are {', '.join(LANDS)}")
    (FOLDER / "maps.json").write_text(describe(MAPS))
    for land in lands:
        stored = {each.spacing_m: name for name, each in MAPS.items() if each.land == land}
        for spacing_m, height in LANDS[land].make():
            if name := stored.get(spacing_m):
                write_png(FOLDER / f"{name}.png", height, LANDS[land].z_scale, LANDS[land].z_offset_m)
                print(f"{name}.png: {height.min():.0f} to {height.max():.0f} m")


if __name__ == "__main__":
    main()
