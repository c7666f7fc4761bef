"""From the record of a command to its scene: the map, the camera, and the options of the picture with their sun."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import UsageError
from ..basics.steps import drain
from ..camera import Camera, Vector
from ..files import maps
from ..files.furniture import Stamp, furniture, land_ahead_m
from ..files.views import depth_below_ground, drawn_near, look_at, stand_at, standard_sun, standard_view
from ..heightmap import Heightmap
from ..light.lighting import check_room, ramp_seen
from ..light.ramps import LOOKS as RAMPS
from ..light.ramps import Ramp, Values, ramp_for
from ..light.sun import sun_position
from ..renderer import Renderer
from ..renderer.options import FrameOptions
from ..store import cache
from . import overlays, report, stores
from .records import CameraOptions, DrawOptions, LaidOptions, SunOptions


@dataclass(frozen=True)
class CommandScene:
    """The map, the camera and the options of the picture."""

    heightmap: Heightmap
    seen: Heightmap  # the map, or a coarse level of a store, which is quick to read as a whole
    camera: Camera
    frame: FrameOptions

    def view(self, **changes: object) -> dict[str, Any]:
        """Keyword arguments of `Renderer.render`; `changes` replace options of the frame."""
        return {"camera": self.camera} | vars(self.frame) | changes

    @property
    def ramp(self) -> tuple[Ramp | None, str]:
        """The ramp that the picture shows, and the unit of its numbers."""
        frame = self.frame
        if frame.shading.is_lit and frame.drape:
            return ramp_seen(Values(frame.drape, frame.ramp, frame.ramp_range), self.heightmap.georeference), ""
        if frame.shading.is_lit and frame.look in RAMPS:
            return ramp_for(*self.heightmap.range_m, frame.look, frame.ramp_range), frame.units
        return None, ""

    def stamps(self, asked: LaidOptions, size: tuple[int, int]) -> list[Stamp]:
        """Stamps to draw over a picture of `size`; none without `--furniture`."""
        if not asked.furniture:
            return []
        title = Path(self.heightmap.name).stem if asked.title is None else asked.title
        ahead_m = land_ahead_m(self.seen, self.camera)
        return furniture(size, self.camera, ahead_m, title, *self.ramp, self.heightmap.north_deg, self.frame.units)

    def pose(self, size: tuple[int, int]) -> dict[str, Any]:
        """The camera of a picture of `size`, and its sun, for JSON: docs/stats.md."""
        camera, factor = self.camera, self.frame.exaggeration
        # (x, y, z) is drawn at (x, y, factor · z); `over_exaggerated` gives the same picture, factor times as small
        intrinsics, turn, offset = camera.over_exaggerated(factor).matrices(size)
        if camera.is_orthographic:  # then K has pixels per metre
            intrinsics[:2, :2] /= factor
        matrices = {"K": intrinsics.tolist(), "R": turn.tolist(), "t": (factor * offset).tolist()}
        told: dict[str, Any] = {"eye": list(camera.eye), "target": list(camera.target), "fov_deg": camera.fov_deg}
        told["projection"] = "orthographic" if camera.is_orthographic else "perspective"
        return told | matrices | {"sun": list(self.frame.sun)}


def open_scene(asked: DrawOptions, progress: Callable[[float], None] | None = None) -> CommandScene:
    """Open the map, by file or bundled name, and choose camera and sun by the options.

    A bundled map brings default scales, view and sun. For other maps, `files.views` computes a default view and sun.
    """
    output = asked.output
    report.check_outputs(
        (output.path, output.json, output.facts_beside(output.path)), [*maps.files_read(asked.map.name), *asked.files]
    )
    if asked.light.time is None and asked.light.latitude is not None:
        raise UsageError("--latitude needs --time: give both, or --sun")
    heightmap, known = stores.opened(asked, progress)
    seen = heightmap.coarse()
    scene = _scene(asked, heightmap, seen, known)
    if (below_m := depth_below_ground(seen, scene.camera)) > 0:
        report.note(f"the eye is {below_m:.3g} m under the ground: give --eye more height")
    return scene


def open_scene_or_sample(
    asked: DrawOptions, progress: Callable[[float], None] | None = None
) -> tuple[CommandScene, str]:
    """Open the scene, or a coarse sample of a raster that is too large for memory and of which no store is made.

    With a sample comes a text that says how to draw the whole raster; else the text is empty.
    """
    may_build = not asked.store.no_cache and cache.is_possible()
    if may_build or not maps.is_huge(asked.map.name, asked.map.reading):
        return open_scene(asked, progress), ""
    stores.check_no_edits(asked)
    coarse, offer = maps.sample(*asked.map.source)
    report.note(offer)
    report.notes_of(coarse)
    return scene_over(asked, coarse), offer


def scene_over(asked: DrawOptions, coarse: Heightmap) -> CommandScene:
    """The scene of a coarse sample of the map."""
    return _scene(asked, coarse, coarse)


def make_renderer(
    scene: CommandScene, asked: DrawOptions, size: tuple[int, int] | None = None, lit: bool = False
) -> Renderer:
    """A renderer for the scene, with its overlays. With `lit`, check that there is room for the tables of light."""
    laid = overlays.of(asked.laid, scene.heightmap)
    renderer = Renderer(scene.heightmap, size or asked.camera.size, asked.output.backend, build=False)
    try:
        if lit and scene.frame.shading.is_lit and not scene.heightmap.is_store:
            with renderer.session:
                check_room(renderer.ctx, scene.heightmap)
        drain(renderer.build_steps)
        stores.rebuild(renderer)
    except BaseException:
        renderer.release()
        raise
    renderer.overlays = laid
    return renderer


def _scene(
    asked: DrawOptions, heightmap: Heightmap, seen: Heightmap, known: maps.BundledMap | None = None
) -> CommandScene:
    """The scene; the view and the sun that no option gives are those of a bundled map, or suit the map `seen`."""
    start = known.camera if known and not asked.camera.view else _first_view(asked, seen)
    sun = asked.light.sun or clock_sun(asked.light, heightmap) or (known.sun if known else standard_sun(seen))
    return CommandScene(heightmap, seen, camera_of(asked.camera, heightmap, start), replace(asked.frame, sun=sun))


def clock_sun(light: SunOptions, heightmap: Heightmap) -> tuple[float, float] | None:
    """The sun of --time at the place of --latitude and --longitude, or where the map lies."""
    if light.time is None:
        return None
    latitude, longitude = light.latitude, light.longitude
    if latitude is None:
        if heightmap.place is None or heightmap.place.crs is None:
            raise UsageError("--time needs --latitude, because the place of the map is not known; or give --sun")
        middle = heightmap.place.middle
        latitude, longitude = middle[1], middle[0] if longitude is None else longitude
    if light.time.tzinfo is not None and longitude is None:
        raise UsageError("--time with a zone needs --longitude; without a zone it is local solar time")
    return sun_position(light.time, latitude, longitude or 0.0)


def _first_view(asked: DrawOptions, heightmap: Heightmap) -> Camera:
    """A standard view, chosen for the exaggerated relief."""
    factor = asked.frame.exaggeration
    return standard_view(heightmap.exaggerated(factor), asked.camera.view or "default").over_exaggerated(1 / factor)


def camera_of(asked: CameraOptions, heightmap: Heightmap, start: Camera) -> Camera:
    """The camera of a first view, changed by the options."""
    given = asked.given
    if asked.coordinates == "map":
        given |= {name: _in_metres(heightmap, given[name]) for name in ("eye", "target") if name in given}
    camera = replace(start, **given)
    if asked.at:
        camera = look_at(heightmap, camera, *asked.at)
    if asked.stand:
        return stand_at(heightmap, camera, *asked.stand)
    if asked.at and not asked.eye:
        eye = np.array(start.eye) + np.subtract(camera.target, start.target)
        return drawn_near(heightmap, replace(camera, eye=tuple(eye.tolist())))
    return camera


def _in_metres(heightmap: Heightmap, point: Vector) -> Vector:
    """World metres of a point that is given in the map's own coordinates, with metres of height."""
    place = heightmap.place
    if place is None:
        raise UsageError("--coordinates map: the map does not say where it lies")
    x, y = place.from_map(float(place.nearest_turn(np.array([point[0]]))[0]), point[1])
    return x, y, point[2]
