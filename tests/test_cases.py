"""Files and commands of public reports, in the folder that TERRAIN_GL_CASES names: each gives the values of its README.

The values were computed by rasterio, pyproj or by hand. A folder with inputs has a check here, named after its number.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import read_image

FOLDER = os.environ.get("TERRAIN_GL_CASES")
pytestmark = pytest.mark.skipif(not FOLDER, reason="TERRAIN_GL_CASES does not name the folder of cases")
rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")

LAND = (400.023, 779.237)  # metres: the hill of most cases
SMALL = ("--size", "320x180")
DOWN = ("--eye=800,600,2600", "--target=800,640,500", "--fov", "40", "--size", "320x240", "--sun", "180,60")

# a file: options, heights in metres, metres between posts, voids, words of its only note
OPENED = {
    "01_mask_inside/mask_inside.tif": ({}, LAND, 30, 400, ""),
    "03_undeclared_void/float_9999.tif": ({}, LAND, 30, 400, "400 posts have exactly -9999"),
    "03_undeclared_void/float_32768.tif": ({}, LAND, 30, 400, "400 posts have exactly -32768"),
    "05_cylindrical_scale/world_mercator_60n.tif": ({}, LAND, (30.08, 30.08), 0, ""),
    "05_cylindrical_scale/equidistant_60n.tif": ({}, LAND, (30.08, 60.05), 0, ""),
    "07_grey_as_rgb/rgb.png": ({}, (100, 194), 1, 0, ""),
    "07_grey_as_rgb/rgba.png": ({}, (100, 194), 1, 0, ""),
    "09_two_layers/height_and_uncertainty.tif": ({"band": 1}, LAND, 30, 0, ""),
    "09_two_layers/three_years.tif": ({"band": 1}, LAND, 30, 0, ""),
    "20_gcps_only/gcps.tif": ({}, LAND, 30, 0, ""),
    "22_webp_tile/mapbox.webp": ({"encoding": "mapbox"}, (400.0, 779.2), 1, 0, ""),
    "22_webp_tile/terrarium.webp": ({"encoding": "terrarium"}, (400.02, 779.24), 1, 0, ""),
    "24_xarray_dataset/one.nc": ({}, LAND, (23.58, 33.34), 0, "taken as degrees"),
    "24_xarray_dataset/two.nc": ({"band": "z"}, LAND, (23.58, 33.34), 0, "taken as degrees"),
    "26_tiny_rotation/almost_north_up.tif": ({}, LAND, 30, 0, ""),
    "31_packed_tile_spacing/12/2145/1434.png": ({"encoding": "mapbox"}, (-20, 900), 25.88, 0, ""),
    "31_packed_tile_spacing/plain16.png": ({}, (0, 920), 30, 0, "--spacing 30"),
    "32_depth_positive_down/depth_crs.tif": ({}, (-120, -5), 10, 0, ""),
    "32_depth_positive_down/depth.nc": ({}, (-120, -5), (65.74, 92.61), 0, "taken as degrees"),
    "33_feet_without_unit/no_height_unit.tif": ({}, (400, 800), 3.048, 0, "--z-scale 0.3048006096"),
    "33_feet_without_unit/compound.tif": ({}, (121.92, 243.84), 3.048, 0, ""),
    "38_points_and_bom/bom.asc": ({}, (400, 800), 10, 0, ""),
    "38_points_and_bom/utf16.asc": ({}, (400, 800), 10, 0, ""),
}
# a file that is refused: what its line names
REFUSED = {
    "09_two_layers/height_and_uncertainty.tif": "--band 1",
    "09_two_layers/three_years.tif": "--band 1",
    "24_xarray_dataset/two.nc": "--band z",
    "38_points_and_bom/cloud.las": "pdal",
    "38_points_and_bom/soundings.xyz": "gdal_grid",
}


def test_each_folder_with_inputs_has_a_check():
    checked = {name[:2] for name in (*OPENED, *REFUSED)} | {name[5:7] for name in globals() if name[5:7].isdigit()}
    for folder in Path(FOLDER).iterdir():
        programs = {"README", "today.png", *(path.name for path in folder.glob("*.py"))}
        if folder.is_dir() and any(path.name not in programs for path in folder.iterdir()):
            assert folder.name[:2] in checked, f"{folder.name} has no check"


@pytest.mark.parametrize("name", OPENED)
def test_a_file_opens(name):
    options, heights_m, spacing_m, voids, words = OPENED[name]
    terrain = tg.Heightmap.open(Path(FOLDER) / name, **options)
    assert terrain.range_m == pytest.approx(heights_m, abs=0.01)
    assert terrain.spacing_m == pytest.approx(np.broadcast_to(spacing_m, 2), rel=3e-3)
    assert terrain.voids == voids
    assert [words in note for note in terrain.notes] == [True] * bool(words), terrain.notes


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_is_refused_with_the_next_step(name):
    with pytest.raises(TerrainError, match=REFUSED[name]) as caught:
        tg.Heightmap.open(Path(FOLDER) / name)
    assert "\n" not in str(caught.value)


@pytest.fixture
def inside(folder, run, request):
    """Work in a copy of the case with the number in the test's name; gives a function that runs a command there."""
    number = request.function.__name__[5:7]
    found = next(Path(FOLDER).glob(f"{number}_*"), None)
    if found is None:
        pytest.skip(f"TERRAIN_GL_CASES has no case {number}")
    for path in found.rglob("*"):  # not copytree: the folder may be read-only
        if path.is_file():
            copy = folder / path.relative_to(found)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)

    def told(*words):
        status, _, err = run(*words)
        assert status == 0, err
        return err

    return told


