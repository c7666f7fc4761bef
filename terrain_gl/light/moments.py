"""Integrals of the sky's lobes that do not depend on the map: glsl/horizon/fold.comp looks them up."""

from __future__ import annotations

import math

import numpy as np

SINES = 256  # steps of the tables over the horizon's sine, from -1 to 1
COSINES = 64  # steps over n · axis, the cosine between the ground's normal and a lobe's axis
Direction = tuple[float, float]


def sector_moments(
    axes: np.ndarray, sharpness: np.ndarray, directions: list[Direction], spacing_m: tuple[float, float]
) -> np.ndarray:
    """Moments of the lobes in each sector of azimuths, over directions above a horizon: M of glsl/horizon/fold.comp.

    (sectors, SINES + 1, K, 4): ∫ SG ω dω, then ∫ SG dω, over that part of the sector, each divided by the lobe's whole
    integral. The second axis is the horizon's sine, from -1 to 1.
    """
    azimuth = np.array([math.atan2(-y * spacing_m[1], x * spacing_m[0]) for x, y in directions])
    width = np.diff(np.append(azimuth, azimuth[0])) % (2 * np.pi)  # to the next sector's middle
    begin, end = azimuth - np.roll(width, 1) / 2, azimuth + width / 2
    across = (np.arange(16) + 0.5) / 16
    up = 2
    phi = begin[:, None] + (end - begin)[:, None] * across
    z = -1 + (np.arange(SINES * up) + 0.5) * 2 / (SINES * up)
    flat = np.sqrt(1 - z * z)[None, :, None]
    w = np.stack(np.broadcast_arrays(flat * np.cos(phi[:, None]), flat * np.sin(phi[:, None]), z[:, None]), -1)
    lobe = np.exp(sharpness * (w @ axes.T - 1))  # (sectors, sines, across, K)
    area = ((end - begin) / 16)[:, None, None] * 2 / (SINES * up)
    moment = np.concatenate([np.einsum("azpk,azpc->azkc", lobe, w), lobe.sum(2)[..., None]], -1) * area[..., None]
    moment = moment.reshape(len(directions), SINES, up, -1, 4).sum(2)
    above = np.cumsum(moment[:, ::-1], 1)[:, ::-1]
    above = np.concatenate([above, np.zeros_like(above[:, :1])], 1)
    return above / above[:, 0, :, 3].sum(0)[:, None]


def open_shares(sharpness: np.ndarray) -> np.ndarray:
    """C of glsl/horizon/fold.comp: ∫ SG ⟨n, ω⟩ dω / ∫ SG dω for n · axis from -1 to 1, (K, COSINES + 1).

    n is the normal of the ground, and ⟨n, ω⟩ = max(0, n · ω).
    """
    x = -1 + (np.arange(256) + 0.5) / 128
    phi = (np.arange(64) + 0.5) * np.pi / 64
    cosine = np.linspace(-1, 1, COSINES + 1)[:, None, None]
    aside = np.sqrt(1 - cosine * cosine) * np.sqrt(1 - x * x)[:, None] * np.cos(phi)
    seen = np.maximum(cosine * x[:, None] + aside, 0).mean(2)  # mean over the circle at angle acos x from the axis
    lobe = np.exp(np.multiply.outer(sharpness, x - 1))
    return np.einsum("kx,cx->kc", lobe, seen) / lobe.sum(1)[:, None]
