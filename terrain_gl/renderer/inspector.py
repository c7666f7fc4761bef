"""Questions about the last frame: which error it achieved, which triangles were drawn, and why."""

import math
from typing import Any, cast

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.rect import Rect
from ..basics.steps import Steps, drain
from ..camera import Camera
from ..camera.rounding import mesh_rounding_px
from ..gpu.session import in_session, steps_in_session
from ..heightmap import Heightmap, bilinear
from ..lod import METRES, Goal, RingsSelector, Selection
from ..mesh import captured_triangles
from ..terrain import Terrain
from ..verify.explain import Explanation, Lookup, PatchExplainer
from ..verify.holes import count_holes
from ..verify.measure import TILE, Achieved, Measurement
from .frame import DrawnFrame, Measured, WholeMapMesh
from .gpu_resources import GpuResources

_MOST_READ = 10_000_000  # most triangles that are read back for a bound of their rounding


class Inspector:
    """Looks at the last frame of a renderer.

    Attributes
    ----------
    frame
        The last frame; None if there is none, or if the map or the picture's size has changed since.
    """

    def __init__(self, resources: GpuResources) -> None:
        self.session = resources.session
        self.resources = resources
        self.frame: DrawnFrame | None = None
        self._measurement: Measurement | None = None
        self._explainer: PatchExplainer | None = None

    @property
    def terrain(self) -> Terrain:
        """The map on the GPU."""
        return self.resources.terrain

    @property
    def heightmap(self) -> Heightmap:
        """The map as it is now."""
        return self.terrain.heightmap

    @in_session
    def measure(self) -> Measured:
        """The last frame's stats with its achieved error: its mesh is compared with the true surface.

        Adds `max_error_px` and `rms_error_px` over 5 × 5 places in each cell; `max_error_posts_px` over posts alone;
        `posts_measured`; `land_measured`, the share of the land in the picture that is drawn and so can be measured;
        `rounding_px`, a bound of what the GPU's float32 adds on the screen; and `holes`, the number of pixels and
        places where the sky shows through, or where land is left out as hidden but would be seen.
        """
        frame = self._drawn()
        achieved = drain(self.measure_steps())
        moved_px = max(frame.selection.certified_px or 0.0, achieved.max_px)  # the bound may be for another metric
        coverage = self.resources.picture.coverage()
        through = count_holes(coverage, self.heightmap, frame.camera, frame.size, frame.near_m, moved_px)
        frame.stats["max_error_px"] = achieved.max_px
        frame.stats["rms_error_px"] = achieved.rms_px
        frame.stats["max_error_posts_px"] = achieved.max_posts_px
        frame.stats["posts_measured"] = achieved.posts
        frame.stats["land_measured"] = achieved.share
        frame.stats["rounding_px"] = self._rounding_px(frame)
        left_out = 0
        if frame.selection.hidden and frame.eye == frame.camera:  # another eye may see what is hidden from the camera
            left_out = int(np.count_nonzero(self.resources.picture.sees_hidden(frame.selection, frame.options.shading)))
        frame.stats["holes"] = achieved.uncovered + through + left_out
        return frame.stats

    def _rounding_px(self, frame: DrawnFrame) -> float | None:
        """What float32 adds at most; None for a mesh without a certificate, and for a very large one."""
        if frame.selection.certified_px is None or frame.selection.most_triangles > _MOST_READ:
            return None
        view = frame.camera, frame.size, frame.near_m
        return mesh_rounding_px(frame.triangles, self.heightmap, self.terrain.base_m, *view)

    @steps_in_session
    def measure_steps(self, tile: int = TILE, frame: DrawnFrame | None = None) -> Steps[Achieved]:
        """Measure a frame, by default the last one, in tiles of at most `tile` posts a side; yields progress, 0 to 1.

        It also works for a mesh without a picture. It does not count holes.
        """
        frame = frame or self._chosen()
        view = frame.camera, frame.size, frame.near_m
        return (yield from self._measuring().achieved_steps(frame.selection, *view, tile))

    @steps_in_session
    def largest_steps(self, tile: int = TILE, frame: DrawnFrame | None = None) -> Steps[float | None]:
        """The largest error of a frame, sooner than by `measure_steps`: see `Measurement.largest_steps`."""
        frame = frame or self._chosen()
        view = frame.camera, frame.size, frame.near_m
        return (yield from self._measuring().largest_steps(frame.selection, *view, tile))

    @steps_in_session
    def jumps_steps(
        self, before: DrawnFrame, after: DrawnFrame, least_px: float, tile: int = TILE
    ) -> Steps[tuple[np.ndarray, np.ndarray]]:
        """How far posts jump from one frame to the next: see `Measurement.jumps_steps`. The last frame is then `after`.

        docs/guarantee.md, section 10: no jump is larger than the sum of both frames' certified largest errors.
        """
        first, second = ((each.selection, each.camera, each.size, each.near_m) for each in (before, after))
        self.frame = after
        after.look()  # so that lines over the picture are drawn for its eye
        return (yield from self._measuring().jumps_steps(first, second, least_px, tile))

    @in_session
    def error_map(self) -> np.ndarray:
        """The largest screen error of the land that each pixel of the last frame shows: (height, width) pixels.

        NaN for the sky. These are the errors that `measure` reports, interpolated between the measured places.
        """
        frame = self._drawn()
        places = self.resources.picture.places()
        px = self._measuring().at(places.reshape(-1, 2), frame.selection, frame.camera, frame.size, frame.near_m)
        px = px.reshape(places.shape[:3])
        return np.fmax.reduce(px)

    @in_session
    def explain(self, x: float, y: float, frame: DrawnFrame | None = None) -> Explanation | None:
        """Why a frame, by default the last one, has the patch that it has over a place in world metres.

        None where no patch can be explained.
        """
        frame = frame or self._chosen()
        options = frame.options
        self._explainer = self._explainer or self.session.keep(PatchExplainer(self.session.ctx, self.terrain.defines))
        tolerance_px = options.tolerance_px if options.triangles is None else math.inf
        frame.look(frame.camera)  # the picture may have another eye
        explanation = self._explainer.explain(frame.selection, self._post(x, y), tolerance_px, options.metric)
        frame.look()  # so that lines over the picture are drawn for its eye
        return explanation

    @in_session
    def error_counts(self, lookup: Lookup, tiles: Rect) -> np.ndarray:
        """Entries of the table of error counts that a look-up of `explain` reads, for a rectangle of tiles."""
        return self.resources.tables.read_counts(lookup.level, lookup.error_class, tiles)

    @in_session
    def triangles(self, frame: DrawnFrame | None = None) -> np.ndarray:
        """Triangles of a frame, by default the last one: (n, 3, 2) columns and rows, counter-clockwise from above.

        Corners are whole numbers on posts. Where cells are cut, they are fractions, in whole 64ths of a post.
        """
        return (frame or self._chosen()).triangles[0].copy()

    @in_session
    def drawn_heights(self, frame: DrawnFrame | None = None) -> np.ndarray:
        """(rows, cols) float32 metres: the drawn height at posts with a vertex, the true height elsewhere.

        For a store: a `PostsOnDemand` with the heights of the loaded tiles. All vertices have these heights.
        """
        posts, heights_m = (frame or self._chosen()).triangles
        drawn = self.terrain.filled.copy()
        if self.resources.streaming:
            return drawn
        on_post = (posts == np.floor(posts)).all(-1)
        col, row = posts[on_post].astype(np.int64).T
        drawn[row, col] = heights_m[on_post] + np.float32(self.terrain.base_m)
        return drawn

    def height_at(self, x: float, y: float) -> float:
        """The true height at a place in world metres, bilinear between posts; NaN over a void and off the map."""
        col, row = self._post(x, y)
        return float(bilinear(self.heightmap.heights, np.array([col]), np.array([row]))[0])

    @in_session
    def drawn_height_at(self, x: float, y: float) -> float:
        """The drawn height at a place in world metres; NaN where nothing is drawn."""
        triangles, heights_m = self._chosen().triangles
        corners = triangles.astype(np.float64)
        post = np.array(self._post(x, y))
        a, b, c = corners[:, 0] - post, corners[:, 1] - post, corners[:, 2] - post
        weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], -1)
        inside = np.flatnonzero((weights <= 0).all(1))
        is_hole = self._chosen().options.voids == "hole" and np.isnan(self.height_at(x, y))
        if not len(inside) or is_hole:
            return float("nan")
        weight = weights[inside[0]] / weights[inside[0]].sum()
        cols, rows = np.vstack([triangles[inside[0]], post]).astype(np.float64).T
        drop_m = self._chosen().eye.drop_between_m(self.heightmap, cols, rows)
        sag_m = float(weight @ drop_m[:3] - drop_m[3])
        return float(weight @ heights_m[inside[0]].astype(np.float64)) - sag_m + self.terrain.base_m

    @in_session
    def triangulate(self, max_error_m: float) -> tuple[np.ndarray, WholeMapMesh]:
        """Triangles over the whole map whose heights differ nowhere by more than `max_error_m` from the truth.

        No camera is needed.

        Returns
        -------
        triangles
            (n, 3, 2) columns and rows, counter-clockwise from above; whole numbers, except in cells that are cut.
        stats
            `triangles`, `patches`, `splits`, `requested_max_error_m`, `certified_max_error_m`; for a store, also its
            missing tiles: docs/stats.md.

        Raises
        ------
        UsageError
            A tolerance that is not above 0.
        """
        if not 0 < max_error_m < 1e9:
            raise UsageError(f"max error must be more than 0 and less than 1e9 metres, got {max_error_m:g}")
        selection, loaded = self._everywhere(max_error_m)
        triangles, _ = captured_triangles(selection)
        counts = {"triangles": len(triangles), "patches": selection.patches, "splits": selection.splits}
        bound = {"requested_max_error_m": max_error_m, "certified_max_error_m": selection.certified_px}
        return triangles, cast(WholeMapMesh, counts | bound | loaded)

    def _everywhere(self, max_error_m: float) -> tuple[Selection, dict[str, Any]]:
        """The mesh of the whole map; of a store after all its tiles are loaded."""
        rings = self.resources.selectors["sat"]
        assert isinstance(rings, RingsSelector)
        if not self.resources.streaming:
            return rings.select_everywhere(max_error_m), {}
        goal = Goal(max_error_m, METRES, cull=False)
        above = Camera.default(self.resources.terrain.heightmap)
        return self.resources.streaming.select(lambda _: rings.select_everywhere(max_error_m), above, goal)

    def _post(self, x: float, y: float) -> tuple[float, float]:
        """Column and row of a place in world metres."""
        east, north = self.heightmap.ground_spacing_m
        return x / east, self.heightmap.rows - 1 - y / north

    def _measuring(self) -> Measurement:
        self._measurement = self._measurement or self.session.keep(Measurement(self.terrain))
        return self._measurement

    def _chosen(self) -> DrawnFrame:
        if self.frame is None:
            raise TerrainError("nothing drawn since the map or the picture's size changed: render a frame first")
        self.frame.look()  # another mesh may have been chosen since
        return self.frame

    def _drawn(self) -> DrawnFrame:
        frame = self._chosen()
        if not frame.has_picture:
            raise TerrainError("the mesh was chosen, but no picture drawn of it: draw a frame first")
        return frame


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
