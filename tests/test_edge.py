"""The surroundings of the map: a block's sides, a plain or the sea, a horizon; none of it is measured."""

import numpy as np
import pytest
from maps import rough

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.renderer import Renderer

SIZE = (192, 108)


def plateau(n=65):
    return Heightmap(np.full((n, n), 500.0) + rough(n, n, 1, 20.0), 30.0)


def coast(n=160):
    """The corner of an island, with sea in the south and the west."""
    y, x = np.mgrid[:n, :n]
    return Heightmap(np.maximum(0, 8 * (x - 60) - 6 * (y - 60) + rough(n, n, 2, 60.0)).astype("f4"), 30.0)


def outside(heightmap):
    """View from the south, above the height of the rim."""
    east, north = heightmap.extent_m
    return Camera((east / 2, -1.2 * north, 900.0), (east / 2, north / 2, 450.0), 50.0)


def pixel_of(camera, place):
    """Column and row of a world place."""
    x, y, z = camera.axes @ np.subtract(place, camera.eye)
    tan_x, tan_y = camera.half_extent(SIZE)
    return int((x / z / tan_x + 1) / 2 * SIZE[0]), int((1 - y / z / tan_y) / 2 * SIZE[1])


def shown(renderer, camera, **options):
    return renderer.render(camera, 1.0, **options).image[..., :3].astype(int)


def inside(land):
    """Pixels of land with only land around them: at the rim a wall may cover land by a pixel, the tolerance."""
    rows = land[:-2] & land[1:-1] & land[2:]
    return np.pad(rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:], 1)


def test_the_side_of_the_block_stands_below_the_rim(ctx):
    heightmap = plateau()
    camera, (east, _) = outside(heightmap), heightmap.extent_m
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        block, none = shown(renderer, camera), shown(renderer, camera, surroundings="none")
        land = renderer.picture.coverage()
    col, row = pixel_of(camera, (east / 2, 0.0, heightmap.range_m[0] - 20))
    wall, foot = block[row, col], block[row + 12, col]
    assert not land[row, col] and np.abs(wall - none[row, col]).max() > 20
    assert np.abs(wall - foot).max() > 8  # beside it lies the plain
    assert np.abs(block - none)[inside(land)].max() <= 2  # the land is as it was
    assert inside(land).sum() > 100 and (np.abs(block - none)[land].max(-1) > 2).mean() < 0.01
    assert np.abs(block - none)[0].max() <= 2  # and so is the sky