def pixels(name):
    return read_image(name)[..., :3].astype(int)


def differing(one, other):
    return int((np.abs(pixels(one) - pixels(other)).max(-1) > 30).sum())


def test_01_a_mask_counts_in_a_dataset_of_rasterio(inside):
    with rasterio.open("mask_inside.tif") as data:
        terrain = tg.Heightmap.of(data)
        expected = data.read(1, masked=True)
    assert terrain.voids == expected.mask.sum() == 400
    assert terrain.range_m == (expected.min(), expected.max())


def test_10_a_track_is_drawn(inside):
    inside("shot", "dem.tif", "--overlay", "way.gpx", "-o", "way.png", *SMALL)
    inside("shot", "dem.tif", "-o", "bare.png", *SMALL)
    assert differing("way.png", "bare.png") > 100


def test_12_longitudes_count_modulo_360(inside):
    inside("shot", "east_285.tif", "--overlay", "way.geojson", "-o", "way.png", *SMALL)
    inside("shot", "east_285.tif", "-o", "bare.png", *SMALL)
    assert differing("way.png", "bare.png") > 100
    inside("shot", "east_285.tif", "--at=-74.99,44.99", "-o", "west.png", *SMALL)
    inside("shot", "east_285.tif", "--at=285.01,44.99", "-o", "east.png", *SMALL)
    assert Path("west.png").read_bytes() == Path("east.png").read_bytes()


@pytest.mark.parametrize("tiles", [(0, 1), (1, 0)])
def test_14_one_coordinate_system_counts_for_all_tiles(inside, tiles):
    pytest.importorskip("zarr")
    from terrain_gl.store import StoredMap

    inside("build", *(f"tile_{i}.tif" for i in tiles), "-o", "s.zarr")
    stored = StoredMap(Path("s.zarr"))
    assert stored.spacing_m == pytest.approx((0.839, 0.835), abs=5e-4)
    assert stored.range_m == pytest.approx(LAND, abs=0.01)


def test_15_a_missing_tile_is_void(inside):
    pytest.importorskip("zarr")
    from terrain_gl.store import StoredMap

    inside("build", *sorted(map(str, Path().glob("tile_*.tif"))), "-o", "s.zarr")
    assert StoredMap(Path("s.zarr")).voids == 4096 + 400


def test_16_normals_and_depths_are_linear(inside):
    for style in ("normals", "depth"):
        inside("shot", "dem.tif", "--style", style, "-o", f"{style}.exr", *SMALL)
    normals, depth = (np.asarray(oiio.ImageBuf(f"{style}.exr").get_pixels()) for style in ("normals", "depth"))
    land = normals[..., 3] == 1
    assert np.median(np.linalg.norm(normals[land][:, :3], axis=1)) == pytest.approx(1, abs=1e-3)
    sky = depth[..., 3] == 0
    assert sky.any() and np.isinf(depth[sky][:, 0]).all()
    assert 100 < depth[~sky][:, 0].min() < depth[~sky][:, 0].max() < 20_000


