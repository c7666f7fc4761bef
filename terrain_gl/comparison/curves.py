"""Error against triangles: each method's error for a number of triangles, and the triangles it needs for an error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.steps import Progress, drain
from ..camera import Camera
from ..gpu.session import in_session
from ..renderer import Renderer
from ..renderer.methods import BASELINES
from ..renderer.options import near_plane_m
from .baselines import Baseline
from .compare import COMPARED, measured

if TYPE_CHECKING:
    from .pruned import Allocation

BUDGETS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4)  # the curves' points, as parts of the requested number of triangles
EQUAL = 0.02  # numbers of triangles count as equal up to this relative difference
FEWEST = 200  # the smallest number of triangles that is requested from a method


def detail_of(
    renderer: Renderer, camera: Camera, method: str, triangles: int, between: bool = True, **options: Any
) -> dict[str, Any]:
    """Options with which a method draws `triangles` triangles; for a baseline, its best parameters.

    `between`: whether baselines may have vertices between posts.
    """
    tried = details_of(renderer, camera, method, triangles, options.get("near_m"), between)
    return best_detail(renderer, camera, method, tried, **options)


def best_detail(
    renderer: Renderer, camera: Camera, method: str, tried: list[dict[str, Any]], **options: Any
) -> dict[str, Any]:
    """The options among `tried` with the smallest RMS screen error. The renderer forgets its last frame."""
    if len(tried) == 1:
        return tried[0]
    errors = []
    for each in tried:
        renderer.choose(camera, method=method, **each, **options)
        errors.append(drain(renderer.inspector.measure_steps()).rms_px)
    renderer.forget()
    return tried[int(np.argmin(errors))]


def drawable(renderer: Renderer, camera: Camera, triangles: int, **options: Any) -> int:
    """The number of triangles that all methods can draw: `triangles`, or fewer if the map has too few posts."""
    most = renderer.choose(camera, method="full", **options)["triangles"]
    if not 0 < most < triangles:
        return triangles
    counts = []
    for method in COMPARED:
        detail = details_of(renderer, camera, method, most, options.get("near_m"), between=False)[0]
        counts.append(renderer.choose(camera, method=method, **detail, **options)["triangles"])
    return max(1, min(counts))


def curve(
    renderer: Renderer,
    camera: Camera,
    methods: Sequence[str],
    budgets: Sequence[int],
    progress: Progress | None = None,
    between: bool = True,
    **options: Any,
) -> dict[str, list[dict[str, Any]]]:
    """The achieved error of each method at each budget: lists of stats by method. `between` as for `detail_of`."""
    achieved: dict[str, list[dict[str, Any]]] = {method: [] for method in methods}
    for i, triangles in enumerate(budgets):
        for method in methods:
            detail = detail_of(renderer, camera, method, triangles, between, **options)
            achieved[method].append(measured(renderer, camera, method=method, **detail, **options))
        if progress:
            progress((i + 1) / len(budgets))
    return achieved


def pruned_curve(renderer: Renderer, camera: Camera, budgets: Sequence[int], near_m: float | None = None) -> Allocation:
    """The RMS error over posts of the pruned quadtree at each budget: `pruned.pruned_quads`."""
    try:
        from .pruned import pruned_quads
    except ModuleNotFoundError:  # as in the tree that students of the course get
        raise TerrainError("the curve of pruned quadtrees needs terrain_gl.reference, which is not installed") from None
    heightmap = renderer.heightmap
    void = np.isnan(heightmap.heights) if heightmap.voids else None
    near_m = near_plane_m(heightmap, near_m)
    filled = renderer.terrain.filled.astype(np.float64)
    return pruned_quads(filled, heightmap.spacing_m, camera, renderer.size, near_m, budgets, void)[0]


def fewest(
    renderer: Renderer,
    camera: Camera,
    method: str,
    max_error_px: float,
    start: int,
    most: int,
    between: bool = True,
    **options: Any,
) -> dict[str, Any] | None:
    """Stats of the frame with the fewest triangles that *achieves* an error, to within 2 %; None if no frame does.

    The first number that is tried is `start`. It is doubled until it is enough, or is `most`.
    """
    error = f"{options.get('metric') or 'max'}_error_px"

    def holds(triangles: float) -> dict[str, Any] | None:
        for detail in details_of(renderer, camera, method, round(triangles), options.get("near_m"), between):
            stats = measured(renderer, camera, method=method, **detail, **options)
            if stats[error] <= max_error_px:
                return dict(stats)
        return None

    low, high = float(FEWEST), float(start)
    while (best := holds(high)) is None:
        if high >= most:
            return None
        low, high = high, min(2 * high, float(most))
    while high > (1 + EQUAL) * low:
        middle = (low * high) ** 0.5
        stats = holds(middle)
        low, high, best = (low, middle, stats) if stats else (middle, high, best)
    return best


@in_session
def details_of(
    renderer: Renderer, camera: Camera, method: str, triangles: int, near_m: float | None = None, between: bool = True
) -> list[dict[str, Any]]:
    """Options with which a method draws about `triangles` triangles, the best guess first. `between`: see `detail_of`.

    The renderer forgets its last frame.
    """
    if method not in BASELINES:
        return [{"triangles": triangles}]
    renderer.forget()
    baseline = renderer.selectors[method]
    assert isinstance(baseline, Baseline)
    near_m = near_plane_m(renderer.heightmap, near_m)
    found = baseline.candidates(camera, renderer.size, near_m, triangles, between)
    return [{"parameters": parameters} for parameters in found]
