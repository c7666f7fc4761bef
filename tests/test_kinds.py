"""Common kinds of map files: each opens by its name alone, with its size and range in metres."""

import gzip
import zipfile

import numpy as np
import OpenImageIO as oiio
import pytest
from rasters import write_raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.files.generate import Land, write_land
from terrain_gl.files.writers import write_heightmap
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.georeference import metres_per_degree

ROWS, COLS = 31, 41
METRES = np.add.outer(np.arange(ROWS) * 20.0, np.arange(COLS) * 3.0).astype("f4") + 100  # 100 to 820, no symmetry
RANGE = (100.0, 820.0)
FOOT, US_FOOT = 0.3048, 1200 / 3937
AT_46 = metres_per_degree(46.0)
SECOND = 1 / 3600


@pytest.fixture
def rasterio():
    return pytest.importorskip("rasterio", reason="the [geo] extra is not installed")


def image(path, pixels, **attributes):
    """Write a picture of one or three channels."""
    pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None])
    kind = {"float32": "float"}.get(pixels.dtype.name, pixels.dtype.name)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(pixels)
    out.close()


def raster(path, values=METRES, driver="GTiff", grid=(30, 0, 5e5, 0, -30, 5.1e6), crs="EPSG:32632", **more):
    """Write a raster of the land."""
    write_raster(path, values, grid, crs, driver, **more)


def geographic(step=SECOND):
    """A grid of degrees whose middle row is at 46° north."""
    return (step, 0, 9.0, 0, -step, 46 + step * ROWS / 2)


def mercator():
    """The same for Web Mercator, where distances are 1 / cos 46° times as long as on the ground."""
    y = 6378137 * np.arctanh(np.sin(np.radians(46)))
    return (10, 0, 1e6, 0, -10, y + 5 * ROWS)


