"""Options for reading a file, found in its description: our own writers put them at the description's end."""

import math
import re
from dataclasses import replace

from terrain_gl.readers.raster import Raster

_OPTION = re.compile(r"--(spacing|z-scale|z-offset|nodata) ([\d.eE+,-]+)")


def as_described(raster: Raster, text: str) -> Raster:
    """The raster with the options after "read with"; invalid options are ignored."""
    options = {name: _numbers(value) for name, value in _OPTION.findall(text.partition("read with ")[2])}
    spacing = options.get("spacing", [])
    z_scale, z_offset, nodata = (options.get(name, []) for name in ("z-scale", "z-offset", "nodata"))
    return replace(
        raster,
        spacing_m=(spacing[0], spacing[-1]) if 1 <= len(spacing) <= 2 and min(spacing) > 0 else raster.spacing_m,
        scale=raster.scale * (z_scale[0] if len(z_scale) == 1 and z_scale[0] else 1.0),
        offset_m=raster.offset_m + (z_offset[0] if len(z_offset) == 1 else 0.0),
        nodata=nodata[0] if len(nodata) == 1 else raster.nodata,
    )


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        return []
    return values if all(map(math.isfinite, values)) else []
