"""Stage 1: every format, encoding, void and spacing rule, and every bad file."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rasters import spaced, write_raster

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.georeference import metres_per_degree

ROWS, COLS = 37, 53
TYPES = {"float32": "float", "float64": "double"}  # as OpenImageIO calls them


def posts(dtype="uint16", shape=(ROWS, COLS)):
    """Heights without symmetry, so that a test fails for a mirrored or transposed map."""
    rng = np.random.default_rng(7)
    limit = 250 if np.dtype(dtype).itemsize == 1 else 9000
    return (rng.random(shape) * limit).astype(dtype)


def write_image(path, pixels, tile=0, **attributes):
    """Write (rows, cols[, channels]) with the type that the array has."""
    pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None])
    rows, cols, channels = pixels.shape
    spec = oiio.ImageSpec(cols, rows, channels, TYPES.get(pixels.dtype.name, pixels.dtype.name))
    spec.tile_width = spec.tile_height = tile
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    whole = (0, cols, 0, rows, 0, 1, pixels)
    assert out.write_tiles(*whole) if tile else out.write_image(pixels), out.geterror()
    out.close()
    return path


@pytest.fixture(params=["rasterio", "no rasterio"])
def geo(request, monkeypatch):
    """Both installations: with the [geo] extra and without."""
    if request.param == "rasterio":
        pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
        return True
    monkeypatch.setitem(sys.modules, "rasterio", None)
    return False


@pytest.fixture
def rasterio():
    return pytest.importorskip("rasterio", reason="the [geo] extra is not installed")


def error_of(path, **options):
    """The one-line error message of opening `path`; it names the file."""
    with pytest.raises(TerrainError) as caught:
        Heightmap.open(path, **options)
    line = str(caught.value)
    assert "\n" not in line and len(line) < 400
    assert os.fsencode(path).decode("utf-8", "replace") in line
    return line


# --- The map itself ---------------------------------------------------------------------------------------------------


def test_attributes():
    terrain = Heightmap([[1, 2, 3], [4, 5, 6]], spacing_m=(10.0, 20.0), name="two rows")
    assert (terrain.rows, terrain.cols, terrain.voids, terrain.range_m) == (2, 3, 0, (1.0, 6.0))
    assert terrain.extent_m == (20.0, 20.0)
    assert terrain.heights.dtype == np.float32 and terrain.heights.flags.c_contiguous
    assert "two rows" in repr(terrain)


def test_what_a_mask_hides_is_void():
    heights = np.ma.masked_less(np.arange(12).reshape(3, 4), 2)
    heightmap = Heightmap(heights)
    assert heightmap.voids == 2 and np.isnan(heightmap.heights[0, :2]).all() and heightmap.range_m == (2.0, 11.0)


def test_infinite_heights_are_voids_and_the_callers_array_stays_as_it_was():
    heights = np.array([[np.inf, 1], [-np.inf, np.nan]], np.float32)
    terrain = Heightmap(heights)
    assert terrain.voids == 3 and terrain.range_m == (1.0, 1.0)
    assert np.isnan(terrain.heights).sum() == 3 and np.isinf(heights).sum() == 2


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (0, 5), (4,), (2, 2, 2)])
def test_wrong_shapes(shape):
    with pytest.raises(TerrainError):
        Heightmap(np.zeros(shape))


def test_what_a_mask_hides_is_void_where_it_is_written():
    heightmap = Heightmap(np.zeros((3, 4)))
    heightmap.write(1, 0, np.ma.masked_less(np.arange(6).reshape(2, 3), 2))
    assert np.array_equal(heightmap.heights[:2], [[0, np.nan, np.nan, 2], [0, 3, 4, 5]], equal_nan=True)
    heightmap.write(3, 2, np.ma.masked)
    assert heightmap.voids == 3 and np.isnan(heightmap.heights[2, 3])


NO_HEIGHTS = [[["a", "b"], ["c", "d"]], np.zeros((2, 2), complex), np.ma.zeros((2, 2), complex), None, [[1, 2], [3]]]


@pytest.mark.parametrize("heights", NO_HEIGHTS)
def test_heights_that_are_none(heights):
    heightmap = Heightmap(np.zeros((2, 2)))
    for give in (Heightmap, lambda none: heightmap.write(0, 0, none)):
        with pytest.raises(UsageError, match="array: expected real heights, got .+"):
            give(heights)


def test_a_map_of_voids_alone_is_none():
    with pytest.raises(TerrainError, match="every post is void"):
        Heightmap(np.full((2, 2), np.nan))


@pytest.mark.parametrize("spacing_m", [0, -1, np.nan, np.inf, (1, 0), (1, 2, 3), "wide", None])
def test_bad_spacing(spacing_m):
    with pytest.raises(UsageError, match="spacing"):
        Heightmap(np.zeros((2, 2)), spacing_m)


def test_an_unnamed_nodata_value_is_told_from_heights():
    with pytest.raises(TerrainError, match=r"-3\.40282347e\+38.*--nodata"):
        Heightmap(np.array([[0, 1], [2, -3.4028235e38]], np.float32))


# --- Formats ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tile", [0, 16])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32", "float64"])
def test_tiff(tmp_path, geo, dtype, tile):
    truth = posts(dtype)
    made = write_image(tmp_path / "map.tif", truth, tile, compression="zip")
    if dtype == "float64" and tile and not geo:  # OpenImageIO returns whatever its buffer held
        assert "pip install 'terrain-gl[geo]'" in error_of(made)
        return
    terrain = Heightmap.open(made)
    np.testing.assert_array_equal(terrain.heights, truth.astype(np.float32))
    assert terrain.spacing_m == (1.0, 1.0)


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize("tail", ["png", "PNG", "tif"])
def test_png_whatever_its_name(tmp_path, dtype, tail):
    made = write_image(tmp_path / "map.png", posts(dtype))
    terrain = Heightmap.open(made.rename(tmp_path / f"again.{tail}"))
    np.testing.assert_array_equal(terrain.heights, posts(dtype))


@pytest.mark.parametrize("tile", [0, 16])
def test_exr(tmp_path, tile):
    truth = posts("float32") - 4000
    np.testing.assert_array_equal(Heightmap.open(write_image(tmp_path / "map.exr", truth, tile)).heights, truth)


def test_hdr_has_three_equal_colours(tmp_path):
    truth = np.round(posts("float32", (8, 16)) / 40)  # eight bits of mantissa hold whole numbers up to 255
    made = write_image(tmp_path / "map.hdr", np.repeat(truth[..., None], 3, axis=2))
    np.testing.assert_array_equal(Heightmap.open(made).heights, truth)


@settings(max_examples=60, deadline=None)
@given(
    truth=hnp.arrays(
        st.sampled_from(["<i2", ">i2", "u1", "<u4", "<i8", ">f4", "<f8", "<f2"]),
        hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=9),
        elements={
            "allow_nan": False,
            "allow_infinity": False,
            "allow_subnormal": False,
            "min_value": 0,
            "max_value": 100,
        },
    ),
    fortran=st.booleans(),
)
def test_npy_round_trip(tmp_path_factory, truth, fortran):
    path = tmp_path_factory.mktemp("npy") / "map.npy"
    np.save(path, np.asfortranarray(truth) if fortran else truth)
    np.testing.assert_array_equal(Heightmap.open(path).heights, truth.astype(np.float32))


def test_npy_in_many_blocks(tmp_path):
    truth = np.add.outer(np.arange(1100.0), np.arange(2100.0) * 3)
    np.save(tmp_path / "c.npy", truth)
    np.save(tmp_path / "f.npy", np.asfortranarray(truth))
    for name in ("c.npy", "f.npy"):
        np.testing.assert_array_equal(Heightmap.open(tmp_path / name).heights, truth.astype(np.float32))


def test_hgt(tmp_path):
    truth = posts("int16", (61, 61)).astype(">i2")
    truth[3, 5] = -32768
    truth.tofile(tmp_path / "S33E018.hgt")
    terrain = Heightmap.open(tmp_path / "S33E018.hgt")
    assert terrain.voids == 1 and np.isnan(terrain.heights[3, 5])
    assert terrain.heights[60, 1] == truth[60, 1]
    assert terrain.spacing_m == pytest.approx(np.array(metres_per_degree(-32.5)) / 60)
    assert Heightmap.open(tmp_path / "S33E018.hgt", spacing_m=30).spacing_m == (30.0, 30.0)


@pytest.mark.parametrize("driver, name", [("AAIGrid", "map.asc"), ("SAGA", "map.sdat")])
def test_other_formats_through_gdal(tmp_path, rasterio, driver, name):
    truth = posts("float32")
    terrain = Heightmap.open(write_raster(tmp_path / name, truth, spaced(5, 0, 0), None, driver, nodata=-9999))
    np.testing.assert_allclose(terrain.heights, truth, rtol=1e-6)
    assert terrain.spacing_m == (5.0, 5.0)


@pytest.mark.parametrize("compress", ["ZSTD", "LERC"])
def test_tiff_that_only_gdal_decodes(tmp_path, geo, compress, monkeypatch):
    if not geo:
        monkeypatch.undo()
    made = write_raster(tmp_path / "map.tif", posts("float32"), spaced(2, 0, 0), None, compress=compress)
    if geo:
        np.testing.assert_array_equal(Heightmap.open(made).heights, posts("float32"))
    else:
        monkeypatch.setitem(sys.modules, "rasterio", None)
        assert "pip install 'terrain-gl[geo]'" in error_of(made)


def test_unknown_format_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    (tmp_path / "map.asc").write_text("ncols 2\nnrows 2\n1 2\n3 4\n")
    assert "pip install 'terrain-gl[geo]'" in error_of(tmp_path / "map.asc")


# --- Values to metres -------------------------------------------------------------------------------------------------


def test_scale_and_offset_keep_centimetres_at_8848_m(tmp_path):
    centimetres = posts("uint16") % 100
    made = write_image(tmp_path / "summit.png", centimetres)
    terrain = Heightmap.open(made, z_scale=0.01, z_offset_m=8848.0)
    truth = 8848 + centimetres / 100.0
    np.testing.assert_array_equal(terrain.heights, truth.astype(np.float32))
    assert np.abs(terrain.heights - truth).max() < 0.0005


@settings(max_examples=40, deadline=None)
@given(colours=hnp.arrays("u1", (3, 4, 3)))
def test_encodings(tmp_path_factory, colours):
    path = write_image(tmp_path_factory.mktemp("rgb") / "tile.png", colours)
    red, green, blue = np.moveaxis(colours.astype(float), 2, 0)
    terrarium = Heightmap.open(path, encoding="terrarium", nodata=math.nan).heights  # no height is a mark of voids
    np.testing.assert_array_equal(terrarium, (red * 256 + green + blue / 256 - 32768).astype(np.float32))
    mapbox = Heightmap.open(path, encoding="mapbox", spacing_m=4, nodata=math.nan).heights
    np.testing.assert_allclose(mapbox, -10000 + (red * 65536 + green * 256 + blue) * 0.1, rtol=1e-7)


def test_encoding_of_a_grey_file(tmp_path):
    assert "8-bit RGB" in error_of(write_image(tmp_path / "grey.png", posts()), encoding="mapbox")


@pytest.mark.parametrize("tail", ["png", "tif"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_rgb_given_as_plain(tmp_path, geo, tail, dtype):
    words = error_of(write_image(tmp_path / f"rgb.{tail}", posts(dtype, (8, 8, 3))))
    assert "--band" in words and ("--encoding" in words) == (dtype == "uint8")


def test_transparent_posts_are_voids_and_opacity_scales_nothing(tmp_path):
    pixels = np.dstack([posts(), np.full((ROWS, COLS), 40000, np.uint16)])
    pixels[2, 3, 1] = 0
    made = write_image(tmp_path / "map.png", pixels, oiio__UnassociatedAlpha=1)
    terrain = Heightmap.open(made)
    assert terrain.voids == 1 and np.isnan(terrain.heights[2, 3])
    np.testing.assert_array_equal(terrain.heights[5:], pixels[5:, :, 0])


def test_a_stack_of_layers_is_refused_before_it_is_read(tmp_path):
    made = np.lib.format.open_memmap(tmp_path / "stack.npy", "w+", "f4", (4096, 4096, 4000))  # 256 GB, sparse
    del made
    assert "(4096, 4096, 4000)" in error_of(tmp_path / "stack.npy")


@pytest.mark.parametrize("kind", ["P2", "P5"])
def test_portable_grey_maps(tmp_path, geo, kind):
    truth = posts()
    rows = truth.astype(">u2").tobytes() if kind == "P5" else "\n".join(map(str, truth.ravel())).encode()
    (tmp_path / "map.pgm").write_bytes(f"{kind}\n{COLS} {ROWS}\n65535\n".encode() + rows)
    np.testing.assert_array_equal(Heightmap.open(tmp_path / "map.pgm").heights, truth)


def test_many_bands(tmp_path, geo):
    error_of(write_image(tmp_path / "map.tif", posts("uint8", (4, 4, 6))))


@pytest.mark.parametrize(
    "options", [{"z_scale": 0}, {"z_scale": np.nan}, {"z_offset_m": np.inf}, {"encoding": "jpeg"}, {"spacing_m": 0}]
)
def test_wrong_options(tmp_path, options):
    np.save(tmp_path / "map.npy", posts())
    with pytest.raises(UsageError):
        Heightmap.open(tmp_path / "map.npy", **options)


# --- Voids and tags ---------------------------------------------------------------------------------------------------


def test_int16_minimum_is_void_without_a_tag(tmp_path, geo):
    heights = posts("int16")
    heights[4, 4], heights[5, 5] = -32768, -9999
    made = write_image(tmp_path / "map.tif", heights)
    assert Heightmap.open(made).voids == 2  # a usual mark, too
    assert Heightmap.open(made, nodata=-9999).voids == 2


def test_nodata_is_compared_before_scaling(tmp_path):
    heights = posts()
    heights[:2] = 65535
    made = write_image(tmp_path / "map.png", heights)
    terrain = Heightmap.open(made, nodata=65535, z_scale=0.1, z_offset_m=-100)
    assert terrain.voids == 2 * COLS and terrain.range_m[1] < 800


def test_tag_of_nodata(tmp_path, rasterio):
    heights = posts("float32")
    heights[0, 0], heights[1, 1], heights[2, 2] = -3.4028235e38, np.nan, np.inf
    made = write_raster(tmp_path / "map.tif", heights, (2, 0, 0, 0, -2, 0), None, nodata=-3.4028234663852886e38)
    assert Heightmap.open(made).voids == 3
    heights = posts("int16")
    heights[0, 0], heights[1, 1] = -32768, -9999
    made = write_raster(tmp_path / "int.tif", heights, (2, 0, 0, 0, -2, 0), None, nodata=-9999)
    terrain = Heightmap.open(made)
    assert np.isnan(terrain.heights[1, 1]) and np.isnan(terrain.heights[0, 0]) and terrain.range_m[0] > -9999


def test_spacing_of_a_geographic_map(tmp_path, rasterio):
    step = 1 / 1200
    grid = (step, 0, 10.0, 0, -step, 46.0 + step * ROWS / 2)
    made = write_raster(tmp_path / "map.tif", posts(), grid, "EPSG:4326")
    assert Heightmap.open(made).spacing_m == pytest.approx(np.array(metres_per_degree(46.0)) / 1200)
    assert Heightmap.open(made, spacing_m=(3, 4)).spacing_m == (3.0, 4.0)


def test_spacing_of_a_map_of_the_moon(tmp_path, rasterio):
    moon = 'GEOGCS["Moon",DATUM["Moon",SPHEROID["Moon",1737400,0]],PRIMEM["0",0],UNIT["degree",0.0174532925199433]]'
    made = write_raster(tmp_path / "map.tif", posts("int16"), (0.1, 0, 0, 0, -0.1, 0.05 * ROWS), moon)
    assert Heightmap.open(made).spacing_m == pytest.approx([np.radians(0.1) * 1737400] * 2)


def test_spacing_of_a_projected_map_in_feet(tmp_path, rasterio):
    made = write_raster(tmp_path / "map.tif", posts(), (10, 0, 6.5e6, 0, -20, 2e6), "EPSG:2225")
    assert Heightmap.open(made).spacing_m == pytest.approx((10 * 1200 / 3937, 20 * 1200 / 3937))


CRS_WITHOUT_UNITS_ON_A_MAP = {
    "local": 'LOCAL_CS["site",UNIT["metre",1]]',
    "engineering": 'ENGCRS["mine",EDATUM["mine"],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]]',
    "geocentric": "EPSG:4978",
    "vertical": "EPSG:5773",
}


@pytest.mark.parametrize("kind", CRS_WITHOUT_UNITS_ON_A_MAP)
@pytest.mark.parametrize("spacing_m", [None, 5])
def test_a_crs_that_is_of_no_use_is_noted(tmp_path, rasterio, kind, spacing_m):
    """Photogrammetry programs write such files."""
    crs = CRS_WITHOUT_UNITS_ON_A_MAP[kind]
    made = write_raster(tmp_path / "map.tif", posts(), (2, 0, 100, 0, -3, 100), crs)
    terrain = Heightmap.open(made, spacing_m=spacing_m)
    np.testing.assert_array_equal(terrain.heights, posts())
    assert terrain.spacing_m == ((5, 5) if spacing_m else (2, 3))
    assert len(terrain.notes) == (0 if spacing_m else 1) and all("--spacing" in note for note in terrain.notes)


@pytest.mark.parametrize("grid", [(-1, 0, 9, 0, -1, 0), (1, 0.5, 0, 0.5, -1, 0)])
def test_maps_that_are_not_north_up(tmp_path, rasterio, grid):
    assert "gdalwarp" in error_of(write_raster(tmp_path / "map.tif", posts(), grid, "EPSG:32610"))


def test_metres_per_degree_against_the_published_table():
    # Snyder 1987 lists, on the ellipsoid, 111.32 and 110.57 km at the equator; 78.85 and 111.13 km at 45 degrees.
    assert np.round(metres_per_degree(0.0), -1) == pytest.approx([111320, 110570])
    assert np.round(metres_per_degree(45.0), -1) == pytest.approx([78850, 111130])


# --- Bad files --------------------------------------------------------------------------------------------------------


def valid_files(folder):
    """One good file of each kind, as bytes, by suffix."""
    np.save(folder / "a.npy", posts())
    posts("int16", (40, 40)).astype(">i2").tofile(folder / "a.hgt")
    write_image(folder / "a.png", posts())
    write_image(folder / "a.tif", posts(), compression="zip")
    write_image(folder / "a.exr", posts("float32"))
    write_image(folder / "a.hdr", np.repeat(posts("float32")[..., None], 3, axis=2))
    return {path.suffix: path.read_bytes() for path in folder.iterdir()}


def test_missing_empty_directory_text_random(tmp_path, geo):
    assert "No such file" in error_of(tmp_path / "missing.tif")
    assert "directory" in error_of(tmp_path)
    noise = np.random.default_rng(1).bytes(4099)
    for suffix in (".tif", ".png", ".exr", ".hdr", ".npy", ".hgt", ".xyz", ""):
        path = tmp_path / f"bad{suffix}"
        path.write_bytes(b"")
        assert "empty" in error_of(path)
        for content in (b"this is a text\n", noise, b"\0" * 5001):
            path.write_bytes(content)
            error_of(path)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.95])
def test_truncated(tmp_path, geo, share, capfd):
    for suffix, content in valid_files(tmp_path).items():
        path = tmp_path / f"cut{suffix}"
        path.write_bytes(content[: max(13, int(len(content) * share) | 1)])
        error_of(path)
    assert capfd.readouterr().err == ""


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_flipped_bytes_end_in_heights_or_in_one_line(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("flip")
    suffix, content = data.draw(st.sampled_from(sorted(valid_files(folder).items())))
    damaged = bytearray(content)
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(4, min(600, len(damaged) - 1)))] = data.draw(st.integers(0, 255))
    path = folder / f"flipped{suffix}"
    path.write_bytes(damaged)
    try:
        assert np.isfinite(Heightmap.open(path).range_m).all()
    except TerrainError as error:
        assert "\n" not in str(error) and str(path) in str(error)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_void_everywhere(tmp_path, geo, value):
    heights = np.full((6, 6), value, np.float32)
    np.save(tmp_path / "void.npy", heights)
    for path in (write_image(tmp_path / "void.tif", heights), write_image(tmp_path / "void.exr", heights)):
        assert "void" in error_of(path)
    assert "void" in error_of(tmp_path / "void.npy")


def test_one_post(tmp_path, geo):
    assert "2 x 2" in error_of(write_image(tmp_path / "one.png", posts(shape=(1, 1))))
    assert "2 x 2" in error_of(write_image(tmp_path / "one.tif", posts(shape=(1, 1))))
    (tmp_path / "one.hgt").write_bytes(b"\0\0")
    assert "2 x 2" in error_of(tmp_path / "one.hgt")


def test_absurd_header_sizes(tmp_path, geo):
    files = valid_files(tmp_path)
    png = bytearray(files[".png"])
    png[16:24] = b"\x7f\xff\xff\xff" * 2
    tif = bytearray(files[".tif"])
    for tag in (b"\0\1", b"\1\1"):  # ImageWidth, ImageLength: 16-bit values become 32-bit ones
        at = tif.index(tag + b"\3\0\1\0\0\0")
        tif[at + 2], tif[at + 8 : at + 12] = 4, (2_000_000_000).to_bytes(4, "little")
    npy = files[".npy"].replace(b"(37, 53)", b"(99, 9999999)")
    for name, content in {"a.png": png, "a.tif": tif, "a.npy": npy}.items():
        (tmp_path / name).write_bytes(content)
        error_of(tmp_path / name)


def test_more_posts_than_fit(tmp_path):
    path = tmp_path / "huge.npy"
    np.lib.format.open_memmap(path, "w+", "u1", (16384, 16385))  # sparse: no disk blocks behind it
    assert "16384" in error_of(path)
    np.lib.format.open_memmap(path, "w+", "u1", (64, 20000))
    assert "20000 x 64 posts, more than 16385 a side" in error_of(path)


def test_npy_of_other_things(tmp_path):
    for number, array in enumerate([np.array([[{}]]), np.zeros((3, 3), complex), np.zeros(9), np.zeros((0, 4)), 3.0]):
        np.save(tmp_path / f"{number}.npy", array)
        error_of(tmp_path / f"{number}.npy")


def test_unreadable(tmp_path):
    np.save(tmp_path / "secret.npy", posts())
    (tmp_path / "secret.npy").chmod(0)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)  # nobody: root may read everything
    try:
        assert "Permission denied" in error_of(tmp_path / "secret.npy")
    finally:
        if root:
            os.seteuid(0)


def test_named_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    assert "pipe" in error_of(tmp_path / "pipe.png")


def test_name_that_is_not_utf8(tmp_path, geo):
    for suffix in (".png", ".tif"):
        name = os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9" + suffix.encode())
        write_image(tmp_path / f"cafe{suffix}", posts()).rename(name)
        error_of(name).encode()  # can be printed
    np.save(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.npy"), posts())
    Heightmap.open(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.npy")).name.encode()


# --- Memory and real maps ---------------------------------------------------------------------------------------------

PEAK = """
import re, sys
from terrain_gl.heightmap import Heightmap
assert Heightmap.open(sys.argv[1]).rows == 8192
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peak memory is read from /proc")
@pytest.mark.parametrize("kind", ["u16.png", "f32.tif", "tiled.tif", "f64.npy"])
def test_8192_opens_within_three_times_its_heights(tmp_path, kind):
    """Measured by VmHWM, not getrusage: ru_maxrss of a child starts at its parent's value."""
    ramp = np.add.outer(np.arange(8192, dtype=np.uint16), np.arange(8192, dtype=np.uint16))
    path = tmp_path / kind
    if kind == "f64.npy":
        np.save(path, ramp.astype(np.float64))
    else:
        pixels = ramp if kind == "u16.png" else ramp.astype(np.float32)
        write_image(path, pixels, 256 if kind == "tiled.tif" else 0, png__compressionLevel=1, tiff__zipquality=1)
    peak_kb = int(subprocess.run([sys.executable, "-c", PEAK, path], capture_output=True, check=True, text=True).stdout)
    path.unlink()
    assert peak_kb * 1024 <= 3 * 8192 * 8192 * 4


