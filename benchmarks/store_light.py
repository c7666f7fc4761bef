"""The light of stores against that of the same maps in memory: angles of horizons, and pictures.

    TERRAIN_GL_DEM=FOLDER python benchmarks/store_light.py [NAME [TILE]]   canyon-15m, alpine-30m, rainier; 64 posts

For pages of each level: the mean and the 99th percentile of the absolute difference of the sun's horizon, in degrees,
from the sweep over the whole map, towards the east and the north, where both sweeps have the same points; and the share
of posts on which a sun 30 degrees high would be on the other side of the horizon. Then pictures of 640 × 360 pixels:
RMSE in steps of 1/255, with the tiles that the view needs, with all tiles, and in the style lambert.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import open_map
from terrain_gl.files.views import standard_view
from terrain_gl.light.ground import towards_sun
from terrain_gl.light.horizon import SunVisibility
from terrain_gl.store import StoredMap, build

SIZE = (640, 360)
LEVELS = 4


def main() -> int:
    """Compare, and print."""
    names = sys.argv[1:2] or ["canyon-15m", "alpine-30m", "rainier"]
    tile = int(sys.argv[2]) if len(sys.argv) > 2 else 64
    angles, seen = dict[str, list[str]](), dict[str, list[str]]()
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            heightmap = opened(name)
            build(np.asarray(heightmap.heights, np.float32), f"{folder}/s", tile=tile, spacing_m=heightmap.spacing_m)
            stored = StoredMap(f"{folder}/s")
            stored.limit(2 << 30, 2 << 30)
            stored.look = heightmap.look = "alpine" if name == "rainier" else heightmap.look
            angles[name] = horizons(heightmap, stored)
            seen[name] = pictures(heightmap, stored)
    head("map", *(f"level {level}: mean, 99 %, other side of the horizon" for level in range(LEVELS)))
    for name, cells in angles.items():
        row(name, *cells)
    head("map", "tiles that the view needs", "all tiles loaded", "style `lambert`, for comparison")
    for name, cells in seen.items():
        row(name, *cells)
    return 0


def opened(name: str) -> tg.Heightmap:
    """A bundled map, or the northern half of the map of Mount Rainier."""
    if name != "rainier":
        return open_map(name)[0]
    whole = tg.Heightmap.open(Path(os.environ["TERRAIN_GL_DEM"]) / "mt_rainier_90m.tif", spacing_m=(64, 93))
    return tg.Heightmap(np.nan_to_num(whole.heights[:1025, :1025]), whole.spacing_m)


def horizons(heightmap: tg.Heightmap, stored: StoredMap) -> list[str]:
    """Differences of the sun's horizon: a cell for each level."""
    off: list[list[np.ndarray]] = [[] for _ in range(LEVELS)]
    flips: list[list[np.ndarray]] = [[] for _ in range(LEVELS)]
    for azimuth in (90.0, 0.0):
        truth = whole_sweep(heightmap, azimuth)
        for level, found in enumerate(page_sweeps(stored, azimuth)):
            rows, cols = (
                np.minimum(np.arange(n) << level, last - 1) for n, last in zip(found.shape, truth.shape, strict=True)
            )
            expected = truth[np.ix_(rows, cols)]
            sees = (expected > -90) & (found > -90)
            off[level].append(np.abs(found - expected)[sees])
            flips[level].append(((found > 30) != (expected > 30))[sees])
    cells = []
    for level in range(LEVELS):
        each = np.concatenate(off[level])
        share = 100 * np.concatenate(flips[level]).mean()
        cells.append(f"{each.mean():.2f}°, {np.percentile(each, 99):.1f}°, {share:.2f} %")
    return cells


def whole_sweep(heightmap: tg.Heightmap, azimuth: float) -> np.ndarray:
    """Angles of the horizon of all posts, in degrees."""
    with tg.Renderer(heightmap, (8, 8)) as renderer, renderer.session:
        sun = SunVisibility(renderer.terrain)
        sun.follow(towards_sun(azimuth, 30))
        return degrees(np.frombuffer(sun.horizon.read(), "u2").reshape(heightmap.rows, heightmap.cols))


def page_sweeps(stored: StoredMap, azimuth: float) -> list[np.ndarray]:
    """The same from the pages of each level."""
    with tg.Renderer(stored, (8, 8)) as renderer, renderer.session:
        light = load_all(renderer).picture.lighting.visibility
        for _ in light.follow_steps(towards_sun(azimuth, 30)):
            pass
        terrain, side = renderer.terrain, stored.tile + 1
        pool = degrees(np.frombuffer(light.sweep.sun.read(alignment=1), "u2").reshape(-1, light.sweep.sun.width))
        found = [np.empty(stored.posts(level), np.float32) for level in range(LEVELS)]
        for (level, row, col), slot in terrain.slot_of.items():
            if level < LEVELS:
                y, x = slot // terrain.across * side, slot % terrain.across * side
                part = found[level][row * stored.tile :, col * stored.tile :][:side, :side]
                part[:] = pool[y : y + part.shape[0], x : x + part.shape[1]]
        return found


def degrees(records: np.ndarray) -> np.ndarray:
    """Angles of stored sines."""
    return np.degrees(np.arcsin(np.clip(records / 32767.5 - 1, -1, 1)))


def load_all(renderer: tg.Renderer) -> tg.Renderer:
    """Load all tiles, and use them all."""
    with renderer.session:
        terrain = renderer.terrain
        renderer.tables.load(map(terrain.numbering.key, range(terrain.numbering.total)))
        terrain.in_use = lambda: sorted(terrain.slot_of, reverse=True)
        return renderer


def pictures(heightmap: tg.Heightmap, stored: StoredMap) -> list[str]:
    """RMSE of pictures, in steps of 1/255: with the tiles of the view, with all tiles, in the style `lambert`."""
    camera = standard_view(heightmap)
    how = {"sun": (245, 20), "surroundings": "none"}
    with tg.Renderer(heightmap, SIZE) as renderer:
        expected = renderer.render(camera, 1.0, **how).image
    cells = []
    for what in ("tiles of the view", "all tiles"):
        with tg.Renderer(stored, SIZE) as renderer:
            if what == "all tiles":
                load_all(renderer)
            frame = renderer.render(camera, 1.0, **how)
            cells.append(f"{rmse(frame.image, expected):.2f} ({frame.stats['tiles_resident']} tiles)")
            plain = renderer.render(camera, 1.0, style="lambert").image
    return [*cells, f"{rmse(plain, expected):.2f}"]


def rmse(one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square of the differences of two pictures."""
    return float(np.sqrt(np.mean((one[..., :3].astype(float) - other[..., :3]) ** 2)))


if __name__ == "__main__":
    sys.exit(main())
