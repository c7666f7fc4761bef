"""The renderer: a heightmap and a camera in, a picture out, with the error promised and, on request, achieved."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property, wraps
from types import GeneratorType, TracebackType
from typing import Any, TypeVar, cast

import moderngl
import numpy as np

from .camera import Camera
from .context import backend_name, create_context
from .drawing import Drawing
from .error import ErrorTables
from .exceptions import TerrainError, UsageError
from .explain import Explainer, Explanation
from .gl import limits
from .heightmap import Heightmap, real_heights
from .holes import bilinear, count_holes
from .image import png_bytes, reduced
from .lod import Levels, Selection
from .measure import TILE, Achieved, Measurement
from .mesh import captured_triangles
from .methods.bilinear import Bilinear
from .methods.rivals import RIVALS, Parameters, Rivals
from .pieces import Piece, cut
from .shade import Picture
from .terrain import Rect, Terrain, hull
from .timing import Stopwatch

Part = TypeVar("Part")
Method = TypeVar("Method", bound=Callable[..., Any])
NEAR = 0.1  # near plane, in spacings


def _in_own_context(method: Method) -> Method:
    """Make the renderer's own context current first, whatever other renderers did meanwhile."""

    @wraps(method)
    def entered(self: Renderer, *args: Any, **settings: Any) -> Any:
        self._enter()
        return method(self, *args, **settings)

    return cast(Method, entered)


def _portions_in_own_context(method: Method) -> Method:
    """The same for what is done in portions: others may draw between two of them."""

    @wraps(method)
    def entered(self: Renderer, *args: Any, **settings: Any) -> Any:
        portions = method(self, *args, **settings)
        self._half_done.append(portions)
        try:
            while True:
                self._enter()
                try:
                    portion = next(portions)
                except StopIteration as end:
                    return end.value
                yield portion
        finally:  # one that is given up gives its memory back, in the right context
            self._half_done.remove(portions)
            if not self._released:
                self._enter()
                portions.close()

    return cast(Method, entered)


@dataclass
class Frame:
    """A picture and what is known of it.

    Attributes
    ----------
    image
        (height, width, 4) uint8 sRGB, first row on top.
    stats
        Triangles, patches, promised error, times in milliseconds, GPU bytes: see docs/stats.md.
    """

    image: np.ndarray
    stats: dict[str, Any]

    def _repr_png_(self) -> bytes:
        """The picture, where a notebook shows a frame."""
        return png_bytes(self.image)


@dataclass
class _Shot:
    """What was drawn last: what `measure` and its kin speak of."""

    camera: Camera
    selection: Selection
    near_m: float
    drawing: Drawing
    eye: Camera  # what it was looked at with: another camera where `camera` is frozen
    drawn: bool = False  # whether the picture shows it
    stats: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """As `captured_triangles` has them."""
        return captured_triangles(self.selection)


