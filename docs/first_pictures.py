"""Draw the first pictures of docs/gallery.md: maps opened by their file name alone.

Run: TERRAIN_GL_DEM=FOLDER python docs/first_pictures.py [NAME...]

The real maps are in the folder; docs/maps.md has their sources. The other maps are made here.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import rasterio

from terrain_gl.files.generate import Land, generate
from terrain_gl.gpu.context import create_context

FOLDER = Path(__file__).parent / "gallery"
REAL = {
    "bay": "N37W123.hgt",
    "rainier": "mt_rainier_90m.tif",
    "greenriver": "greenriver.tif",
    "narok": "narok_srtm_z12_4608_f32.tif",
    "puget": "ps_height_1k.png",
    "deathvalley": "deathvalley_basinrange_4097_u16_off100.png",
    "moon": "moon_gld100_lon100-116_lat28-44_4096.png",
}


def land(cols, rows, **more):
    """Generated heights, 0 to 1."""
    ctx = create_context()
    try:
        heights = generate(ctx, Land(cols, rows, **more)).heights
    finally:
        ctx.release()
    return (heights - heights.min()) / np.ptp(heights)


def game(folder):
    """An island of a game: 16 bits that fill their range, the sea at 0."""
    from_middle = np.hypot(*np.meshgrid(np.linspace(-1, 1, 1025), np.linspace(-1, 1, 1025)))
    ranges = land(1025, 1025, seed=4, recipe="alpine", relief_m=900.0)
    heights = np.maximum(ranges + 0.2 - 1.25 * from_middle, 0)
    (heights / heights.max() * 65535).astype("<u2").tofile(folder / "island.r16")
    return folder / "island.r16"


def voids(folder):
    """Hills without data on their summits and steep slopes, as in radar data."""
    heights = (900 * land(900, 900, seed=11, recipe="alpine", relief_m=1200.0, spacing_m=20.0)).astype("f4")
    steep = np.hypot(*np.gradient(heights, 20.0))
    heights[(steep > np.percentile(steep, 92)) | (heights > np.percentile(heights, 91))] = np.nan
    raster(folder / "radar.tif", heights, (20, 0, 4e5, 0, -20, 5.2e6), "EPSG:32632")
    return folder / "radar.tif"


def tiny(folder):
    """A hill of 5 x 5 posts."""
    np.save(folder / "tiny.npy", np.outer((1, 2, 4, 3, 1), (1, 3, 4, 2, 1)).astype("f4") / 10)
    return folder / "tiny.npy"


def huge(folder):
    """Land and sea over 20 degrees, posts 0.036 degrees apart."""
    rough = land(556, 556, seed=21, recipe="alpine", relief_m=1000.0, spacing_m=100.0)
    broad = land(556, 556, seed=5, cliffs=0.0, octaves=4, relief_m=1000.0, spacing_m=40.0)
    heights = np.maximum(9000 * (broad - 0.42) * (0.1 + 1.8 * rough**2), 0).astype("i2")
    raster(folder / "globe.tif", heights, (0.036, 0, 70, 0, -0.036, 50), "EPSG:4326")
    return folder / "globe.tif"


def raster(path, heights, grid, crs):
    """Write a GeoTIFF."""
    rows, cols = heights.shape
    about = {"dtype": heights.dtype.name, "width": cols, "height": rows, "count": 1, "crs": crs}
    with rasterio.open(path, "w", "GTiff", transform=rasterio.Affine(*grid), **about) as out:
        out.write(heights, 1)


MADE = {"game": game, "voids": voids, "tiny": tiny, "huge": huge}


def main(*names):
    """Draw the pictures with these names, or all."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names or (*REAL, *MADE):
            path = MADE[name](Path(folder)) if name in MADE else Path(os.environ["TERRAIN_GL_DEM"]) / REAL[name]
            command = ["shot", path, "-o", FOLDER / f"{name}.jpg", "--size", "640x360"]
            subprocess.run([sys.executable, "-m", "terrain_gl", *command], check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
