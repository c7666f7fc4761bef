"""What the pixels of a picture show, against rays from the eye."""

import numpy as np
import pytest

from terrain_gl import Camera, Heightmap, Renderer, TerrainError
from terrain_gl.renderer.facts import KINDS

SIZE = (320, 240)
SKY, LAND, WATER, AROUND, VOID = range(5)


def hills(n=129):
    y, x = np.mgrid[0:n, 0:n] * 1.0
    return (500 + 300 * np.sin(x / 17) * np.cos(y / 23) + 20 * np.sin(x / 3.1 + y / 4.7)).astype("f4")


CAMERAS = [
    Camera((1000, -900, 1800), (1900, 2500, 500), 50),
    Camera.orthographic((1000, -5000, 8000), (1900, 1900, 500), 5000.0),
]


def rays(camera):
    u, v = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    (across, above), (x, y) = camera.half_extent(SIZE), camera.centre
    x, y = x + (2 * u / SIZE[0] - 1) * across, y + (1 - 2 * v / SIZE[1]) * above
    aside = x[..., None] * camera.axes[0] + y[..., None] * camera.axes[1]
    eye = np.array(camera.eye)
    return (
        (eye + aside, 0 * aside + camera.axes[2])
        if camera.is_orthographic
        else (eye + 0 * aside, aside + camera.axes[2])
    )


@pytest.mark.slow
@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_depth_place_normal_and_kind_agree(camera, factor):
    heightmap = Heightmap(hills(), 30.0)
    with Renderer(heightmap, SIZE) as renderer:
        frame = renderer.render(camera, 0.25, water_m=600.0, exaggeration=factor)
        kind, depth, places, normals = frame.kind, frame.depth, frame.places, frame.normals
        renderer.render(camera, 0.25)
        assert frame.depth is depth, "kept after the next picture"
    assert {LAND, WATER} <= {*np.unique(kind)} <= {SKY, LAND, WATER, AROUND}
    assert np.isinf(depth[kind == SKY]).all() and np.isnan(places[kind == SKY]).all()
    start, along = rays(camera)
    near = (kind == WATER) & (depth < 2e4)
    if factor == 1:
        t = (600 - start[..., 2])[near] / along[..., 2][near]
        assert np.quantile(np.abs(depth[near] / t - 1), 0.98) < 1e-4
        inside = np.abs(camera.pixels(places[kind != SKY], SIZE) - np.argwhere(kind != SKY)[:, ::-1])
        assert inside.max() < 0.5 and np.quantile(inside, 0.9) < 0.01
    assert np.quantile(np.abs(places[near][:, 2] - 600), 0.99) < 1.0 and (normals[near] == [0, 0, 1]).all()
    x, y, z = places[kind == LAND].T
    off = np.abs(z - heightmap.height_at(x, y))
    assert np.nanquantile(off, 0.5) < 1.0 and (z > 599).mean() > 0.99
    assert np.linalg.norm(normals[kind == LAND], axis=-1) == pytest.approx(1, abs=1e-5)


@pytest.mark.slow
def test_surroundings_and_voids_are_told_apart():
    heights = hills()
    heights[50:70, 50:80] = np.nan
    camera = CAMERAS[0]
    with Renderer(Heightmap(heights, 30.0), SIZE) as renderer:
        frame = renderer.render(camera, 0.5)
        kinds = {KINDS[i] for i in np.unique(frame.kind)}
        assert kinds == {"sky", "land", "surroundings", "void"}
        alone = renderer.render(camera, 0.5, surroundings="none")
        assert AROUND not in alone.kind and (alone.kind == SKY).sum() > (frame.kind == SKY).sum()
        start, along = rays(camera)
        plain = (frame.kind == AROUND) & (frame.normals[..., 2] == 1)
        heights_m = frame.places[plain][:, 2]
        assert np.ptp(heights_m[frame.depth[plain] < 2e4]) < 1.0


def test_a_place_under_a_pixel():
    heightmap = Heightmap(hills(), 30.0)
    with Renderer(heightmap, SIZE) as renderer:
        frame = renderer.render(CAMERAS[0], 0.25)
        place = renderer.place_at(160, 200)
        assert place[:3] == pytest.approx(tuple(frame.places[200, 160])) and place.lon is None
        assert place.z == pytest.approx(heightmap.height_at(place.x, place.y), abs=2)
        assert renderer.place_at(160, 0) is None


def test_only_the_last_picture_is_known():
    with Renderer(Heightmap(hills(), 30.0), SIZE) as renderer:
        frame = renderer.render(CAMERAS[0], 0.5)
        renderer.render(CAMERAS[1], 0.5)
        with pytest.raises(TerrainError, match="another picture"):
            frame.depth  # noqa: B018
        with pytest.raises(TerrainError, match="pieces"):
            renderer.render(CAMERAS[0], 0.5, size=(400, 300)).kind  # noqa: B018