def test_17_a_mesh_leaves_a_void_out(inside):
    from terrain_gl.files.mesh_readers import read_mesh

    for voids in ("hole", "fill"):
        inside("mesh", "hole.tif", "--voids", voids, "-o", f"{voids}.glb")
    areas = []
    for voids in ("hole", "fill"):
        places, faces = read_mesh(f"{voids}.glb")
        (x1, y1), (x2, y2), (x3, y3) = (places[faces[:, i], :2].T for i in range(3))
        areas.append(float(np.abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)).sum()) / 2)
    assert areas[1] == pytest.approx((63 * 30) ** 2, rel=1e-6)
    assert areas[1] - areas[0] == pytest.approx((20 * 30) ** 2, rel=1e-6)  # cells with a void corner


def test_18_exaggeration_is_that_of_higher_land(inside):
    """As land three times as high, seen from three times the height; the options' heights are those of the map."""
    view = ("--curvature", "off", "--style", "lambert", "--look", "grey", "--surroundings", "none", *SMALL)
    low, high = ((f"--eye=945,-1500,{1500 * f}", f"--target=945,945,{600 * f}") for f in (1, 3))
    inside("shot", "dem.tif", "--exaggeration", "3", "-o", "tall.png", *low, *view)
    inside("shot", "dem.tif", "--z-scale", "3", "-o", "scaled.png", *high, *view)
    inside("shot", "dem.tif", "-o", "plain.png", *low, *view)
    assert differing("tall.png", "scaled.png") < 20 and differing("tall.png", "plain.png") > 1000


def test_19_differences_have_a_diverging_ramp(inside):
    assert "diverging from -12 to 12" in inside("shot", "after.tif", "--material", "change.tif", "-o", "a.png", *SMALL)
    assert "from -12 to 9 m" in inside("shot", "change.tif", "--look", "viridis", "-o", "b.png", *SMALL)


