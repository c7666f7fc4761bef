"""Bands of a file: which hold heights, and every way to say that a post has none."""

import numpy as np
import OpenImageIO as oiio
import pytest
from rasters import write_raster
from test_kinds import COLS, METRES, ROWS, image, raster, terrarium

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.files.maps import sample
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers import Reading
from terrain_gl.readers.windows import open_windows

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")

VOID = np.zeros((ROWS, COLS), bool)
VOID[4:9, 30:] = True
OPAQUE = np.where(VOID, 0, 255).astype("u1")
WITH_ZEROS = np.where(VOID, 0, METRES)
BYTES = (METRES / 4).astype("u1")  # 25 to 205


def masked(path, inside, values=WITH_ZEROS, **more):
    raster(path, values, **more)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=inside), rasterio.open(path, "r+") as file:
        file.write_mask(OPAQUE)


def masked_south_up(path):
    raster(path, WITH_ZEROS[::-1], grid=(30, 0, 0, 0, 30, 0))
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(path, "r+") as file:
        file.write_mask(OPAQUE[::-1])


def with_alpha(path, values=WITH_ZEROS):
    raster(path, np.stack([values, OPAQUE.astype(values.dtype)]), alpha="yes")


def with_dataset_nodata(path):
    """One value of all bands together: GDAL's metadata NODATA_VALUES."""
    raster(path, np.stack([WITH_ZEROS] * 2))
    with rasterio.open(path, "r+") as file:
        file.update_tags(NODATA_VALUES="0 0")


def palette(path, values=BYTES, colours=None, driver="GTiff", **more):
    """Indices of a palette; by default entry i is the grey i."""
    colours = colours or {i: (i, i, i, 255) for i in range(256)}
    write_raster(path, values, None, None, driver, palette=colours, photometric="palette", **more)


def png_with_headers(path):
    image(path, np.where(VOID, 7, METRES).astype("u2"))
    band = '<PAMRasterBand band="1"><NoDataValue>7</NoDataValue></PAMRasterBand>'
    path.with_name(path.name + ".aux.xml").write_text(f"<PAMDataset>{band}</PAMDataset>")


def png_with_mask(path):
    image(path, WITH_ZEROS.astype("u2"))
    raster(path.with_name("mask.tif"), OPAQUE, grid=None, crs=None)
    (path.parent / "mask.tif").rename(path.with_name(path.name + ".msk"))
    with rasterio.open(path.with_name(path.name + ".msk"), "r+") as file:
        file.update_tags(INTERNAL_MASK_FLAGS_1="2")  # GMF_PER_DATASET, as GDAL writes it


RECTANGLES = "".join(f'<{tag} xOff="0" yOff="0" xSize="{COLS}" ySize="{ROWS}"/>' for tag in ("SrcRect", "DstRect"))
PART = '<SourceFilename relativeToVRT="1">part.tif</SourceFilename>'


def mosaic_of_masked(path, more="", ending=""):
    """A mosaic of one file with a mask; `more` in its source, `ending` after its band."""
    masked(path.parent / "part.tif", True)
    source = f"<ComplexSource>{PART}<SourceBand>1</SourceBand>{RECTANGLES}{more}</ComplexSource>"
    nodata = "<NoDataValue>-1</NoDataValue>" if more else ""
    band = f'<VRTRasterBand dataType="Float32" band="1">{nodata}{source}</VRTRasterBand>'
    path.write_text(f'<VRTDataset rasterXSize="{COLS}" rasterYSize="{ROWS}">{band}{ending}</VRTDataset>')


def mosaic_with_mask(path):
    """As gdalbuildvrt writes it for sources with a mask."""
    source = f"<SimpleSource>{PART}<SourceBand>mask,1</SourceBand>{RECTANGLES}</SimpleSource>"
    mosaic_of_masked(path, "", f'<MaskBand><VRTRasterBand dataType="Byte">{source}</VRTRasterBand></MaskBand>')


NAN = np.where(VOID, np.nan, METRES)
# name: how it is written, options of Heightmap.open
WAYS = {
    "nodata.tif": (lambda p: raster(p, np.where(VOID, -77, METRES), nodata=-77),),
    "nan.tif": (lambda p: raster(p, NAN.astype("f4")),),
    "infinite.tif": (lambda p: raster(p, np.where(VOID, np.inf, METRES).astype("f4")),),
    "mask-inside.tif": (lambda p: masked(p, True),),
    "mask-beside.tif": (lambda p: masked(p, False),),
    "mask-and-nodata.tif": (lambda p: masked(p, True, np.where(VOID & (METRES > 250), -5, WITH_ZEROS), nodata=-5),),
    "south-up-mask.tif": (masked_south_up,),
    "alpha.tif": (with_alpha,),
    "alpha-bytes.tif": (lambda p: with_alpha(p, WITH_ZEROS.astype("u2")),),
    "alpha-chosen.tif": (with_alpha, {"band": 1}),
    "dataset-nodata.tif": (with_dataset_nodata, {"band": 2}),
    "alpha.png": (lambda p: image(p, np.stack([WITH_ZEROS, OPAQUE * 257.0], -1).astype("u2")),),
    "headers.png": (png_with_headers,),
    "mask.png": (png_with_mask,),
    "masked-source.vrt": (lambda p: mosaic_of_masked(p, "<UseMaskBand>true</UseMaskBand>"),),
    "mask-band.vrt": (mosaic_with_mask,),
}


