"""Images through OpenImageIO: PNG, EXR, HDR, PNM, WebP, JPEG XL, SGI and, without rasterio, TIFF."""

from contextlib import suppress
from typing import Any

import numpy as np
import OpenImageIO as oiio

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import quiet_stderr, reason_of
from terrain_gl.readers.georeference import Georeference, Grid, at_place, world_file
from terrain_gl.readers.local import utf8
from terrain_gl.readers.raster import INSTALL_GEO, MAX_CHANNELS, Blocks, Raster, damaged, rows_at_once


def open_oiio(path: str, name: str) -> Raster:
    """Open an image of one height per pixel, or of packed colours."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # otherwise heights are multiplied by their opacity
    with quiet_stderr():
        image = oiio.ImageInput.open(utf8(path, name), config)
    if image is None:
        raise damaged(name, reason_of(oiio))
    spec = image.spec()
    if spec.deep or spec.depth > 1 or spec.nchannels > MAX_CHANNELS:
        raise TerrainError(f"{name}: is a deep, volume or many-channel image: keep one channel of heights")
    bits = spec.get_int_attribute("oiio:BitsPerSample", 0)
    if spec.tile_width and bits > 16 and bits != 32:  # OpenImageIO 3.0 to 3.2 reads nothing, without an error
        raise TerrainError(f"{name}: is a tiled TIFF of {bits} bits, which only GDAL reads rightly: {INSTALL_GEO}")
    shape = (spec.height, spec.width, spec.nchannels)
    has_alpha = spec.nchannels > 1 and spec.alpha_channel == spec.nchannels - 1
    dtype = np.dtype({"uint": "uint32", "int": "int32", "half": "float16"}.get(str(spec.format), str(spec.format)))
    raster = Raster(
        name, shape, dtype, _oiio_blocks(image, name), has_alpha, bands=tuple(spec.channelnames)[: shape[2] - has_alpha]
    )
    about = ""
    with suppress(UnicodeDecodeError):
        about = str(spec.get_string_attribute("ImageDescription"))
    place = Georeference(world_file(path) or Grid(), None, (spec.width, spec.height))
    return at_place(raster, place, about)


def _oiio_blocks(image: Any, name: str) -> Blocks:
    spec = image.spec()
    step = spec.tile_height or rows_at_once(spec.width)
    for row in range(0, spec.height, step):
        rows = slice(row, min(row + step, spec.height))
        top, bottom = spec.y + rows.start, spec.y + rows.stop
        with quiet_stderr():
            if spec.tile_width:
                columns = (spec.x, spec.x + spec.width)
                pixels = image.read_tiles(0, 0, *columns, top, bottom, 0, 1, 0, spec.nchannels, spec.format)
            else:
                pixels = image.read_scanlines(0, 0, top, bottom, 0, 0, spec.nchannels, spec.format)
        if pixels is None:
            raise damaged(name, reason_of(image))
        yield rows, pixels.reshape(rows.stop - rows.start, spec.width, spec.nchannels)
