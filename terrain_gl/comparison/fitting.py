"""The best parameters of a baseline for a number of triangles: all candidates are drawn and measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..basics.steps import drain
from ..camera import Camera
from ..renderer import Renderer
from ..renderer.options import near_plane_m
from .baselines import Baseline, Parameters


def candidates(
    renderer: Renderer,
    camera: Camera,
    method: str,
    triangles: int,
    near_m: float | None = None,
    between: bool = True,
) -> list[Parameters]:
    """Parameters with which a baseline draws about `triangles` triangles, the best guess first.

    With `between`, also parameters with vertices between posts, as our own methods have them. The renderer forgets its
    last frame.
    """
    renderer.forget()
    baseline = renderer.selectors[method]
    assert isinstance(baseline, Baseline)
    return baseline.candidates(camera, renderer.size, near_plane_m(renderer.heightmap, near_m), triangles, between)


def best_parameters(
    renderer: Renderer, camera: Camera, method: str, triangles: int, between: bool = True, **options: Any
) -> Parameters:
    """The parameters with the smallest RMS error among those that draw about `triangles` triangles.

    Measures all of them. The renderer forgets its last frame.

    Parameters
    ----------
    method
        "clipmap" or "tessellated".
    between
        Whether vertices may be between posts.
    options
        Other fields of `RenderOptions`, by name.
    """
    return best_of(
        renderer,
        camera,
        method,
        candidates(renderer, camera, method, triangles, options.get("near_m"), between),
        **options,
    )


def best_of(renderer: Renderer, camera: Camera, method: str, tried: list[Parameters], **options: Any) -> Parameters:
    """The parameters with the smallest RMS error among those `tried`."""
    errors = [_rms_px(renderer, camera, method=method, parameters=each, **options) for each in tried]
    renderer.forget()
    return tried[int(np.argmin(errors))]


def _rms_px(renderer: Renderer, camera: Camera, **options: Any) -> float:
    renderer.choose(camera, **options)
    return drain(renderer.inspector.measure_steps()).rms_px
