"""Meshes within metres, next to pydelatin's and pymartini's, and frames next to VTK's; needs the extra [bench].

    python benchmarks/peers.py [POSTS [FOLDER]]      the bundled maps, then the real maps of the folder

Of each map the middle square of at most POSTS (1025) a side, voids filled. "true" is the largest error of the very
triangles over all posts, in float64; "ours / its" compares triangles at the error that the other's mesh truly has.
Times are medians of one run: compare ratios, not milliseconds.
"""

import sys
from pathlib import Path

from terrain_gl import Heightmap, peers
from terrain_gl.maps import bundled

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import REAL  # noqa: E402  the tests' own list of real maps

SIZE = (1280, 720)
HEAD = f"{'map':24}{'program':>12}{'asked m':>9}{'true m':>9}{'triangles':>11}{'ours/its':>11}{'ms':>9}{'its/ours':>12}"


def maps(folder):
    """Name and map, one at a time."""
    for name, known in bundled().items():
        yield name, Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    for name, options in REAL.items() if folder else ():
        if (Path(folder) / name).exists():
            yield name, Heightmap.open(Path(folder) / name, **options)


def line(name, program, asked_m, true_m, found, ratio):
    """A mesh or a frame, as a row."""
    metres = f"{asked_m:9.3g}{true_m:9.3g}" if asked_m else " " * 18
    ratios = f"{ratio:11.2f}" if ratio else " " * 11
    times = f"{found['its_ms_to_ours']:12.3g}" if "its_ms_to_ours" in found else ""
    return f"{name[:23]:24}{program:>12}{metres}{found['triangles']:11,}{ratios}{found['ms']:9.1f}{times}"


def main():
    """Print a table."""
    posts = int(sys.argv[1]) if len(sys.argv) > 1 else 1025
    print(HEAD)
    for name, heightmap in maps(sys.argv[2] if len(sys.argv) > 2 else None):
        found = peers.compare(peers.square_of(heightmap, posts), SIZE)
        for mesh in found["meshes"]:
            metres = mesh["requested_max_error_m"], mesh["max_error_m"]
            print(line(name, mesh["name"], *metres, mesh, mesh.get("our_triangles_to_its")), flush=True)
        for frame in found["frames"]:
            print(line(name, frame["name"][-12:], None, None, frame, None), flush=True)
        print(*found["absent"], sep="\n", end="\n" if found["absent"] else "")


if __name__ == "__main__":
    main()
