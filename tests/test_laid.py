"""A picture of the ground is placed by its own coordinates, for any coordinate system of the map."""

from pathlib import Path

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.light.laid import read_ground
from terrain_gl.renderer import Renderer

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
warp = pytest.importorskip("rasterio.warp", reason="the [geo] extra is not installed")

UTM, N, STEP = "EPSG:32632", 65, 10.0
WEST, NORTH = 500_000.0, 5_150_000.0
SPAN = N * STEP


@pytest.fixture
def heightmap(folder):
    """A map with a place on the earth. It is level, so that its colour is the picture's."""
    write_raster("map.tif", np.zeros((N, N), "f4"), spaced(STEP, WEST, NORTH), UTM)
    return Heightmap.open("map.tif")


def picture(name, box, crs=UTM, pixels=160, alpha=None, **more):
    """Write a picture of the land from (west, south) to (east, north), in metres from the map's corner.

    The north-eastern quarter of the map is red, the rest is green. A picture of a part of the map shows its colours.
    """
    west, south, east, north = WEST + box[0], NORTH - SPAN + box[1], WEST + box[2], NORTH - SPAN + box[3]
    if crs != UTM:
        west, south, east, north = warp.transform_bounds(UTM, crs, west, south, east, north)
    step = (east - west) / pixels, (north - south) / pixels
    x, y = np.meshgrid(west + step[0] * (np.arange(pixels) + 0.5), north - step[1] * (np.arange(pixels) + 0.5))
    x, y = (np.reshape(v, x.shape) for v in warp.transform(crs, UTM, x.ravel(), y.ravel())[:2])
    red = (x > WEST + SPAN / 2) & (y > NORTH - SPAN / 2)
    colours = np.where(red[..., None], (240, 20, 20), (20, 120, 20)).astype("u1")
    bands = np.moveaxis(colours if alpha is None else np.dstack([colours, alpha]), -1, 0)
    return write_raster(name, bands, (step[0], 0, west, 0, -step[1], north), crs)


@pytest.mark.parametrize("crs", [UTM, "EPSG:4326", "EPSG:3857", "EPSG:2056"])
@pytest.mark.parametrize("box", [(0, 0, SPAN, SPAN), (-900, -700, 800, 1500), (200, 300, 600, 640)])
def test_colours_lie_where_they_belong(heightmap, crs, box):
    """Each texel has the colour of its own place in the map, and is covered where the picture reaches."""
    albedo = read_ground(picture("p.tif", box, crs), heightmap.georeference).astype("f4")
    rows, cols = albedo.shape[:2]
    y, x = np.meshgrid(
        SPAN * (1 - (np.arange(rows) + 0.5) / rows), SPAN * (np.arange(cols) + 0.5) / cols, indexing="ij"
    )
    slack = 3 * max(SPAN / rows, SPAN / cols, (box[2] - box[0]) / 160)  # a few texels and pixels, and turned edges
    slack += 0 if crs == UTM else 0.05 * SPAN  # its edges are oblique
    inside = (x > box[0] + slack) & (x < box[2] - slack) & (y > box[1] + slack) & (y < box[3] - slack)
    outside = (x < box[0] - slack) | (x > box[2] + slack) | (y < box[1] - slack) | (y > box[3] + slack)
    assert inside.any() and np.all(albedo[inside, 3] == 1) and np.all(albedo[outside] == 0)
    slack = 3 * max(SPAN / rows, SPAN / cols, (box[2] - box[0]) / 160)
    off_line = np.minimum(np.abs(x - SPAN / 2), np.abs(y - SPAN / 2)) > slack
    is_red = (x > SPAN / 2) & (y > SPAN / 2)
    seen_red = albedo[..., 0] > albedo[..., 1]
    assert np.array_equal(seen_red[inside & off_line], is_red[inside & off_line])


def test_a_large_picture_is_reduced_to_means(heightmap):
    whole = read_ground(picture("p.tif", (0, 0, SPAN, SPAN)), heightmap.georeference)
    few = read_ground("p.tif", heightmap.georeference, most_side=32)
    assert whole.shape == (160, 160, 4) and few.shape == (32, 32, 4)
    means = whole.astype("f8").reshape(32, 5, 32, 5, 4).mean((1, 3))
    assert few.astype("f8") == pytest.approx(means, abs=2e-3)


def test_opacity_and_pictures_without_coordinates(heightmap, folder):
    alpha = np.zeros((160, 160), "u1")
    alpha[:, 80:] = 255
    albedo = read_ground(picture("p.tif", (0, 0, SPAN, SPAN), alpha=alpha), heightmap.georeference)
    assert np.all(albedo[:, :78] == 0) and np.all(albedo[:, 82:, 3] == 1)
    write_image("plain.png", np.full((8, 8, 3), 200, "u1"))
    assert read_ground("plain.png", heightmap.georeference).shape == (8, 8, 3)
    assert read_ground("p.tif", None).shape[:2] == (160, 160)  # a map without a place is covered from edge to edge


@pytest.mark.slow
def test_a_picture_of_other_land_is_refused(heightmap):
    picture("p.tif", (2000, 0, 3000, 900))
    with pytest.raises(TerrainError, match=r"p\.tif: lies off the map"):
        read_ground("p.tif", heightmap.georeference)
    whole = Path(picture("q.tif", (0, 0, 9, 9)))
    whole.write_bytes(whole.read_bytes()[:20_000])
    with pytest.raises(TerrainError, match=r"q\.tif"):
        read_ground("q.tif", heightmap.georeference)


def test_land_beside_the_picture_keeps_its_own_cover(heightmap, ctx):
    camera = Camera((320, 320, 2000), (320, 320, 0), 15)
    picture("p.tif", (320, 0, SPAN, SPAN), "EPSG:4326")
    with Renderer(heightmap, (64, 64), ctx=ctx) as renderer:
        bare = renderer.render(camera, sun=(90, 60)).image.astype(int)
        worn = renderer.render(camera, sun=(90, 60), material="p.tif").image.astype(int)
    red = worn[..., 0] - worn[..., 1]
    assert np.abs(worn - bare)[:, :27].max() <= 1
    assert red[8:24, 40:56].min() > 40 and red[40:56, 40:56].max() < -20
