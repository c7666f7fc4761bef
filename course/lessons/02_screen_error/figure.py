"""Figure of lesson 2: how many times K δ / distance is too small, over the picture."""

import sys

import numpy as np
from matplotlib import pyplot as plt


def ratio(pitch_deg, x, y):
    """Exact shift of a small rise, divided by K δ / distance, at the place (x/z, y/z) of the picture."""
    up, forward = np.cos(np.radians(pitch_deg)), np.sin(np.radians(pitch_deg))
    return np.hypot(x * forward, up - y * forward) * np.sqrt(1 + x * x + y * y)


def main(path):
    """Draw the ratio for three cameras."""
    tan_y = np.tan(np.radians(30))
    x, y = np.meshgrid(np.linspace(-1, 1, 320) * tan_y * 16 / 9, np.linspace(1, -1, 180) * tan_y)
    figure, axes = plt.subplots(1, 3, figsize=(12, 2.9), constrained_layout=True)
    for ax, pitch_deg in zip(axes, (0, -20, -45), strict=True):
        values = ratio(pitch_deg, x, y)
        shown = ax.imshow(values, cmap="RdBu_r", vmin=0, vmax=2, extent=(0, 1280, 720, 0))
        ax.contour(values[::-1], [1.0], colors="k", linewidths=0.8, extent=(0, 1280, 720, 0))
        ax.set_title(f"pitch {pitch_deg}°: from {values.min():.2f} to {values.max():.2f}")
    figure.colorbar(shown, ax=axes, label="exact / (K δ / distance)")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
