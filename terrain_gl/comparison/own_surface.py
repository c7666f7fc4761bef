"""Pictures that are shaded from the surface that a method draws, instead of the map's own posts.

Our shading reads tables of the map in each pixel's footprint, and does not depend on the mesh. A renderer without such
tables can only shade its mesh. To imitate such a renderer, we make a second map from the drawn heights at all posts.
The same code computes normals, cover, horizons and shadows from the second map. If a mesh has the true height at every
post, the picture is the same, bit for bit.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..camera import Camera
from ..gpu.layout import PLACES
from ..gpu.session import in_session
from ..light.ground import HeightSums
from ..light.lighting import Lighting
from ..renderer import Renderer
from ..renderer.options import FrameOptions
from ..verify.measure import TILE, Measurement, places_of


@contextmanager
def shaded_from_mesh(renderer: Renderer, camera: Camera, **options: Any) -> Iterator[None]:
    """Inside this context, the renderer shades from the surface that these options draw. The last frame is lost."""
    with renderer.session:
        yield from _shaded_from_mesh(renderer, camera, options)


def _shaded_from_mesh(renderer: Renderer, camera: Camera, options: dict[str, Any]) -> Iterator[None]:
    picture = renderer.picture
    terrain = renderer.terrain.with_heights(drawn_heights(renderer, camera, **options))
    sums = HeightSums(terrain)
    lighting = Lighting(terrain, sums)
    kept = picture.terrain, picture.sums, picture.lighting
    picture.terrain = terrain
    picture.sums = sums
    picture.lighting = lighting
    try:
        yield
    finally:
        picture.terrain, picture.sums, picture.lighting = kept
        for made in (lighting, sums, terrain):
            made.release()


@in_session
def drawn_heights(renderer: Renderer, camera: Camera, **options: Any) -> np.ndarray:
    """(rows, cols) float32 metres: the drawn surface at every post of the map, NaN over voids."""
    chosen = FrameOptions(**(options | {"cull": False}))
    selection = renderer.select(camera, renderer.size, chosen).selection
    measurement = Measurement(renderer.terrain)
    drawn = renderer.terrain.filled.copy()
    cols, rows = places_of(renderer.heightmap)
    side = PLACES * TILE
    for y in range(0, rows, side):
        for x in range(0, cols, side):
            errors_m = measurement.errors_m(selection, (x, y, min(side, cols - x), min(side, rows - y)))
            errors_m = errors_m[::PLACES, ::PLACES]
            here = drawn[y // PLACES :, x // PLACES :][: errors_m.shape[0], : errors_m.shape[1]]
            here += np.nan_to_num(errors_m)
    measurement.release()
    drawn[np.isnan(renderer.heightmap.heights)] = np.nan
    return drawn
