"""Packed errors and heights: numpy twins of the functions of glsl/error/nodes.glsl."""

import numpy as np

ERROR_UNIT = 2.0**-8  # unit of errors in a record, as a fraction of the span
MOST_SPANS = 64  # heights may lie in so many spans: `terrain.units_hold`
STEPS = 65535  # heights are stored as steps of 16 bits


def pack_16(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Words of two 16-bit numbers."""
    return low.astype(np.uint32) | high.astype(np.uint32) << np.uint32(16)


def unpack_16(words: np.ndarray) -> np.ndarray:
    """The two 16-bit numbers of each word, (2, …) uint16: the low one first."""
    return np.stack([words & np.uint32(0xFFFF), words >> np.uint32(16)]).astype(np.uint16)


def pack_pair(errors_m: tuple[np.ndarray, np.ndarray], span_m: float) -> np.ndarray:
    """Words of two errors in metres, as half floats, rounded up."""
    low, high = (_half_up(np.asarray(error) / (span_m * ERROR_UNIT)) for error in errors_m)
    return pack_16(low, high)


def unpack_pair(words: np.ndarray) -> np.ndarray:
    """The two errors of each word, (2, …) float16: units of span · `ERROR_UNIT`."""
    return unpack_16(words).view(np.float16)


def _half_up(values: np.ndarray) -> np.ndarray:
    values = np.where(values > 0, np.maximum(values * (1 + 2.0**-20), 2.0**-14), 0.0)
    halves = values.astype(np.float16)
    bits = halves.view(np.uint16)
    return np.where(halves.astype(np.float64) < values, bits + 1, bits)


def pack_range(low_m: np.ndarray, high_m: np.ndarray, least_m: float, span_m: float) -> np.ndarray:
    """Lowest and highest heights, (2, …) uint16: steps of a quantisation range from `least_m` on, rounded outwards."""
    low, high = ((np.clip(h, -1e9, 1e9) - least_m) / span_m * STEPS for h in (low_m, high_m))
    outward = np.floor(low - 0.1).clip(0, STEPS - 1), np.ceil(high + 0.1).clip(1, STEPS)
    return np.stack(outward).astype(np.uint16)


def square_up(share: np.ndarray) -> np.ndarray:
    """Squared errors, float32 fractions of span², as 64-bit fixed-point numbers, rounded up."""
    s = share * np.float32(8) * np.float32(1 + 2.0**-18)
    high = np.floor(s)
    high = np.minimum(high, np.float32(4294967040.0))
    fixed = ((s - high) * np.float32(2.0**32)).astype(np.uint64) + (high.astype(np.uint64) << np.uint64(32))
    return np.where(share == 0, np.uint64(0), fixed + np.uint64(1))
