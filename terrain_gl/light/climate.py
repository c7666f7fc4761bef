"""Looks of the land, by name; and the climate of a place: its tree line, its snow line, and how dry it is.

Colours depend on metres above the sea and on the place on the Earth, not on the map's own range of heights. So a part
of a map has the same colours as in the whole map, and edits elsewhere do not change them. Only ramps show the map's own
range, unless another range is given.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..readers.georeference import DEGREES, flat_crs
from ..readers.place import Place

AUTO = "auto"
_NATURAL, _EARTH, _GREY, _TINT, RAMP = range(5)  # glsl/shade/cover.glsl
_EARTH_M = 6.3e6, 6.4e6  # semi-major axes
ATLAS_M = 1000.0  # if posts are at least this far apart, woods are too small to show: the colours are those of an atlas
LATITUDE_DEG = 46.0  # used if the latitude is not known: that of the Alps
# Latitude, and heights in metres of the tree line and of the snow line in early summer: rough values of our own choice.
_LATITUDES = 0, 20, 30, 40, 46, 52, 60, 70, 78, 90
_TREES_M = 3800, 4000, 3900, 3000, 1950, 1600, 900, 150, -200, -400
_SNOW_M = 4800, 5600, 5300, 3500, 2450, 2000, 1300, 600, 200, -200
# The large deserts, roughly, as ellipses: latitude and longitude of the middle, and half axes in degrees.
_DESERTS = np.array(
    (
        (23, 5, 10, 24),  # Sahara
        (23, 30, 9, 9),  # Egypt and Nubia
        (24, 47, 10, 12),  # Arabia
        (31, 55, 6, 10),  # Iran
        (28, 70, 4, 5),  # Thar
        (42, 60, 6, 8),  # Karakum
        (40, 83, 4, 9),  # Taklamakan
        (42, 103, 4, 10),  # Gobi
        (35, -115, 4, 5),  # Mojave
        (39, -117, 3, 4),  # Great Basin
        (37, -110.5, 3, 3.5),  # Colorado Plateau
        (31, -112, 5, 5),  # Sonora
        (28, -104, 4, 3),  # Chihuahua
        (-23, -69.5, 7, 2.5),  # Atacama
        (-44, -68, 7, 4),  # Patagonia
        (-24, 16, 8, 3.5),  # Namib
        (-26, 132, 7, 13),  # Australia
        (9, 46, 5, 6),  # Horn of Africa
    ),
    np.float64,
)
_RIM = 0.25  # dryness fades out over this part of the half axes, outside an ellipse


class Climate(NamedTuple):
    """Metres of the tree line and of the snow line, and how dry the land is, 0 to 1."""

    trees_m: float
    snow_m: float
    dryness: float


class Kind(NamedTuple):
    """A look: its number in glsl/shade/cover.glsl, its climate (None: that of the map's place), and its help text."""

    shader: int
    climate: Climate | None
    help: str


LOOKS = {
    "alpine": Kind(_NATURAL, None, "woods, meadows, rock and snow, by the latitude of the map, else of the Alps"),
    "green": Kind(_NATURAL, Climate(2500.0, 1e6, 0.0), "woods and meadows, no snow"),
    "arid": Kind(_NATURAL, Climate(4000.0, 6000.0, 1.0), "sand and layers of rock"),
    "earth": Kind(_EARTH, None, "soil and rock, by steepness alone"),
    "grey": Kind(_GREY, None, "a hillshade"),
    "tint": Kind(_TINT, None, "an atlas' colours of heights"),
    "viridis": Kind(RAMP, None, "a colour map of heights, over those of the map, or --range"),
    "diverging": Kind(RAMP, None, "red below 0, blue above, or --range"),
}
NAMES = (AUTO, *LOOKS)


def look_of(heightmap: Heightmap) -> str:
    """The look for "auto": the one that the map describes, else one that suits its planet, spacing and place."""
    if heightmap.look != AUTO:
        return heightmap.look
    if not is_of_earth(heightmap):
        return "grey"
    if min(heightmap.ground_spacing_m) >= ATLAS_M:
        return "tint"
    return "earth" if heightmap.place is None and heightmap.assumes_spacing else "alpine"


def is_of_earth(heightmap: Heightmap) -> bool:
    """Whether a map may be of the Earth. Its coordinate system decides; if it has none, its heights decide."""
    return _is_earth(heightmap.place.crs) if heightmap.place else heightmap.of_earth


def climates(heightmap: Heightmap, look: str) -> tuple[Climate, ...]:
    """The climate at the map's corners: north-west, north-east, south-west, south-east."""
    own = LOOKS[look].climate
    if own:
        return (own,) * 4
    corners = _corners(heightmap.place) if heightmap.place else None
    if corners is None:
        return (climate_of(LATITUDE_DEG),) * 4
    dry = heightmap.look == AUTO
    return tuple(climate_of(latitude, longitude if dry else None) for longitude, latitude in corners)


@lru_cache(maxsize=64)
def _corners(place: Place) -> tuple[tuple[float, float], ...] | None:
    """Longitude and latitude of the map's corners, in the order of `climates`; None if they are unknown."""
    cols, rows = place.georeference.size
    east, north = place.spacing_m
    at = [(x, y) for y in ((rows - 1) * north, 0.0) for x in (0.0, (cols - 1) * east)]
    try:
        return tuple(place.to_lonlat(x, y) for x, y in at) if _is_earth(place.crs) else None
    except TerrainError:
        return None


@lru_cache(maxsize=64)
def _is_earth(crs: str | None) -> bool:
    """Whether a coordinate system is of the Earth; an unknown system counts as one of the Earth."""
    if crs is None or crs == DEGREES:
        return True
    try:
        ellipsoid = flat_crs(crs).ellipsoid
    except TerrainError:
        return True
    return ellipsoid is None or _EARTH_M[0] < ellipsoid.semi_major_metre < _EARTH_M[1]


@lru_cache(maxsize=64)
def climate_of(latitude: float, longitude: float | None = None) -> Climate:
    """The climate of a place on the Earth, in degrees north and east. Without a longitude, the land is not dry."""
    trees, snow = (float(np.interp(abs(latitude), _LATITUDES, metres)) for metres in (_TREES_M, _SNOW_M))
    return Climate(trees, snow, 0.0 if longitude is None else _dryness(latitude, longitude))


def _dryness(latitude: float, longitude: float) -> float:
    east = (longitude - _DESERTS[:, 1] + 180) % 360 - 180
    out = np.hypot((latitude - _DESERTS[:, 0]) / _DESERTS[:, 2], east / _DESERTS[:, 3])
    return float(np.clip((1 + _RIM - out.min()) / _RIM, 0.0, 1.0))