def check(heights, way):
    assert np.array_equal(np.isnan(heights), VOID), way
    np.testing.assert_allclose(heights[~VOID], METRES[~VOID], atol=1e-3)


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_say_that_there_is_no_data(tmp_path, way):
    write, *options = WAYS[way]
    write(tmp_path / way)
    check(Heightmap.open(tmp_path / way, **(options[0] if options else {})).heights, way)


@pytest.mark.parametrize(
    "way", ["mask-inside.tif", "mask-beside.tif", "south-up-mask.tif", "alpha.tif", "mask.png", "mask-band.vrt"]
)
def test_masks_are_read_by_windows_samples_and_datasets_too(tmp_path, way):
    WAYS[way][0](tmp_path / way)
    windows = open_windows([tmp_path / way])
    check(windows.read(slice(0, ROWS), slice(0, COLS)), way)
    assert np.array_equal(np.isnan(windows.read(slice(3, 11), slice(28, 35))), VOID[3:11, 28:35])
    few, _ = sample(tmp_path / way, Reading())
    assert np.array_equal(np.isnan(few.heights), VOID)
    with rasterio.open(tmp_path / way) as data:
        check(Heightmap.of(data).heights, way)


# --- Grey that is stored as colour ------------------------------------------------------------------------------------


def equal_bands(path, values, alpha=False):
    image(path, np.stack([values] * 3 + [np.full_like(values, np.iinfo(values.dtype).max)] * alpha, -1))


GREYS = {
    "bytes.png": lambda p: equal_bands(p, BYTES),
    "words.png": lambda p: equal_bands(p, BYTES.astype("u2") * 256),
    "opaque.png": lambda p: equal_bands(p, BYTES, alpha=True),
    "bytes.tif": lambda p: raster(p, np.stack([BYTES] * 3)),
    "words.tif": lambda p: raster(p, np.stack([BYTES.astype("i2")] * 4)),
    "stacked.npy": lambda p: np.save(p, np.stack([BYTES] * 3, -1)),
    "palette.tif": palette,
    "palette.bmp": lambda p: palette(p, driver="BMP"),
    "palette.png": lambda p: palette(p, driver="PNG"),
    "reversed.tif": lambda p: palette(p, 255 - BYTES, {i: (255 - i,) * 3 + (255,) for i in range(256)}),
}


@pytest.mark.parametrize("name", GREYS)
def test_equal_channels_and_grey_palettes_are_one_channel(tmp_path, name):
    GREYS[name](tmp_path / name)
    terrain = Heightmap.open(tmp_path / name, z_scale=1)
    unit = 256 if name == "words.png" else 1
    np.testing.assert_array_equal(terrain.heights, BYTES.astype("f4") * unit)
    windows = open_windows([tmp_path / name], Reading(z_scale=1.0))
    np.testing.assert_array_equal(windows.read(slice(2, 9), slice(3, 20)), terrain.heights[2:9, 3:20])


def test_grey_of_lossy_compression_is_grey(tmp_path):
    """Compressed colours differ by a level or two; colours of a map differ by more."""
    noise = np.random.default_rng(0).integers(0, 3, (ROWS, COLS, 3))
    noise[..., 0] = 1
    image(tmp_path / "a.png", (BYTES[..., None] + noise - 1).astype("u1"))
    np.testing.assert_array_equal(Heightmap.open(tmp_path / "a.png", z_scale=1).heights, BYTES)


def test_a_transparent_entry_of_a_palette_is_a_void(tmp_path):
    colours = {i: (i, i, i, 255) for i in range(256)} | {3: (200, 10, 10, 0)}
    palette(tmp_path / "a.png", np.where(VOID, 3, BYTES).astype("u1"), colours, driver="PNG")
    palette(tmp_path / "b.tif", np.where(VOID, 3, BYTES).astype("u1"), nodata=3)
    for name in ("a.png", "b.tif"):
        assert np.array_equal(np.isnan(Heightmap.open(tmp_path / name).heights), VOID)


