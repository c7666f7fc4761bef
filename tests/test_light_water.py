"""Water at one height is one surface: over drowned land, in the lakes and the sea of the map, and around it."""

import numpy as np
import pytest
from maps import island

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.renderer.facts import KINDS

SIZE = (320, 180)


def hills(n=129, spacing_m=30.0):
    y, x = np.mgrid[0:n, 0:n] * 1.0
    bumps = 300 * np.sin(x / 17) * np.cos(y / 23) + 20 * np.sin(x / 3.1 + y / 4.7)
    return Heightmap((500 + bumps).astype("f4"), spacing_m)


@pytest.fixture(scope="module")
def flooded():
    with Renderer(hills(), SIZE) as renderer:
        yield renderer


def levels(image):
    return image[..., :3].astype(int)


VIEWS = [
    Camera((1900, 1000, 1500), (1900, 3000, 1100), 60),
    Camera((-1500, -900, 1700), (1900, 1900, 1100), 60),
    Camera((900, 900, 6000), (1900, 1900, 1100), 60),
    Camera.orthographic((900, -900, 6000), (1900, 1900, 1100), 6000.0),
]


@pytest.mark.parametrize("camera", VIEWS)
def test_the_map_below_deep_water_leaves_no_mark(flooded, camera):
    """The sea over drowned hills is the sea over an abyss, whose map ends elsewhere: no rim, no slope, no grain."""
    over_hills = levels(flooded.render(camera, water_m=1100.0).image)
    with Renderer(Heightmap(np.full((33, 33), -3000.0) + np.eye(33), 30.0), SIZE) as renderer:
        over_an_abyss = levels(renderer.render(camera, water_m=1100.0).image)
    assert np.abs(over_hills - over_an_abyss).max() <= 1


def test_the_bed_shows_through_shallow_water(flooded):
    camera = Camera((1900, 1900, 3000), (1900, 1950, 600), 60)
    deep, shallow = (levels(flooded.render(camera, water_m=height).image) for height in (1100.0, 801.0))
    assert np.abs(shallow - deep).max() > 20


@pytest.mark.parametrize("is_inside", [True, False])
def test_land_throws_its_shadow_on_water_inside_the_map_and_beside_it(is_inside):
    """A wall of 200 m hides a sun of 30 degrees for 346 m behind it; the shadow does not stop at the map's rim."""
    heights = np.full((101, 101), -400.0, "f4")
    heights[30:70, 40 : 43 if is_inside else 101] = 200.0
    if not is_inside:
        heights[30:70, 40:98] = -400.0
    foot_m = 42 * 10.0 if is_inside else 1000.0
    with Renderer(Heightmap(heights, 10.0), (200, 200)) as renderer:
        camera = Camera.orthographic((foot_m + 250, 500, 900), (foot_m + 250, 500, 0), 800.0, up=(0, 1, 0))
        image = levels(renderer.render(camera, water_m=0.0, sun=(270, 30)).image).sum(-1)
    across = image[95:105].mean(0)  # 4 m a pixel, from foot_m - 150 on
    at = foot_m - 150 + 4 * (np.arange(200) + 0.5)
    dark, lit = across[(at > foot_m + 60) & (at < foot_m + 280)], across[at > foot_m + 420]
    assert dark.max() < lit.min() - 15
    edge = at[at > foot_m + 60][np.argmax(across[at > foot_m + 60] > 0.5 * (dark.mean() + lit.mean()))]
    assert edge == pytest.approx(foot_m + 200 / np.tan(np.radians(30)), abs=25)


def test_the_bed_fades_towards_the_rim_of_the_map():
    """Over a bank 3 m below the water, its light does not end in a line where the map ends."""
    bank = np.zeros((101, 101), "f4")
    bank[50, 50] = -1e-3
    with Renderer(Heightmap(bank, 10.0), (400, 100)) as renderer:
        camera = Camera.orthographic((0, 500, 900), (0, 500, 0), 100.0, up=(0, 1, 0))
        across = levels(renderer.render(camera, water_m=3.0, grain="off").image)[50]
    assert np.abs(across[-1] - across[2]).max() > 20, "away from the rim, the bank shows"
    assert np.abs(np.diff(across, axis=0)).max() <= 8, "one metre a pixel: it fades over 20 m"


ISLAND = [
    Camera((2900, -1800, 700), (2900, 2900, 100), 50),
    Camera((2500, 300, 900), (3000, 2800, 150), 50),
    Camera((2900, 2900, 9000), (2900, 2901, 0), 50),
]


def inside(water):
    """Pixels of water whose neighbours are water, too: without those at a shore."""
    padded = np.pad(water, 3, constant_values=False)
    rows, cols = water.shape
    return np.all([padded[i : i + rows, j : j + cols] for i in range(7) for j in range(7)], axis=0)


@pytest.mark.parametrize("camera", ISLAND)
@pytest.mark.parametrize("level_m", [0.0, 150.0])
def test_water_of_the_map_is_that_of_a_level(camera, level_m):
    """The sea and the lake of a map have the colours of `water_m` over a pit; the same flat land has others."""
    heights = island()
    pit, dry = (np.where(heights == level_m, z, heights).astype("f4") for z in (level_m - 3000.0, level_m))
    dry[::4, ::4] += np.where(dry[::4, ::4] == level_m, 1e-3, 0.0)
    drawn = []
    for map_, options in ((heights, {}), (pit, {"water_m": level_m}), (dry, {})):
        with Renderer(Heightmap(map_, 30.0), SIZE) as renderer:
            frame = renderer.render(camera, grain="off", **options)
            is_at = frame.kind == KINDS.index("water")
            with np.errstate(invalid="ignore"):
                is_at &= np.abs(frame.places[..., 2] - level_m) < 2.0
            drawn.append((levels(frame.image), is_at, frame.normals))
    (mine, is_mine, normals), (level, is_level, _), (as_land, _, _) = drawn
    both = inside(is_mine & is_level)
    assert both.sum() > 300 and (normals[both] == [0, 0, 1]).all()
    assert np.abs(mine - level)[both].max() <= 2
    assert np.abs(as_land - level)[both].mean() > 10


@pytest.mark.parametrize("look", ["grey", "viridis"])
def test_in_a_diagram_the_sea_around_has_the_colour_of_the_sea_in_the_map(look):
    with Renderer(Heightmap(island(), 30.0), SIZE) as renderer:
        image = levels(renderer.render(Camera((-300, -300, 9000), (-300, -299, 0), 12), look=look).image)
    across = image[:60].mean(0)  # the map's western rim crosses these rows, near column 190
    assert np.abs(np.diff(across, axis=0)).max() < 1
