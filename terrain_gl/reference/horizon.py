"""horizon: how much of the sun and of the sky is visible at each place."""

from collections.abc import Iterator

import numpy as np

from .heightmap import bilinear_heights, normals_of

# sin θ = max over points q ahead of   Δh / √(Δh² + d²),   d the level distance to q


def horizon_sines(
    heights: np.ndarray, posts: np.ndarray, towards: tuple[float, float], spacing_m: tuple[float, float]
) -> np.ndarray:
    """Sine of the horizon's elevation, by marching in quarters of a post; -1 if there is only sky ahead.

    Parameters
    ----------
    posts
        (..., 2) columns and rows of the places.
    towards
        Direction as columns and rows of one step, the larger of them 1 or -1.
    """
    h = heights.astype(np.float64)
    x = posts[..., 0].astype(np.float64)
    y = posts[..., 1].astype(np.float64)
    last_y, last_x = np.array(h.shape) - 1
    own = bilinear_heights(h, x, y)
    slope = np.full(x.shape, -np.inf)
    step_m = float(np.hypot(towards[0] * spacing_m[0], towards[1] * spacing_m[1]))
    for steps in np.arange(0.25, max(h.shape), 0.25):
        at_x = x + steps * towards[0]
        at_y = y + steps * towards[1]
        inside = (at_x >= 0) & (at_x <= last_x) & (at_y >= 0) & (at_y <= last_y)
        rise = bilinear_heights(h, np.clip(at_x, 0, last_x), np.clip(at_y, 0, last_y)) - own
        slope = np.where(inside, np.maximum(slope, rise / (steps * step_m)), slope)
    seen = np.where(np.isinf(slope), 0.0, slope)
    return np.where(np.isinf(slope), -1.0, seen / np.hypot(1, seen))


def windowed_sines(
    windows: tuple[np.ndarray, np.ndarray, np.ndarray],
    posts: np.ndarray,
    towards: tuple[float, float],
    spacing_m: tuple[float, float],
) -> np.ndarray:
    """`horizon_sines` from windows around a page, at the points where a line crosses their columns.

    Parameters
    ----------
    windows
        Heights, shifts and parts inside the map: `pages.windows.PageWindows`.
    posts
        (..., 2) columns and rows of the places, in posts of the first window.
    """
    axis = 0 if abs(towards[0]) >= abs(towards[1]) else 1  # the light's axis; rows take the place of columns
    heights = [h.astype(np.float64).T if axis == 0 else h.astype(np.float64) for h in windows[0]]  # (column, place)
    shift, low, high = (np.roll(each, -axis, 1) for each in (windows[1], windows[2][:, :2], windows[2][:, 2:]))
    along, across = posts[..., axis].astype(np.float64), posts[..., 1 - axis].astype(np.float64)
    side = len(heights[0]) - 1
    slope = np.full(along.shape, -np.inf)
    step_m = float(np.hypot(towards[0] * spacing_m[0], towards[1] * spacing_m[1]))
    on_map = across.clip(low[0, 1], high[0, 1])
    place = np.floor(on_map).astype(int).clip(0, side - 1)
    own = [heights[0][along.astype(int), place + i] for i in (0, 1)]
    own_m = own[0] + (on_map - place) * (own[1] - own[0])
    for k, (window, first) in enumerate(zip(heights, shift, strict=True)):
        for column in range(low[k, 0], high[k, 0] + 1):
            at = column * 2.0**k + first[0]
            if k and shift[k - 1, 0] <= at <= shift[k - 1, 0] + side * 2 ** (k - 1):
                continue  # the finer window has it
            steps = (at - along) * towards[axis]
            crossed = (across + towards[1 - axis] * steps - first[1]) / 2.0**k
            inside = (steps > 0) & (crossed >= low[k, 1] - 0.5) & (crossed < high[k, 1] + 0.5)
            rise_m = np.interp(
                crossed, np.arange(low[k, 1], high[k, 1] + 1), window[column, low[k, 1] : high[k, 1] + 1]
            )
            slope = np.where(inside, np.maximum(slope, (rise_m - own_m) / np.where(inside, steps * step_m, 1)), slope)
    seen = np.where(np.isinf(slope), 0.0, slope)
    return np.where(np.isinf(slope), -1.0, seen / np.hypot(1, seen))


