"""Hostile files, with which GDAL would read other files than the map or the network; and stores that are damaged."""

import os
import socket
import threading
from pathlib import Path

import numpy as np
from rasters import write_raster

SECRET = 4711.0  # the heights of the file that no map may show
N = 64


class Listener:
    """A server on the loopback that counts who connects."""

    def __enter__(self):
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self.connections = 0
        threading.Thread(target=self._count, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._socket.close()

    def _count(self):
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            self.connections += 1
            connection.close()


def vrt(source, attributes="", head="", kind="SimpleSource", more=""):
    """A .vrt of one source."""
    return (
        f'<VRTDataset rasterXSize="{N}" rasterYSize="{N}">{head}<VRTRasterBand dataType="Float32" band="1">'
        f"<{kind}><SourceFilename {attributes}>{source}</SourceFilename><SourceBand>1</SourceBand>{more}"
        f'<SrcRect xOff="0" yOff="0" xSize="{N}" ySize="{N}"/><DstRect xOff="0" yOff="0" xSize="{N}" ySize="{N}"/>'
        f"</{kind}></VRTRasterBand></VRTDataset>"
    )


def raw(path, offset=0):
    """A .vrt whose heights are the bytes of a file."""
    return (
        f'<VRTDataset rasterXSize="8" rasterYSize="8"><VRTRasterBand dataType="Byte" band="1" '
        f'subClass="VRTRawRasterBand"><SourceFilename relativeToVRT="0">{path}</SourceFilename>'
        f"<ImageOffset>{offset}</ImageOffset><PixelOffset>1</PixelOffset><LineOffset>8</LineOffset>"
        "</VRTRasterBand></VRTDataset>"
    )


def texts(url, outside):
    """Hostile text files by name; `url` is the listener's, `outside` a folder with `secret.tif`."""
    secret, inside = f"{outside}/secret.tif", 'relativeToVRT="1"'
    wms = (
        f'<GDAL_WMS><Service name="TMS"><ServerUrl>{url}/${{z}}/${{x}}/${{y}}.png</ServerUrl></Service><DataWindow>'
        "<UpperLeftX>0</UpperLeftX><UpperLeftY>9</UpperLeftY><LowerRightX>9</LowerRightX><LowerRightY>0</LowerRightY>"
        "<TileLevel>1</TileLevel><TileCountX>1</TileCountX><TileCountY>1</TileCountY></DataWindow>"
        "<Projection>EPSG:3857</Projection><BlockSizeX>64</BlockSizeX><BlockSizeY>64</BlockSizeY>"
        "<BandsCount>1</BandsCount><DataType>Float32</DataType></GDAL_WMS>"
    )
    warped = (
        f'<VRTDataset rasterXSize="{N}" rasterYSize="{N}" subClass="VRTWarpedDataset"><VRTRasterBand dataType='
        '"Float32" band="1" subClass="VRTWarpedRasterBand"/><GDALWarpOptions><SourceDataset relativeToVRT="0">'
        f"{secret}</SourceDataset></GDALWarpOptions></VRTDataset>"
    )
    derived = vrt(secret).replace('band="1"', 'band="1" subClass="VRTDerivedRasterBand"')
    return {
        "wms.tif": wms,
        "wms.xml": wms,
        "wms with space.png": f"  \n{wms}",
        "wmts.xml": f"<GDAL_WMTS><GetCapabilitiesUrl>{url}/wmts</GetCapabilitiesUrl><Layer>a</Layer></GDAL_WMTS>",
        "wcs.xml": f"<WCS_GDAL><ServiceURL>{url}/wcs?</ServiceURL><CoverageName>a</CoverageName></WCS_GDAL>",
        "tiles.gti": f"<GDALTileIndexDataset><IndexDataset>/vsicurl/{url}/index.gpkg</IndexDataset>"
        "<IndexLayer>index</IndexLayer><LocationField>location</LocationField></GDALTileIndexDataset>",
        "stac.json": f'{{"stac_version":"1.0.0","type":"Feature","assets":{{"a":{{"href":"{url}/a.tif"}}}}}}',
        "mosaic.mrf": f'<MRF_META><CachedSource><Source>/vsicurl/{url}/a.tif</Source></CachedSource>'
        f'<Raster><Size x="{N}" y="{N}" c="1"/></Raster></MRF_META>',
        "curl.vrt": vrt(f"/vsicurl/{url}/a.tif"),
        "http.vrt": vrt(f"{url}/a.tif"),
        "s3.vrt": vrt("/vsis3/bucket/a.tif"),
        "streaming.vrt": vrt(f"/vsicurl_streaming/{url}/a.tif"),
        "zip.vrt": vrt(f"/vsizip//vsicurl/{url}/a.zip/a.tif"),
        "inline.vrt": vrt(wms.replace("<", "&lt;")),
        "nested.vrt": vrt("curl.vrt", inside),
        "wms.vrt": vrt("wms.tif", inside),
        "a.tif?if=WMS": wms,
        "options in a name.vrt": vrt("a.tif?if=WMS", inside),
        "options.vrt": vrt("good.tif", inside, more='<OpenOptions><OOI key="A">B</OOI></OpenOptions>'),
        "raw.vrt": raw("/etc/passwd"),
        "raw beside.vrt": raw("good.tif"),
        "outside.vrt": vrt(secret),
        "upwards.vrt": vrt(f"../{os.path.basename(outside)}/secret.tif", inside),
        "link.vrt": vrt("link.tif", inside),
        "folder link.vrt": vrt("folder/secret.tif", inside),
        "warped.vrt": warped,
        "derived.vrt": derived,
        "pipe.vrt": vrt("pipe.tif", inside),
        "device.vrt": vrt("/dev/zero"),
        "entity.vrt": f'<VRTDataset><!DOCTYPE a [<!ENTITY x SYSTEM "{secret}">]></VRTDataset>',
        "overview.vrt": vrt("good.tif", inside).replace(
            "<SimpleSource>", f"<Overview><SourceFilename>/vsicurl/{url}/o</SourceFilename></Overview><SimpleSource>"
        ),
        "crs.vrt": vrt("good.tif", inside, f"<SRS>{url}/crs</SRS><GeoTransform>0,2,0,0,0,-2</GeoTransform>"),
        "raw.ers": "DatasetHeader Begin\n\tVersion = \"6.0\"\n\tDataSetType = ERStorage\n\tDataType = Raster\n"
        f"\tDataFile = \"{outside}/secret.bin\"\n\tByteOrder = LSBFirst\n\tRasterInfo Begin\n\t\tCellType = "
        "Unsigned8BitInteger\n\t\tNrOfLines = 8\n\t\tNrOfCellsPerLine = 8\n\t\tNrOfBands = 1\n\tRasterInfo End\n"
        "DatasetHeader End\n",
        "label.lbl": f"PDS_VERSION_ID = PDS3\nRECORD_BYTES = 8\n^IMAGE = (\"{outside}/secret.bin\", 1)\n"
        "OBJECT = IMAGE\n"
        " LINES = 8\n LINE_SAMPLES = 8\n SAMPLE_BITS = 8\n SAMPLE_TYPE = UNSIGNED_INTEGER\nEND_OBJECT = IMAGE\nEND\n",
    }  # fmt: skip


# Files that may be read: GDAL would follow parts of them, but nobody asks for these parts.
HARMLESS = ("overview.vrt", "crs.vrt", "overview.tif", "tags.tif")


def cut_heights(store):
    """Cut all shards of a store's finest heights short."""
    for shard in Path(store, "heights/0/c").rglob("*"):
        if shard.is_file():
            shard.write_bytes(shard.read_bytes()[:100])


def make_files(rasterio, folder, outside, url):
    """Write the hostile files and those that they name; returns their paths by name."""
    heights = np.add.outer(np.arange(float(N)), np.arange(float(N))).astype("f4")
    for path, values in ((folder / "good.tif", heights), (outside / "secret.tif", np.full_like(heights, SECRET))):
        write_raster(path, values, None, None)
    (outside / "secret.bin").write_bytes(bytes(range(64)))
    hostile = texts(url, str(outside))
    for name, text in hostile.items():
        (folder / name).write_text(text)
    (folder / "link.tif").symlink_to(outside / "secret.tif")
    (folder / "folder").symlink_to(outside)
    os.mkfifo(folder / "pipe.tif")
    with rasterio.open(write_raster(folder / "overview.tif", heights, None, None), "r+") as out:
        out.update_tags(ns="OVERVIEWS", OVERVIEW_FILE=f"/vsicurl/{url}/overview.tif")
    for name in ("tags.tif", "waits.tif", "linked.tif"):
        (folder / name).write_bytes((folder / "good.tif").read_bytes())
    tags = f'<Metadata domain="OVERVIEWS"><MDI key="OVERVIEW_FILE">/vsicurl/{url}/tags.tif</MDI></Metadata>'
    (folder / "tags.tif.aux.xml").write_text(f"<PAMDataset>{tags}</PAMDataset>")
    os.mkfifo(folder / "waits.tfw")
    (folder / "linked.tfw").symlink_to(outside / "secret.bin")
    spill = "long_enough_name.img"
    write_raster(folder / spill, np.full_like(heights, SECRET), None, None, "HFA", USE_SPILL="YES")
    (folder / "long_enough_name.ige").rename(outside / "spl.ige")
    elsewhere = b"../elsewhere/spl.ige"
    content = (folder / spill).read_bytes()
    assert content.count(b"long_enough_name.ige") == 1 and len(elsewhere) == len(b"long_enough_name.ige")
    (folder / spill).write_bytes(content.replace(b"long_enough_name.ige", elsewhere))
    (folder / "external.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(2000))
    more = ("overview.tif", "tags.tif", "waits.tif", "linked.tif", "external.nc", "pipe.tif", "long_enough_name.img")
    return {name: folder / name for name in (*hostile, *more)}
