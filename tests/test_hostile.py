"""Opening a map never uses the network or other files than its own, also if the file asks for it."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from hostile import HARMLESS, SECRET, Listener, make_files, vrt
from rasters import spaced, write_raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers import files_of
from terrain_gl.readers.windows import RasterFile

OPEN = """
import json, sys
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
for path in sys.argv[2:]:
    try:
        told = Heightmap.open(path, trusted=sys.argv[1] == "trusted").range_m
    except TerrainError as error:
        told = str(error)
    print(json.dumps([path, told]), flush=True)
"""


@pytest.fixture
def rasterio():
    return pytest.importorskip("rasterio", reason="the [geo] extra is not installed")


@pytest.fixture
def places(tmp_path):
    folder, outside = tmp_path / "maps", tmp_path / "elsewhere"
    folder.mkdir()
    outside.mkdir()
    return folder, outside


def opened(paths, trusted=False, port=0):
    """What opening each file gives, in a separate process: its range of heights, or the error message."""
    cloud = {"AWS_S3_ENDPOINT": f"127.0.0.1:{port}", "AWS_HTTPS": "NO", "AWS_VIRTUAL_HOSTING": "FALSE"}
    keys = {"AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b"}
    command = [sys.executable, "-c", OPEN, "trusted" if trusted else "", *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=os.environ | cloud | keys)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(line) for line in done.stdout.splitlines())


def test_hostile_files_reach_nothing(rasterio, places):
    with Listener() as listener:
        files = make_files(rasterio, *places, f"http://127.0.0.1:{listener.port}")
        assert len(files) >= 31
        told = opened(files.values(), port=listener.port)
        assert listener.connections == 0
    for name, path in files.items():
        if name in HARMLESS:
            assert told[str(path)] == [0.0, 126.0], name
        else:
            assert isinstance(told[str(path)], str) and str(path) in told[str(path)], name
    assert not any(SECRET in found for found in told.values() if isinstance(found, list))


def test_the_listener_counts_what_a_trusted_map_reaches_for(rasterio, places):
    """Without the protection the same files, when trusted, do connect, and do show the other file."""
    with Listener() as listener:
        files = make_files(rasterio, *places, f"http://127.0.0.1:{listener.port}")
        names = ("curl.vrt", "wmts.xml", "s3.vrt", "outside.vrt")
        told = opened([files[name] for name in names], trusted=True, port=listener.port)
        assert listener.connections >= 3
    assert told[str(files["outside.vrt"])] == [SECRET, SECRET]


def test_a_mosaic_is_what_gdal_makes_of_it(rasterio, places):
    folder, _ = places
    (folder / "below").mkdir()
    rng = np.random.default_rng(3)
    tiles = {}
    for name, east in (("a.tif", 0), ("below/b.tif", 50)):
        tiles[name] = rng.integers(0, 3000, (64, 64), "i2")
        tiles[name][:5, :7] = -9999
        write_raster(folder / name, tiles[name], spaced(30, 30 * east, 0), "EPSG:32610", nodata=-9999)
    sources = "".join(
        f'<ComplexSource><SourceFilename relativeToVRT="1">{name}</SourceFilename><SourceBand>1</SourceBand>'
        f'<SrcRect xOff="0" yOff="0" xSize="64" ySize="64"/><DstRect xOff="{x}" yOff="{y}" xSize="{s}" ySize="{s}"/>'
        "<NODATA>-9999</NODATA></ComplexSource>"
        for name, x, y, s in (("a.tif", 0, 0, 64), ("below/b.tif", 50, 3, 64), ("a.tif", 80, 80, 32))
    )
    (folder / "mosaic.vrt").write_text(
        '<VRTDataset rasterXSize="130" rasterYSize="130"><SRS>EPSG:32610</SRS><GeoTransform>0,30,0,0,0,-30'
        '</GeoTransform><VRTRasterBand dataType="Int16" band="1"><NoDataValue>-9999</NoDataValue>'
        f"{sources}</VRTRasterBand></VRTDataset>"
    )
    ours, theirs = (Heightmap.open(folder / "mosaic.vrt", trusted=trusted) for trusted in (False, True))
    np.testing.assert_array_equal(ours.heights, theirs.heights)
    assert ours.spacing_m == theirs.spacing_m == (30, 30) and ours.voids == theirs.voids > 0
    assert np.array_equal(ours.heights[3:67, 64:114][5:], tiles["below/b.tif"][5:, 14:])


def test_a_mosaic_names_the_files_that_it_reads(rasterio, places):
    folder, outside = places
    files = make_files(rasterio, folder, outside, "http://127.0.0.1:9")
    (folder / "own.vrt").write_text(vrt("good.tif", 'relativeToVRT="1"'))
    assert files_of(folder / "own.vrt") == [str(folder / "own.vrt"), str(folder / "good.tif")]
    assert files_of(files["pipe.tif"]) == [str(files["pipe.tif"])]
    assert Heightmap.open(folder / "own.vrt").range_m == (0, 126)


@pytest.mark.parametrize("text", ["<VRTDataset", "<VRTDataset/>", "<VRTDataset rasterXSize='a' rasterYSize='2'/>"])
def test_broken_mosaics_end_in_one_line(rasterio, tmp_path, text):
    (tmp_path / "a.vrt").write_text(text)
    with pytest.raises(TerrainError, match=r"a\.vrt") as caught:
        Heightmap.open(tmp_path / "a.vrt")
    assert "\n" not in str(caught.value)


def test_a_wrong_element_of_a_mosaic_does_not_print_the_mosaic(rasterio, places):
    folder, outside = places
    make_files(rasterio, folder, outside, "http://127.0.0.1:9")
    (folder / "a.vrt").write_text(vrt("good.tif", 'relativeToVRT="1"').replace("Band>1<", "Band>0<"))
    with pytest.raises(TerrainError, match="one of its elements is wrong"):
        Heightmap.open(folder / "a.vrt")


def test_an_empty_source_of_a_mosaic_is_named(rasterio, tmp_path):
    (tmp_path / "empty.tif").touch()
    (tmp_path / "a.vrt").write_text(vrt("empty.tif", 'relativeToVRT="1"'))
    with pytest.raises(TerrainError, match=r"a\.vrt: .*empty\.tif is empty"):
        Heightmap.open(tmp_path / "a.vrt")


@pytest.mark.parametrize("way", ["untrusted", "trusted", "windows", "dataset"])
def test_a_damaged_source_of_a_large_mosaic_is_no_land(rasterio, tmp_path, way):
    """GDAL reads several sources of a window of more than a million posts at the same time."""
    n = 1024
    profile = {"driver": "GTiff", "height": n, "width": n, "count": 1, "dtype": "int16"}
    heights = np.random.default_rng(0).integers(1, 3000, (n, n)).astype(np.int16)
    with rasterio.open(tmp_path / "a.tif", "w", **profile, tiled=True, compress="deflate") as out:
        out.write(heights, 1)
    whole = (tmp_path / "a.tif").read_bytes()
    (tmp_path / "b.tif").write_bytes(whole[: len(whole) // 2])
    sources = "".join(
        f'<SimpleSource><SourceFilename relativeToVRT="1">{name}</SourceFilename><SourceBand>1</SourceBand>'
        f'<SrcRect xOff="0" yOff="0" xSize="{n}" ySize="{n}"/><DstRect xOff="{x}" yOff="0" xSize="{n}" ySize="{n}"/>'
        "</SimpleSource>"
        for name, x in (("a.tif", 0), ("b.tif", n))
    )
    path = tmp_path / "mosaic.vrt"
    path.write_text(
        f'<VRTDataset rasterXSize="{2 * n}" rasterYSize="{n}"><VRTRasterBand dataType="Int16" band="1">{sources}'
        "</VRTRasterBand></VRTDataset>"
    )
    with pytest.raises(TerrainError, match=r"damaged or cut short \(b\.tif"):
        if way == "windows":
            RasterFile(str(path)).read(slice(0, n), slice(0, 2 * n))
        elif way == "dataset":
            with rasterio.open(path) as data:
                Heightmap.of(data)
        else:
            Heightmap.open(path, trusted=way == "trusted")


def test_a_mosaic_of_a_band_that_is_not_there_names_the_file(rasterio, places):
    folder, outside = places
    make_files(rasterio, folder, outside, "http://127.0.0.1:9")
    (folder / "a.vrt").write_text(vrt("good.tif", 'relativeToVRT="1"').replace("Band>1<", "Band>5<"))
    with pytest.raises(TerrainError, match=r"a\.vrt: .*good\.tif") as caught:
        Heightmap.open(folder / "a.vrt")
    assert "?if=" not in str(caught.value)
