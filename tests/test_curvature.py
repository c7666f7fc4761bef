"""The Earth is round: land far away is drawn lower, and the certificate holds for that surface."""

import math
from dataclasses import replace

import numpy as np
import pytest
from asking import ask
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, Scene, cameras, random_camera, random_map, rough
from ring_scenes import clipmap_of
from test_measure import check_bound

from terrain_gl import reference
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera, boxes_in_picture, screen_shift_px
from terrain_gl.camera.view import ViewBlock
from terrain_gl.gpu.layout import PLACES
from terrain_gl.heightmap import Heightmap
from terrain_gl.mesh import captured_triangles
from terrain_gl.readers.georeference import Georeference, Grid
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.shade.surroundings import BLOCK
from terrain_gl.verify.measure import _parts_in_picture, places_of, truth_m

EARTH_M = 6378137.0
PLAIN = Heightmap(0.05 * rough(70, 91, 3), 4000.0)  # 360 km of flat land: flat, its cells would be as large as the map
FAR = (1.4e5, 1.1e5, -2100.0)  # about where the land there is drawn


def over_plain(height_m=3000.0, bend=1 / (2 * EARTH_M)):
    """From the south-western corner of the plain towards its middle."""
    return Camera((9e3, 9e3, height_m), (2e5, 1.5e5, 0.0), 50.0, bend_per_m=bend)


# --- The reference ----------------------------------------------------------------------------------------------------


def test_the_drop_of_a_cell_of_the_map_is_a_plane():
    drop = reference.drop_m((9, 12), (30.0, 41.0), np.array([77.0, -310.0, 5.0]), 0.01)
    assert np.abs(reference.twists(drop)).max() <= 1e-12 * drop.max()


@given(st.integers(1, 6), st.integers(0, 10**6))
def test_no_triangle_in_a_cell_sags_more_than_its_bound(level, seed):
    """Brute force: any triangle with corners in a cell, at any place of it, over the bilinear drop of the posts."""
    rng = np.random.default_rng(seed)
    side, spacing_m, eye = (1 << level) + 1, tuple(10 ** rng.uniform(0, 2, 2)), rng.uniform(-1e3, 1e3, 3)
    drop = reference.drop_m((side, side), spacing_m, eye, 1.0)
    corners = rng.uniform(0, side - 1, (200, 3, 2))
    corners[:80] = rng.integers(0, 2, (80, 3, 2)) * (side - 1)
    weights = rng.dirichlet(np.ones(3), 200)
    weights[:40] = 0.5, 0.5, 0.0
    place = (weights[..., None] * corners).sum(1)
    at_corners = reference.bilinear_heights(drop, corners[..., 0], corners[..., 1])
    sag = (weights * at_corners).sum(1) - reference.bilinear_heights(drop, *place.T)
    most = reference.largest_sag_m(level, spacing_m, 1.0)
    slack = 1e-9 * drop.max()
    assert sag.min() >= -slack and sag.max() <= most + slack
    diagonal = 0.5 * (drop[0, 0] + drop[-1, -1]) - drop[side // 2, side // 2]
    assert diagonal == pytest.approx(most), "a diagonal has this sag in the middle"


def test_the_shaders_drop_and_sag_are_the_references(ctx):
    heightmap, camera = Heightmap(rough(9, 12), (300.0, 410.0)), over_plain(bend=1e-6)
    scene, view = Scene.of(ctx, heightmap), ViewBlock(ctx)
    view.write(scene.terrain, camera, (64, 36), 1.0)

    posts = np.indices((9, 12)).reshape(2, -1)[::-1].T
    expected = reference.drop_m((9, 12), heightmap.spacing_m, np.asarray(camera.eye), camera.bend_per_m)
    statement = "return vec4(drop_m(post_from_eye_m(ivec2(a.xy))), sag_m(int(a.z)), drop_between_m({}, b.xy), 0.0);"
    at = "post_from_eye_m(ivec2(a.xy)) + vec2(b.x, -b.y) * u_spacing_m"
    questions = np.c_[posts, np.arange(len(posts)) % 9 - 2, 0 * posts[:, :1]]
    part = (0.25, 0.625)
    told = ask(
        ctx,
        "blocks/view.glsl",
        statement.format(at),
        questions,
        (*part, 0, 0),
        resources={**view.resources, **scene.terrain.resources},
    )
    assert told[:, 0] == pytest.approx(expected.ravel(), rel=1e-5)
    sags = [reference.largest_sag_m(int(level), heightmap.spacing_m, camera.bend_per_m) for level in questions[:, 2]]
    assert told[:, 1] == pytest.approx(sags, rel=1e-5)
    inner = (posts[:, 0] < 11) & (posts[:, 1] < 8)
    cols, rows = (posts[inner] + part).T
    between = reference.bilinear_heights(expected, cols, rows)
    assert told[inner, 2] == pytest.approx(between, rel=1e-5)
    assert camera.drop_between_m(heightmap, cols, rows) == pytest.approx(between, rel=1e-12)


# --- The certificate --------------------------------------------------------------------------------------------------


def brute_force_px(scene, selection, camera, rng, n=12):
    """Largest screen error at places in all triangles, from posts that are lowered one by one, in float64."""
    corners, heights_m = captured_triangles(selection)
    heightmap, weights = scene.heightmap, rng.dirichlet(np.ones(3), n)
    drop = reference.drop_m(heightmap.heights.shape, heightmap.spacing_m, np.asarray(camera.eye), camera.bend_per_m)
    truth = scene.terrain.filled.astype("f8") - drop
    place = np.einsum("nk,tki->tni", weights, corners.astype("f8")).reshape(-1, 2)
    lower = reference.bilinear_heights(drop, *corners.reshape(-1, 2).astype("f8").T).reshape(-1, 3)
    drawn = ((heights_m.astype("f8") + scene.terrain.base_m - lower) @ weights.T).ravel()
    true_m = reference.bilinear_heights(truth, *place.T)
    east, north = place[:, 0] * heightmap.spacing_m[0], (heightmap.rows - 1 - place[:, 1]) * heightmap.spacing_m[1]
    flat = replace(camera, bend_per_m=0.0)
    points = np.stack([east, north, true_m], -1)
    px, seen = screen_shift_px(flat, scene.size, points, drawn - true_m, scene.near_m)
    void = np.isnan(reference.bilinear_heights(heightmap.heights, *place.T))
    return float(px[seen & ~void].max(initial=0.0))


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from(["max", "rms"]))
def test_any_map_on_any_small_planet_from_anywhere(ctx, seed, metric):
    rng = np.random.default_rng(seed)
    heightmap = random_map(rng)
    scene = Scene.of(ctx, heightmap, (160, 90))
    for _ in range(2):
        bend = 10 ** rng.uniform(-4, 0) / max(heightmap.extent_m)
        camera = replace(random_camera(rng, heightmap), bend_per_m=bend)
        achieved = check_bound(scene, camera, float(rng.choice([0.5, 4.0])), metric)
        if metric == "max":
            selection = scene.select(camera, 2.0)
            assert brute_force_px(scene, selection, camera, rng) <= selection.certified_px * (1 + 1e-5)
        assert achieved.posts >= 0
    scene.release()


