"""What the stored values mean: their unit, and whether they count up or down. The result is metres up.

A file says it in several places: the unit of its band, CF attributes (`units`, `positive`, `standard_name`), and the
vertical axis of its coordinate system. What a file says is believed. What it does not say is metres up; where this is
unlikely, a note asks for an option, and `contradictions` compares the values with the land of the Earth.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from terrain_gl.readers.raster import Meaning, gdal_failures

EARTH_M = -11_000.0, 8_900.0  # heights of the deepest sea floor and of Everest
FOOT_M, US_FOOT_M = 0.3048, 1200 / 3937
_US_FOOT = ("us ft", "ftus", "usft", "us foot", "foot us", "us survey foot", "us survey ft", "survey foot", "sft")
_SINGULAR = {"feet": "foot", "inches": "inch"}
_UNITS = {  # in the singular
    **dict.fromkeys(("m", "metre", "meter", "mtr", "mt", "mts", "masl", "mamsl", "gpm", "geopotential meter"), 1.0),
    "m2 s 2": 1 / 9.80665,  # geopotential, as weather models give it
    **dict.fromkeys(("ft", "foot", "international foot", "intl foot", "foot international"), FOOT_M),
    **dict.fromkeys((*_US_FOOT, "foot us survey", "foot survey us"), US_FOOT_M),
    **{"fathom": 1.8288, "yd": 0.9144, "yard": 0.9144, "in": 0.0254, "inch": 0.0254},
    **{
        prefix + name: factor
        for short, long, factor in (("k", "kilo", 1e3), ("d", "deci", 0.1), ("c", "centi", 0.01), ("m", "milli", 1e-3))
        for prefix, name in ((short, "m"), (long, "metre"), (long, "meter"))
    },
}
NAMES = {1.0: "metres", FOOT_M: "feet", US_FOOT_M: "US survey feet", 0.1: "decimetres", 0.01: "centimetres"}
NAMES |= {1e-3: "millimetres", 1e3: "kilometres", 1.8288: "fathoms", 0.9144: "yards", 0.0254: "inches"}
NAMES[_UNITS["m2 s 2"]] = "geopotential"
_NO_UNIT = {"1", "none", "unitless", "dimensionless", "unknown", "n/a", "na", "null", "undefined"}
_DOWN = re.compile(r"\b(depth|down|below)\b")
_SAID_DOWN = re.compile(r"positive\W+(is\W+)?down")  # in a title or a comment


def meaning_of(unit: str | None, crs: Any, about: Mapping[str, str]) -> Meaning:
    """What values mean by the unit of their band, the coordinate system, and attributes.

    `about` may have "positive", "standard_name", "long_name" and "name" of the variable.
    """
    axis_m, axis_is_down = _vertical_axis(crs)
    told = re.sub(r"[.*^]", "", re.sub(r"[,;:()\[\]]", " ", (unit or about.get("units", "")).lower())).strip()
    told = "" if told in _NO_UNIT else told
    words = [_SINGULAR.get(w, re.sub("(re|er|yard|fathom)s$", r"\1", w)) for w in re.split(r"[\s_-]+", told) if w]
    unit_m = _unit_m(words)
    notes: tuple[str, ...] = ()
    if words and unit_m is None:
        notes = (f"unit of heights {' '.join(words)[:30]!r} is unknown: values count as metres (--z-scale)",)
    elif unit_m is None and axis_m is None and (feet := _in_feet(crs)):
        notes = (
            f"no unit of heights, but {NAMES[feet]} between posts: values count as metres; "
            f"if they are feet, give --z-scale {feet:.10g}",
        )
    metres = next((known for known in (unit_m, axis_m) if known), 1.0)
    positive = about.get("positive", "").strip().lower()
    names = " ".join(about.get(key, "") for key in ("standard_name", "units")).lower().replace("_", " ")
    is_down = positive == "down" if positive in ("up", "down") else axis_is_down or bool(_DOWN.search(names + told))
    is_down |= not positive and bool(_SAID_DOWN.search(" ".join(about.values()).lower()))
    is_given = unit_m is not None or axis_m is not None
    known = next((name for size, name in NAMES.items() if math.isclose(size, metres)), f"units of {metres:g} m")
    shown = known if is_given else Meaning().words
    named = " ".join(about.get(key, "") for key in ("name", "long_name")).lower().replace("_", " ")
    is_named = bool(re.search(r"depth|bathy", named)) and not re.search(r"topo|elev|height|altitude", named)
    may_be = is_named and not is_down and positive != "up"
    return Meaning(-metres if is_down else metres, shown + " down" * is_down, notes, may_be)


def _unit_m(words: list[str]) -> float | None:
    for length in range(len(words), 0, -1):  # a datum may follow the unit, as in "metres above sea level"
        known = _UNITS.get(" ".join(words[:length]))
        if known and not any(word.isdecimal() for word in words[length:]):  # m s-1 is a speed
            return known
    return None


def _vertical_axis(crs: Any) -> tuple[float | None, bool]:
    """Metres in a unit of the vertical axis of a coordinate system, None if it has no such axis; and if it is down."""
    try:
        text = crs.to_wkt(version="WKT2_2019") if crs is not None else ""
    except gdal_failures():
        return None, False
    found = re.search(r'AXIS\["[^"]*",(up|down),(?:ORDER\[3\],)?LENGTHUNIT\["[^"]*",([\d.eE+-]+)', text)
    return (float(found[2]), found[1] == "down") if found else (None, False)


def _in_feet(crs: Any) -> float | None:
    """Metres in the horizontal unit of a coordinate system if this is a foot."""
    try:
        unit_m = float(crs.linear_units_factor[1]) if crs is not None and crs.is_projected else 0.0
    except gdal_failures():
        return None
    return next((foot for foot in (FOOT_M, US_FOOT_M) if math.isclose(unit_m, foot, rel_tol=1e-9)), None)
