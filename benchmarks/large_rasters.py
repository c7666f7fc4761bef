"""Large rasters: a first picture from memory, from a store that is made for it, and from that store again.

python benchmarks/large_rasters.py 2048 4096 8192      posts a side
python benchmarks/large_rasters.py 8192 stores         nothing that holds the raster in memory
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from table import head, row

from terrain_gl.image import read_image

SHOT = ("shot", "map.npy", "-o", "p.png", "--spacing", "10", "--size", "1280x720")
RUNS = {  # in this order
    "build": ("build", "map.npy", "-o", "map.zarr", "--spacing", "10"),
    "shot map.zarr": ("shot", "map.zarr", "-o", "q.png", "--size", "1280x720"),
    "shot --no-cache --style lambert": (*SHOT, "--no-cache", "--style", "lambert"),
    "shot --no-cache": (*SHOT, "--no-cache"),
    "shot, first time": SHOT,
    "shot, second time": SHOT,
}


def land(posts: int) -> np.ndarray:
    """Fractal land: a spectrum that falls with the square of the frequency."""
    side = min(posts, 2048)
    noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((side, side)).astype("f4"))
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side))
    heights = np.fft.irfft2(noise / np.maximum(frequency, 1 / side) ** 2).astype("f4")
    heights *= 1500 / np.ptp(heights)
    times = -(-posts // side)  # it repeats without a seam
    slope = np.linspace(0, 300, posts, dtype="f4")
    return np.tile(heights, (times, times))[:posts, :posts] + slope


def run(words: tuple[str, ...]) -> tuple[float, float, float]:
    """Seconds by the clock, processor seconds and MiB of a command."""
    started = os.times().elapsed
    process = subprocess.Popen([sys.executable, "-m", "terrain_gl", *words], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    assert status == 0, words
    return os.times().elapsed - started, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> None:
    """Print a table for each size."""
    held = "stores" not in sys.argv
    head("posts", "picture", "clock", "processor time", "memory")
    for posts in (int(word) for word in sys.argv[1:] if word.isdigit()):
        with tempfile.TemporaryDirectory() as folder:
            os.environ["XDG_CACHE_HOME"] = str(Path(folder) / "cache")
            os.chdir(folder)
            np.save("map.npy", land(posts))
            for name, words in RUNS.items():
                if "--no-cache" in words and not held:
                    continue
                clock_s, used_s, peak = run(words)
                row(f"{posts:,}²", name, f"{clock_s:.1f} s", f"{used_s:.1f} s", f"{peak:,.0f} MiB")
            away = read_image("p.png").astype(float) - read_image("q.png")
            print(f"{posts:6d}²  RMSE of both pictures from stores: {np.sqrt(np.square(away).mean()) / 255:.3g}")
            os.chdir("/")


if __name__ == "__main__":
    main()
