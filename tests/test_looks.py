"""The land's colours: by place and height, the same in a part of a map and after an edit; water only where it is."""

import numpy as np
import pytest
from maps import rough

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.climate import LOOKS, NAMES, climate_of, climates, look_of
from terrain_gl.light.ramps import LOOKS as RAMPS
from terrain_gl.readers.georeference import DEGREES, Georeference, Grid
from terrain_gl.renderer import Renderer
from terrain_gl.terrain.water import water_posts

SIZE = (160, 90)


def mountains(rows=260, cols=300):
    """Land from the sea's height to 3000 m."""
    return rough(rows, cols, 3, 3000.0) - rough(rows, cols, 3, 3000.0).min()


@pytest.fixture(scope="module")
def whole_and_part(session_context):
    """A map and a part of it, whose light is made once."""
    heights = mountains()
    with session_context:
        maps = Heightmap(heights, 30.0), Heightmap(heights[40:150, 60:190].copy(), 30.0)
        made = [Renderer(heightmap, SIZE, ctx=session_context) for heightmap in maps]
        yield made
        for renderer in made:
            renderer.release()


def picture(ctx, heightmap, camera, **options):
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        return renderer.render(camera, 2.0, **options).image[..., :3].astype(int)


def at(longitude, latitude, heightmap):
    """A map with a place on the earth: that of its north-western corner."""
    return Georeference(Grid(1e-4, 0, longitude, 0, -1e-4, latitude), DEGREES, (heightmap.cols, heightmap.rows))


def over(heightmap, row, col, up_m=6000.0, origin=(0, 0)):
    """Look down at a post of a map, or at the same post of a part of it that begins at `origin`."""
    x, y = (col - origin[1]) * heightmap.spacing_m[0], (heightmap.rows - 1 - (row - origin[0])) * heightmap.spacing_m[1]
    return Camera((x, y, up_m), (x, y, 0.0), 15.0)


@pytest.mark.slow
@pytest.mark.parametrize("look", sorted(set(NAMES) - set(RAMPS)))  # which show the map's own range
def test_a_part_of_a_map_has_the_colours_of_the_whole(ctx, whole_and_part, look):
    """A part keeps the land's colours, though its range of heights differs. The grain of its colours may move."""
    whole, part = (renderer.heightmap for renderer in whole_and_part)
    assert part.range_m[1] - part.range_m[0] < 0.9 * (whole.range_m[1] - whole.range_m[0])
    cameras = over(whole, 95, 125), over(part, 95, 125, origin=(40, 60))
    one, other = (
        renderer.render(camera, 2.0, look=look, grain="off").image[..., :3].astype(int)
        for renderer, camera in zip(whole_and_part, cameras, strict=True)
    )
    assert np.median(np.abs(one - other)) <= 2


def test_an_edit_far_away_leaves_the_colours_as_they_are(ctx):
    heightmap = Heightmap(mountains(), 30.0)
    camera = over(heightmap, 95, 125)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        before = renderer.render(camera, 2.0).image.astype(int)
        renderer.edit(slice(250, 255), slice(280, 290), 9000.0)
        after = renderer.render(camera, 2.0).image.astype(int)
    assert np.median(np.abs(before - after)) <= 1 and np.abs(before - after).mean() < 2


def test_looks_differ_and_can_be_changed_back(ctx):
    heightmap = Heightmap(mountains(), 30.0)
    camera = Camera((4500, 3900, 9000), (4500, 3900, 0), 50.0)  # all of it
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        pictures = {name: renderer.render(camera, 2.0, look=name).image for name in LOOKS}
        again = renderer.render(camera, 2.0, look="alpine").image
        auto = renderer.render(camera, 2.0).image
    assert np.array_equal(pictures["alpine"], again) and np.array_equal(again, auto)
    names = list(pictures)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            assert np.abs(pictures[one].astype(int) - pictures[other]).mean() > 2, (one, other)


def test_snow_lies_where_latitude_and_height_say_so(ctx):
    """The same land at 70 and at 10 degrees north."""
    heightmap = Heightmap(mountains(), 30.0)
    white = {}
    for latitude in (70.0, 46.0, 10.0):
        heightmap.georeference = at(10.0, latitude, heightmap)
        shown = picture(ctx, heightmap, over(heightmap, 95, 125))
        white[latitude] = (shown.min(-1) > 170).mean()
    assert white[70.0] > white[46.0] + 0.05 and white[10.0] == 0


def test_climates_of_places():
    davos, everest, green_river, sahara = (9.8, 46.8), (86.9, 28.0), (-110.1, 39.0), (10.0, 25.0)
    of = {place: climate_of(place[1], place[0]) for place in (davos, everest, green_river, sahara)}
    assert [of[place].dryness for place in (davos, everest, green_river, sahara)] == [0, 0, 1, 1]
    assert 2000 < of[davos].snow_m < 3000 < 5000 < of[everest].snow_m < 6000
    assert all(climate.trees_m < climate.snow_m for climate in of.values())
    assert climate_of(-45.0, 170.0) == climate_of(45.0, 5.0)  # New Zealand is no desert


