"""What tiles declare and what they have: the table of docs/tiles.md.

Each row is `terrain-gl tiles MAP -o t`, then `terrain-gl check t --map MAP`. One set of tiles then declares half of
each error, and is refused.

Run: python benchmarks/tile_errors.py FOLDER    the real maps in FOLDER
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from table import head, row

import terrain_gl as tg

MAPS = {  # a file, how it is opened, and further options of `tiles`
    "N37W123.hgt": ((), ()),
    "mt_rainier_90m.tif": ((), ()),
    "greenriver.tif": ((), ()),
    "ps_height_1k.png": (("--spacing", "160", "--z-scale", "0.1"), ("--local",)),
    "narok.npy": (("--spacing", "19.1"), ("--local", "--max-error-m", "4")),
}
NAROK, POSTS = "narok_srtm_z12_4608_f32.tif", slice(1500, 2525)  # of both axes
HALVED = "mt_rainier_90m.tif"


def terrain_gl(*words):
    """The exit status of a command."""
    return subprocess.run([sys.executable, "-m", "terrain_gl", *map(str, words)], stdout=subprocess.DEVNULL).returncode


def halve(tile):
    """Halve the declared error of a tile and of all tiles below it."""
    tile["geometricError"] /= 2
    for child in tile.get("children", ()):
        halve(child)


def leaf_m(tile):
    """The largest declared error of the tiles that have no tiles below them."""
    below = tile.get("children")
    return max(map(leaf_m, below)) if below else tile["geometricError"]


def tell(what, path, tiles, opening):
    """Check a set of tiles, and print its row."""
    status = terrain_gl("check", tiles, "--map", path, *opening, "--json", tiles / "check.json")
    found = json.loads((tiles / "check.json").read_text())
    root = json.loads((tiles / "tileset.json").read_text())["root"]
    ratios = [tile["declared_m"] / tile["posts_m"] for tile in found["tiles"] if tile["posts_m"]]
    row(
        what,
        len(found["tiles"]),
        f"{sum(tile['triangles'] for tile in found['tiles']):,}",
        f"{leaf_m(root):.3g} m, {root['geometricError']:.3g} m",
        f"{found['lying']}; exit status {status}",
        ", ".join(f"{value:.4g}" for value in (min(ratios), statistics.median(ratios), max(ratios))),
    )


def main(maps):
    """Make and check the tiles of each map, and print the table."""
    head("map", "tiles", "triangles", "leaf, root", "declare too little", "declared / measured: least, median, most")
    with tempfile.TemporaryDirectory() as folder:
        piece = np.array(tg.Heightmap.open(maps / NAROK, 19.1).heights[POSTS, POSTS])
        np.save(Path(folder, "narok.npy"), piece)
        for name, (opening, more) in MAPS.items():
            path = maps / name if (maps / name).exists() else Path(folder, name)
            tiles = Path(folder, f"tiles-{name}")
            assert terrain_gl("tiles", path, *opening, *more, "-o", tiles) == 0
            tell(f"`{' '.join((name, *opening, *more))}`", path, tiles, opening)
            if name == HALVED:
                declared = json.loads((tiles / "tileset.json").read_text())
                halve(declared["root"])
                (tiles / "tileset.json").write_text(json.dumps(declared))
                tell(f"`{name}`, each `geometricError` halved by hand", path, tiles, opening)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
