"""A whole state of the window as JSON: camera, options of each side, frozen levels. Bookmarks and lectures hold states.

    {"view": "first", "layers": [{"path": "way.gpx", "shown": true, "colour": "#ff4632"}],
     "sides": [{"style": "lod", "max_error_px": 2}], "divider": 0.5, "frozen": null, "sums": false}

A view is a name of `files.views.VIEWS`, "first" for the map's own, the numbers of a pose, or a place near a view:
{"from": "first", "ahead": 0.1, "up": 0.2, "elevation_deg": -20}, by sides of the map. Options that a side does not name
have their defaults; but the sun is that of the map, and the look stays.
"""

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..camera import Camera
from ..files.views import FOV_DEG, VIEWS
from ..heightmap import ground_m
from ..renderer.options import FrameOptions
from ..renderer.overlay import read_paint
from .explainer import Explainer
from .layers import Layers
from .pose import Pose, vector
from .scene import FrameSpec, Scene

FIRST = "first"  # the view of the map itself
_KEYS = {"view", "layers", "sides", "divider", "swapped", "centred", "frozen", "sums"}
_BESIDE = {"from", "ahead", "up", "elevation_deg"}
_OPTIONS = (
    *("style", "method", "metric", "max_error_px", "triangles", "wires", "error_scale_px", "contour_m", "water_m"),
    *("sun", "haze", "look", "voids", "surroundings", "grain", "sky", "material", "occlusion"),
)


def state_of(scene: Scene, layers: Layers) -> dict[str, Any]:
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
    return state | {"layers": layers.state} | chosen | {"divider": settings.divider, "sums": settings.sums}


def checked(state: object, where: str) -> dict[str, Any]:
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
            if isinstance(view, dict) and "from" in view:
                if unknown := sorted(set(view) - _BESIDE):
                    raise UsageError(f"view: expected {', '.join(sorted(_BESIDE))}, got {', '.join(unknown)}")
                _ = [float(view[name]) for name in set(view) - {"from"}]
                view = view["from"]
            if not isinstance(view, str):
                _ = Pose.read(view).camera
            elif view not in (FIRST, *VIEWS):
                raise UsageError(f"view: expected one of {', '.join((FIRST, *VIEWS))}, got {view!r}")
        for layer in state.get("layers", []):
            read_paint(str(layer["colour"]))
            if not isinstance(layer["path"], str):
                raise UsageError(f"layers: expected a path, got {layer['path']}")
        if not 0 < float(state.get("divider", 0.5)) < 1:
            raise UsageError(f"divider: expected a number between 0 and 1, got {state['divider']}")
    except (TerrainError, TypeError, ValueError, KeyError) as error:
        raise UsageError(f"{where}: {error}") from None
    return state


def apply(scene: Scene, explainer: Explainer, layers: Layers, state: dict[str, Any], travels: bool = True) -> None:
    """Show a state. The camera travels to its view, or jumps there if not `travels`."""
    settings = scene.settings
    explainer.take_sides(_sides(scene, state))
    settings.divider = state.get("divider", 0.5)
    settings.swapped, settings.centred = bool(state.get("swapped")), bool(state.get("centred"))
    settings.sums = bool(state.get("sums"))
    layers.restore(state.get("layers"))
    scene.frozen = _frozen(scene, state)
    pose = _pose(scene, state)
    if travels:
        scene.controller.travel_to(pose)
    else:
        scene.controller.pose = pose


def spec_of(scene: Scene, state: dict[str, Any]) -> FrameSpec:
    """The picture that a state will show; the size is that of the window now."""
    sides = [side.otherwise(exaggeration=scene.exaggeration) for side in _sides(scene, state)]
    return scene.spec_of(scene.controller.camera_at(_pose(scene, state)), sides, _frozen(scene, state))


def _sides(scene: Scene, state: dict[str, Any]) -> list[FrameOptions]:
    base = FrameOptions(sun=scene.opened.sun, look=scene.settings.options.look)
    return [_options(side, base) for side in state.get("sides", [{}])]


def _frozen(scene: Scene, state: dict[str, Any]) -> Camera | None:
    frozen = state.get("frozen")
    return camera_of(scene, frozen) if frozen else None


def _pose(scene: Scene, state: dict[str, Any]) -> Pose:
    return Pose.of(camera_of(scene, state.get("view", FIRST)))


def camera_of(scene: Scene, view: Any) -> Camera:
    """The camera of a view, over the land as drawn."""
    if isinstance(view, dict) and "from" in view:
        return _beside(scene, **view)
    if not isinstance(view, str):
        return scene.drawn_pose(Pose.read(view)).camera
    named = scene.opened.camera if view == FIRST else VIEWS[view](scene.heightmap.coarse(), FOV_DEG)
    return scene.of_view(named)


def _beside(
    scene: Scene, ahead: float = 0.0, up: float = 0.0, elevation_deg: float | None = None, **view: Any
) -> Camera:
    """A camera that stands before and above another one, by sides of the map; never under the ground."""
    pose, heightmap = Pose.of(camera_of(scene, view["from"])), scene.heightmap
    side_m, azimuth = max(heightmap.extent_m), np.radians(pose.azimuth_deg)
    eye = np.add(pose.eye, side_m * np.array([ahead * np.sin(azimuth), ahead * np.cos(azimuth), up]))
    ground = scene.exaggeration * ground_m(heightmap, eye[None, :2])[0]
    eye[2] = np.fmax(eye[2], ground + 0.01 * side_m)
    tilt_deg = pose.elevation_deg if elevation_deg is None else elevation_deg
    return replace(pose, eye=vector(eye), elevation_deg=tilt_deg).camera


def _options(side: dict[str, Any], base: FrameOptions) -> FrameOptions:
    if unknown := sorted(set(side) - set(_OPTIONS)):
        raise UsageError(f"options of a side: {', '.join(_OPTIONS)}; got {', '.join(unknown)}")
    return base.otherwise(**{name: tuple(v) if isinstance(v, list) else v for name, v in side.items()})
