"""Lines of sight: 10,000 random lines against a brute-force march in float64, and the time of lines and viewsheds.

The march is that of tests/test_sight.py: 4,000 steps, then ever finer steps around the lowest places. A line counts as
wrong if march and `sees` disagree and the line is further than a micrometre from grazing the land.

Run: python benchmarks/sight.py [LINES]; `time` instead of a number measures the processor's time.
"""

import sys
import time
from pathlib import Path

import numpy as np
from table import head, row

from terrain_gl.files.maps import open_map

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from test_sight import hills, marched, pairs  # noqa: E402  the tests' own maps and march

MAPS = 5


def check(lines):
    """Count the lines that are wrong."""
    wrong = seen = 0
    off_m = 0.0
    for seed in range(1, MAPS + 1):
        heightmap = hills(seed=seed)
        a, b = pairs(heightmap, lines // MAPS, seed, above=(1.0, 5.0, 30.0, 60.0, 100.0)[seed - 1])
        sight = heightmap.sees(a, b)
        least = marched(heightmap.heights.astype(float), heightmap.spacing_m, a, b)
        wrong += int(((sight.seen != (least >= 0)) & (np.abs(least) > 1e-6)).sum())
        seen += int(sight.seen.sum())
        off_m = max(off_m, float(np.abs(sight.clearance_m - least).max()))
    print(
        f"{lines // MAPS * MAPS:,} lines, {seen:,} seen: {wrong} wrong; heights over the land differ by {off_m:.1e} m"
    )
    return wrong


def times():
    """Print the time of 10,000 lines and of a viewshed, for three sizes of map."""
    head("map", "posts a side", "10,000 lines", "viewshed")
    for name, heightmap in (
        ("random hills", hills(257, 257)),
        *((f"`{each}`", open_map(each)[0]) for each in ("alpine-30m", "alpine")),
    ):
        east, north = heightmap.extent_m
        eye = (0.5 * east, 0.5 * north, float(heightmap.height_at(0.5 * east, 0.5 * north)) + 20)
        a, b = pairs(heightmap, 10_000)
        seconds = []
        for call, places in ((heightmap.sees, (a, b)), (heightmap.viewshed, (eye,))):
            started = time.process_time()
            call(*places)
            seconds.append(time.process_time() - started)
        row(name, heightmap.rows, f"{seconds[0]:.2f} s", f"{seconds[1]:.2f} s")


if __name__ == "__main__":
    word = sys.argv[1] if len(sys.argv) > 1 else "10000"
    if word == "time":
        times()
    else:
        sys.exit(check(int(word)) > 0)
