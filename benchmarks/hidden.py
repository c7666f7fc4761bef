"""Hidden land: triangles, patches and milliseconds with occlusion and without, for one certified pixel.

Three views of every map at 1280 × 720: the first view, from a ridge, and in a valley. `seen` is the share of patches
that own a sample of the picture: no test of whole patches can leave out more. Milliseconds are the sum of `lod` and
`draw`, the best of nine frames of both in turn, given as a ratio, because times vary with the load of the machine.

Run: python benchmarks/hidden.py [FOLDER]    the bundled maps, and the real maps of the folder
"""

from __future__ import annotations

import sys

import numpy as np
from methods import SIZE, maps

import terrain_gl as tg
from terrain_gl.files.views import standard_view
from terrain_gl.lod import RingsSelector
from terrain_gl.shade.picture import UNLIT

FRAMES = 9


def seen_share(renderer: tg.Renderer) -> float:
    """The share of the last frame's patches that own a sample, hidden ones included."""
    frame = renderer.inspector.frame
    assert frame and isinstance(frame.selection.surface, RingsSelector)
    patches = frame.selection.surface.chosen(frame.selection)
    rows, cols = renderer.heightmap.heights.shape
    owner = np.full((rows, cols), -1)
    low = np.maximum(patches.corner, 0)
    for i, ((x0, y0), (x1, y1)) in enumerate(zip(low, patches.corner + patches.size, strict=True)):
        owner[y0:y1, x0:x1] = i
    places = renderer.picture.places().reshape(-1, 2)
    col, row = places[np.isfinite(places).all(1)].astype(int).T
    seen = np.unique(owner[np.clip(row, 0, rows - 2), np.clip(col, 0, cols - 2)])
    return float(np.count_nonzero(seen >= 0) / max(len(patches.corner), 1))


def main() -> None:
    """Print a line a view."""
    print(f"{'map':24} {'view':7}{'triangles':>10}{'off':>10}{'ratio':>7}{'patches':>9}{'seen':>6}{'lod':>6}{'ms':>6}")
    for name, heightmap, first in maps(sys.argv[1] if len(sys.argv) > 1 else None):
        views = {"first": first} | {view: standard_view(heightmap, view) for view in ("ridge", "valley")}
        with tg.Renderer(heightmap, SIZE) as renderer:
            for view, camera in views.items():
                best: dict[str, tuple[float, float]] = {}
                stats = {}
                for _ in range(FRAMES):
                    for occlusion in ("on", "off"):
                        told = stats[occlusion] = renderer.draw(camera, 1.0, occlusion=occlusion, style=UNLIT)
                        ms = told["ms"]["lod"], told["ms"]["draw"]
                        best[occlusion] = min(best.get(occlusion, ms), ms, key=sum)
                on, off = stats["on"], stats["off"]
                lod, both = best["on"][0] / best["off"][0], sum(best["on"]) / sum(best["off"])
                print(
                    f"{name[:24]:24} {view:7}{on['triangles']:10,}{off['triangles']:10,}"
                    f"{on['triangles'] / max(off['triangles'], 1):7.2f}{on['patches'] / max(off['patches'], 1):9.2f}"
                    f"{seen_share(renderer):6.2f}{lod:6.2f}{both:6.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
