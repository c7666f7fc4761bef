"""The achieved error in small portions, so that measuring never holds up a window."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..camera import screen_shift_px
from ..measure import Measurement, _points
from ..renderer import Renderer

TILE = 512  # posts a side that are measured at a time


def achieved_px(renderer: Renderer, measurement: Measurement) -> Iterator[dict[str, float] | None]:
    """Measure the last frame region by region: None while posts are left, then px by metric, "max" and "rms".

    Valid as long as nothing else is drawn.
    """
    shot = renderer._last()
    heightmap = renderer.heightmap
    largest = total = 0.0
    posts = 0
    for x in range(0, heightmap.cols, TILE):
        for y in range(0, heightmap.rows, TILE):
            region = x, y, min(TILE, heightmap.cols - x), min(TILE, heightmap.rows - y)
            points = _points(heightmap, region)
            _, seen = screen_shift_px(shot.camera, renderer.size, points, np.zeros(len(points)), shot.near_m)
            seen &= np.isfinite(points[:, 2])
            if seen.any():
                errors = measurement.errors_m(shot.selection, region).ravel()[seen].astype(np.float64)
                drawn = np.isfinite(errors)
                px, _ = screen_shift_px(shot.camera, renderer.size, points[seen][drawn], errors[drawn], shot.near_m)
                largest, total, posts = max(largest, px.max(initial=0.0)), total + (px**2).sum(), posts + len(px)
                yield None
    yield {"max": float(largest), "rms": float(np.sqrt(total / max(1, posts)))}
