"""A picture of a difference: yours, expected, and the difference. It needs matplotlib, the extra [compare]."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .checking import Finding


def draw(finding: Finding, path: Path) -> bool:
    """Write a PNG of a finding; False if there is nothing to see or no matplotlib."""
    got, want = finding.got, finding.want
    if got is None or want is None or got.size < 2 or got.shape != want.shape:
        return False
    try:
        import matplotlib
    except ImportError:
        return False
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    got, want = shown(got, want)
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), constrained_layout=True)
    panels = {"yours": got, "expected": want, "yours - expected": got - want}
    for ax, (title, values) in zip(axes, panels.items(), strict=True):
        ax.set_title(title)
        if values.ndim == 1:
            ax.plot(values, ".-", linewidth=0.8)
            continue
        largest = np.nanmax(np.abs(got - want), initial=1e-30)
        signed = {"cmap": "RdBu", "vmin": -largest, "vmax": largest} if title.startswith("yours -") else {}
        figure.colorbar(ax.imshow(values, interpolation="nearest", **signed), ax=ax, shrink=0.8)
    figure.suptitle(finding.what)
    figure.savefig(path, dpi=80)
    plt.close(figure)
    return True


def shown(got: np.ndarray, want: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both as curves or as pictures; of more than two axes, the picture with the largest difference."""
    pair = np.stack([np.where(np.isfinite(values), values, np.nan) for values in (got.astype(float), want)])
    unlike = np.where(np.isnan(pair[0]) != np.isnan(pair[1]), np.inf, np.abs(pair[0] - pair[1]))
    worst = list(np.unravel_index(int(np.argmax(np.nan_to_num(unlike, nan=0.0))), got.shape))
    while pair.ndim > 3:
        axis = int(np.argmin(pair.shape[1:]))
        pair = pair.take(worst.pop(axis), axis + 1)
    flat = pair.ndim == 3 and min(pair.shape[1:]) <= 4
    return tuple(values.ravel() if flat else values for values in pair)