def test_21_a_notebook_page_has_the_picture(inside):
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed")
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel", reason="the [notebook] extra is not installed")
    notebook = nbformat.read("show.ipynb", 4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": os.getcwd()}}).execute()
    try:
        html, _ = nbconvert.HTMLExporter().from_notebook_node(notebook)
    except ValueError as error:
        pytest.skip(f"nbconvert does not find its templates: {error}")
    assert "data:image/png;base64," in html


def test_23_the_smoother_byte_order_is_taken(inside):
    given = {"spacing_m": 30, "z_scale": 0.00579}
    mac, windows = (tg.Heightmap.open(f"{name}.raw", **given) for name in ("mac", "windows"))
    np.testing.assert_array_equal(mac.heights, windows.heights)
    assert any("--byte-order" in note for note in mac.notes)


def test_24_a_dataset_with_one_map_is_that_map(inside):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset("one.nc") as one, xarray.open_dataset("two.nc") as two:
        assert tg.Heightmap.of(one).range_m == pytest.approx(LAND, abs=0.01)
        with pytest.raises(TerrainError, match="z, source_id"):
            tg.Heightmap.of(two)


def test_25_a_camera_in_coordinates_of_the_map(inside):
    view = ("--eye=500900,4997500,1500", "--target=500900,4999000,500", *SMALL)
    assert "--coordinates map" in inside("shot", "dem.tif", *view, "-o", "none.png")
    inside("shot", "dem.tif", *view, "--coordinates", "map", "-o", "map.png")
    inside("shot", "dem.tif", "--eye=885,-595,1500", "--target=885,905,500", *SMALL, "-o", "posts.png")
    assert Path("map.png").read_bytes() == Path("posts.png").read_bytes()


@pytest.mark.parametrize(("place", "turned"), [("arctic", 105.0), ("antarctic", 90.0), ("europe", 15.1), ("utm", 0.0)])
def test_28_the_sun_counts_from_true_north(inside, place, turned):
    """A cone is brightest where it faces the sun; the overlay, a line due north, lies at the angle of the README."""
    view = ("--look", "grey", "--sun", "90,35", "--eye=3000,2900,9000", "--target=3000,3000,800", *SMALL)
    told = inside("shot", f"{place}.tif", *view, "-o", "p.png")
    assert (f"{turned:.1f} degrees clockwise" in told) == (turned > 1)
    image = pixels("p.png").mean(-1)
    rows, cols = np.indices(image.shape)
    around = np.hypot(rows - 90, cols - 160) < 80
    east, north = (cols - 160)[around], (90 - rows)[around]
    brightest = np.degrees(np.arctan2((image[around] * east).sum(), (image[around] * north).sum())) % 360
    assert brightest == pytest.approx((turned + 90) % 360, abs=4)


@pytest.mark.slow
def test_29_photos_of_more_bits_have_the_colours_of_eight(inside):
    def fields(name, *more):
        told = inside("shot", "dem.tif", "--material", f"{name}.tif", *DOWN, "-o", f"{name}.png", *more)
        return told, pixels(f"{name}.png")

    _, eight = fields("eight")
    shown = np.ptp(eight, -1) > 90  # inside the four fields
    assert shown.sum() > 3000
    for name, highest in (("twelve", 3520), ("reflectance", 2640)):
        told, image = fields(name)
        assert f"white is {highest}" in told
        assert ((image > 140) == (eight > 140))[shown].mean() > 0.98, "the same channels are bright; 2 % are borders"
        _, same = fields(name, "--range", f"0,{255 * highest / 220}")
        assert np.abs(same - eight).max() <= 2


def test_31_tiles_are_built_in_their_place(inside):
    pytest.importorskip("zarr")
    from terrain_gl.store import StoredMap

    inside("build", "12/2145/1434.png", "--encoding", "mapbox", "-o", "s.zarr")
    assert StoredMap(Path("s.zarr")).spacing_m == pytest.approx((25.88, 25.88), rel=3e-3)


def test_32_depths_of_an_array_point_down(inside):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset("depth.nc") as data:
        assert tg.Heightmap.of(data.depth).range_m == pytest.approx((-120, -5), abs=0.01)


def test_35_neighbouring_solids_meet(inside):
    for name, file in (("west", "w"), ("east", "e")):
        more = ("--print-mm", "100", "--max-error-m", "0.5", "--base-m", "300")
        inside("mesh", f"{name}.tif", "-o", f"{file}.stl", *more)
    out = subprocess.run([sys.executable, "edge.py", "w.stl", "e.stl"], capture_output=True, text=True, check=True)
    assert out.stdout.count("step 0.00 mm") == len(out.stdout.splitlines()) == 3


@pytest.mark.parametrize("ending", ["stl", "ply", "obj"])
def test_36_water_is_a_flat_sea(inside, ending):
    inside("mesh", "coast.tif", "-o", f"bed.{ending}")
    inside("mesh", "coast.tif", "--water", "0", "-o", f"sea.{ending}")
    assert Path(f"bed.{ending}").read_bytes() != Path(f"sea.{ending}").read_bytes()
    if ending == "obj":
        up = [float(line.split()[3]) for line in Path("sea.obj").read_text().splitlines() if line.startswith("v ")]
        assert min(up) == 0 < max(up)


def test_40_contours_in_feet_have_labels_in_feet(inside):
    terrain = tg.Heightmap.open("dem.tif")
    with tg.Renderer(terrain, (640, 360)) as renderer:
        renderer.render(tg.Camera.default(terrain), contour_m=40 * 0.3048)
        names = {label.name for label in renderer.contour_labels(40 * 0.3048, units="ft")}
    assert names and names <= {f"{feet} ft" for feet in range(1400, 2800, 200)}
    inside("shot", "dem.tif", "--contours", "40ft", "-o", "p.png", *SMALL)


@pytest.mark.parametrize("ending", ["kml", "geojson"])
def test_41_zones_have_their_colours(inside, ending):
    inside("shot", "dem.tif", "--overlay", f"zones.{ending}", "-o", "p.png", *SMALL)
    image = pixels("p.png")
    for channel in (0, 1):  # one zone is red, one is green; the land is neither
        others = np.delete(image, channel, -1).max(-1)
        assert (image[..., channel] > 1.5 * others + 20).sum() > 500


def test_42_a_transparent_sky(inside):
    inside("shot", "dem.tif", "--surroundings", "none", "--sky", "none", "-o", "p.png", *SMALL)
    alpha = read_image("p.png")[..., 3]
    assert alpha[0].max() == 0 and alpha[120, 160] == 255
