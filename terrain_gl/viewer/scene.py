"""The scene: the map, the camera, and how they are drawn. The parts of the window read and change this state."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import Any

from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..readers.georeference import Georeference
from ..renderer import Renderer
from ..renderer.options import RenderOptions
from ..shade.contours import interval_m
from ..shade.picture import UNLIT, Look
from .controller import Controller
from .loading import Opened
from .pose import Pose
from .settings import Settings
from .window_state import Size, WindowState

_OF_ERROR = ("promise", "error")  # styles that a preview cannot show, because it has no errors of the whole map


@dataclass(frozen=True)
class FrameSpec:
    """Everything that a picture depends on, except the map."""

    camera: Camera
    size: Size
    sides: tuple[RenderOptions, ...]
    divider: float
    exaggeration: float = 1.0  # of the map; labels of contours must give true heights

    def part(self, side: int) -> tuple[float, float]:
        """Where a side begins and ends, from 0 at the left edge to 1."""
        if len(self.sides) == 1:
            return 0.0, 1.0
        return (0.0, self.divider) if side == 0 else (self.divider, 1.0)

    @property
    def lit_look(self) -> Look:
        """The look for which light is made, with only the options that matter for light."""
        lit = next((side.shading for side in self.sides if side.shading.is_lit), None)
        if lit is None:
            return Look(UNLIT)
        return Look(sun=lit.sun, sky=lit.sky, material=lit.material, land=lit.land, ramp_range=lit.ramp_range)


class Scene:
    """The map that is shown, and the camera.

    Attributes
    ----------
    opened
        The map as it was read.
    is_preview
        Whether a coarse sample of the map is shown, because the tables of the whole map are not ready.
    exaggeration
        Factor of all heights.
    pending_exaggeration
        The new factor while the map is loaded with it; None otherwise.
    controller
        Moves the camera. There is one for each map.
    frozen
        The camera that the levels were chosen for, if they are frozen.
    """

    opened: Opened
    controller: Controller

    def __init__(self, settings: Settings, window: WindowState) -> None:
        self.settings = settings
        self.window = window
        self.is_preview = False
        self.exaggeration = 1.0
        self.pending_exaggeration: float | None = None
        self.frozen: Camera | None = None
        self._renderer: Renderer | None = None

    @property
    def renderer(self) -> Renderer:
        """Draws the map that is shown."""
        assert self._renderer
        return self._renderer

    @property
    def heightmap(self) -> Heightmap:
        """The map that is shown, with all edits; its heights are multiplied by the exaggeration."""
        shown = self.renderer.heightmap
        return _taller(shown, self.exaggeration) if self.is_paged and self.exaggeration != 1 else shown

    @property
    def awaits_map(self) -> bool:
        """Whether a preview is shown until the tables of its map are ready."""
        return self.is_preview and not self.opened.offer

    @property
    def is_paged(self) -> bool:
        """Whether the map is a store."""
        return self.has_map and self.renderer.streaming is not None

    @property
    def raster_behind(self) -> dict[str, Any] | None:
        """Arguments of `Heightmap.open` for the raster whose store is shown; None for other maps."""
        return self.opened.heightmap.opened if self.is_paged else None

    @property
    def in_memory(self) -> str:
        """Advice for the user on features that stores lack."""
        return "Hold in memory, under Map, has it" if self.raster_behind else "open its raster with --no-cache"

    @property
    def has_map(self) -> bool:
        """Whether there is a map yet."""
        return self._renderer is not None

    def georeference(self) -> Georeference | None:
        """Where the map lies; None without a map, or if this is not known."""
        return self.heightmap.georeference if self.has_map else None

    @property
    def is_visible(self) -> bool:
        """Whether there is a map, and the window has pixels to show it."""
        return self.has_map and self.window.is_visible

    def replace_renderer(self, renderer: Renderer, is_preview: bool) -> Renderer | None:
        """Show another map from now on; returns the renderer of the last map, if any."""
        before = self._renderer
        self._renderer = renderer
        self.is_preview = is_preview
        return before

    def enter(self, opened: Opened, bookmarks: dict[int, Pose], last_pose: Pose | None) -> None:
        """Begin with a new map: at its last view in an earlier run, or at its first view."""
        self.opened = opened
        self.exaggeration = 1.0
        start = opened.camera if opened.camera_given else self.beside_panel(opened.camera)
        self.controller = Controller(opened.heightmap, start, bookmarks=bookmarks)
        if last_pose and not opened.camera_given:
            self.controller.pose = last_pose
        self.settings.change_all(sun=opened.sun)

    def beside_panel(self, camera: Camera) -> Camera:
        """The camera, turned so that its target is in the middle of the part that the panel leaves free."""
        if not (self.settings.panel and self.window.panel_px):
            return camera
        return Pose.of(camera).beside(0.5 * self.window.panel_px, self.window.size[1]).camera

    def go_on(self, opened: Opened, factor: float) -> None:
        """Continue with the same land, its heights multiplied by `factor`; the eye keeps its place over it."""
        before = self.controller
        ratio = factor / self.exaggeration
        self.exaggeration = factor
        heightmap = self.heightmap if self.is_paged else opened.heightmap
        now = Controller(heightmap, opened.camera, before.above_ground, before.bookmarks, before.held)
        now.pose = replace(before.pose, eye=raised(before.pose.eye, ratio))
        now.change_mode(before.mode)
        self.opened = opened
        self.controller = now
        self.pending_exaggeration = None

    def frame_spec(self, size: Size | None = None) -> FrameSpec:
        """The picture that should be shown in the window, or the same picture of another size."""
        changes: dict[str, Any] = {}
        if near_m := self.controller.near_m:
            changes["near_m"] = near_m
        if self.frozen:
            changes["chosen_for"] = self.for_renderer(self.frozen)
        sides = [replace(side, **changes, **self._of_map(side)) for side in self.settings.sides]
        camera = self.controller.camera
        self.controller.bend_per_m = self.settings.sides[0].seen(self.heightmap, camera).bend_per_m
        picture = self.for_renderer(camera), size or self.window.size, tuple(sides), self.settings.divider
        return FrameSpec(*picture, 1.0 if self.is_paged else self.exaggeration)

    def for_renderer(self, camera: Camera) -> Camera:
        """A camera of the window as the renderer needs it: with true heights if the map is a store.

        A map in memory is loaded again with higher relief. The relief of a store is exaggerated by `RenderOptions`.
        """
        return _camera_raised(camera, 1 / self.exaggeration) if self.is_paged else camera

    def of_view(self, camera: Camera) -> Camera:
        """The inverse of `for_renderer`."""
        return _camera_raised(camera, self.exaggeration) if self.is_paged else camera

    def _of_map(self, side: RenderOptions) -> dict[str, Any]:
        """Options that depend on the map: a style that a preview can show, and contour lines at true heights."""
        changes: dict[str, Any] = {"style": "lambert"} if self.is_preview and side.style in _OF_ERROR else {}
        if self.is_paged:
            changes = self.of_store(side)
        elif side.contour_m is not None and self.exaggeration != 1:
            low_m, high_m = (height_m / self.exaggeration for height_m in self.heightmap.range_m)
            changes["contour_m"] = self.exaggeration * (side.contour_m or interval_m(low_m, high_m))
        return changes

    def of_store(self, side: RenderOptions) -> dict[str, Any]:
        """Changes of options that a store needs: the method "sat", exaggerated relief, and water at a true height."""
        water_m = None if side.water_m is None else side.water_m / self.exaggeration
        return {"method": "sat", "parameters": None, "exaggeration": self.exaggeration, "water_m": water_m}


def _taller(heightmap: Heightmap, factor: float) -> Heightmap:
    """A store for reading alone, whose posts have `factor` times their heights."""
    drawn = copy(heightmap)
    drawn.heights = heightmap.heights * factor
    low_m, high_m = heightmap.range_m
    drawn.range_m = factor * low_m, factor * high_m
    return drawn


def _camera_raised(camera: Camera, factor: float) -> Camera:
    """A camera with the heights of its eye and of its target multiplied."""
    return replace(camera, eye=raised(camera.eye, factor), target=raised(camera.target, factor))


def raised(place: Vector, factor: float) -> Vector:
    """A place in world metres with its height multiplied."""
    return place[0], place[1], factor * place[2]
