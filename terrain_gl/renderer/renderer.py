"""The renderer: from a heightmap and a camera to a picture with a certified error.

There is one way to draw, `Renderer.draw_steps`:

    select    choose the mesh, once for the whole picture               lod: `methods`
    draw      for each piece: the place of the map that each sample sees    mesh, shade: `Picture.see_steps`
    shade     for each piece: the colour of each pixel                  shade: `Picture.shade_steps`
    receive   pass on the piece's pixels                                image

`draw` takes all steps at once, `render` also reads the pixels, and `choose` stops after the first. `edit` changes the
map; `inspector` answers questions about the last frame.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from types import TracebackType
from typing import Any, Unpack, cast
from weakref import finalize

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from ..basics.exceptions import TerrainError, UsageError
from ..basics.steps import Progress, Steps, drain
from ..camera import Camera
from ..camera.lens import clip_of_depth
from ..camera.pieces import Piece, cut
from ..error import ErrorTables
from ..files.edits import write_edits
from ..gpu.context import backend_name, create_context
from ..gpu.current import kept
from ..gpu.passes import Box, State
from ..gpu.session import Session, in_session, steps_in_session
from ..heightmap import Heightmap
from ..image import png_bytes, reduced
from ..lod import Selection
from ..lod.cracks import with_cracks
from ..pages.streaming import Streaming
from ..shade.contours import interval_m
from ..shade.picture import TILE_PX, Picture
from ..terrain import Terrain
from .contour_labels import contour_labels
from .draped import OverlayLines, fills
from .edit import Editor
from .facts import Facts, PlaceSeen, facts_of, place_seen
from .frame import DrawnFrame, Frame, Measured, OtherPicture, Stats
from .gpu_resources import GpuResources
from .inspector import Inspector
from .methods import BASELINES, Selectors
from .names import Label, labels_seen
from .options import FrameOptions, OtherOptions, near_plane_m
from .overlay import Overlay

Size = tuple[int, int]
REVERSED = {"<": False, "<=": False, ">": True, ">=": True}  # depth tests, and whether far depths are small
Receive = Callable[[Piece, np.ndarray], None]


class Renderer:
    """Draws a heightmap at a certified error.

    Parameters
    ----------
    heightmap
        The map.
    size
        Width and height of the picture in pixels.
    backend
        "egl", "osmesa", "glfw" (needs a display), or "auto" for the first of these that works.
    ctx
        A moderngl context to use; by default a new one is made. After every call, the context that was current is so
        again, and a context of yours has the state of OpenGL that it had before.
    build
        Build all tables at once. If False, take all steps of `build_steps` before you draw.

    Attributes
    ----------
    build_steps
        The generator that builds all tables; yields progress from 0 to 1.
    resources, timer
        Everything on the GPU, and the times of all stages. `timer.waits`: whether to wait for each stage.
    inspector
        Answers questions about the last frame.
    editor
        Changes the map.

    Raises
    ------
    TerrainError
        No OpenGL 4.3, or too little GPU memory for the map.
    UsageError
        A size of no pixels, or beyond what the GPU can draw.
    """

    def __init__(
        self,
        heightmap: Heightmap,
        size: Size = (1280, 720),
        backend: str = "auto",
        ctx: moderngl.Context | None = None,
        build: bool = True,
    ) -> None:
        with kept():  # a new context is current at once
            self.session = Session(ctx or create_context(backend), owned=ctx is None)
        finalize(self, self.session.release_if_dropped).atexit = False
        self.ctx = self.session.ctx
        with self.session:  # read once, because `info` asks the driver for dozens of limits, not only for the name
            self._gl = {"gl_renderer": self.ctx.info["GL_RENDERER"], "backend": backend_name(self.ctx)}
            self._laid = self.session.keep(OverlayLines(self.ctx))
            self.resources = GpuResources(self.session)
        self.timer = self.resources.timer
        self.inspector = Inspector(self.resources)
        self.editor = Editor(self.resources, self.forget)
        self._overlays: tuple[Overlay, ...] = ()
        self._drawn: tuple[DrawnFrame, Piece] | None = None  # what the picture shows
        self._edition = object()  # of the map: another one after each edit
        self._size = size
        self.build_steps = self.resources.build_steps(heightmap, size)
        if build:
            drain(self.build_steps)

    @property
    def heightmap(self) -> Heightmap:
        """The map as it is now, edits included."""
        drawn = self.terrain.heightmap
        return drawn if drawn.exaggeration == 1 else drawn.exaggerated(1.0)

    @property
    def terrain(self) -> Terrain:
        """The map on the GPU."""
        return self.resources.terrain

    @property
    def tables(self) -> ErrorTables:
        """The error tables."""
        return self.resources.tables

    @property
    def selectors(self) -> Selectors:
        """The selectors of the mesh, by method."""
        return self.resources.selectors

    @property
    def picture(self) -> Picture:
        """The picture on the GPU."""
        return self.resources.picture

    @property
    def streaming(self) -> Streaming | None:
        """Loads the pages of a store that views need; None for other maps."""
        return self.resources.streaming

    @property
    def size(self) -> Size:
        """Width and height of the picture in pixels."""
        return self._size

    @in_session
    def resize(self, size: Size) -> None:
        """Change the picture's size; the last frame is lost."""
        self.resources.check_size(size)
        self.inspector.frame = None
        self.resources.resize(size)
        self._size = size

    def render(
        self,
        camera: Camera,
        max_error_px: float | None = None,
        progress: Progress | None = None,
        *,
        size: Size | None = None,
        fine: int = 1,
        exact: bool = False,
        **options: Unpack[OtherOptions],
    ) -> Frame:
        """Draw a picture whose geometric error is at most `max_error_px`, or the smallest with `triangles` triangles.

        Parameters
        ----------
        camera
            The view.
        max_error_px
            The screen error: the distance in pixels between the drawn and the true position of a point of the surface.
            With the metric "max", no point has a larger error; with "rms", the root mean square is at most this. By
            default 1.
        progress
            Called with the progress, 0 to 1.
        size
            Width and height in pixels, for a picture of any size: one larger than the GPU can draw at once comes in
            pieces of one mesh. It cannot be measured afterwards.
        fine
            With a size: each pixel is the mean light of fine × fine pixels.
        exact
            The picture has float32 pixels: see `Picture.exact`.
        options
            The other fields of `FrameOptions`, by name; `RenderOptions` has their types.

        Raises
        ------
        UsageError
            An argument outside its range.
        """
        steps = self.render_steps(camera, max_error_px, size, exact, fine=fine, gradual=False, **options)
        with self.session.turn():
            return drain(steps, progress)

    def render_steps(
        self,
        camera: Camera,
        max_error_px: float | None = None,
        size: Size | None = None,
        exact: bool = False,
        *,
        fine: int = 1,
        gradual: bool = True,
        **options: Unpack[OtherOptions],
    ) -> Steps[Frame]:
        """Incremental `render`; yields progress from 0 to 1. Arguments as for `draw_steps`."""
        width, height = size or self.size
        image = np.empty((height, width, 4), np.float32 if exact else np.uint8)

        def receive(piece: Piece, pixels: np.ndarray) -> None:
            image[piece.rows, piece.cols] = pixels

        stats = yield from self.draw_steps(camera, max_error_px, size, fine, receive, gradual, exact, **options)
        drawn = self.inspector.frame
        return Frame(image, stats, None if size else lambda: self._facts(drawn))

    @in_session
    def _facts(self, drawn: DrawnFrame | None) -> Facts:
        """What the picture of a frame shows; it must be the last one."""
        if drawn is None or self.inspector.frame is not drawn:
            raise TerrainError("another picture was drawn since: ask a frame for its depths before you draw the next")
        drawn.look()
        return facts_of(self.picture, drawn.eye)

    @in_session
    def facts(self) -> Facts:
        """What the pixels of the last picture show; in `receive`, those of the piece."""
        if self._drawn is None:
            raise TerrainError("there is no picture yet: draw one")
        return facts_of(self.picture, self._look_again(*self._drawn)[0])

    def draw(
        self,
        camera: Camera,
        max_error_px: float | None = None,
        *,
        size: Size | None = None,
        fine: int = 1,
        receive: Receive | None = None,
        exact: bool = False,
        **options: Unpack[OtherOptions],
    ) -> Stats:
        """Like `render`, but the picture stays on the GPU (`picture`); returns the stats."""
        with self.session.turn():
            return drain(self.draw_steps(camera, max_error_px, size, fine, receive, False, exact, **options))

    @steps_in_session
    def draw_steps(
        self,
        camera: Camera,
        max_error_px: float | None = None,
        size: Size | None = None,
        fine: int = 1,
        receive: Receive | None = None,
        gradual: bool = True,
        exact: bool = False,
        earlier: DrawnFrame | None = None,
        **options: Unpack[OtherOptions],
    ) -> Steps[Stats]:
        """Incremental `draw`; yields progress from 0 to 1 and returns the stats. Draw nothing else in between.

        Parameters
        ----------
        size, fine
            As for `render`. With a size, the picture comes in pieces.
        receive
            Function that gets each piece of the picture and its pixels, (height, width, 4) uint8 sRGB, first row on
            top.
        exact
            Pixels are float32 (see `Picture.exact`) and have no overlays.
        gradual
            Take small steps. Otherwise each of the two passes over a piece is one step, which is faster.
        earlier
            A frame whose mesh may be drawn again (`select`).
        options
            The fields of `FrameOptions`, by name.

        Raises
        ------
        UsageError
            An argument outside its range.
        """
        if exact and fine > 1:
            raise UsageError("exact pixels are not reduced: leave fine out")
        chosen = FrameOptions(max_error_px, **options)
        pieces = cut(size, fine) if size else [Piece.whole(self.size)]
        self._laid.begin(self.overlays)
        with self.timer.frame(gradual):
            frame = self.select(camera, pieces[0].picture, chosen, earlier)
            self.inspector.frame = None  # its picture will be overwritten
            self._drawn = frame, pieces[0]
            yield 0.0
            for done, piece in enumerate(pieces):
                for share in self._piece_steps(piece, frame, gradual):
                    yield (done + share) / len(pieces)
                if receive:
                    receive(piece, self.picture.exact() if exact else reduced(self.picture.read(), piece.fine))
        self._complete(frame)
        if not size:
            frame.has_picture = True
            self.inspector.frame = frame
        return frame.stats

    @in_session
    def draw_into(
        self,
        framebuffer: moderngl.Framebuffer,
        view: ArrayLike,
        projection: ArrayLike,
        max_error_px: float | None = None,
        *,
        viewport: Box | None = None,
        depth: str = "<",
        zero_to_one: bool = False,
        **options: Unpack[OtherOptions],
    ) -> Stats:
        """Draw colour and depth into a framebuffer of yours: objects that you draw before or after meet the land.

        Your scene has the land's world: metres east, north and up (`Heightmap`). Colours are those of `render`, encoded
        as sRGB. A pixel is drawn where its depth passes your test; then it writes colour and depth. Land beyond your
        far plane is drawn at this plane. Where there is only sky, your picture stays, unless `sky` is given.

        Parameters
        ----------
        framebuffer
            A framebuffer of the renderer's context: make the renderer with your context, `Renderer(..., ctx=ctx)`. It
            may have any size, several samples and several colours; the first colour is drawn.
        view, projection
            (4, 4) matrices for column vectors, as for `Camera.from_matrices`; the third and the last row of the
            projection also give the depth.
        max_error_px
            As for `render`.
        viewport
            Column and row of the lower left pixel, width, height; by default the whole framebuffer. `size` becomes this
            width and height.
        depth
            Your depth test: "<", "<=", ">" or ">=". The last two are for reversed depth.
        zero_to_one
            Whether your clip-space depth runs from 0 to 1 (glClipControl), not from -1 to 1.
        options
            The other fields of `FrameOptions`. By default, curvature is off and `sky` is "none".

        Returns
        -------
        Stats
            The numbers of the frame, with its certificate.

        Raises
        ------
        UsageError
            A framebuffer of another context or without depth, matrices of no camera, or an option outside its range.
        """
        if framebuffer.ctx is not self.ctx:
            raise UsageError("draw_into: the framebuffer is of another context: Renderer(..., ctx=framebuffer.ctx)")
        if framebuffer.glo and framebuffer.depth_attachment is None:
            raise UsageError("draw_into: the framebuffer has no depth: give it a depth_attachment")
        if depth not in REVERSED:
            raise UsageError(f"draw_into: expected a depth test of {', '.join(REVERSED)}, got {depth!r}")
        camera = Camera.from_matrices(view, projection)
        box = viewport or (0, 0, *framebuffer.size)
        if self.size != box[2:]:
            self.resize(box[2:])
        has_sky = options.get("sky", "none") != "none"
        chosen: OtherOptions = {"curvature": "off", "sky": "none", **options}
        stats = self.draw(camera, max_error_px, **chosen)
        state = State(framebuffer, box, depth=depth, blends=True, stays_opaque=True, colours=1)
        clip = clip_of_depth(projection, self.terrain.heightmap.exaggeration)
        where = {"corner": box[:2], "clip": clip, "zero_to_one": zero_to_one, "has_sky": has_sky}
        self.picture.draw_into(state, {**where, "far": 0.0 if REVERSED[depth] else 1.0})
        return stats

    @in_session
    def choose(self, camera: Camera, max_error_px: float | None = None, **options: Unpack[OtherOptions]) -> Stats:
        """Choose the mesh like `draw`, but draw no picture; returns the stats. `inspector` then has the mesh."""
        with self.timer.frame():
            frame = self.select(camera, self.size, FrameOptions(max_error_px, **options))
        self.inspector.frame = self._complete(frame)
        return frame.stats

    def check_method(self, method: str, camera: Camera | None = None) -> None:
        """Raise `UsageError` if the method does not draw stores, and the map is one; or not this kind of camera."""
        if camera and camera.is_orthographic and method in BASELINES:
            raise UsageError(f"method {method} follows an eye: an orthographic camera has none, draw it by sat")
        if self.streaming and method != "sat":
            raise UsageError(f"a store is drawn by the method sat, not by {method}")

    @in_session
    def select(
        self, camera: Camera, size: Size, options: FrameOptions, earlier: DrawnFrame | None = None
    ) -> DrawnFrame:
        """Choose the mesh of a picture of `size`, and set the view.

        The mesh of an `earlier` frame is taken again if all that its choice depended on is the same. That of a store is
        not, because tiles may have come.
        """
        if options.exaggeration != self.terrain.heightmap.exaggeration:
            self.resources.exaggerate(options.exaggeration)
        camera.check_picture(size)
        near_m = near_plane_m(self.heightmap, options.near_m, camera) / options.exaggeration
        camera = options.seen(self.heightmap, camera)
        chosen_for = options.seen(self.heightmap, options.chosen_for) if options.chosen_for else camera
        way = options.method, options.goal, options.style == "cracks", options.exaggeration
        asked = self._edition, chosen_for, size, near_m, *way
        with self.timer.stage("lod"):
            if earlier and earlier.asked == asked and not self.streaming:
                selection, loaded = earlier.selection, earlier.loaded
            else:
                selection, loaded = self._mesh_for(chosen_for, camera, size, near_m, options)
        frame = DrawnFrame(chosen_for, camera, size, near_m, options, selection, asked, loaded=loaded)
        frame.look()
        return frame

    def _mesh_for(
        self, chosen_for: Camera, camera: Camera, size: Size, near_m: float, options: FrameOptions
    ) -> tuple[Selection, dict[str, Any]]:
        """Choose a mesh for one camera, which another one may look at; and numbers about the tiles of a store."""
        self.check_method(options.method, camera)
        selector = self.selectors[options.method]

        def choose(camera: Camera) -> Selection:
            return selector.select(camera, size, near_m, options.goal)

        loading = self.streaming
        if loading:
            loading.terrain.shows_errors = options.style == "error"
            loading.terrain.rim_focal_px = chosen_for.focal_px(size[1]) if options.voids == "hole" else 0.0
        selection, loaded = loading.select(choose, chosen_for, options.goal) if loading else (choose(chosen_for), {})
        return (with_cracks(selection) if options.style == "cracks" else selection), loaded

    @in_session
    def exchange(self, other: OtherPicture) -> None:
        """Let another picture be the last one; `other` then holds what was the last one.

        A picture that is drawn in steps is drawn on, if both are exchanged back before the next step.
        """
        self.picture.targets, other.targets = other.targets, self.picture.targets
        self._drawn, other.drawn = other.drawn, self._drawn
        self.inspector.frame, other.frame = other.frame, self.inspector.frame
        if self._drawn:
            self._look_again(*self._drawn)

    def forget(self) -> None:
        """Forget the last frame, and take no earlier mesh again: the map has changed."""
        self._edition = object()
        self.inspector.frame = None

    def measure(self) -> Measured:
        """The last frame's stats with its achieved error: see `Inspector.measure`."""
        return self.inspector.measure()

    def triangles(self) -> np.ndarray:
        """Triangles of the last frame as drawn: (n, 3, 2) columns and rows; see `Inspector.triangles`."""
        return self.inspector.triangles()

    def height_at(self, x: float, y: float) -> float:
        """The true height at a place in world metres, bilinear between posts; NaN over a void and off the map."""
        return self.inspector.height_at(x, y)

    def drawn_height_at(self, x: float, y: float) -> float:
        """The drawn height of the last frame at a place in world metres; NaN where nothing is drawn."""
        return self.inspector.drawn_height_at(x, y)

    @property
    def overlays(self) -> tuple[Overlay, ...]:
        """Lines and points over every picture, from `overlay.read_overlay`; filled polygons colour the land."""
        return self._overlays

    @overlays.setter
    def overlays(self, laid: tuple[Overlay, ...]) -> None:
        self._overlays = laid
        self.picture.lighting.fills = fills(laid, self.heightmap)

    @in_session
    def place_at(self, column: int, row: int) -> PlaceSeen | None:
        """The place that a pixel of the last picture shows; row 0 is on top. None for the sky."""
        if not (0 <= column < self.size[0] and 0 <= row < self.size[1]):
            raise UsageError(f"the picture has {self.size[0]} x {self.size[1]} pixels, got column {column}, row {row}")
        return place_seen(self._facts(self.inspector.frame), self.heightmap, column, row)

    @in_session
    def labels(self) -> list[Label]:
        """The names of points in the last picture that no land hides."""
        if self._drawn is None:
            return []
        seen = self._look_again(*self._drawn)
        return labels_seen(self.overlays, self.picture, *seen)

    @in_session
    def contour_labels(self, contour_m: float | None, water_m: float | None = None, units: str = "m") -> list[Label]:
        """Heights of the index lines in the last picture; arguments as in `FrameOptions`."""
        if self._drawn is None or contour_m is None:
            return []
        interval = contour_m or interval_m(*self.heightmap.range_m, units)
        least_m = -math.inf if water_m is None else water_m
        camera, _, piece = self._look_again(*self._drawn)
        return contour_labels(self.picture, camera, piece, interval, least_m, units)

    def edit(self, rows: slice | int, cols: slice | int, heights: ArrayLike, settle: bool = True) -> None:
        """Give a rectangle of posts new heights, NaN for voids; all tables are updated. See `Editor.edit`."""
        self.editor.edit(rows, cols, heights, settle)

    def settle(self) -> None:
        """Update the light after edits with `settle=False`."""
        self.editor.settle()

    def rebuild(self, progress: Progress | None = None) -> None:
        """Make the bounds of an edited store exact. A map in memory needs no rebuild. See `Editor.rebuild_steps`."""
        with self.session.turn():
            drain(self.editor.rebuild_steps(), progress)

    def save_edits(self, path: str | os.PathLike[str]) -> None:
        """Write the edits of a store, .tif or .npz: see `files.edits.write_edits`."""
        write_edits(path, self.heightmap)

    def load_edits(self, path: str | os.PathLike[str]) -> None:
        """Apply the edits of a file to a store: see `Editor.load`."""
        self.editor.load(path)

    def release(self) -> None:
        """Release GPU resources."""
        self.session.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    @in_session
    def _repr_png_(self) -> bytes | None:
        """The last picture, for a notebook."""
        return png_bytes(self.picture.read()) if self.inspector.frame else None

    def _piece_steps(self, piece: Piece, frame: DrawnFrame, gradual: bool) -> Steps[None]:
        """Draw and shade a piece; yields progress from 0 to 1."""
        self.resources.crop(piece)
        look = frame.options.shading
        commands = 1 if gradual else max(1, frame.selection.draws)
        tile = TILE_PX if gradual else piece.drawn_size
        for share in self.timer.steps("draw", self.picture.see_steps(frame.selection, look, commands)):
            yield 0.3 * share
        for share in self.timer.steps("shade", self.picture.shade_steps(frame.eye, look, tile)):
            yield 0.3 + 0.7 * share
        if self.overlays:
            self._laid.draw(self.overlays, self.picture, frame.eye, piece)
        self._drawn = frame, piece

    def _look_again(self, frame: DrawnFrame, piece: Piece) -> tuple[Camera, float, Piece]:
        """Set the view to that of the picture, because another mesh may have been chosen since; returns it."""
        frame.look()
        self.resources.crop(piece)
        return frame.eye, frame.near_m, piece

    def _complete(self, frame: DrawnFrame) -> DrawnFrame:
        """Give a frame its stats."""
        if self.streaming and frame.options.shading.is_lit:
            frame.loaded["tiles_unlit"] = self.picture.lighting.missing
        times = {"ms": dict(self.timer.ms), "ms_clock": self.timer.clock, "voids": self.heightmap.voids}
        numbers = frame.summary() | frame.loaded | self._gl | times | {"gpu_bytes": self.resources.gpu_bytes}
        frame.stats = cast(Measured, numbers)
        if self.overlays:
            frame.stats["overlay_samples"] = self._laid.drawn
        return frame
