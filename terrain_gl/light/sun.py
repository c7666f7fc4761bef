"""The sun's position at a time and place: Meeus 1998, "Astronomical algorithms", chapters 25 and 28."""

import math
from datetime import UTC, datetime

from ..basics.exceptions import UsageError

_NOON_2000 = datetime(2000, 1, 1, 12, tzinfo=UTC)


def sun_position(time: datetime, latitude_deg: float, longitude_deg: float = 0.0) -> tuple[float, float]:
    """Azimuth, clockwise from north, and elevation of the sun's centre in degrees, without refraction.

    Both are accurate to 0.02 degrees from 1950 to 2050.

    Parameters
    ----------
    time
        With a time zone, an instant. Without one, local mean solar time, in which the sun is highest at about twelve.
    latitude_deg, longitude_deg
        North and east are positive. The longitude only matters if `time` has a time zone.

    Raises
    ------
    UsageError
        A latitude beyond 90 degrees or a longitude beyond 360.
    """
    if not abs(latitude_deg) <= 90 or not abs(longitude_deg) <= 360:
        raise UsageError(
            f"expected a latitude of -90 to 90, a longitude of -360 to 360: {latitude_deg}, {longitude_deg}"
        )
    instant = time if time.tzinfo else time.replace(tzinfo=UTC)
    days = (instant - _NOON_2000).total_seconds() / 86400
    declination, right_ascension, mean_longitude = _apparent(days)
    # the mean sun crosses the meridian at twelve; the true sun is early or late by the equation of time
    hour_deg = 360 * (days % 1) + mean_longitude - right_ascension + (longitude_deg if time.tzinfo else 0.0)
    return _horizontal(math.radians(hour_deg), math.radians(declination), math.radians(latitude_deg))


def _apparent(days: float) -> tuple[float, float, float]:
    """Declination, right ascension and mean longitude in degrees, `days` after noon of 1 January 2000."""
    century = days / 36525
    mean_longitude = 280.46646 + 36000.76983 * century
    anomaly = math.radians(357.52911 + 35999.05029 * century)
    centre = (1.914602 - 0.004817 * century) * math.sin(anomaly) + 0.019993 * math.sin(2 * anomaly)
    node = math.radians(125.04 - 1934.136 * century)
    longitude = math.radians(
        mean_longitude + centre + 0.000289 * math.sin(3 * anomaly) - 0.00569 - 0.00478 * math.sin(node)
    )
    tilt = math.radians(23.439291 - 0.0130042 * century + 0.00256 * math.cos(node))
    right_ascension = math.atan2(math.cos(tilt) * math.sin(longitude), math.cos(longitude))
    return (
        math.degrees(math.asin(math.sin(tilt) * math.sin(longitude))),
        math.degrees(right_ascension),
        mean_longitude - 0.0057183,
    )


def _horizontal(hour: float, declination: float, latitude: float) -> tuple[float, float]:
    """Azimuth and elevation in degrees of a body at hour angle `hour`; all arguments in radians."""
    up = math.sin(latitude) * math.sin(declination) + math.cos(latitude) * math.cos(declination) * math.cos(hour)
    north = math.cos(latitude) * math.sin(declination) - math.sin(latitude) * math.cos(declination) * math.cos(hour)
    east = -math.cos(declination) * math.sin(hour)
    return math.degrees(math.atan2(east, north)) % 360, math.degrees(math.atan2(up, math.hypot(east, north)))
