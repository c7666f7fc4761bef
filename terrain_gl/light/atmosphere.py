"""A clear sky from first principles: the sunlight that air and haze scatter towards the eye.

After Hillaire 2020, "A scalable and production ready sky and atmosphere rendering technique". Single scattering is
integrated along each ray. All higher orders are one isotropic term, a geometric series. Lengths are kilometres. The sun
may have any elevation, also below the horizon: then it still lights the upper air.
"""

import math
from functools import cache

import numpy as np

EARTH_KM = 6360.0
TOP_KM = 6460.0
RAYLEIGH = np.array([5.802e-3, 13.558e-3, 33.1e-3])  # scattering per km at sea level: red, green, blue
MIE_SCATTERING = 3.0e-3
MIE_EXTINCTION = 3.4e-3
OZONE = np.array([0.75e-3, 1.25e-3, 0.085e-3])  # absorption per km at 25 km, the densest layer; it makes twilight blue
RAYLEIGH_KM = 8.0  # scale heights: density falls to 1/e
MIE_KM = 1.2
ASYMMETRY = 0.8  # of haze: g of the Henyey-Greenstein phase function
GROUND_ALBEDO = np.array([0.16, 0.165, 0.15])
EYE_KM = 1.0
STEPS = 40  # along a ray
COLOURFULNESS = 0.72  # three wavelengths alone make skies too blue and sunsets too red, so we mix in some grey
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def sunlight(elevation_deg: float) -> np.ndarray:
    """Transmittance of sunlight through the air to the eye, (3,): red, green, blue."""
    h, mu = np.array([EYE_KM]), np.array([math.sin(math.radians(elevation_deg))])
    return _transmittance(h, np.maximum(mu, _horizon(h)))[:, 0]