def test_a_wall_hides_the_land_behind_it(tmp_path, ctx):
    """From beside a bowl, below its rim. Without the block one sees the inside of the bowl, which is red here."""
    write_image(tmp_path / "red.png", np.full((8, 8, 3), (250, 0, 0), "u1"))
    y, x = np.mgrid[:65, :65] / 32.0 - 1
    heightmap = Heightmap((150 + 350 * np.maximum(np.abs(x), np.abs(y))).astype("f4"), 30.0)
    east, north = heightmap.extent_m
    camera = Camera((east / 2, -0.8 * north, 400.0), (east / 2, north / 2, 400.0), 50.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        block, none = (
            shown(renderer, camera, surroundings=e, material=tmp_path / "red.png") for e in ("block", "none")
        )
        land = renderer.picture.coverage()
    (col, top), (_, foot) = (pixel_of(camera, (east / 2, 0.0, z)) for z in (490.0, 330.0))
    wall = np.s_[top:foot, col - 20 : col + 20]
    assert foot - top > 8 and land[wall].mean() > 0.9
    redness = [(picture[wall][..., 0] > 2 * picture[wall][..., 1]).mean() for picture in (block, none)]
    assert redness[0] == 0 and redness[1] > 0.9


def test_the_sea_goes_on_beyond_the_map(ctx):
    """No rim is visible where the map ends in water."""
    heightmap = coast()
    top = heightmap.range_m[1]
    camera = Camera((0.0, 0.0, 3 * top), (0.0, 1.0, 0.0), 40.0)  # straight down on the south-western corner
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        assert renderer.terrain.sea_m == 0.0
        sea = shown(renderer, camera)
        land = renderer.picture.coverage()
    assert 0.1 < land.mean() < 0.5 and np.abs(sea[land].mean(0) - sea[~land].mean(0)).max() < 6
    assert sea[..., 2].mean() > sea[..., 0].mean() + 10


def test_land_without_water_at_its_rim_has_no_sea(ctx):
    lake = np.maximum(rough(160, 160, 3, 100.0), 0.0) + 5
    for heights in (lake, plateau().heights):
        with Renderer(Heightmap(heights, 30.0), SIZE, ctx=ctx) as renderer:
            assert renderer.terrain.sea_m is None or (renderer.heightmap.heights[0] == renderer.terrain.sea_m).any()


def test_over_the_map_one_looks_out_on_a_plain_and_no_wall(ctx):
    """View from the middle outward: land, then the plain, then the sky, one of them in each row of pixels."""
    heightmap = plateau()
    (east, north), top = heightmap.extent_m, heightmap.range_m[1]
    camera = Camera((east / 2, north / 2, top + 150), (east / 2, 3 * north, top), 40.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        picture = shown(renderer, camera)
        land = renderer.picture.coverage()
    horizon = pixel_of(camera, (east / 2, 1e9, camera.eye[2]))[1]
    beyond = [row for row in range(horizon + 2, SIZE[1]) if not land[row].any()]
    from_land = np.abs(picture[beyond] - picture[land].mean(0)).mean()
    assert len(beyond) > 2 and from_land < 25  # no grey abyss
    assert np.abs(picture[: horizon - 2] - picture[land].mean(0)).mean() > 2 * from_land


@pytest.mark.slow
@pytest.mark.parametrize("style", ["lod", "error", "normals", "ambient"])
def test_other_styles_show_the_map_alone(ctx, style):
    heightmap = plateau()
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        both = [shown(renderer, outside(heightmap), style=style, surroundings=edge) for edge in ("block", "none")]
    assert np.array_equal(*both)


def test_what_is_measured_is_the_mesh(ctx):
    heightmap = plateau()
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        told, keys = [], ("max_error_px", "rms_error_px", "posts_measured", "triangles", "holes")
        for edge in ("block", "none"):
            renderer.draw(outside(heightmap), 1.0, surroundings=edge)
            stats = renderer.measure()
            told.append([stats[key] for key in keys])
    assert told[0] == told[1] and told[0][-1] == 0


def test_pieces_of_a_picture_have_the_same_surroundings(ctx):
    heightmap = plateau()
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        whole = shown(renderer, outside(heightmap))
    with Renderer(heightmap, (100, 60), ctx=ctx) as renderer:
        pieces = shown(renderer, outside(heightmap), size=SIZE)
    assert np.abs(whole - pieces).max() <= 1


@pytest.mark.parametrize("inside", [True, False])
def test_pixels_of_the_surroundings_show_the_mean_of_what_is_in_them(ctx, inside):
    """A pixel shades the plain, each wall and the sky once; a picture of 6 × 6 pixels for each has the same colours."""
    heightmap = plateau()
    (east, north), top = heightmap.extent_m, heightmap.range_m[1]
    above = Camera((0.3 * east, 0.2 * north, top + 150), (0.6 * east, 3 * north, top), 60.0)
    corner = Camera((-0.5 * east, -0.4 * north, 1.3 * top), (0.5 * east, 0.5 * north, 450.0), 50.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        camera = above if inside else corner
        drawn = shown(renderer, camera)
        around = renderer.picture.sky_share() == 1
        fine = shown(renderer, camera, size=SIZE, fine=6)
        assert inside or len(np.unique(drawn[around], axis=0)) > 300  # two walls with layers, plain and sky
    off = np.abs(drawn - fine).max(-1)[around]
    assert around.mean() > 0.3 and (off > 3).mean() < 0.01
    assert off.mean() < 0.8  # both pictures have noise of half a step
