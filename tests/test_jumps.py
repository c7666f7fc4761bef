"""From one frame to the next, a point jumps by no more than the sum of both certificates: docs/guarantee.md."""

import numpy as np
import pytest
from maps import Scene, rough

from terrain_gl.basics.steps import drain
from terrain_gl.camera import Camera, in_picture, shift_px
from terrain_gl.gpu.layout import PLACES
from terrain_gl.heightmap import Heightmap, bilinear

POSTS, SPACING_M = 97, 10.0
WAYS = {
    "a tolerance": {"tolerance_px": 2.0},
    "a budget of the largest error": {"triangles": 1500, "metric": "max"},
    "a budget of least squares": {"triangles": 1500, "metric": "rms"},
}


@pytest.fixture(scope="module")
def land():
    return Heightmap(rough(POSTS, POSTS, 3, relief=300.0), SPACING_M)


def eye_at(t):
    """Looking across the land; t moves the eye ahead, in metres."""
    return Camera((480.0, 100.0 + t, 400.0), (480.0, 600.0 + t, 100.0), 60.0)


def shown(scene, camera, asked):
    """The selection, and how far each place of the map is drawn off: pixels along the vertical, NaN if not seen."""
    selection = scene.select(camera, **asked)
    side = PLACES * (POSTS - 1) + 1
    row, col = np.indices((side, side)) / PLACES
    z = scene.measurement.terrain.heightmap.heights
    off_m = scene.measurement.errors_m(selection, (0, 0, side, side)).astype("f8")
    points = np.stack([col * SPACING_M, (POSTS - 1 - row) * SPACING_M, bilinear(z, col, row)], -1)
    at = [axis.ravel() for axis in np.moveaxis((points - camera.eye) @ camera.axes.T, -1, 0)]
    off_m = off_m.ravel()
    seen = in_picture(camera, scene.size, at, scene.near_m) & np.isfinite(off_m)
    px = np.full(side * side, np.nan)
    px[seen] = np.sign(off_m[seen]) * shift_px(camera, scene.size, [axis[seen] for axis in at], off_m[seen])
    return selection, px


def switches(scene, asked):
    """Pairs of places of the eye, a millimetre apart, with different meshes."""

    def mesh(t):
        selection = scene.select(eye_at(t), **asked)
        return selection.counts, selection.triangles

    for start in (0.0, 13.0, 26.0):
        low, high, first = start, start + 12.0, mesh(start)
        if mesh(high) == first:
            continue
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if mesh(middle) == first else (low, middle)
        yield low, high


@pytest.mark.parametrize("way", WAYS)
def test_a_jump_is_at_most_the_sum_of_both_certificates(ctx, land, way):
    asked = WAYS[way]
    scene = Scene.of(ctx, land, (160, 120))
    jumps = []
    for before, after in switches(scene, asked):
        (first, off), (second, later) = (shown(scene, eye_at(t), asked) for t in (before, after))
        jump = np.nanmax(np.abs(later - off))
        assert jump <= first.certified_px + second.certified_px
        jumps.append(jump / max(first.certified_px, second.certified_px))
        px = np.abs(later - off).reshape(PLACES * (POSTS - 1) + 1, -1)[::PLACES, ::PLACES]
        views = [(of, eye_at(t), scene.size, scene.near_m) for of, t in ((first, before), (second, after))]
        posts, far_px = drain(scene.measurement.jumps_steps(*views, least_px=0.1, tile=40))
        assert sorted(map(tuple, posts.tolist())) == sorted(map(tuple, np.argwhere(px >= 0.1)[:, ::-1].tolist()))
        assert far_px == pytest.approx(px[posts[:, 1], posts[:, 0]])
    scene.release()
    assert len(jumps) >= 2 and max(jumps) > 0.1, jumps