def test_flat_land_needs_triangles_only_because_the_earth_is_round(ctx):
    """Take the term away: with cells chosen for a flat Earth, the promise is broken on the round one."""
    scene, camera = Scene.of(ctx, PLAIN, (640, 360)), replace(over_plain(), target=FAR, fov_deg=2.0)
    flat = scene.select(replace(camera, bend_per_m=0.0), 0.1)
    scene.levels.view.write(scene.terrain, camera, scene.size, scene.near_m, **flat.settings)
    assert scene.achieved(flat, camera).max_px > 0.1
    achieved = check_bound(scene, camera, 0.1, "max")
    selection = scene.select(camera, 0.1)
    assert flat.triangles < selection.triangles < 2 * 69 * 90
    found = brute_force_px(scene, selection, camera, np.random.default_rng(1))
    assert 0.5 * achieved.max_px < found <= selection.certified_px


def test_a_budget_is_spent_on_the_round_earth_too(ctx):
    scene, camera = Scene.of(ctx, PLAIN, (640, 360)), over_plain()
    for budget in (100, 2000):
        selection = scene.select(camera, triangles=budget)
        assert 0.5 * budget <= selection.triangles <= budget
        assert scene.achieved(selection, camera).max_px <= selection.certified_px


def test_flat_ground_is_drawn_as_before(ctx):
    """A bend of 0 changes no patch."""
    scene = clipmap_of(ctx, MAPS["odd"]())
    camera = cameras(scene.heightmap, scene.size)["wide"]
    selection = scene.select(camera)
    patches = selection.buffers.patches.read(16 * selection.patches)
    bent = scene.select(replace(camera, bend_per_m=1e-30))
    assert bent.buffers.patches.read(16 * bent.patches) == patches


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_measuring_leaves_nothing_out(seed):
    """Bands of `measure` and boxes that are drawn hold every place in the picture, with its drop."""
    rng = np.random.default_rng(seed)
    heightmap = random_map(rng, 24, 33)
    camera = replace(random_camera(rng, heightmap), bend_per_m=10 ** rng.uniform(-3, 0) / max(heightmap.extent_m))
    cols, rows = places_of(heightmap)
    row, col = np.indices((rows, cols)).reshape(2, -1) / PLACES
    east, north = heightmap.spacing_m
    truth = truth_m(heightmap, (0, 0, cols, rows)).ravel()
    place = np.stack([col * east, (heightmap.rows - 1 - row) * north, truth], -1)
    lower = camera.drop_between_m(heightmap, col, row) - camera.drop_m(place[:, 0], place[:, 1])
    known = np.isfinite(truth)
    place[:, 2] -= lower
    _, seen = screen_shift_px(camera, (64, 36), place[known], np.zeros(known.sum()), 1.0)
    covered = np.zeros((rows, cols), bool)
    for x, y, w, h in _parts_in_picture(heightmap, (0, 0, cols, rows), camera, (64, 36), 1.0):
        covered[y : y + h, x : x + w] = True
    assert covered.ravel()[known][seen].all()
    low, high = place[known].min(0), place[known].max(0)
    low[2], high[2] = heightmap.range_m[0] - 1, heightmap.range_m[1]
    assert boxes_in_picture(camera, (64, 36), 1.0, low[None], high[None])[0] or not seen.any()


