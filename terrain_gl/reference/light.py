"""light: spherical Gaussians, merged lobes and what the ground reflects."""

import math

import numpy as np

from .heightmap import normals_of

# A spherical Gaussian of axis μ, sharpness λ and amplitude a; directions are unit vectors:
#   SG(ω) = a e^{λ (ω · μ − 1)}
# ∫ SG dω = 2π (1 − e^{−2λ}) / λ   for a = 1


def sg_integral(sharpness: float) -> float:
    """Integral over the sphere of a Gaussian of amplitude 1 (Wang et al. 2009)."""
    return 4 * np.pi if sharpness == 0 else -2 * np.pi * np.expm1(-2 * sharpness) / sharpness


# SG₁ SG₂ = e^{s − λ₁ − λ₂} · e^{s (ω · μ − 1)},   s μ = λ₁ μ₁ + λ₂ μ₂,   |μ| = 1


def sg_product(
    axis: np.ndarray, sharpness: float, other_axis: np.ndarray, other_sharpness: float
) -> tuple[np.ndarray, float, float]:
    """Axis, sharpness and amplitude of the product of two Gaussians of amplitude 1."""
    s = sharpness * np.asarray(axis, float) + other_sharpness * np.asarray(other_axis, float)
    product = float(np.linalg.norm(s))
    return s / product, product, float(np.exp(product - sharpness - other_sharpness))


# A von Mises-Fisher lobe of sharpness κ has a mean vector of length   r = coth κ − 1/κ


def mean_length(sharpness: float) -> float:
    """Length of the mean vector of a von Mises-Fisher lobe."""
    k = sharpness
    return k / 3 - k**3 / 45 if k < 1e-3 else 1 / np.tanh(k) - 1 / k


def sharpness_of_length(length: float) -> float:
    """Sharpness of the lobe with a mean vector of this length: the inverse of `mean_length`, by bisection.

    Equation C.1 of the paper is within 5 % of it.
    """
    low, high = 0.0, 1e9
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_length(middle) < length else (low, middle)
    return 0.5 * (low + high)


# C.1   κ = (3 r − r³) / (1 − r²)


def cubic_length(sharpness: float) -> float:
    """Length r that equation C.1 gives this sharpness for: its one root from 0 to 1."""
    roots = np.roots([1.0, -sharpness, -3.0, sharpness])
    return float(next(root.real for root in roots if abs(root.imag) < 1e-9 and 0 <= root.real < 1))


def cubic_sharpness(length: float) -> float:
    """Sharpness that equation C.1 gives a mean vector of this length."""
    return (3 * length - length**3) / (1 - length**2)


# B.3   ρ_n = mean of 1.170 e^{2.133 (ω · n − 1)} = W mean of vMF(ω; n, 2.133)   ≈ W vMF(ω; r_M)   (C.1 to C.4)


def printed_diffuse(axis: np.ndarray, sharpness: float, mean_normal: np.ndarray) -> float:
    """Radiance of white ground under a Gaussian of amplitude 1, as the supplement prints it: B.3 times the BRDF's 1/π.

    Parameters
    ----------
    mean_normal
        (3,) mean of the footprint's unit normals.
    """
    r = cubic_length(2.133) * np.asarray(mean_normal, float)
    length = float(np.linalg.norm(r))
    merged_sharpness = cubic_sharpness(length)
    _, product, amplitude = sg_product(axis, sharpness, r / length, merged_sharpness)
    weight = 1.170 * sg_integral(2.133) / sg_integral(merged_sharpness)
    return weight * amplitude * sg_integral(product) / np.pi


# C.3   r = Σ w_i r_i / Σ w_i


def merged(r: np.ndarray, weights: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Axis and sharpness of one lobe that replaces many: its mean vector is the average of all r, (n, 3)."""
    mean = np.average(np.asarray(r, float), axis=0, weights=weights)
    length = float(np.linalg.norm(mean))
    return mean / length, sharpness_of_length(length)


# Mean of max(l · n, 0) over normals n of mean vector r, c = l · r:
#   (c + w)² / 4w   for |c| < w,   max(c, 0)   else,   w(r) fitted


def cosine_mean(c: float, r: float) -> float:
    """Mean cosine between a direction and normals whose mean vector has length r and component c along it."""
    w = 0.5 + 0.5 * np.sqrt(1 - 4 / 3 * r * r) if r < 0.75 else np.sqrt(3 * r * (1 - r))
    return max(c, 0.0) if abs(c) >= w else (c + w) ** 2 / (4 * w)


# The half-vector's lobe (μ, λ) mirrors light from   μ_i = 2 (μ · o) μ − o,   λ_i = λ / (4 |μ · o|)   (Wang et al. 2009)


def reflection_lobe(axis: np.ndarray, sharpness: float, towards_eye: np.ndarray) -> tuple[np.ndarray, float]:
    """Axis and sharpness of the light that a lobe of half-vectors mirrors to the eye at `towards_eye`."""
    slant = float(np.dot(axis, towards_eye))
    return 2 * slant * np.asarray(axis) - towards_eye, sharpness / (4 * max(abs(slant), 0.05))


# A facet of slope s fills max(o_z − o_h · s, 0) of the picture (Dupuy 2013). With Gaussian slopes of variance σ²:
#   W = |o_h| σ (t Φ(t) + φ(t)),   t = (o_z − o_h · s̄) / (|o_h| σ),   lean = o_h Φ(t) / W


def lean(slope: np.ndarray, variance: float, towards_eye: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean weight W and lean of the facets that an eye sees: slope s weighs about W (1 − lean · (s − slope))."""
    across = float(np.hypot(*towards_eye[:2])) * variance**0.5
    t = float(towards_eye[2] - towards_eye[:2] @ slope) / across
    share = 0.5 * (1 + math.erf(t / 2**0.5))
    weight = across * (t * share + math.exp(-0.5 * t * t) / (2 * np.pi) ** 0.5)
    return weight, towards_eye[:2] * share / weight


def lobe_values(heights: np.ndarray, spacing_m: tuple[float, float], albedo: float, roughness: float) -> np.ndarray:
    """Values under the tables of merged lobes for ground of one material: (9, rows, cols) of blocks of 2 × 2 cells.

    Mean normal times albedo, mean vector of the half-vectors, albedo of three colours.
    """
    normals = normals_of(heights, spacing_m)
    rows, cols = (-(-n // 2) for n in normals.shape[:2])
    padded = np.full((2 * rows, 2 * cols, 3), np.nan)
    padded[: normals.shape[0], : normals.shape[1]] = normals
    mean = np.nanmean(padded.reshape(rows, 2, cols, 2, 3), axis=(1, 3)).transpose(2, 0, 1)
    length = mean_length(2 / roughness**4)
    return np.concatenate([albedo * mean, length * mean, np.full((3, rows, cols), albedo)])


def box_mean(values: np.ndarray, a: np.ndarray, c: np.ndarray) -> float:
    """Mean of texels (rows, cols) over any box from a to c, (column, row); weights are their areas inside the box."""

    def weights(low: float, high: float, count: int) -> np.ndarray:
        i = np.arange(count)
        return np.clip(np.minimum(high, i + 1) - np.maximum(low, i), 0, 1)

    across, down = (weights(a[i], c[i], values.shape[1 - i]) for i in (0, 1))
    return float(down @ values @ across / (down.sum() * across.sum()))
