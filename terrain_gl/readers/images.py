"""PNG, EXR, HDR and TIFF through OpenImageIO."""

from typing import Any

import numpy as np
import OpenImageIO as oiio

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import quiet_stderr, reason_of
from terrain_gl.readers.description import said_in
from terrain_gl.readers.georeference import Georeference, Grid, spacing_of, world_file
from terrain_gl.readers.raster import INSTALL_GEO, MAX_CHANNELS, Blocks, Raster, damaged, north_up, rows_at_once, utf8


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
    said = said_in(_description(spec))
    grid = world_file(path) or Grid()
    place = Georeference(grid, None, (spec.width, spec.height))
    spacing_m, notes = spacing_of(place, name)
    blocks = _oiio_blocks(image, name)
    return Raster(
        name,
        shape,
        dtype,
        north_up(blocks, spec.height) if grid.is_south_up else blocks,
        has_alpha,
        nodata=said.nodata,
        spacing_m=spacing_m or said.spacing_m,
        scale=said.z_scale,
        offset_m=said.z_offset_m,
        notes=notes,
        bands=tuple(spec.channelnames)[: spec.nchannels - has_alpha],
        georeference=place.kept(),
    )


def _description(spec: Any) -> str:
    try:
        return str(spec.get_string_attribute("ImageDescription"))
    except UnicodeDecodeError:
        return ""


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