DEM = os.environ.get("TERRAIN_GL_DEM")


@pytest.mark.skipif(not DEM, reason="TERRAIN_GL_DEM does not name the folder of real maps")
@pytest.mark.parametrize(
    "name, options, size, range_m, voids, spacing_m",
    [
        ("N37W123.hgt", {}, (1201, 1201), (-52, 990), 192, (73, 93)),
        ("mt_rainier_90m.tif", {}, (1201, 1201), (263, 4371), 9033, (64, 93)),
        ("greenriver.tif", {}, (2000, 1000), (1297, 1347), 0, (1, 1)),
        ("narok_srtm_z12_4608_f32.tif", {"spacing_m": 19.1}, (4608, 4608), (1227, 3095), 0, (19, 19)),
        ("ps_height_1k.png", {"z_scale": 0.1, "spacing_m": 160}, (1025, 1025), (0, 4380), 0, (160, 160)),
        ("deathvalley_basinrange_4097_u16_off100.png", {"z_offset_m": -100, "spacing_m": (73, 93)},
         (4097, 4097), (-70, 4361), 0, (73, 93)),
    ],
)  # fmt: skip
def test_real_maps(name, options, size, range_m, voids, spacing_m):
    if name.endswith(".tif"):
        pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
    terrain = Heightmap.open(Path(DEM) / name, **options)
    assert (terrain.cols, terrain.rows) == size
    assert terrain.range_m == pytest.approx(range_m, abs=0.6)
    assert terrain.voids == voids
    assert terrain.spacing_m == pytest.approx(spacing_m, abs=0.8)
