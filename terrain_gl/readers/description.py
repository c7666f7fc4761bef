"""How a file is read, by texts that GDAL does not interpret: its description, and headers beside it."""

import math
import re
from contextlib import suppress
from dataclasses import replace
from typing import Any

from terrain_gl.readers.raster import Raster

_OPTION = re.compile(r"--(spacing|z-scale|z-offset|nodata) ([\d.eE+,-]+)")


def as_described(raster: Raster, text: str) -> Raster:
    """The raster with the options after "read with", which our own writers put there; invalid ones are ignored."""
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


_BESIDE = re.compile(r"^(UNIT|Z_FACTOR|ZUNITS)(?:[ \t]*=|[ \t])[ \t]*([^\s=].*)$", re.IGNORECASE | re.MULTILINE)
_MOST_BYTES = 10_000


def unit_beside(data: Any) -> tuple[str, float]:
    """The unit of heights, and a factor, in the .sgrd of SAGA and in old .prj of Arc/Info; "" and 1 if there are none.

    `data` is a dataset of rasterio.
    """
    found: dict[str, str] = {}
    if data.driver in ("SAGA", "AAIGrid"):
        for path in data.files:
            if path.lower().endswith((".sgrd", ".prj")):
                with open(path, encoding="utf-8", errors="replace") as file:
                    found |= {key.upper(): value.strip() for key, value in _BESIDE.findall(file.read(_MOST_BYTES))}
    unit = found.get("UNIT") or found.get("ZUNITS", "")
    factor = 1.0
    with suppress(ValueError, ZeroDivisionError):
        factor = float(found["Z_FACTOR"]) if "Z_FACTOR" in found else 1 / float(unit)  # Zunits 100: 100 for a metre
    return ("" if unit.lower() == "no" or unit[:1].isdigit() else unit), factor if 0 < factor < math.inf else 1.0