def terrarium():
    """Heights as 256 R + G + B / 256 − 32768."""
    value = (METRES + 32768).astype("f8")
    return np.stack([value // 256, value % 256, value * 256 % 256], -1).astype("u1")


def zipped(path):
    raster(path.parent / "inner.tif")
    (path.parent / "readme.txt").write_text("made of stone")
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("inner.tif", "readme.txt"):
            archive.write(path.parent / name, f"folder/{name}")


def gzipped(path, content):
    path.write_bytes(gzip.compress(content))


def with_world_file(path):
    image(path, METRES.astype("u2"))
    path.with_suffix(".pgw").write_text("25\n0\n0\n-40\n500012.5\n5099980\n")


def mosaic(path):
    raster(path.parent / "west.tif", METRES[:, :21])
    raster(path.parent / "east.tif", METRES[:, 21:])
    sources = "".join(
        f'<SimpleSource><SourceFilename relativeToVRT="1">{name}</SourceFilename><SourceBand>1</SourceBand>'
        f'<SrcRect xOff="0" yOff="0" xSize="{w}" ySize="{ROWS}"/>'
        f'<DstRect xOff="{x}" yOff="0" xSize="{w}" ySize="{ROWS}"/>'
        "</SimpleSource>"
        for name, x, w in (("west.tif", 0, 21), ("east.tif", 21, 20))
    )
    path.write_text(
        f'<VRTDataset rasterXSize="{COLS}" rasterYSize="{ROWS}"><SRS>EPSG:32632</SRS><GeoTransform>0,30,0,0,0,-30'
        f'</GeoTransform><VRTRasterBand dataType="Float32" band="1"><UnitType>m</UnitType>{sources}</VRTRasterBand>'
        "</VRTDataset>"
    )


def tagged_beside(path):
    """Nothing in the file: place, scale and unit stand in a header beside it."""
    raster(path, STEPS, grid=None, crs=None)
    transform = "5e5, 30, 0, 5.1e6, 0, -30"
    band = '<PAMRasterBand band="1"><UnitType>ft</UnitType><Offset>328.0839895</Offset><Scale>0.3280839895</Scale>'
    about = f"<SRS>EPSG:32632</SRS><GeoTransform>{transform}</GeoTransform>{band}</PAMRasterBand>"
    path.with_name(path.name + ".aux.xml").write_text(f"<PAMDataset>{about}</PAMDataset>")


def with_projection(path):
    path.write_text(DEGREES_ASC)
    from rasterio.crs import CRS

    path.with_suffix(".prj").write_text(CRS.from_epsg(4326).to_wkt(version="WKT1_ESRI"))


def netcdf(path):
    """The classic format."""
    copied(path, "netCDF", FORMAT="NC")


def copied(path, driver, **options):
    import rasterio.shutil

    raster(path.parent / "source.tif")
    rasterio.shutil.copy(path.parent / "source.tif", path, driver=driver, **options)


ASC = f"ncols {COLS}\nnrows {ROWS}\nxllcorner 0\nyllcorner 0\ncellsize 12.5\n" + "\n".join(
    " ".join(f"{value:g}" for value in row) for row in METRES
)
DEGREES_ASC = ASC.replace("cellsize 12.5", f"cellsize {SECOND:.12f}").replace("corner 0", "corner 46", 2)
MOON = "+proj=eqc +R=1737400 +units=m"
HGT = np.full((61, 61), 500, ">i2")
U2, STEPS = METRES.astype("u2"), ((METRES - 100) / 0.1).astype("u2")

# name: how it is written, metres between posts, heights in metres, options of Heightmap.open
KINDS = {
    "projected.tif": (lambda p: raster(p), 30, RANGE),
    "geographic.tif": (lambda p: raster(p, grid=geographic(), crs="EPSG:4326"), np.multiply(AT_46, SECOND), RANGE),
    "south-up.tif": (lambda p: raster(p, METRES[::-1], grid=(30, 0, 0, 0, 30, 0)), 30, RANGE),
    "scaled.tif": (lambda p: raster(p, STEPS, scale=0.1, offset=100), 30, RANGE),
    "feet.tif": (lambda p: raster(p, METRES / FOOT, unit="ft"), 30, RANGE),
    "us-feet.tif": (lambda p: raster(p, METRES / US_FOOT, crs="EPSG:2225", unit="US survey foot"), 30 * US_FOOT, RANGE),
    "compound-feet.tif": (lambda p: raster(p, METRES / FOOT, crs="EPSG:32632+8050"), 30, RANGE),
    "mercator.tif": (lambda p: raster(p, grid=mercator(), crs="EPSG:3857"), 10 * np.cos(np.radians(46)), RANGE),
    "degrees-without-crs.tif": (lambda p: raster(p, grid=geographic(), crs=None), np.multiply(AT_46, SECOND), RANGE),
    "metres-without-crs.tif": (lambda p: raster(p, crs=None), 30, RANGE),
    "untagged.tif": (lambda p: raster(p, grid=None, crs=None), 1, RANGE),
    "cog.tif": (lambda p: raster(p, driver="COG"), 30, RANGE),
    "tiled.tif": (lambda p: raster(p, tiled=True, blockxsize=16, blockysize=16, compress="deflate"), 30, RANGE),
    "int16.tif": (lambda p: raster(p, METRES.astype("i2"), nodata=-9999), 30, RANGE),
    "erdas.img": (lambda p: raster(p, driver="HFA"), 30, RANGE),
    "esri.bil": (lambda p: raster(p, driver="EHdr"), 30, RANGE),
    "mosaic.vrt": (mosaic, 30, RANGE),
    "plain.asc": (lambda p: p.write_text(ASC), 12.5, RANGE),
    "degrees.asc": (lambda p: p.write_text(DEGREES_ASC), np.multiply(metres_per_degree(46 + SECOND * ROWS / 2), SECOND),
                    RANGE),
    "projection.asc": (with_projection, np.multiply(metres_per_degree(46 + SECOND * ROWS / 2), SECOND), RANGE),
    "beside.tif": (tagged_beside, 30, RANGE),
    "grid.nc": (netcdf, 30, RANGE),
    "grid.flt": (lambda p: raster(p, driver="EHdr"), 30, RANGE),
    "envi.dat": (lambda p: raster(p, driver="ENVI"), 30, RANGE),
    "saga.sdat": (lambda p: raster(p, driver="SAGA"), 30, RANGE),
    "moon.tif": (lambda p: raster(p, grid=(30, 0, 0, 0, -30, 465), crs=MOON), 30, RANGE),
    "N46E009.hgt": (lambda p: HGT.tofile(p), np.divide(metres_per_degree(46.5), 60), (500, 500)),
    "world-file.png": (with_world_file, (25, 40), RANGE),
    "grey.png": (lambda p: image(p, U2), 1, RANGE),
    "linear.exr": (lambda p: image(p, METRES), 1, RANGE),
    "array.npy": (lambda p: np.save(p, METRES), 1, RANGE),
    "stack.npy": (lambda p: np.save(p, METRES[None]), 1, RANGE),
    "sigma.sigdem": (lambda p: copied(p, "SIGDEM"), 30, RANGE),
    "steps.hf2": (lambda p: copied(p, "HF2"), 30, RANGE),
    "grey.pgm": (lambda p: p.write_bytes(f"P5 {COLS} {ROWS} 65535\n".encode() + U2.astype(">u2").tobytes()), 1, RANGE),
    "square.r16": (lambda p: U2[:31, :31].tofile(p), 1, (100, 790)),
    "engine.raw": (lambda p: U2.tofile(p), 1, RANGE, {"raw": (COLS, ROWS)}),
    "floats.raw": (lambda p: METRES.tofile(p), 1, RANGE, {"raw": (COLS, ROWS)}),
    "terrarium.png": (lambda p: image(p, terrarium()), 1, RANGE, {"encoding": "terrarium"}),
    "second-band.tif": (lambda p: raster(p, np.stack([0 * METRES] * 5 + [METRES])), 30, RANGE, {"band": 6}),
    "zipped.zip": (zipped, 30, RANGE),
    "N46E009.hgt.gz": (lambda p: gzipped(p, HGT.tobytes()), np.divide(metres_per_degree(46.5), 60), (500, 500)),
    "array.asc.gz": (lambda p: gzipped(p, ASC.encode()), 12.5, RANGE),
}  # fmt: skip


@pytest.mark.parametrize("name", KINDS)
def test_kind(tmp_path, rasterio, name):
    write, spacing_m, range_m, *options = KINDS[name]
    write(tmp_path / name)
    terrain = Heightmap.open(tmp_path / name, **(options[0] if options else {}))
    assert terrain.spacing_m == pytest.approx(np.broadcast_to(spacing_m, 2), rel=2e-3 if "mercator" in name else 1e-5)
    assert terrain.range_m == pytest.approx(range_m, rel=1e-5)
    if terrain.heights.shape == METRES.shape:
        np.testing.assert_allclose(terrain.heights, METRES, rtol=1e-5)
    notes = {"degrees-without-crs.tif": "taken as degrees", "degrees.asc": "taken as degrees"}
    assert [notes[name] in note for note in terrain.notes] == [True] * (name in notes)


def test_web_mercator_is_true_to_the_ground(tmp_path, rasterio):
    """Against geodesics on the ellipsoid: 10 m of the map at 46° are 6.96 m east and 6.92 m north (Snyder, 7-7 f.)."""
    raster(tmp_path / "a.tif", grid=mercator(), crs="EPSG:3857")
    east, north = Heightmap.open(tmp_path / "a.tif").spacing_m
    radians = 10 / 6378137
    assert east == pytest.approx(np.degrees(radians) * AT_46[0], rel=1e-6)
    assert north == pytest.approx(np.degrees(radians) * np.cos(np.radians(46)) * AT_46[1], rel=1e-6)


@pytest.mark.parametrize("ending", ["png", "tif", "exr"])
@pytest.mark.parametrize("geo", [True, False])
def test_what_is_saved_says_its_own_scale(tmp_path, monkeypatch, ending, geo):
    heights = METRES.copy()
    heights[3:5, 7] = np.nan
    map_ = Heightmap(heights, (12.5, 20.0))
    write_heightmap(tmp_path / f"a.{ending}", map_)
    if not geo:
        monkeypatch.setitem(__import__("sys").modules, "rasterio", None)
    again = Heightmap.open(tmp_path / f"a.{ending}")
    assert again.spacing_m == (12.5, 20.0) and again.voids == 2 and not again.assumes_spacing
    np.testing.assert_allclose(again.heights, heights, atol=0.02)
    told = Heightmap.open(tmp_path / f"a.{ending}", spacing_m=3, z_scale=2, z_offset_m=0)
    assert told.spacing_m == (3, 3) and (ending == "png" or told.range_m[1] == pytest.approx(1640))


def test_generated_land_says_its_own_scale(ctx, tmp_path):
    low, high = write_land(ctx, Land(65, 65, 3, relief_m=800.0, spacing_m=7.0), tmp_path / "land.png")
    again = Heightmap.open(tmp_path / "land.png")
    assert again.spacing_m == (7, 7) and again.range_m == pytest.approx((low, high), abs=1e-3)


def test_values_that_cannot_be_metres_get_a_scale_and_a_line(tmp_path):
    values = np.linspace(0, 65535, 512 * 512).reshape(512, 512).astype("u2")
    values.tofile(tmp_path / "game.r16")
    image(tmp_path / "game.png", values)
    for name in ("game.r16", "game.png"):
        terrain = Heightmap.open(tmp_path / name)
        assert 50 <= terrain.range_m[1] <= 110 and terrain.scales == (0.001, 0.0)
        assert len(terrain.notes) == 1 and "--z-scale 0.001" in terrain.notes[0] and "--spacing" in terrain.notes[0]
        assert Heightmap.open(tmp_path / name, z_scale=0.5).notes == ()
    assert Heightmap.open(tmp_path / "game.r16", spacing_m=30).range_m[1] == pytest.approx(0.04 * 65535)


def test_relief_and_extent_that_cannot_both_be_right_get_a_spacing_and_a_line(tmp_path):
    """4000 m of relief on 300 m of land: 30 m between posts; 15,000 m need more. Given or possible values are kept."""
    ramp = np.linspace(0, 1, 301 * 280).reshape(301, 280)
    for relief, spacing in ((4000, 30), (15000, 270), (140, 1)):
        np.save(tmp_path / "a.npy", (ramp * relief).astype("f4"))
        terrain = Heightmap.open(tmp_path / "a.npy")
        assert terrain.spacing_m == (spacing, spacing) and terrain.range_m == (0, relief) and terrain.assumes_spacing
        chosen = [f"--spacing {spacing:g} is chosen" in note for note in terrain.notes]
        assert chosen == [True] * (spacing > 1) + [False] * (not terrain.of_earth)
        assert terrain.of_earth == (relief < 9000)
        for told in ({"spacing_m": 2.0}, {"z_scale": 1.0}):
            assert Heightmap.open(tmp_path / "a.npy", **told).spacing_m == (told.get("spacing_m", 1.0),) * 2
    image(tmp_path / "a.png", (ramp * 4000).astype("u2"))
    assert Heightmap.open(tmp_path / "a.png").spacing_m == (30, 30)


@pytest.mark.parametrize("spacing", [10.0, 30.0, 90.0])
def test_land_too_steep_for_posts_of_one_metre_gets_a_spacing_by_its_slopes(tmp_path, spacing):
    """A tenth of it is steeper than 0.4 at the spacing that it had."""
    y, x = np.mgrid[:400, :420]
    hills = (np.sin(x / 9) * np.cos(y / 11)).astype("f4")
    slopes = np.hypot(np.diff(hills, axis=0)[:, 1:], np.diff(hills, axis=1)[1:])
    np.save(tmp_path / "a.npy", hills * (0.4 * spacing / np.percentile(slopes, 90)))
    terrain = Heightmap.open(tmp_path / "a.npy")
    assert terrain.spacing_m == (spacing, spacing) and terrain.assumes_spacing and terrain.of_earth
    assert len(terrain.notes) == 1 and f"--spacing {spacing:g} is chosen" in terrain.notes[0]
    np.save(tmp_path / "a.npy", hills * 20)
    assert Heightmap.open(tmp_path / "a.npy").spacing_m == (1, 1)


def test_rough_values_of_16_bits_are_flattened_to_usual_slopes(tmp_path):
    y, x = np.mgrid[:400, :420]
    waves = (32000 * (1 + np.sin(x / 2) * np.cos(y / 3))).astype("u2")
    waves[0, 0] = 65535
    image(tmp_path / "a.png", waves)
    heights = Heightmap.open(tmp_path / "a.png").heights
    slopes = np.hypot(np.diff(heights, axis=0)[:, 1:], np.diff(heights, axis=1)[1:])
    assert 0.4 < np.percentile(slopes, 90) <= 0.8  # the scale is rounded down to one digit


def test_heights_that_no_land_has_are_not_of_the_earth(tmp_path):
    ramp = np.linspace(5000, 12000, 300 * 300).reshape(300, 300)
    image(tmp_path / "a.png", ramp.astype("u2"))
    terrain = Heightmap.open(tmp_path / "a.png")
    assert not terrain.of_earth and not terrain.copy().of_earth and "drawn in grey" in terrain.notes[-1]
    assert not Heightmap.open(tmp_path / "a.png", spacing_m=30.0).of_earth  # this says nothing about heights
    for told in ({"z_scale": 1.0}, {"z_offset_m": -10000.0}):
        assert Heightmap.open(tmp_path / "a.png", **told).of_earth


def test_a_description_that_makes_no_sense_is_as_if_it_were_not_there(tmp_path):
    about = "read with --spacing -3 --z-scale 0 --z-offset 1e999 --nodata abc"
    image(tmp_path / "a.png", U2, ImageDescription=about)
    terrain = Heightmap.open(tmp_path / "a.png")
    assert terrain.range_m == RANGE and terrain.spacing_m == (1, 1)


BAD_ARCHIVES = {
    "empty.zip": lambda p: zipfile.ZipFile(p, "w").writestr("readme.txt", "nothing"),
    "two.zip": lambda p: [zipfile.ZipFile(p, "a").writestr(name, "x") for name in ("a.tif", "b.tif")],
    "short.zip": lambda p: p.write_bytes(b"PK\x03\x04" + bytes(50)),
    "short.asc.gz": lambda p: p.write_bytes(gzip.compress(ASC.encode())[:200]),
    "gz.gz": lambda p: p.write_bytes(gzip.compress(gzip.compress(b"a"))),
    "odd.r16": lambda p: p.write_bytes(bytes(2 * 31 * 31 + 2)),
}


@pytest.mark.parametrize("name", BAD_ARCHIVES)
def test_bad_archives_end_in_one_line(tmp_path, name):
    BAD_ARCHIVES[name](tmp_path / name)
    with pytest.raises(TerrainError) as caught:
        Heightmap.open(tmp_path / name)
    assert name in str(caught.value) and "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_what_is_unpacked_goes_when_the_map_is_read(tmp_path, monkeypatch):
    (tmp_path / "space").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "space"))
    gzipped(tmp_path / "N46E009.hgt.gz", HGT.tobytes())
    assert Heightmap.open(tmp_path / "N46E009.hgt.gz").range_m == (500, 500)
    assert not list((tmp_path / "space").iterdir())