# --- The picture ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("refraction", [0.0, 0.13])
def test_the_horizon_of_a_plain_is_where_geometry_puts_it(refraction):
    """Over a sphere, the horizon is √(2 R h) away and √(2 h / R) below the horizontal."""
    plain, height_m = Heightmap(np.zeros((151, 151)), 4000.0), 3000.0
    radius_m = EARTH_M / (1 - refraction)
    with Renderer(plain, (64, 360)) as renderer, renderer.session:
        camera = Camera((3e5, 1e3, height_m), (3e5, 2e3, height_m), 8.0)
        stats = renderer.draw(camera, 0.5, curvature="on", refraction=refraction, style="normals", surroundings="none")
        assert stats["curvature_radius_m"] == pytest.approx(radius_m)
        cols_rows = renderer.picture.places()[0]
        row = int(np.argmax(cols_rows[:, 32, 0] >= 0))
        dip = (row - 180) / camera.focal_px(360)
        assert dip == pytest.approx(math.sqrt(2 * height_m / radius_m), abs=2 / camera.focal_px(360))
        farthest_m = (150 - cols_rows[row, 32, 1]) * 4000 - 1e3
        # a pixel is 0.4 mrad high: at 30 mrad, √(2 · 0.4 / 30) = 16 % of the distance
        assert farthest_m == pytest.approx(math.sqrt(2 * radius_m * height_m), rel=0.17)
        measured = renderer.measure()
        assert measured["max_error_px"] <= measured["certified_max_error_px"] <= 0.5 and measured["holes"] == 0
        flat = renderer.draw(camera, 0.5, curvature="off", style="normals", surroundings="none")
        assert flat["curvature_radius_m"] is None
        assert np.argmax(renderer.picture.places()[0][:, 32, 0] >= 0) < row


def test_rays_meet_the_plain_around_the_map_where_it_is(ctx):
    """Beyond the horizon they meet nothing."""
    scene, view, camera = Scene.of(ctx, PLAIN), ViewBlock(ctx), over_plain(bend=1e-6)
    view.write(scene.terrain, camera, (64, 36), 1.0)
    rays = np.c_[np.random.default_rng(2).normal(size=(200, 2)), np.linspace(-0.6, 0.1, 200)]
    read, plain = {**view.resources, **scene.terrain.resources}, {"edge_m": 40.0}
    statement = "return vec4(plain_depth(Ray(vec3(0.0), a.xyz)));"
    told = ask(ctx, "shade/edge.glsl", statement, np.c_[rays, rays[:, 0]], resources=read, uniforms=plain)[:, 0]
    across, below_m = np.square(rays[:, :2]).sum(1), camera.eye[2] - 40.0 + scene.terrain.base_m
    inside = np.square(rays[:, 2]) - 4e-6 * across * below_m
    meets = (rays[:, 2] < 0) & (inside > 1e-6)
    assert (told[(rays[:, 2] >= 0) | (inside < -1e-6)] == -1).all() and 20 < meets.sum() < 180
    roots = [np.roots([1e-6 * a, z, below_m]).real.min() for a, z in zip(across[meets], rays[meets, 2], strict=True)]
    assert told[meets] == pytest.approx(roots, rel=1e-3)


