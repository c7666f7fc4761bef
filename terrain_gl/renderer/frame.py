"""Frames: a picture with its numbers, and the mesh of the last picture."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypedDict

import numpy as np

from ..basics.exceptions import TerrainError
from ..camera import Camera
from ..camera.pieces import Piece
from ..image import png_bytes
from ..lod import RingsSelector, Selection
from ..mesh import captured_triangles
from ..shade.targets import Targets
from .facts import Facts
from .methods import BASELINES
from .options import FrameOptions

Size = tuple[int, int]


_Price = TypedDict("_Price", {"lambda": float | None}, total=False)  # a word that Python has taken


class Stats(_Price, total=False):
    """The keys of `Frame.stats`, with their types; docs/stats.md explains them. Maps in memory lack those of stores."""

    method: str
    metric: str
    certified_metric: str
    triangles: int
    patches: int
    splits: int
    patches_hidden: int
    certified_max_error_px: float | None
    requested_max_error_px: float | None
    requested_triangles: int | None
    curvature_radius_m: float | None
    width: int
    height: int
    cracks: int
    voids: int
    gl_renderer: str
    backend: str
    ms: dict[str, float]
    ms_clock: str
    gpu_bytes: dict[str, int]
    overlay_samples: list[int]
    complete: bool
    within_tolerance: float
    tiles_resident: int
    tiles_unlit: int
    tiles_wide: int
    tiles_missing: list[dict[str, str]]


class Measured(Stats, total=False):
    """The keys of `Renderer.measure`, with their types: those of `Stats`, and the achieved error."""

    max_error_px: float
    rms_error_px: float
    max_error_posts_px: float
    posts_measured: int
    land_measured: float
    rounding_px: float | None
    holes: int


class WholeMapMesh(TypedDict, total=False):
    """The keys of the stats of `Inspector.triangulate`, with their types. Only stores have `complete` and the next."""

    triangles: int
    patches: int
    splits: int
    requested_max_error_m: float
    certified_max_error_m: float | None
    complete: bool
    within_tolerance: float
    tiles_resident: int
    tiles_wide: int
    tiles_missing: list[dict[str, str]]


@dataclass
class Frame:
    """A picture and its numbers.

    Attributes
    ----------
    image
        (height, width, 4) uint8 sRGB, first row on top; float32 with the option `exact`.
    stats
        Triangles, patches, certified error, times in milliseconds, GPU bytes: see docs/stats.md.
    """

    image: np.ndarray
    stats: Stats
    _ask: Callable[[], Facts] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def facts(self) -> Facts:
        """What the pixels show. The first time, ask before the renderer draws another picture."""
        if self._ask is None:
            raise TerrainError("a picture that is drawn in pieces keeps no depths: leave out size and fine")
        return self._ask()

    @property
    def depth(self) -> np.ndarray:
        """(height, width) metres along the view, of what the picture shows, water included; infinite for the sky."""
        return self.facts.depth

    @property
    def places(self) -> np.ndarray:
        """(height, width, 3) world metres of what the picture shows; NaN for the sky."""
        return self.facts.places

    @property
    def normals(self) -> np.ndarray:
        """(height, width, 3) unit normals of what the picture shows; 0 for the sky."""
        return self.facts.normals

    @property
    def kind(self) -> np.ndarray:
        """(height, width) what each pixel shows: index into `renderer.facts.KINDS`."""
        return self.facts.kind

    def _repr_png_(self) -> bytes:
        """The picture, for notebooks."""
        return png_bytes(self.image)


@dataclass
class DrawnFrame:
    """A mesh that was chosen for a picture.

    Attributes
    ----------
    camera
        The camera that the mesh was chosen for.
    eye
        The camera that looks at the mesh; another one if the level of detail is frozen (`FrameOptions.chosen_for`).
    size
        Width and height of the picture in pixels.
    near_m
        Distance of the near plane.
    asked
        Everything that the choice of this mesh depended on.
    has_picture
        Whether the renderer's picture shows this mesh.
    stats
        Those of `Frame.stats`; after a measurement, also the achieved error.
    loaded
        For a store, what `Streaming.select` reports of its tiles, loaded and missing. Empty for other maps.
    """

    camera: Camera
    eye: Camera
    size: Size
    near_m: float
    options: FrameOptions
    selection: Selection
    asked: tuple[object, ...] = ()
    has_picture: bool = False
    stats: Measured = field(default_factory=Measured)
    loaded: dict[str, Any] = field(default_factory=dict)

    def look(self, camera: Camera | None = None) -> None:
        """Set the view to this frame's, or to that of another camera that looks at its mesh."""
        surface = self.selection.surface
        eye = camera or self.eye
        surface.view.write(surface.terrain, eye, self.size, self.near_m, **self.selection.settings)

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners and heights of all triangles, as `captured_triangles` returns them."""
        return captured_triangles(self.selection)

    @cached_property
    def steps_log2(self) -> list[int]:
        """log2 of the posts between vertices, for each level of the drawn patches; none if the method has no levels."""
        if not isinstance(self.selection.surface, RingsSelector):
            return []
        patches = self.selection.surface.chosen(self.selection)
        return sorted(set(patches.step_log2[: self.selection.patches].tolist()))

    def summary(self) -> dict[str, Any]:
        """The request and the chosen mesh, with the keys of docs/stats.md."""
        selection = self.selection
        options = self.options
        return {
            "method": options.method,
            "metric": options.metric,
            "certified_metric": options.certified_metric,
            "triangles": selection.triangles,
            "patches": selection.patches,
            "splits": selection.splits,
            "patches_hidden": selection.hidden,
            "certified_max_error_px": selection.certified_px,
            "requested_max_error_px": None if options.method in BASELINES else options.max_error_px,
            "requested_triangles": options.triangles,
            "lambda": selection.price,
            "curvature_radius_m": 1 / (2 * bend) if (bend := self.camera.bend_per_m / options.exaggeration) else None,
            "width": self.size[0],
            "height": self.size[1],
        } | ({} if selection.cracks is None else {"cracks": selection.cracks})


@dataclass
class OtherPicture:
    """A picture beside the renderer's own: `Renderer.exchange`. Its targets get their size when it is drawn."""

    targets: Targets
    drawn: tuple[DrawnFrame, Piece] | None = None  # what it shows; None before it is drawn
    frame: DrawnFrame | None = None  # the inspector's