class Renderer:
    """Draws a heightmap at a certified error.

    Parameters
    ----------
    heightmap
        The map.
    size
        Width and height of the picture in pixels.
    backend
        "egl", "osmesa", "glfw", or "auto" for the first that works without a display.
    ctx
        A moderngl context to use instead of making one. It is left as drawing needs it: depth from 0 to 1 in clip
        space, a reversed depth test, patches of one vertex.
    build
        Make all tables at once; else `building` is to be gone through before anything is drawn.

    Raises
    ------
    TerrainError
        No OpenGL 4.3 to be had, or too little GPU memory for the map.
    UsageError
        A size of no pixels or beyond what the GPU can draw.
    """

    def __init__(
        self,
        heightmap: Heightmap,
        size: tuple[int, int] = (1280, 720),
        backend: str = "auto",
        ctx: moderngl.Context | None = None,
        build: bool = True,
    ) -> None:
        self._owns_ctx = ctx is None
        self.ctx = ctx or create_context(backend)
        # asked once: the context looks up dozens of limits to say its name
        self._gl = {"gl_renderer": self.ctx.info["GL_RENDERER"], "backend": backend_name(self.ctx)}
        self.ms: dict[str, float] = {}
        self._shot: _Shot | None = None
        self._measurement: Measurement | None = None
        self._explainer: Explainer | None = None
        self._stopwatch: Stopwatch | None = None
        self._unsettled: Rect | None = None  # what was edited since the light last followed
        self._parts: list[Any] = []
        self._half_done: list[GeneratorType[Any, None, Any]] = []
        self._released = False
        self._size = size
        self.building = self._build(heightmap, size)
        if build:
            deque(self.building, maxlen=0)

    waits = True
    """Whether each stage is waited for, to be timed. If not, `ms` are the GPU's own times, a frame or more late."""

    queries = False
    """Whether the stages of a frame are timed by the GPU's own clock, too, where each is waited for: `ms` are its times
    then, without what Python and the driver take. For drivers of which `Stopwatch.works`."""

    building: Generator[float, None, None]
    """Makes the tables in portions, for who must not wait for the whole; after each: the part done, 0 to 1."""

    @_portions_in_own_context
    def _build(self, heightmap: Heightmap, size: tuple[int, int]) -> Generator[float, None, None]:
        posts = heightmap.rows * heightmap.cols
        try:
            self._check_size(size)
            with _memory_errors(self.ctx, f"{heightmap.name}: its {posts} posts need", 16 * posts, "use a smaller map"):
                self.terrain = self._keep(Terrain(self.ctx, heightmap))
                yield 0.05
                with self._timed("error"):
                    self.tables = self._keep(ErrorTables(self.terrain, build=False))
                    for part in self.tables.building():
                        self.ctx.finish()  # who waits for portions wants them to be done
                        yield 0.05 + 0.75 * part
                self.levels = self._keep(Levels(self.tables))
                self.rivals = self._keep(Rivals(self.terrain, self.levels.view))
                self.truth = self._keep(Bilinear(self.levels))
                yield 0.85
            with self._room_for_picture(size), self._timed("sat"):
                self.picture = self._keep(Picture(self.levels, size))
            yield 1.0
        except BaseException:  # a portion failed, or nobody waits any more
            self.release()
            raise

    def _keep(self, part: Part) -> Part:
        """Note what is to be released with the renderer."""
        self._parts.append(part)
        return part

    @property
    def heightmap(self) -> Heightmap:
        """The map as it is now, edits included."""
        return self.terrain.heightmap

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in pixels."""
        return self._size

    @_in_own_context
    def resize(self, size: tuple[int, int]) -> None:
        """Change the picture's size; the last frame is gone with it."""
        self._check_size(size)
        self._shot = None
        with self._room_for_picture(size):
            self.picture.resize(size)
        self._size = size

    @_in_own_context
    def render(self, camera: Camera, max_error_px: float | None = None, **options: Any) -> Frame:
        """Draw a picture whose geometric error is nowhere above `max_error_px`, or as small as `triangles` can make it.

        Parameters
        ----------
        camera
            Where the eye is.
        max_error_px
            The largest distance on the screen between where a post of the map is drawn and where it belongs
            (metric "max"), or the root mean square of all those distances ("rms"). By default 1.
        options
            The other fields of `Drawing`, by name: triangles, metric, method, style, sun, near_m, cull.

        Raises
        ------
        UsageError
            An argument outside its range.
        """
        started = time.perf_counter()
        self.draw(camera, max_error_px, **options)
        image = self.picture.read()
        assert self._shot
        self.ms["frame"] = 1e3 * (time.perf_counter() - started)
        self._shot.stats["ms"] = dict(self.ms)
        return Frame(image, self._shot.stats)

    @_in_own_context
    def draw(self, camera: Camera, max_error_px: float | None = None, **options: Any) -> dict[str, Any]:
        """Draw like `render`, but leave the picture on the GPU (`picture`); returns the stats."""
        started = time.perf_counter()
        drawing = Drawing(max_error_px, **options)
        self._shot = self._select(camera, self.size, drawing)
        self._shade(Piece.whole(self.size), self._shot, drawing)
        self._shot.drawn = True
        self.ms["frame"] = 1e3 * (time.perf_counter() - started)
        if self._stopwatch:
            self.ms |= self._stopwatch.frame() or {}
        self._shot.stats = self._stats(drawing, self._shot.selection, self.size)
        return self._shot.stats

    def choose(self, camera: Camera, max_error_px: float | None = None, **options: Any) -> dict[str, Any]:
        """Choose the mesh like `draw`, and draw nothing: for `explain`, `measuring`, `triangles`; returns the stats."""
        drawing = Drawing(max_error_px, **options)
        shot = self._select(camera, self.size, drawing)
        if self._stopwatch:
            self.ms |= self._stopwatch.frame() or {}
        shot.stats = self._stats(drawing, shot.selection, self.size)
        self._shot = shot
        return shot.stats

    @_portions_in_own_context
    def drawing(
        self, camera: Camera, max_error_px: float | None = None, **options: Any
    ) -> Generator[float, None, dict[str, Any]]:
        """Draw like `draw` in portions, for who must not wait for the whole: after each, the share that is done.

        To be gone through before anything else is drawn; returns the stats.
        """
        drawing = Drawing(max_error_px, **options)
        with self._whole_frame():
            shot = self._select(camera, self.size, drawing)
            yield 0.1
            for share in self._shading(Piece.whole(self.size), shot, drawing):
                yield 0.1 + 0.9 * share
        shot.stats, shot.drawn = self._stats(drawing, shot.selection, self.size), True
        self._shot = shot
        return shot.stats

    @_portions_in_own_context
    def rendering_large(
        self, camera: Camera, size: tuple[int, int], max_error_px: float | None = None, **options: Any
    ) -> Generator[float, None, Frame]:
        """Draw like `render_large` in portions: after each, the share that is done. Returns the frame."""
        drawing, parts = Drawing(max_error_px, **options), cut(size)
        shot = self._select(camera, size, drawing)
        image, spent = np.empty((size[1], size[0], 4), np.uint8), dict.fromkeys(("draw", "shade"), 0.0)
        for done, piece in enumerate(parts):
            with self._whole_frame():
                for share in self._shading(piece, shot, drawing):
                    yield (done + share) / len(parts)
            image[piece.rows, piece.cols] = self.picture.read()
            spent = {stage: ms + self.ms.get(stage, 0.0) for stage, ms in spent.items()}
        return Frame(image, self._stats(drawing, shot.selection, size) | {"ms": self.ms | spent})

    def render_large(
        self,
        camera: Camera,
        size: tuple[int, int],
        max_error_px: float | None = None,
        *,
        fine: int = 1,
        progress: Callable[[float], None] | None = None,
        **options: Any,
    ) -> Frame:
        """Draw a picture of any size, in pieces: also beyond what the GPU can draw in one.

        The mesh is chosen once, for the whole picture. There is nothing to `measure` afterwards.

        Parameters
        ----------
        size
            Width and height of the picture in pixels.
        fine
            Draw each pixel as fine × fine, and average their light.
        progress
            Called with the part that is done, 0 to 1.
        options
            As for `render`.
        """
        parts = self.pieces(camera, size, max_error_px, fine=fine, **options)
        whole = Frame(np.empty((size[1], size[0], 4), np.uint8), {})
        for piece, part in parts:
            whole.image[piece.rows, piece.cols] = part.image
            whole.stats = part.stats
            if progress:
                progress(piece.share_done)
        return whole

    def pieces(
        self, camera: Camera, size: tuple[int, int], max_error_px: float | None = None, *, fine: int = 1, **options: Any
    ) -> Iterator[tuple[Piece, Frame]]:
        """Draw a picture of any size piece by piece, the top row first; arguments as for `render_large`.

        Returns
        -------
        Iterator
            Of each piece, which says by `rows` and `cols` where it belongs, and its frame: its own pixels, and the
            stats of the whole picture, with the times of all pieces so far. To be gone through before anything else
            is drawn.

        Raises
        ------
        UsageError
            An argument outside its range.
        """
        drawing, parts = Drawing(max_error_px, **options), cut(size, fine)
        return self._draw_pieces(parts, self._select(camera, size, drawing), drawing)

    def _draw_pieces(self, parts: list[Piece], shot: _Shot, drawing: Drawing) -> Iterator[tuple[Piece, Frame]]:
        stats = self._stats(drawing, shot.selection, parts[0].picture)
        spent = dict.fromkeys(("draw", "shade", "frame"), 0.0)
        for piece in parts:
            started = time.perf_counter()
            pixels = self._render_piece(piece, shot, drawing)
            self.ms["frame"] = 1e3 * (time.perf_counter() - started)
            spent = {stage: ms + self.ms.get(stage, 0.0) for stage, ms in spent.items()}
            yield piece, Frame(pixels, stats | {"ms": self.ms | spent})

    @_in_own_context
    def _select(self, camera: Camera, size: tuple[int, int], drawing: Drawing) -> _Shot:
        """Choose the mesh of a picture."""
        near_m = drawing.near_m or NEAR * min(self.heightmap.spacing_m)
        self._shot = None
        promised_to = drawing.chosen_for or camera
        with self._timed("lod"):
            selection = self._choose(promised_to, size, near_m, drawing)
        if drawing.chosen_for:
            selection.surface.view.move(self.terrain, camera, size, near_m)
        return _Shot(promised_to, selection, near_m, drawing, eye=camera)

    def _choose(self, camera: Camera, size: tuple[int, int], near_m: float, drawing: Drawing) -> Selection:
        if drawing.method in RIVALS:
            how: dict[str, Any] = {"parameters": drawing.parameters, "triangles": drawing.triangles}
            how |= {"tolerance_px": drawing.tolerance_px, "cull": drawing.cull}
            return self.rivals.select(drawing.method, camera, size, near_m, **how)
        if drawing.method == "truth":
            return self.truth.select(camera, size, near_m, drawing.cull)
        asked = drawing.tolerance_px, drawing.metric, drawing.cull, drawing.triangles
        return self.levels.select(camera, size, near_m, *asked)

    @_in_own_context
    def _render_piece(self, piece: Piece, shot: _Shot, drawing: Drawing) -> np.ndarray:
        self._shade(piece, shot, drawing)
        return reduced(self.picture.read(), piece.fine)

    def _crop(self, piece: Piece, shot: _Shot) -> None:
        """Make a piece of the picture what is drawn next."""
        if self.picture.size != piece.drawn_size:
            self.picture.resize(piece.drawn_size)
        shot.selection.surface.view.crop(piece)

    def _shade(self, piece: Piece, shot: _Shot, drawing: Drawing) -> None:
        self._crop(piece, shot)
        with self._timed("draw"):
            self.picture.see(shot.selection, drawing.look)
        with self._timed("shade"):
            self.picture.shade(shot.eye, drawing.look)

    def _shading(self, piece: Piece, shot: _Shot, drawing: Drawing) -> Generator[float, None, None]:
        """The same in portions, after each the share that is done."""
        self._crop(piece, shot)
        seeing = self.picture.seeing(shot.selection, drawing.look)
        shading = self.picture.shading(shot.eye, drawing.look)
        for stage, portions, begun, whole in (("draw", seeing, 0.0, 0.3), ("shade", shading, 0.3, 0.7)):
            spent = 0.0
            while (share := self._timed_portion(stage, portions)) is not None:
                spent += self.ms.get(stage, 0.0)
                yield begun + whole * share
            if self.waits:
                self.ms[stage] = spent
        if self._stopwatch:
            self.ms |= self._stopwatch.frame() or {}

    def _timed_portion(self, stage: str, portions: Generator[float, None, None]) -> float | None:
        with self._timed(stage):
            return next(portions, None)

    @contextmanager
    def _whole_frame(self) -> Iterator[None]:
        """What was timed of a frame that is given up is not the next one's."""
        try:
            yield
        except BaseException:
            if self._stopwatch:
                self._stopwatch.drop()
            raise

    @_in_own_context
    def measure(self) -> dict[str, Any]:
        """The last frame's stats with its achieved error: that very mesh against every post in the picture.

        Adds `max_error_px`, `rms_error_px`, `posts_measured` and `holes`, the pixels and posts where the sky shows
        through.
        """
        shot = self._last_drawn()
        achieved = deque(self.measuring(), maxlen=1).pop()
        moved_px = max(shot.selection.certified_px or 0.0, achieved.max_px)  # the metric may be another
        through = count_holes(self.picture.coverage(), self.heightmap, shot.camera, self.size, shot.near_m, moved_px)
        shot.stats["max_error_px"], shot.stats["rms_error_px"] = achieved.max_px, achieved.rms_px
        shot.stats["posts_measured"], shot.stats["holes"] = achieved.posts, achieved.uncovered + through
        return shot.stats

    def best_parameters(self, camera: Camera, method: str, triangles: int, **options: Any) -> Parameters:
        """The parameters with which a rival has the least RMS error among those of about so many triangles.

        Measures them all: ends what `measure` and its kin could say of the last frame.

        Parameters
        ----------
        method
            "clipmap" or "tessellated".
        options
            Other fields of `Drawing`, by name.
        """
        tried = self.candidates(camera, method, triangles, options.get("near_m"))
        errors = [self._rms_px(camera, method=method, parameters=each, **options) for each in tried]
        self._shot = None
        return tried[int(np.argmin(errors))]

    @_in_own_context
    def candidates(self, camera: Camera, method: str, triangles: int, near_m: float | None = None) -> list[Parameters]:
        """Parameters with which a rival draws about so many triangles, the most promising first.

        Ends what `measure` and its kin could say of the last frame.
        """
        self._shot = None
        near_m = near_m or NEAR * min(self.heightmap.spacing_m)
        return cast(list[Parameters], self.rivals.of(method).candidates(camera, self.size, near_m, triangles))

    def _rms_px(self, camera: Camera, **options: Any) -> float:
        self.choose(camera, **options)
        return deque(self.measuring(), maxlen=1).pop().rms_px

    @_portions_in_own_context
    def measuring(self, tile: int = TILE) -> Generator[Achieved, None, None]:
        """Measure the last frame in portions of at most `tile` posts a side, for who must not wait for the whole.

        After each portion: what was achieved so far. To be gone through before anything else is drawn.
        """
        shot = self._last()
        yield from self._measuring().steps(shot.selection, shot.camera, self.size, shot.near_m, tile)

    @_in_own_context
    def error_map(self) -> np.ndarray:
        """(height, width) pixels: the largest screen error of what each pixel of the last frame shows; NaN for the sky.

        The very errors that `measure` speaks of, between posts bilinear, at the places that the pixel's samples see.
        """
        shot, places = self._last_drawn(), self.picture.places()
        px = self._measuring().at(places.reshape(-1, 2), shot.selection, shot.camera, self.size, shot.near_m)
        px = px.reshape(places.shape[:3])
        return np.fmax.reduce(px)

    @_in_own_context
    def explain(self, x: float, y: float) -> Explanation | None:
        """Why the patch over a place in world metres was drawn as it was; None where there is none to explain."""
        shot, view = self._last(), self._last().selection.surface.view
        drawing = shot.drawing
        east, north = self.heightmap.spacing_m
        self._explainer = self._explainer or self._keep(Explainer(self.levels))
        post = x / east, self.heightmap.rows - 1 - y / north
        tolerance_px = drawing.tolerance_px if drawing.triangles is None else math.inf
        view.move(self.terrain, shot.camera, self.size, shot.near_m)  # it may be looked at from elsewhere
        try:
            return self._explainer.explain(shot.selection, post, tolerance_px, drawing.metric)
        finally:
            view.move(self.terrain, shot.eye, self.size, shot.near_m)

    @_in_own_context
    def triangles(self) -> np.ndarray:
        """Triangles of the last frame as drawn: (n, 3, 2) columns and rows, counter-clockwise from above.

        Their corners are posts; with a number of triangles asked for also middles of cells: halves.
        """
        return self._last().triangles[0].copy()

    @_in_own_context
    def drawn_heights(self) -> np.ndarray:
        """(rows, cols) float32 metres: at posts where the last frame has a vertex its height, elsewhere the truth."""
        posts, heights_m = self._last().triangles
        drawn = self.terrain.filled.copy()
        on_post = (posts == np.floor(posts)).all(-1)
        col, row = posts[on_post].astype(np.int64).T
        drawn[row, col] = heights_m[on_post] + np.float32(self.terrain.base_m)
        return drawn

    @_in_own_context
    def triangulate(self, max_error_m: float) -> tuple[np.ndarray, dict[str, Any]]:
        """Triangles over the whole map that are nowhere further than `max_error_m` from a post, in height.

        Wherever they are seen from: there is no camera. Ends what `measure` and its kin could say of the last frame.

        Returns
        -------
        triangles
            (n, 3, 2) columns and rows of posts, counter-clockwise from above.
        stats
            `triangles`, `patches`, `splits`, `requested_max_error_m`, `certified_max_error_m`: docs/stats.md.

        Raises
        ------
        UsageError
            A tolerance that is not above 0.
        """
        if not 0 < max_error_m < 1e9:
            raise UsageError(f"max error must be more than 0 and less than 1e9 metres, got {max_error_m:g}")
        self._shot = None
        selection = self.levels.select_everywhere(max_error_m)
        triangles, _ = captured_triangles(selection)
        promise = {"requested_max_error_m": max_error_m, "certified_max_error_m": selection.certified_px}
        counts = {"triangles": len(triangles), "patches": selection.patches, "splits": selection.splits}
        return triangles, counts | promise | self._gl

    @_in_own_context
    def edit(self, rows: slice | int, cols: slice | int, heights: Any, settle: bool = True) -> None:
        """Give a rectangle of posts new heights, NaN for voids; all tables follow, as if built anew.

        Time grows with the rectangle, save for the tables' sums, of which all that stand south-east of it move along;
        everything is built anew when heights leave the span of the map: see `make_room`.

        Parameters
        ----------
        rows, cols
            Which posts, as slices or numbers, counted from the end where negative.
        heights
            Metres, of a shape that fits; NaN, ±Inf and what a masked array hides are voids.
        settle
            Have the light follow, too. It looks far over the map: while one sculpts it can wait for `settle`.

        Raises
        ------
        UsageError
            Heights of another shape, or no real numbers; posts beyond the map.
        TerrainError
            Heights out of all measure, or voids alone; the map is as it was then.
        """
        new = real_heights(heights, "edit")
        y, x = _chosen(self.heightmap.rows, rows, "rows"), _chosen(self.heightmap.cols, cols, "cols")
        if not (len(y) and len(x)):
            return
        patch = self.heightmap.heights[y.min() : y.max() + 1, x.min() : x.max() + 1]
        patch = patch.astype(np.result_type(patch, new))
        try:
            patch[np.ix_(y - y.min(), x - x.min())] = new
        except ValueError as error:
            raise UsageError(f"edit: {error}") from None
        self._shot = None
        with self._timed("edit"):
            if rect := self.terrain.edit(int(x.min()), int(y.min()), patch):
                self.tables.update(rect)
                self.rivals.update(rect)
                self.picture.update(rect)
                self._unsettled = hull(self._unsettled or rect, rect)
        if settle:
            self.settle()

    @_in_own_context
    def settle(self) -> None:
        """Have the light follow all edits that did not wait for it; nothing is done if there were none."""
        if self._unsettled:
            self.picture.settle(self._unsettled)
            self._unsettled = None

    @property
    def room_m(self) -> tuple[float, float]:
        """How far edits may dig below the lowest post, and raise the highest, before everything is built anew."""
        return self.terrain.room_m

    def make_room(self, up_m: float, down_m: float = 0.0) -> None:
        """Get ready for edits that raise the highest post by `up_m` and dig `down_m` below the lowest.

        Without it edits are just as right, but the first one copies the map, and one that leaves the map's span builds
        all tables anew, with room for more.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        """
        deque(self.making_room(up_m, down_m), maxlen=0)

    @_portions_in_own_context
    def making_room(self, up_m: float, down_m: float = 0.0) -> Generator[float, None, None]:
        """The same in portions, after each the share that is done: tables are made beside those that there are.

        One may draw meanwhile; an edit ends it. Nothing if there is room already.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        TerrainError
            The map was edited since the last portion; all is as the edit left it.
        """
        terrain = self.terrain.roomy(up_m, down_m)
        if terrain is None:
            return
        tables, edits = None, self.terrain.edits
        try:
            yield 0.0
            tables = self.tables.beside(terrain)
            yield 0.0
            for share in tables.building():
                self._check_unedited(edits)
                self.ctx.finish()  # who waits for portions wants them to be done
                yield 0.9 * share
            self._check_unedited(edits)
            based = terrain.base_m != self.terrain.base_m
            self.terrain.take(terrain)
            self.tables.take(tables)
        finally:  # with what was there before, or with what did not come to be
            terrain.release()
            if tables:
                tables.release_tables()
        self._shot = None
        if based:
            self.rivals.update(self.terrain.all_posts)
        self.picture.update(self.terrain.all_posts)
        self.picture.settle(self.terrain.all_posts, moved=based)
        yield 1.0

    def _check_unedited(self, edits: int) -> None:
        """Tables are made of the heights that there were; half of them would be of others."""
        if self.terrain.edits != edits:
            raise TerrainError("the map was edited while room was made for edits: begin again")

    def height_at(self, x: float, y: float) -> float:
        """The truth at a place in world metres, between posts bilinear; NaN over a void and outside the map."""
        east, north = self.heightmap.spacing_m
        row = self.heightmap.rows - 1 - y / north
        return float(bilinear(self.heightmap.heights, np.array([x / east]), np.array([row]))[0])

    @_in_own_context
    def drawn_height_at(self, x: float, y: float) -> float:
        """Height of the last frame's surface at a place in world metres; NaN where it draws nothing."""
        east, north = self.heightmap.spacing_m
        point = np.array([x / east, self.heightmap.rows - 1 - y / north])
        triangles, heights_m = self._last().triangles
        corners = triangles.astype(np.float64)
        a, b, c = corners[:, 0] - point, corners[:, 1] - point, corners[:, 2] - point
        weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], -1)
        inside = np.flatnonzero((weights <= 0).all(1))
        if not len(inside) or np.isnan(self.height_at(x, y)):
            return float("nan")
        weight = weights[inside[0]] / weights[inside[0]].sum()
        return float(weight @ heights_m[inside[0]].astype(np.float64)) + self.terrain.base_m

    def release(self) -> None:
        """Give the GPU's memory back."""
        if self._released:
            return
        self._released = True
        if self._owns_ctx:
            self.ctx.__enter__()
        for portions in self._half_done:
            if not portions.gi_running:  # else it is their failure that releases
                portions.close()
        while self._parts:
            self._parts.pop().release()
        if self._owns_ctx:
            self.ctx.release()

    @_in_own_context
    def _repr_png_(self) -> bytes | None:
        """The last picture, where a notebook shows the renderer."""
        return png_bytes(self.picture.read()) if self._shot else None

    def _enter(self) -> None:
        if self._released:
            raise TerrainError("this renderer has been released: make another one")
        if self._owns_ctx:
            self.ctx.__enter__()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def _measuring(self) -> Measurement:
        self._measurement = self._measurement or self._keep(Measurement(self.terrain))
        return self._measurement

    def _last(self) -> _Shot:
        if self._shot is None:
            raise TerrainError("nothing drawn since the map or the picture's size changed: render a frame first")
        return self._shot

    def _last_drawn(self) -> _Shot:
        if not (shot := self._last()).drawn:
            raise TerrainError("the mesh was chosen, but no picture drawn of it: draw a frame first")
        return shot

    def _stats(self, drawing: Drawing, selection: Selection, size: tuple[int, int]) -> dict[str, Any]:
        return {
            "method": drawing.method,
            "metric": drawing.metric,
            "triangles": selection.triangles,
            "patches": selection.patches,
            "splits": selection.splits,
            "certified_max_error_px": selection.certified_px,
            "requested_max_error_px": None if drawing.method in RIVALS else drawing.max_error_px,
            "requested_triangles": drawing.triangles,
            "lambda": selection.price,
            "width": size[0],
            "height": size[1],
            **self._gl,
            "ms": dict(self.ms),
            "ms_clock": "cpu" if self.waits and not self.queries else "gpu",
            "gpu_bytes": self.gpu_bytes(),
        }

    def gpu_bytes(self) -> dict[str, int]:
        """GPU memory by what it holds: the heights, the summed-area tables, the error table, shading, and all."""
        heights = self.heightmap.rows * self.heightmap.cols * (5 if self.heightmap.voids else 4)
        sat = self.tables.counters.size + self.tables.squares.size
        error = self.tables.nodes.size + self.tables.gains.size + self.tables.blocks.size
        parts = {"heights": heights, "sat": sat, "error": error, "shade": self.picture.bytes}
        return parts | {"total": sum(parts.values()) + self.levels.bytes + self.rivals.bytes}

    def _check_size(self, size: tuple[int, int]) -> None:
        most = min(limits(self.ctx)[name] for name in ("viewport_size", "renderbuffer_size", "texture_size"))
        if min(size) < 1 or max(size) > most:
            raise UsageError(f"picture size must be from 1x1 to {most}x{most} on this GPU, got {size[0]}x{size[1]}")

    def _room_for_picture(self, size: tuple[int, int]) -> AbstractContextManager[None]:
        what = f"a picture of {size[0]}x{size[1]} needs"
        return _memory_errors(self.ctx, what, 64 * size[0] * size[1], "use a smaller one")

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        started = time.perf_counter()
        with self._queried(stage):
            yield
        if self.waits:
            self.ctx.finish()
            self.ms[stage] = 1e3 * (time.perf_counter() - started)

    def _queried(self, stage: str) -> AbstractContextManager[None]:
        """Have the GPU time what is issued inside the block, where it is asked to."""
        if self.waits and not self.queries:
            return nullcontext()
        self._stopwatch = self._stopwatch or self._keep(Stopwatch(self.ctx))
        return self._stopwatch.stage(stage)


@contextmanager
def _memory_errors(ctx: moderngl.Context, what: str, needed: int, advice: str) -> Iterator[None]:
    """Say what needs how many bytes, and what to do, when the GPU has too little memory for it."""
    message = f"{what} about {max(1, needed >> 20)} MiB of GPU memory, more than is free: {advice}"
    try:
        yield
    except (moderngl.Error, MemoryError) as error:
        raise TerrainError(f"{message} ({error})") from None
    if ctx.error == "GL_OUT_OF_MEMORY":
        raise TerrainError(message)


def _chosen(n: int, which: Any, name: str) -> np.ndarray:
    """Numbers of the posts that a slice or a number means, among n."""
    try:
        chosen = np.atleast_1d(np.arange(n)[which])
    except (IndexError, TypeError, ValueError):
        chosen = None
    if chosen is None or chosen.ndim > 1:
        raise UsageError(f"edit: {name} must be a slice, or numbers from {-n} to {n - 1}, got {which!r}")
    return chosen


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
