"""Method sat compared with the quadtree: triangles, patches and milliseconds for one certified pixel.

Three views of every map: the first view, from a ridge, and in a valley. `from T ≥ 4` is the share of the clipmap's
triangles that come from patches of four or more segments a side. Milliseconds are the sum of `lod` and `draw`, the best
of nine frames of both methods in turn, and are given as a ratio, because times vary with the load of the machine.

Run: python benchmarks/methods.py [FOLDER]    the bundled maps, and the real maps of the folder
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterator
from pathlib import Path

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.files.views import standard_view
from terrain_gl.shade.picture import UNLIT

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from maps import REAL  # noqa: E402  the tests' own maps, and how to open them

SIZE = (1280, 720)
FRAMES = 9


def maps(folder: str | None) -> Iterator[tuple[str, tg.Heightmap, tg.Camera]]:
    """Name, map and first view, one at a time."""
    for name, known in bundled().items():
        yield name, open_map(name)[0], known.camera
    for name, options in REAL.items() if folder else ():
        if (path := Path(folder or "") / name).exists():
            heightmap = tg.Heightmap.open(path, **options)
            yield name, heightmap, tg.Camera.default(heightmap)


def drawn(renderer: tg.Renderer, camera: tg.Camera) -> dict[str, tuple[dict, float, tuple[int, ...]]]:
    """Stats, the best milliseconds of `lod` and `draw`, and patches of each size, for both methods in turn."""
    found = {}
    for _ in range(FRAMES):
        for method in ("sat", "quadtree"):
            stats = renderer.draw(camera, 1.0, method=method, style=UNLIT)
            best = found[method][1] if method in found else float("inf")
            frame = renderer.inspector.frame
            assert frame
            found[method] = stats, min(best, stats["ms"]["lod"] + stats["ms"]["draw"]), frame.selection.counts
    return found


def main() -> None:
    """Print a line for each view, and the medians."""
    print(f"{'map':44} {'view':7}{'triangles':>10}{'ratio':>7}{'patches':>9}{'ratio':>7}{'T >= 4':>8}{'ms':>7}")
    ratios: list[tuple[float, float, float]] = []
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                found = drawn(renderer, camera)
                (ours, our_ms, counts), (tree, tree_ms, _) = found["sat"], found["quadtree"]
                large = sum(2 * 4**s * n for s, n in enumerate(counts) if s >= 2) / max(ours["triangles"], 1)
                ratio = tuple(ours[key] / max(tree[key], 1) for key in ("triangles", "patches"))
                ratios.append((*ratio, our_ms / tree_ms))
                print(
                    f"{name[-44:]:44} {view:7}{ours['triangles']:10,}{ratio[0]:7.2f}{ours['patches']:9,}{ratio[1]:7.2f}"
                    f"{min(large, 1.0):8.2f}{ratios[-1][2]:7.2f}",
                    flush=True,
                )
    medians = [statistics.median(column) for column in zip(*ratios, strict=True)]
    worst = [max(column) for column in zip(*ratios, strict=True)]
    print(f"median: triangles {medians[0]:.2f}, patches {medians[1]:.2f}, ms {medians[2]:.2f}")
    print(f"most:   triangles {worst[0]:.2f}, patches {worst[1]:.2f}, ms {worst[2]:.2f}")


if __name__ == "__main__":
    main()