def sky_radiance(directions: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """Radiance of the clear sky without the sun's disc, for sunlight of irradiance 1 above the atmosphere.

    A ray that meets the ground ends there, and sees the light that the ground reflects. `directions` and the result are
    (rows, columns, 3). All directions of a row have one elevation.
    """
    # in parts, whose arrays fit into the processor's cache
    parts = np.array_split(directions, -(-directions[..., 0].size // _RAYS_AT_ONCE))
    light = np.concatenate([_radiance(part, sun) for part in parts])
    return COLOURFULNESS * light + (1 - COLOURFULNESS) * (light @ LUMINANCE)[..., None]


def spread(count: int) -> np.ndarray:
    """(count, 3) unit vectors, spread evenly over the sphere by the golden angle."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    turn = math.pi * (1 + 5**0.5) * i
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)


# Below, h are heights in km and mu sines of elevations, both of any shape; results per colour are (3, *shape).


def _radiance(directions: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """Radiance along rays, before grey is mixed in. The air along a ray depends on its elevation alone."""
    mu = directions[:, :1, 2]
    cosine = (directions @ sun)[..., None]
    reach, grounded = _reach(EYE_KM, mu)
    s = ((np.arange(STEPS) + 0.5) / STEPS) ** 2  # short steps near the eye, where the air is dense
    widths = np.diff((np.arange(STEPS + 1) / STEPS) ** 2) * reach[..., None]  # (rows, 1, steps)
    t = s * reach[..., None]
    radius = np.sqrt((EARTH_KM + EYE_KM) ** 2 + t * t + 2 * (EARTH_KM + EYE_KM) * mu[..., None] * t)
    mu_sun = np.clip(((EARTH_KM + EYE_KM) * sun[2] + t * cosine) / radius, -1, 1)  # (rows, columns, steps)
    h = np.clip(radius - EARTH_KM, 0, _HEIGHTS)
    extinction = _extinction(h)
    depth = extinction * widths
    along = np.cumsum(depth, -1)
    through = _fall(along - depth) * -np.expm1(-np.minimum(depth, 80)) / np.maximum(extinction, 1e-12)
    light = (_source(h, mu_sun, cosine) * through).sum(-1)
    light = light + grounded * _fall(along[..., -1]) * _ground_light(float(sun[2]))[:, None, None]
    return np.moveaxis(light, 0, -1)


def _source(h: np.ndarray, mu_sun: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """Light scattered towards the eye per km, for sunlight of irradiance 1."""
    g = ASYMMETRY
    forward = (1 - g * g) / (4 * np.pi * np.maximum(1 + g * g - 2 * g * cosine, 1e-6) ** 1.5)
    rayleigh, mie = _scattering(h)
    once = rayleigh * (3 / (16 * np.pi) * (1 + cosine**2)) + mie * forward
    return _transmittance(h, mu_sun) * once + _often(h, mu_sun) * (rayleigh + mie)


def _ground_light(mu_sun: float) -> np.ndarray:
    h, mu = np.zeros(1), np.array([mu_sun])
    return GROUND_ALBEDO / np.pi * (_transmittance(h, mu)[:, 0] * max(mu_sun, 0.0) + np.pi * _often(h, mu)[:, 0])


def _scattering(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scattering per km by air, for each colour, and by haze, the same for all colours."""
    return np.multiply.outer(RAYLEIGH, np.exp(-h / RAYLEIGH_KM)), MIE_SCATTERING * np.exp(-h / MIE_KM)


def _extinction(h: np.ndarray) -> np.ndarray:
    rayleigh, mie = _scattering(h)
    ozone = np.maximum(0, 1 - np.abs(h - 25) / 15)
    return rayleigh + MIE_EXTINCTION / MIE_SCATTERING * mie + np.multiply.outer(OZONE, ozone)


def _fall(depth: np.ndarray) -> np.ndarray:
    return np.exp(-np.minimum(depth, 80))


def _horizon(h: np.ndarray) -> np.ndarray:
    """Sine of the horizon's elevation, seen from a height."""
    return -np.sqrt(np.maximum(0, 1 - (EARTH_KM / (EARTH_KM + h)) ** 2))


def _reach(height_km: float, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length of rays until they meet the ground or leave the atmosphere, and whether they meet the ground."""
    r = EARTH_KM + height_km
    to_top = -r * mu + np.sqrt(np.maximum(0, (r * mu) ** 2 - r * r + TOP_KM**2))
    inside = (r * mu) ** 2 - r * r + EARTH_KM**2
    grounded = (mu < 0) & (inside >= 0)
    to_ground = -r * mu - np.sqrt(np.maximum(0, inside))
    return np.where(grounded, to_ground, to_top), grounded


# --- Tables over height and the sun's elevation, made once -----------------------------------------------------------

_HEIGHTS = TOP_KM - EARTH_KM
_SIZE = (32, 128)  # heights, spaced by square root; sines of elevations, spaced by signed square root
_OFTEN_SIZE = (10, 28)
_RAYS_AT_ONCE = 128


def _transmittance(h: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """Transmittance from outside the atmosphere along a ray with sine of elevation `mu`; 0 through the Earth.

    It falls to 0 over the width of the sun's disc as the disc sets.
    """
    over = (mu - _horizon(h)) / 0.0047
    return _lookup(_transmittance_table(), h, mu) * np.clip(0.5 + 0.5 * over, 0, 1)


def _often(h: np.ndarray, mu_sun: np.ndarray) -> np.ndarray:
    """Isotropic radiance of light that was scattered at least twice."""
    return _lookup(_often_table(), h, mu_sun)


def _axes(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.linspace(0, 1, size[0]), np.linspace(-1, 1, size[1])
    return _HEIGHTS * u * u, v * np.abs(v)


def _lookup(table: np.ndarray, h: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """A table (3, heights, sines), bilinear."""
    rows, cols = table.shape[1:]
    x = np.sqrt(np.clip(h / _HEIGHTS, 0, 1)) * (rows - 1)
    y = (0.5 + 0.5 * np.sign(mu) * np.sqrt(np.abs(mu))) * (cols - 1)
    i, j = np.minimum(x.astype(int), rows - 2), np.minimum(y.astype(int), cols - 2)
    at = i * cols + j
    s = x - i
    t = y - j
    a, b, c, d = (np.take(table.reshape(3, -1), at + beside, 1) for beside in (0, 1, cols, cols + 1))
    low, high = a + (b - a) * t, c + (d - c) * t
    return low + (high - low) * s


@cache
def _transmittance_table() -> np.ndarray:
    h, mu = np.meshgrid(*_axes(_SIZE), indexing="ij")
    mu = np.maximum(mu, _horizon(h))  # below the horizon, use the value at the horizon
    r = EARTH_KM + h
    reach = -r * mu + np.sqrt(np.maximum(0, (r * mu) ** 2 - r * r + TOP_KM**2))
    depth = np.zeros((3, *h.shape))
    steps = 60
    for k in range(steps):
        t = reach * ((k + 0.5) / steps) ** 2
        height = np.sqrt(r * r + t * t + 2 * r * mu * t) - EARTH_KM
        depth += _extinction(np.clip(height, 0, _HEIGHTS)) * (reach * (2 * k + 1) / steps**2)
    return _fall(depth)


@cache
def _often_table() -> np.ndarray:
    """Hillaire's geometric series: each time, a share f of the light L is scattered again; the sum is L / (1 - f)."""
    heights, mus = _axes(_OFTEN_SIZE)
    rays, steps = spread(40), 20
    z = rays[:, 2]
    table = np.zeros((3, *_OFTEN_SIZE))
    for row, height in enumerate(np.minimum(heights, _HEIGHTS - 0.1)):
        reach, grounded = _reach(height, z)
        t = (np.arange(steps) + 0.5) / steps * reach[:, None]
        radius = np.sqrt((EARTH_KM + height) ** 2 + t * t + 2 * (EARTH_KM + height) * z[:, None] * t)
        h = np.clip(radius - EARTH_KM, 0, _HEIGHTS)
        depth = np.cumsum(_extinction(h) * (reach / steps)[:, None], -1)
        rayleigh, mie = _scattering(h)
        share = _fall(depth) * (rayleigh + mie) * (reach / steps)[:, None]
        again = share.sum(-1).mean(-1)
        for column, mu in enumerate(mus):
            sun = np.array([math.sqrt(1 - mu * mu), 0, mu])
            mu_sun = np.clip(((EARTH_KM + height) * mu + t * (rays @ sun)[:, None]) / radius, -1, 1)
            once = (share * _transmittance(h, mu_sun)).sum(-1) / (4 * np.pi)
            floor = _transmittance(np.zeros(1), np.array([mu])) * max(mu, 0.0) * GROUND_ALBEDO[:, None] / np.pi
            once = once + grounded * _fall(depth[..., -1]) * floor
            table[:, row, column] = once.mean(-1) / (1 - again)
    return table