# Share of a disc of radius ρ above a straight horizon, x = (elevation − horizon) / ρ in [−1, 1]:
#   1/2 + (x √(1 − x²) + arcsin x) / π


def disc_share(elevation: np.ndarray, horizon: np.ndarray, radius: float) -> np.ndarray:
    """Share of a disc above a straight horizon; all angles in radians."""
    x = np.clip((np.asarray(elevation) - horizon) / radius, -1, 1)
    return 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi


def middles_of_cells(heights: np.ndarray) -> np.ndarray:
    """Columns and rows of the middles of cells, (rows - 1, cols - 1, 2)."""
    y, x = np.indices((heights.shape[0] - 1, heights.shape[1] - 1)) + 0.5
    return np.stack([x, y], -1)


# E = visible share of the disc × max(n · l, 0)


def sunlit(
    heights: np.ndarray, sun: np.ndarray, radius: float, towards: tuple[float, float], spacing_m: tuple[float, float]
) -> np.ndarray:
    """Visible share of the sun's disc in the middle of each cell, times the cosine, (rows - 1, cols - 1)."""
    horizon = np.arcsin(horizon_sines(heights, middles_of_cells(heights), towards, spacing_m))
    cosine = np.maximum(normals_of(heights, spacing_m) @ np.asarray(sun), 0)
    return disc_share(np.arcsin(sun[2]), horizon, radius) * cosine


# ∫ SG(ω) V(ω) max(n · ω, 0) dω / ∫ SG(ω) dω,   V = 1 above the horizon, 0 below


def skylit(
    heights: np.ndarray, axis: np.ndarray, sharpness: float, spacing_m: tuple[float, float], azimuths: int = 32
) -> tuple[np.ndarray, np.ndarray]:
    """Light from a lobe of the sky for each cell: with the horizons, and with only the cell's own plane as horizon."""
    n = normals_of(heights, spacing_m)
    z = -1 + (np.arange(100) + 0.5) / 50
    got = np.zeros(n.shape[:2])
    of_all = np.zeros(n.shape[:2])
    total = 0.0
    for gaussian, w, seen in _rays(heights, axis, sharpness, spacing_m, z, azimuths):
        cosine = gaussian * np.maximum(n @ w, 0)
        got = got + cosine * seen
        of_all = of_all + cosine
        total = total + gaussian
    return got / total, of_all / total


# A.5   ∫ SG(ω) V(ω) dω / ∫ SG(ω) dω,   both over ω_z > 0


def visible_shares(
    heights: np.ndarray, axis: np.ndarray, sharpness: float, spacing_m: tuple[float, float], azimuths: int = 32
) -> np.ndarray:
    """Visible share of a lobe's light from above the horizontal, without a cosine, by cell (rows - 1, cols - 1)."""
    z = (np.arange(100) + 0.5) / 100
    got = np.zeros((heights.shape[0] - 1, heights.shape[1] - 1))
    total = 0.0
    for gaussian, _, seen in _rays(heights, axis, sharpness, spacing_m, z, azimuths):
        got = got + gaussian * seen
        total = total + gaussian
    return got / total


def _rays(
    heights: np.ndarray,
    axis: np.ndarray,
    sharpness: float,
    spacing_m: tuple[float, float],
    sines: np.ndarray,
    azimuths: int,
) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """For each ray: the lobe's value along it, the ray's direction, and the cells whose horizon is below the ray."""
    middles = middles_of_cells(heights)
    flat = np.sqrt(1 - sines * sines)
    for azimuth in (np.arange(azimuths) + 0.5) * 2 * np.pi / azimuths:
        east, north = np.cos(azimuth), np.sin(azimuth)
        step = np.array([east / spacing_m[0], -north / spacing_m[1]])
        horizon = horizon_sines(heights, middles, tuple(step / np.abs(step).max()), spacing_m)
        for w in np.stack([flat * east, flat * north, sines], -1):
            yield np.exp(sharpness * (w @ np.asarray(axis) - 1)), w, w[2] > horizon


def pack_shares(shares: np.ndarray) -> np.ndarray:
    """Shares (lobes, rows, cols) of 0 to 1, three to a word of ten bits each: (rows, cols, 4) uint32."""
    steps = np.rint(1023 * shares).astype(np.uint32)
    words = np.zeros((*shares.shape[1:], 4), np.uint32)
    for lobe, step in enumerate(steps):
        words[..., lobe // 3] |= step << np.uint32(10 * (lobe % 3))
    return words