def test_the_sky_reaches_down_to_the_horizon_and_covers_it():
    """There is no ground between the horizontal and the horizon of a round Earth. The plain fades into the sky."""
    with Renderer(Heightmap(rough(33, 33, 1, 300.0), 500.0), (32, 180)) as renderer:
        camera = Camera((8e3, -1e3, 6000.0), (8e3, -2e3, 6000.0), 8.0)  # the map is behind
        renderer.draw(Camera((8e3, 1e3, 900.0), (8e3, 9e3, 0.0)), look="green")
        column = renderer.render(camera, curvature="on", look="green").image[:, 16, :3].astype(int)
    above_m = 6000.0 + BLOCK * 16e3  # above the plain at the foot of the block
    row = 90 + round(math.sqrt(2 * above_m / EARTH_M) * camera.focal_px(180))
    steps = np.abs(np.diff(column, axis=0)).max(1)
    assert steps[: row + 8].max() <= 3  # no line, neither at the horizontal nor at the horizon
    assert np.abs(column[90] - column[row - 3]).max() > 4  # it grows pale as far as the horizon
    assert np.abs(column[-1] - column[row - 3]).max() > 12


def test_drawn_and_true_heights_stay_heights_of_the_map():
    heightmap = Heightmap(rough(70, 91, 3, 500.0), 4000.0)
    with Renderer(heightmap, (320, 180)) as renderer:
        stats = renderer.draw(over_plain(), 1.0, curvature="on", style="depth")
        for x, y in ((1.1e5, 9.3e4), (2.3e5, 2e5), (3e5, 1.2e5)):
            away_m = math.dist((x, y), (9e3, 9e3))
            error_m = abs(renderer.drawn_height_at(x, y) - renderer.height_at(x, y))
            assert error_m <= 1.1 * stats["certified_max_error_px"] * away_m / over_plain().focal_px(180)
        patch = renderer.inspector.explain(2.3e5, 2e5)
        sag_m = reference.largest_sag_m(round(math.log2(patch.chosen.step)), heightmap.spacing_m, 0.5 / EARTH_M)
        assert patch.chosen.max_m >= sag_m > 0


# --- The options ------------------------------------------------------------------------------------------------------

MOON = 'GEOGCS["Moon",DATUM["D",SPHEROID["Moon 2000",1737400,0]],PRIMEM["P",0],UNIT["degree",0.0174532925199433]]'


def placed(spacing_m, crs):
    heightmap = Heightmap(np.zeros((101, 51)), spacing_m)
    heightmap.georeference = Georeference(Grid(1, 0, 0, 0, -1, 0), crs, (51, 101))
    return heightmap


@pytest.mark.parametrize(
    "heightmap, mode, radius_m",
    [
        (placed(501.0, "EPSG:4326"), "auto", EARTH_M),
        (placed(499.0, "EPSG:4326"), "auto", None),  # below 50 km
        (placed(499.0, "EPSG:4326"), "on", EARTH_M),
        (placed(501.0, "EPSG:4326"), "off", None),
        (placed(501.0, None), "auto", None),  # a grid without a coordinate system
        (placed(70e3, "EPSG:4326"), "auto", None),  # as long as a planet
        (placed(501.0, MOON), "auto", 1737400.0),
        (placed(20e3, MOON), "auto", None),
        (Heightmap(np.zeros((101, 51)), 5000.0), "auto", None),  # a game's map
        (Heightmap(np.zeros((101, 51)), 5000.0), "on", EARTH_M),
    ],
)
def test_the_rule_by_which_the_earth_is_round(heightmap, mode, radius_m):
    assert heightmap.bend_per_m(mode, 0.0) == (pytest.approx(1 / (2 * radius_m)) if radius_m else 0.0)


@pytest.mark.parametrize("options", [{"curvature": "yes"}, {"refraction": 1.0}, {"refraction": -0.1}])
def test_bad_values_are_refused(options):
    with pytest.raises(UsageError, match=next(iter(options))):
        FrameOptions(**options)


def test_the_command_line_bends_the_ground(run, folder):
    np.save("plain.npy", PLAIN.heights)
    words = ("measure", "plain.npy", "--spacing", "4000", "--size", "96x54", "--json", "m.json")
    assert run(*words, "--curvature", "on", "--refraction", "0.13")[0] == 0
    status, out, err = run("shot", "plain.npy", "-o", "a.png", "--refraction", "1")
    assert status == 2 and err.count("\n") == 1 and "refraction" in err
