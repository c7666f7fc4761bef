"""A whole state of the window as JSON: camera, options of each side, frozen levels. Bookmarks and lectures hold states.

    {"view": "first", "sides": [{"style": "lod", "max_error_px": 2}], "divider": 0.5, "frozen": null, "sums": false}

A view is a name of `files.views.VIEWS`, "first" for the map's own, or the numbers of a pose. Options that a side does
not name have their defaults; but the sun is that of the map, and the look stays.
"""

from dataclasses import asdict
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..camera import Camera
from ..files.views import VIEWS
from ..renderer.options import FrameOptions
from .explainer import Explainer
from .pose import Pose
from .scene import Scene

FIRST = "first"  # the view of the map itself
_KEYS = {"view", "sides", "divider", "swapped", "centred", "frozen", "sums"}
_OPTIONS = (
    *("style", "method", "metric", "max_error_px", "triangles", "wires", "error_scale_px", "contour_m", "water_m"),
    *("sun", "haze", "look", "voids", "surroundings", "grain", "sky", "material", "occlusion"),
)


def state_of(scene: Scene) -> dict[str, Any]:
    """The present state."""
    settings = scene.settings
    plain = FrameOptions()
    sides = [
        {name: value for name in _OPTIONS if (value := getattr(side, name)) != getattr(plain, name)}
        for side in settings.sides
    ]
    frozen = asdict(scene.true_pose(Pose.of(scene.frozen))) if scene.frozen else None
    state = {"view": asdict(scene.true_pose(scene.controller.pose)), "sides": sides, "frozen": frozen}
    chosen = {name: True for name in ("swapped", "centred") if getattr(settings, name)}
    return state | chosen | {"divider": settings.divider, "sums": settings.sums}


def checked(state: Any, where: str) -> dict[str, Any]:
    """The state, if it can be shown; else a `UsageError` that begins with `where` and names what is wrong."""
    if not isinstance(state, dict) or (unknown := sorted(set(state) - _KEYS)):
        known = ", ".join(sorted(_KEYS))
        raise UsageError(f"{where}: expected a state with {known}, got {unknown if isinstance(state, dict) else state}")
    sides = state.get("sides", [{}])
    if not isinstance(sides, list) or len(sides) not in (1, 2):
        raise UsageError(f"{where}: expected one or two sides, got {sides}")
    try:
        for side in sides:
            _options(side, FrameOptions())
        for view in (state.get("view", FIRST), state.get("frozen") or FIRST):
            if not isinstance(view, str):
                _ = Pose.read(view).camera
            elif view not in (FIRST, *VIEWS):
                raise UsageError(f"view: expected one of {', '.join((FIRST, *VIEWS))}, got {view!r}")
        if not 0 < float(state.get("divider", 0.5)) < 1:
            raise UsageError(f"divider: expected a number between 0 and 1, got {state['divider']}")
    except (TerrainError, TypeError, ValueError, KeyError) as error:
        raise UsageError(f"{where}: {error}") from None
    return state


def apply(scene: Scene, explainer: Explainer, state: dict[str, Any], travels: bool = True) -> None:
    """Show a state. The camera travels to its view, or jumps there if not `travels`."""
    settings = scene.settings
    base = FrameOptions(sun=scene.opened.sun, look=settings.options.look)
    explainer.take_sides([_options(side, base) for side in state.get("sides", [{}])])
    settings.divider = state.get("divider", 0.5)
    settings.swapped, settings.centred = bool(state.get("swapped")), bool(state.get("centred"))
    settings.sums = bool(state.get("sums"))
    frozen = state.get("frozen")
    scene.frozen = _camera(scene, frozen) if frozen else None
    pose = Pose.of(_camera(scene, state.get("view", FIRST)))
    if travels:
        scene.controller.travel_to(pose)
    else:
        scene.controller.pose = pose


def _camera(scene: Scene, view: Any) -> Camera:
    if not isinstance(view, str):
        return scene.drawn_pose(Pose.read(view)).camera
    named = scene.opened.camera if view == FIRST else VIEWS[view](scene.heightmap.coarse(), 45.0)
    return scene.of_view(named)


def _options(side: dict[str, Any], base: FrameOptions) -> FrameOptions:
    if unknown := sorted(set(side) - set(_OPTIONS)):
        raise UsageError(f"options of a side: {', '.join(_OPTIONS)}; got {', '.join(unknown)}")
    return base.otherwise(**{name: tuple(v) if isinstance(v, list) else v for name, v in side.items()})
