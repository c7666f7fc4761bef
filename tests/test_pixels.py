"""The parts of a pixel: places from depths, kinds of pixels, and the tables that each kind looks up."""

import numpy as np
import pytest
from maps import rough

from terrain_gl import reference
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap, bilinear
from terrain_gl.light.ground import towards_sun
from terrain_gl.renderer import Renderer
from terrain_gl.shade.programs import KINDS

SIZE = (160, 90)
SUN = (300.0, 30.0)
AT = np.array([(-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375)])  # samples, right and up in pixels


@pytest.fixture(scope="module")
def hills(session_context):
    with session_context, Renderer(Heightmap(rough(257, 257, 2, 900), 10.0), SIZE, ctx=session_context) as r:
        yield r


@pytest.fixture
def renderer(ctx, hills):
    return hills


def view(heightmap, fov_deg):
    """Return a camera south of the map, above it; with a small angle, a pixel sees few posts, else many."""
    east, north = heightmap.extent_m
    return Camera((east / 2, -2.0 * north, 2.2 * north), (east / 2, north / 2, 450.0), fov_deg)


NEAR, FAR = 2.0, 60.0


def kinds_of(picture):
    """(height, width) of `KINDS`, top row first."""
    return np.rint(8 * np.frombuffer(picture.targets.kinds.read(), "f4").reshape(SIZE[1], SIZE[0])[::-1]).astype(int)


def shaded(renderer, camera, **options):
    """The land alone, in a plain colour: no surroundings, no grain."""
    return (
        renderer.render(camera, sun=SUN, look="earth", surroundings="none", grain="off", **options)
        .image[..., :3]
        .astype(int)
    )


def test_places_lie_where_rays_meet_the_ground(renderer):
    """For each sample: at the place that it sees, the ray through it has the height of the ground."""
    heightmap, camera = renderer.heightmap, Camera.default(renderer.heightmap)
    renderer.draw(camera, method="full", style="depth")
    (right, up, forward), (half_x, half_y) = camera.axes, camera.half_extent(SIZE)
    east, north = heightmap.spacing_m
    for place, at in zip(renderer.picture.places(), AT, strict=True):
        x = ((np.arange(SIZE[0]) + 0.5 + at[0]) / SIZE[0] * 2 - 1) * half_x
        y = ((np.arange(SIZE[1])[::-1] + 0.5 + at[1]) / SIZE[1] * 2 - 1) * half_y
        ray = forward + x[None, :, None] * right + y[:, None, None] * up
        land = place[..., 0] >= 0
        seen_m = place * [east, -north] + [0, (heightmap.rows - 1) * north] - camera.eye[:2]
        along = np.linalg.norm(seen_m, axis=-1) / np.linalg.norm(ray[..., :2], axis=-1)
        truth_m = bilinear(heightmap.heights, place[..., 0].ravel(), place[..., 1].ravel()).reshape(land.shape)
        off_px = np.abs(camera.eye[2] + along * ray[..., 2] - truth_m) / (along * 2 * half_y / SIZE[1])
        assert land.sum() > 2000 and np.median(off_px[land]) < 0.05  # a triangle is not a bilinear patch


def test_pixels_with_edges_get_more_samples(renderer, monkeypatch):
    """Without the list of mixed pixels only those pixels change; most pixels are not in the list."""
    camera = Camera.default(renderer.heightmap)
    whole = shaded(renderer, camera)
    kinds = kinds_of(renderer.picture)
    assert set(np.unique(kinds)) == {KINDS["SKY"], KINDS["NEAR"], KINDS["MIXED"]}
    mixed = kinds == KINDS["MIXED"]
    assert 0 < mixed.mean() < 0.5
    renderer.picture.targets.picture.write(b"\xff\x00\xff\xff" * (SIZE[0] * SIZE[1]))
    monkeypatch.setattr(renderer.picture.programs, "run_listed", lambda *listed: None)
    without = shaded(renderer, camera)
    assert np.array_equal((without == [255, 0, 255]).all(-1), mixed)
    assert np.array_equal(without[~mixed], whole[~mixed])


@pytest.mark.parametrize("fov_deg", [NEAR, FAR])
@pytest.mark.parametrize("style", ["shaded", "lambert"])
def test_a_kinds_program_draws_what_the_program_for_all_draws(renderer, fov_deg, style):
    camera = view(renderer.heightmap, fov_deg)
    drawn = shaded(renderer, camera, style=style)
    by_one = np.rint(255 * renderer.picture.note(f"shade/{style}.frag", 4, "f4", sun=towards_sun(*SUN))[..., :3])
    off = np.abs(drawn - np.clip(by_one, 0, 255)).max(-1)
    assert (off > 1).mean() < 0.002


def poisoned_buffer(buffer):
    kept = buffer.read()
    buffer.write(np.random.default_rng(1).bytes(len(kept)))
    return lambda: buffer.write(kept)


def poisoned_texture(texture):
    kept = texture.read(alignment=1)
    texture.write(np.random.default_rng(1).bytes(len(kept)), alignment=1)
    return lambda: texture.write(kept, alignment=1)


TABLES = {  # each in a view where it matters
    "heights": (NEAR, lambda p: poisoned_buffer(p.sums.buffer)),
    "lobes": (FAR, lambda p: poisoned_buffer(p.lighting.lobes.buffer)),
    "sky, summed": (FAR, lambda p: poisoned_buffer(p.lighting.visibility.sky.buffer)),
    "sky, near": (NEAR, lambda p: poisoned_texture(p.lighting.visibility.sky.packed)),
    "sun, summed": (FAR, lambda p: poisoned_buffer(p.lighting.visibility.sun.buffer)),
    "sun, near": (NEAR, lambda p: poisoned_texture(p.lighting.visibility.sun.horizon)),
}


def test_shares_side_by_side_are_the_reference(renderer):
    """The compiler may round a tie the other way."""
    renderer.render(view(renderer.heightmap, NEAR), style="shaded")
    with renderer.session:
        sky = renderer.picture.lighting.visibility.sky
        words, expected = sky.packed.read(), reference.pack_shares(sky.read())
    got = np.frombuffer(words, "u4").reshape(expected.shape)
    parts = np.array([[part >> shift & 1023 for shift in (0, 10, 20)] for part in (got, expected)], int)
    off = np.abs(parts[0] - parts[1])
    assert off.max() <= 1 and (off > 0).mean() < 0.01 and len(np.unique(parts[0])) > 100


@pytest.mark.parametrize("table", TABLES)
def test_every_table_of_light_shows(renderer, table):
    """A table overwritten with random words changes most of the land; written back, the picture is as before."""
    fov_deg, poison = TABLES[table]
    camera = view(renderer.heightmap, fov_deg)
    before = shaded(renderer, camera)
    land = renderer.picture.coverage()
    mend = poison(renderer.picture)
    changed = (np.abs(shaded(renderer, camera) - before).max(-1) > 2)[land].mean()
    mend()
    assert np.array_equal(shaded(renderer, camera), before)
    assert changed > 0.2, f"{changed:.1%} of the land"


def test_a_first_picture_of_the_sky_alone_is_not_black():
    """A context of its own, in which no mesh was drawn before."""
    with Renderer(Heightmap(rough(33, 33, 2, 50), 10.0), SIZE) as alone:
        frame = alone.render(Camera((160.0, 160.0, 900.0), (160.0, 400.0, 2000.0)), style="lambert")
    assert frame.stats["triangles"] == 0 and (frame.image == frame.image[0, 0]).all()
    assert frame.image[0, 0, 3] == 255 and frame.image[0, 0, 2] > 100
