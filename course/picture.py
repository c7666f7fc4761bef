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

    got, want = (_flat(values.astype(float)) for values in (got, want))
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


def _flat(values: np.ndarray) -> np.ndarray:
    """Values as a curve or as a picture."""
    values = np.where(np.isfinite(values), values, np.nan)
    if values.ndim > 2:
        values = values.reshape(*values.shape[:2], -1)[..., 0] if min(values.shape[:2]) > 4 else values.ravel()
    return values.ravel() if values.ndim == 2 and min(values.shape) <= 4 else values
