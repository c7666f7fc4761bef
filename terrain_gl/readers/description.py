"""Options for reading a file, found in its description: our own writers put them at the description's end."""

import math
import re
from typing import NamedTuple

from terrain_gl.readers.raster import Spacing

_OPTION = re.compile(r"--(spacing|z-scale|z-offset|nodata) ([\d.eE+,-]+)")


class Said(NamedTuple):
    """Spacing, scale and offset of heights, and the value that marks voids."""

    spacing_m: Spacing | None = None
    z_scale: float = 1.0
    z_offset_m: float = 0.0
    nodata: float | None = None


def said_in(text: str) -> Said:
    """Find the options after "read with"; invalid options are ignored."""
    options = dict(_OPTION.findall(text.partition("read with ")[2]))
    spacing = _numbers(options.get("spacing", ""))
    z_scale, z_offset, nodata = (_numbers(options.get(name, "")) for name in ("z-scale", "z-offset", "nodata"))
    return Said(
        (spacing[0], spacing[-1]) if 1 <= len(spacing) <= 2 and min(spacing) > 0 else None,
        z_scale[0] if len(z_scale) == 1 and z_scale[0] else 1.0,
        z_offset[0] if len(z_offset) == 1 else 0.0,
        nodata[0] if len(nodata) == 1 else None,
    )


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        return []
    return values if all(map(math.isfinite, values)) else []
