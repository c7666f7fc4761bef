"""The scene: the map, the camera, and how they are drawn. The parts of the window read and change this state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..camera import Camera
from ..heightmap import Heightmap
from ..renderer import Renderer
from ..renderer.options import FrameOptions
from ..shade.picture import UNLIT, Look
from .controller import Controller
from .loading import Opened
from .pose import Pose, raised
from .settings import Settings
from .split import Split
from .window_state import Size, WindowState

_OF_ERROR = ("promise", "error")  # styles that a preview cannot show, because it has no errors of the whole map


@dataclass(frozen=True)
class FrameSpec:
    """Everything that a picture depends on, except the map."""

    camera: Camera
    size: Size
    sides: tuple[FrameOptions, ...]
    split: Split = field(compare=False)  # the pictures of the sides do not depend on it

    @property
    def lit_look(self) -> Look:
        """The look for which light is made, with only the options that matter for light."""
        lit = next((side.shading for side in self.sides if side.shading.is_lit), None)
        if lit is None:
            return Look(UNLIT)
        return Look(
            sun=lit.sun, sky=lit.sky, material=lit.material, land_colours=lit.land_colours, ramp_range=lit.ramp_range
        )


class Scene:
    """The map that is shown, and the camera."""

    opened: Opened  # the map as it was read
    controller: Controller  # moves the camera; there is one for each map

    def __init__(self, settings: Settings, window: WindowState) -> None:
        self.settings = settings
        self.window = window
        self.is_preview = False  # whether a coarse sample is shown, because the tables of the map are not ready
        self.frozen: Camera | None = None  # the camera that the levels were chosen for, if they are frozen
        self.bookmarks: dict[int, dict[str, Any]] = {}  # states by number, 1 to 9: `state.state_of`
        self._renderer: Renderer | None = None

    @property
    def renderer(self) -> Renderer:
        """Draws the map that is shown."""
        assert self._renderer
        return self._renderer

    @property
    def heightmap(self) -> Heightmap:
        """The map that is shown, with all edits; its heights are true."""
        return self.renderer.heightmap

    @property
    def exaggeration(self) -> float:
        """How many times higher the relief is drawn. The controller moves its camera over the land as drawn."""
        return self.settings.options.exaggeration

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

    @property
    def is_visible(self) -> bool:
        """Whether there is a map, and the window has pixels to show it."""
        return self.has_map and self.window.is_visible

    def replace_renderer(self, renderer: Renderer, is_preview: bool) -> Renderer | None:
        """Show another map from now on; returns the renderer of the last map, if any."""
        before, self._renderer = self._renderer, renderer
        self.is_preview = is_preview
        return before

    def enter(self, opened: Opened, last_pose: Pose | None) -> None:
        """Begin with a new map: at its last view in an earlier run, or at its first view."""
        self.opened = opened
        camera = self.of_view(opened.camera)
        start = camera if opened.camera_given else self.beside_panel(camera)
        self.controller = Controller(opened.heightmap, start, exaggeration=self.exaggeration)
        if last_pose and not opened.camera_given:
            self.controller.pose = self.drawn_pose(last_pose)
        self.settings.change_all(sun=opened.sun)

    def beside_panel(self, camera: Camera) -> Camera:
        """The camera, turned so that its target is in the middle of the part that the panel leaves free."""
        if not (self.settings.panel and self.window.panel_px):
            return camera
        return Pose.of(camera).beside(0.5 * self.window.panel_px, self.window.size[1]).camera

    def go_on(self, opened: Opened) -> None:
        """Continue with the map whose sample was shown; the camera keeps its place."""
        before = self.controller
        self.opened = opened
        self.controller = replace(before, heightmap=self.heightmap, start=self.of_view(opened.camera))
        self.controller.pose = before.pose
        self.controller.change_mode(before.mode)

    def exaggerate(self, factor: float) -> None:
        """Draw the relief `factor` times as high as it is; the eye keeps its place over the land."""
        ratio = factor / self.exaggeration
        self.settings.change_all(exaggeration=factor)
        self.controller.exaggerate(factor)
        self.frozen = self.frozen and _raised_camera(self.frozen, ratio)

    def frame_spec(self, size: Size | None = None) -> FrameSpec:
        """The picture that should be shown in the window, or the same picture of another size."""
        controller = self.controller
        spec = self.spec_of(controller.camera, self.settings.sides, self.frozen, controller.near_m, size)
        first = spec.sides[0]
        controller.bend_per_m = self.heightmap.bend_per_m(first.curvature, first.refraction or 0.0)
        return spec

    def spec_of(
        self,
        camera: Camera,
        sides: Sequence[FrameOptions],
        frozen: Camera | None,
        near_m: float | None = None,
        size: Size | None = None,
    ) -> FrameSpec:
        """The picture of a camera with these sides; by default in the size of the window."""
        changes: dict[str, Any] = {}
        if near_m:
            changes["near_m"] = near_m
        if frozen:
            changes["chosen_for"] = self.for_renderer(frozen)
        drawable = tuple(replace(self.drawable(side), **changes) for side in sides)
        return FrameSpec(self.for_renderer(camera), size or self.window.size, drawable, self.split)

    @property
    def split(self) -> Split:
        """How the picture in the window is split."""
        settings, window = self.settings, self.window
        covered = window.panel_px / max(1, window.size[0]) if settings.panel else 0.0
        return Split(len(settings.sides), settings.divider, settings.swapped, settings.centred, covered)

    def for_renderer(self, camera: Camera) -> Camera:
        """A camera of the window at true heights: the renderer itself raises eye and target with the relief."""
        return _raised_camera(camera, 1 / self.exaggeration)

    def of_view(self, camera: Camera) -> Camera:
        """The inverse of `for_renderer`."""
        return _raised_camera(camera, self.exaggeration)

    def true_pose(self, pose: Pose) -> Pose:
        """A pose over the land as drawn, brought to its height over the true land."""
        return replace(pose, eye=raised(pose.eye, 1 / self.exaggeration))

    def drawn_pose(self, pose: Pose) -> Pose:
        """The inverse of `true_pose`."""
        return replace(pose, eye=raised(pose.eye, self.exaggeration))

    def drawable(self, side: FrameOptions) -> FrameOptions:
        """The options as this map can be drawn: a store by the method "sat", a preview without errors."""
        if self.is_paged:
            return replace(side, method="sat", parameters=None)
        return replace(side, style="lambert") if self.is_preview and side.style in _OF_ERROR else side


def _raised_camera(camera: Camera, factor: float) -> Camera:
    """A camera with the heights of its eye and of its target multiplied."""
    return replace(camera, eye=raised(camera.eye, factor), target=raised(camera.target, factor))