def test_auto_is_what_the_map_says_of_itself():
    land = Heightmap(mountains(20, 20), 30.0)
    assert look_of(land) == "alpine" and climates(land, "arid")[0].dryness == 1
    land.assumes_spacing = True
    assert look_of(land) == look_of(land.copy()) == "earth"
    land.georeference = at(9.0, 47.0, land)
    assert look_of(land) == "alpine"
    land.look = "grey"
    assert look_of(land) == look_of(land.copy()) == "grey"


def test_posts_far_apart_and_other_bodies_have_looks_of_their_own():
    assert look_of(Heightmap(mountains(20, 20), 999.0)) == "alpine"
    wide = Heightmap(mountains(20, 20), 1000.0)
    assert look_of(wide) == "tint"
    wide.of_earth = False
    assert look_of(wide) == "grey"
    wide.georeference = at(9.0, 47.0, wide)  # what a file says of its place counts more
    assert look_of(wide) == "tint"


def test_without_air_the_sky_is_black_and_there_is_no_haze(ctx):
    heightmap = Heightmap(mountains(), 3000.0)
    camera = Camera((400_000, -100_000, 60_000), (400_000, 300_000, 0), 45.0)
    hazy = picture(ctx, heightmap, camera, look="grey", sun=(300, 30))
    heightmap.of_earth = False
    bare = picture(ctx, heightmap, camera, look="grey", sun=(300, 30))
    assert (hazy[0] > 100).all() and (bare[0] < 12).all()
    assert np.ptp(bare[-1], axis=-1).max() <= 12 < np.ptp(hazy[0], axis=-1).max()  # no blue without air


def test_climates_follow_the_corners_of_a_map():
    """Towards the southern rim it becomes warmer; the moon has no climate."""
    pytest.importorskip("pyproj", reason="the [geo] extra is not installed")
    land = Heightmap(mountains(200, 20), 30.0)
    land.georeference = Georeference(Grid(0.01, 0, 9, 0, -0.01, 47), DEGREES, (20, 200))
    north, south = climates(land, "alpine")[0], climates(land, "alpine")[2]
    assert north == climate_of(46.995, 9.0) and south == climate_of(45.005, 9.0) and south.snow_m > north.snow_m
    land.georeference = Georeference(Grid(1000, 0, 5e5, 0, -1000, 5.2e6), "EPSG:32632", (20, 200))
    assert climates(land, "alpine")[0].snow_m == pytest.approx(climate_of(46.95).snow_m, abs=10)
    land.georeference = Georeference(Grid(100, 0, 0, 0, -100, 0), "+proj=eqc +R=1737400 +units=m +no_defs", (20, 200))
    assert look_of(land) == "grey" and climates(land, "grey")[0] == climate_of(46.0)


# --- Water ------------------------------------------------------------------------------------------------------------


def lake():
    """Land of whole metres around a lake at 40 m, with an outlet in the east."""
    y, x = np.mgrid[:200, :240].astype("f4")
    heights = np.round(np.maximum(40.0, 40 + (np.hypot(x - 110, y - 100) - 60) * 0.7)).astype("f4")
    heights[98:102, 165:] = 40 - np.arange(75) // 10
    return heights


def terraces():
    """A gentle plain of whole metres, as in a valley: steps 15 posts wide and 200 long."""
    y, x = np.mgrid[:200, :240].astype("f4")
    return np.floor(x / 30 + 0.3 * np.sin(y / 20)).astype("f4")


def test_a_lake_is_water_and_terraces_are_none():
    water = water_posts(lake())
    assert water[100, 110] and not water[5, 5] and not water[100, 230]
    assert np.abs(water.sum() / (np.pi * 60**2) - 1) < 0.1
    assert water_posts(terraces()) is None
    assert water_posts(np.zeros((200, 200), "f4")) is None  # no shore
    assert water_posts(rough(200, 200)) is None
    coast = np.maximum(rough(200, 200, 1, 800.0), 0)
    assert np.array_equal(water_posts(coast), coast == 0) or (water_posts(coast) & ~(coast == 0)).sum() == 0
    top = np.minimum(lake(), 41)  # the land is a plain at 41 m, which is not water
    assert not water_posts(top)[5, 5]


def test_water_shows_and_an_edit_dries_it(ctx):
    heightmap = Heightmap(lake(), 30.0)
    camera = over(heightmap, 100, 110, 4000.0)
    with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        wet = renderer.render(camera, 2.0).image[45, 80, :3].astype(int)
        renderer.edit(slice(80, 120), slice(90, 130), 60.0)
        dry = renderer.render(camera, 2.0).image[45, 80, :3].astype(int)
        renderer.edit(slice(80, 120), slice(90, 130), 40.0)
        again = renderer.render(camera, 2.0).image[45, 80, :3].astype(int)
        grey = renderer.render(camera, 2.0, look="grey").image[45, 80, :3].astype(int)
    assert wet[2] > wet[0] + 10 and dry[1] > dry[2] and np.abs(wet - again).max() <= 1
    assert np.ptp(grey) < 30
