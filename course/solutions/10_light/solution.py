"""Lesson 10: the light of a footprint, from mean vectors.

A lobe is a von Mises-Fisher distribution of unit vectors: an axis, and a sharpness κ. Its mean vector is the axis times
A(κ) = coth κ − 1/κ, between 0 (all directions alike) and 1 (one direction).
"""

import numpy as np


def mean_length(kappa):
    """10.1 A(κ), for κ from 0 to a million, without loss of digits near 0.

    kappa     (n,) numbers
    returns   (n,)
    """
    # solution
    k = np.asarray(kappa, float)
    small = k < 0.01
    safe = np.where(small, 1.0, k)
    return np.where(small, k / 3 - k**3 / 45, 1 / np.tanh(safe) - 1 / safe)
    # end


def kappa_of(length):
    """10.2 The sharpness with A(κ) = length, by bisection or as you like.

    length    (n,) from 0.001 to 0.999
    returns   (n,), so exact that A(κ) is within 1e-9 of the length
    """
    # solution
    low, high = np.full(np.shape(length), -20.0), np.full(np.shape(length), 20.0)
    for _ in range(80):
        middle = 0.5 * (low + high)
        under = mean_length(2.0**middle) < length
        low, high = np.where(under, middle, low), np.where(under, high, middle)
    return 2.0**low
    # end


def mean_normals(normals, boxes):
    """10.3 The mean vector of the normals of each footprint, by a summed-area table of each component.

    normals   (rows, cols, 3) unit vectors
    boxes     (n, 4) x0, y0, x1, y1, ends excluded
    returns   (n, 3); shorter than 1 where the normals differ
    """
    # solution
    table = np.pad(normals.cumsum(0).cumsum(1), ((1, 0), (1, 0), (0, 0)))
    x0, y0, x1, y1 = boxes.T
    sums = table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]
    return sums / ((x1 - x0) * (y1 - y0))[:, None]
    # end


def diffuse(mean, light, albedo):
    """10.4 The mean of albedo · n·l over a footprint whose normals all face the light.

    mean      (n, 3) mean vectors
    light     (3,) unit vector towards the light
    returns   (n,)
    """
    # solution
    return albedo * (mean @ light)
    # end


def merged_kappa(mean, kappa):
    """10.5 The sharpness of a footprint's highlight.

    Each place has a lobe of sharpness κ around its normal. The footprint gets the one lobe that has the same mean
    vector as all these lobes together.

    mean      (n, 3) mean vectors of normals
    kappa     the material's sharpness, a number
    returns   (n,)
    """
    # solution
    return kappa_of(np.linalg.norm(mean, axis=1) * mean_length(np.array([kappa]))[0])
    # end


def furnace_scale(amplitude, sharpness):
    """10.6 The factor with which a Gaussian, in place of the cosine, passes the furnace test.

    The Gaussian is amplitude · exp(sharpness (ω·n − 1)) over the whole sphere. Under a white sky it must receive π, as
    the cosine does.
    """
    # solution
    return sharpness / (2 * amplitude * (1 - np.exp(-2 * sharpness)))
    # end