def test_colours_are_refused_with_what_may_be_meant(tmp_path):
    image(tmp_path / "a.png", np.stack([BYTES, BYTES, BYTES // 2], -1))
    with pytest.raises(TerrainError, match=r"3 bands \(1: R, 2: G, 3: B\): .*terrarium, mapbox or gsi.*--band 1"):
        Heightmap.open(tmp_path / "a.png")
    assert Heightmap.open(tmp_path / "a.png", band="B").range_m[1] == BYTES.max() // 2
    palette(tmp_path / "b.tif", colours={i: (i, 0, 0, 255) for i in range(256)})
    with pytest.raises(TerrainError, match="holds palette indices"):
        Heightmap.open(tmp_path / "b.tif")


# --- Several layers ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_layers_are_listed_and_one_is_asked_for(tmp_path, count):
    raster(tmp_path / "a.tif", np.stack([METRES + 5 * i for i in range(count)]))
    with pytest.raises(
        TerrainError, match=rf"a\.tif: has {count} bands: say which holds the heights, as with --band 1"
    ):
        Heightmap.open(tmp_path / "a.tif")
    with rasterio.open(tmp_path / "a.tif", "r+") as file:
        file.descriptions = [f"year {2020 + i}" for i in range(count)]
    with pytest.raises(TerrainError, match=rf"has {count} bands \(1: year 2020, 2: year 2021.*--band 1") as error:
        Heightmap.open(tmp_path / "a.tif")
    assert "colour" not in str(error.value) and "encoding" not in str(error.value)
    for band in (2, "2", "year 2021"):
        terrain = Heightmap.open(tmp_path / "a.tif", band=band)
        np.testing.assert_allclose(terrain.heights, METRES + 5)
        np.testing.assert_allclose(
            terrain.heights[:3],
            open_windows([tmp_path / "a.tif"], Reading(band=band)).read(slice(0, 3), slice(0, COLS)),
        )
    for band in (7, "year 1066", "-1"):
        with pytest.raises(TerrainError, match=f"there is no band {band}"):
            Heightmap.open(tmp_path / "a.tif", band=band)


def test_layers_of_a_picture_have_the_names_of_its_channels(tmp_path):
    spec = oiio.ImageSpec(COLS, ROWS, 2, "float")
    spec.channelnames = ("height", "slope")
    out = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_image(np.stack([METRES, METRES * 0], -1))
    out.close()
    with pytest.raises(TerrainError, match=r"has 2 bands \(1: height, 2: slope\)"):
        Heightmap.open(tmp_path / "a.exr")
    np.testing.assert_array_equal(Heightmap.open(tmp_path / "a.exr", band="height").heights, METRES)


@pytest.fixture
def layered(tmp_path):
    """A netCDF file with two variables, in the classic format; `one`: with one of them."""
    netcdf = pytest.importorskip("scipy.io", reason="scipy is not installed")

    def write(path, **layers):
        with netcdf.netcdf_file(path, "w") as file:
            for name, n in (("y", ROWS), ("x", COLS)):
                file.createDimension(name, n)
                file.createVariable(name, "f8", (name,))[:] = 30.0 * np.arange(n)
            for name, values in layers.items():
                file.createVariable(name, "f4", ("y", "x"))[:] = values
        return path

    return write


def test_layers_of_a_file_are_listed_and_opened_by_name(tmp_path, layered):
    path = layered(tmp_path / "two.nc", height=METRES, age=METRES * 0)
    with pytest.raises(TerrainError, match="holds the layers height, age: .*--band height"):
        Heightmap.open(path)
    terrain = Heightmap.open(path, band="height")
    np.testing.assert_array_equal(terrain.heights, METRES[::-1])
    windows = open_windows([path], Reading(band="height"))
    np.testing.assert_array_equal(windows.read(slice(0, 5), slice(0, 7)), METRES[::-1][:5, :7])


def test_coordinates_need_no_attributes(tmp_path, layered):
    """xarray writes x and y without attributes, if it has none."""
    assert Heightmap.open(layered(tmp_path / "a.nc", z=METRES)).spacing_m == (30, 30)


def test_bounds_of_cells_are_no_layers(tmp_path):
    netcdf = pytest.importorskip("scipy.io", reason="scipy is not installed")
    with netcdf.netcdf_file(tmp_path / "a.nc", "w") as file:
        for name, n in (("y", ROWS), ("x", COLS), ("side", 2)):
            file.createDimension(name, n)
        file.createVariable("y_bnds", "f8", ("y", "side"))[:] = 0
        file.createVariable("height", "f4", ("y", "x"))[:] = METRES
    assert Heightmap.open(tmp_path / "a.nc").range_m == (100, 820)


def test_an_only_layer_needs_no_name(tmp_path, layered):
    path = layered(tmp_path / "one.nc", height=METRES)
    for options in ({}, {"band": "height"}, {"band": 1}):
        np.testing.assert_array_equal(Heightmap.open(path, **options).heights, METRES[::-1])


# --- Kinds of pictures ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["webp", "gif", "sgi", "tga", "bmp", "jp2"])
def test_pictures_that_name_no_other_file_need_no_trust(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    drivers = {"bmp": ("BMP", {}), "gif": ("GIF", {}), "jp2": ("JP2OpenJPEG", {"QUALITY": "100", "REVERSIBLE": "YES"})}
    if ending in drivers:
        driver, options = drivers[ending]
        raster(path, BYTES, driver, None, None, **options)
    else:
        image(path, np.stack([BYTES] * 3, -1), **({"compression": "lossless:100"} if ending == "webp" else {}))
    np.testing.assert_array_equal(Heightmap.open(path).heights, BYTES)


def test_packed_heights_in_webp(tmp_path):
    image(tmp_path / "a.webp", terrarium(), compression="lossless:100")
    heights = Heightmap.open(tmp_path / "a.webp", encoding="terrarium").heights
    np.testing.assert_allclose(heights, METRES, atol=1 / 256)
