"""Ground truth for light: rays, directions, averages; and the difference of each prefilter from it."""

import math
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from asking import ask
from maps import MAPS, rough

from terrain_gl import reference
from terrain_gl.camera import Camera
from terrain_gl.comparison.likeness import rmse
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import srgb_from_linear
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.terrain import Terrain

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from light_truth import developed, render_light_truth
from prefilters import LIGHT_LABELS, compare_light

RAYS = "return vec4(sees(a.xy, ground_m(a.xy), b.xyz) ? 1.0 : 0.0, ground_m(a.xy), slope_of_cells(a.xy));"

DIRECTIONS = """
    vec2 u = point_of(int(b.x), vec2(0.3, 0.7));
    vec3 w = a.w == 0.0 ? cosine_weighted(a.xyz, u) : a.w < 0.0 ? in_disc(a.xyz, -a.w, u) : vmf_weighted(a.xyz, a.w, u);
    return vec4(w, 0.0);
"""


def test_rays_end_where_marching_says(ctx):
    heightmap = Heightmap(rough(64, 64, 3, 400), (20.0, 25.0))
    terrain = Terrain(ctx, heightmap)
    rng = np.random.default_rng(1)
    posts = rng.uniform(5, 58, (300, 2))
    towards = (-1.0, 0.4)
    sines = reference.horizon_sines(heightmap.heights, posts, towards, heightmap.spacing_m)
    flat = np.array([towards[0] * 20.0, -towards[1] * 25.0])
    flat /= np.linalg.norm(flat)
    for off, expected in ((0.01, 1.0), (-0.01, 0.0)):
        sine = np.clip(sines + off, -0.999, 0.999)
        level = np.sqrt(1 - sine * sine)
        rays = np.stack([flat[0] * level, flat[1] * level, sine, 0 * sine], -1)
        places = np.pad(posts, ((0, 0), (0, 2)))
        answers = ask(ctx, "../benchmarks/glsl/truth/ground.glsl", RAYS, places, rays, resources=terrain.resources)
        # beyond 4 posts the shader's steps are longer than the reference's, and may step over a tip
        assert np.mean(answers[:, 0] == expected) > 0.97
    assert np.allclose(answers[:, 1], reference.bilinear_heights(heightmap.heights, *posts.T), atol=1e-2)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (-0.36, 0.48, -0.8)])
def test_directions_fill_their_lobes(ctx, axis):
    draws = np.pad(np.arange(4096.0)[:, None], ((0, 0), (0, 3)))

    def mean_direction(w):
        return ask(ctx, "../benchmarks/glsl/truth/random.glsl", DIRECTIONS, [*axis, w], draws)[:, :3].mean(0)

    # means of ω: 2/3 for the cosine; of a uniform disc of radius 0.3, √(1 − r²) over it; coth k − 1/k
    disc = (1 - math.cos(0.3) ** 3) * 2 / 3 / math.sin(0.3) ** 2
    for w, length in ((0.0, 2 / 3), (-0.3, disc), (0.5, reference.mean_length(0.5)), (8.0, reference.mean_length(8.0))):
        assert np.allclose(mean_direction(w), length * np.array(axis), atol=0.003)


def test_land_and_sky_are_averaged_apart():
    light = np.zeros((2, 2, 4))
    light[0] = [0.5, 0.5, 0.5, 1]
    light[1] = [2.0, 2.0, 2.0, 0]
    shown = developed(light, 2, 1.0)[0, 0, :3]

    def tone(x):
        return x * (1 + x / 2.2**2) / (1 + x)

    assert np.all(np.abs(shown.astype(int) - srgb_from_linear(np.array(0.5 * tone(0.5) + 0.5 * tone(2.0)))) <= 1)


@pytest.fixture
def renderer(ctx):
    return partial(Renderer, ctx=ctx)


def test_level_ground_is_shaded_as_it_is_by_rays(renderer):
    heightmap = MAPS["constant"]()
    east, north = heightmap.extent_m
    camera = Camera((east / 2, north / 2, 300.0), (east / 2, north / 2 + 20, 123.4), 40)
    r = renderer(heightmap, (32, 18))
    truth = render_light_truth(r, camera, (32, 18), 4, FrameOptions(sun=(200.0, 40.0)))
    r.resize((32, 18))
    ours = r.render(camera, method="full", sun=(200.0, 40.0)).image
    assert rmse(truth, ours) < 0.012  # 3 steps of 8 bits: noise of 128 rays a pixel, and the fit of the sky


@pytest.mark.slow
def test_lobes_are_nearer_to_the_truth_than_any_rival(renderer):
    heightmap = Heightmap(rough(257, 257, 2, 900), 10.0)
    east, north = heightmap.extent_m
    eye, middle = (east / 2, -2.0 * north, 2.2 * north), (east / 2, north / 2, 450.0)
    shader = renderer(heightmap, (32, 24))
    # far, where mipmapped normals lose most, and near (about one post a pixel), where only the edges of shadows matter
    for fov_deg, fine, most in ((12.0, 12, 0.75), (1.2, 8, 0.9)):
        truth, images = compare_light(shader, Camera(eye, middle, fov_deg), fine, sun=(300.0, 30.0))
        error = {name: rmse(truth, image) for name, image in images.items()}
        assert list(error) == list(LIGHT_LABELS)
        assert error["lobes"] < most * error["mip"] and error["lobes"] == min(error.values())
