"""The achieved error of a view: its own mesh, drawn from straight above, is compared with the truth.

Each cell is sampled at `PLACES` × `PLACES` places, posts included; between posts the truth is bilinear. The GPU
subtracts the truth from the drawn height at each place (glsl/mesh/error.frag). This module then projects the error of
every place in the picture to pixels, in float64.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..basics.steps import Steps, drain, portion
from ..camera import Camera, boxes_in_picture, in_picture, picture_planes, shift_px
from ..gpu import gl
from ..gpu.layout import PLACES, Patches
from ..gpu.passes import Resource, State
from ..heightmap import Heightmap, bilinear
from ..lod import RingsSelector, Selection
from ..lod.patches import PatchSurface
from ..mesh import MeshDraws
from ..terrain import Terrain

TILE = 512  # posts a side of the region that is measured together
_COMMANDS = 8  # draw commands of a step, each of at most `gpu.gl.MOST_VERTICES` vertices
_STORED = moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT
_FIRST = 64  # of so many patches, the one with the largest bound is measured first
_MOST = 0.25  # the largest share of the land that is measured to find the largest error alone
_BAND = 32  # rows of places that are projected together
Region = tuple[int, int, int, int]  # first column, first row, columns, rows
View = tuple[Selection, Camera, tuple[int, int], float]  # a mesh, its camera, the picture's size, the near plane
_FLIPS = ((0, 0), (1, 1), (1, 0), (0, 1))
# Weights along an axis of a place on a line of posts, and of one between: 3/22 at each end of a cell and 4/22 inside,
# in fifths. With equal weights, the mean of a bend over a cell that is cut could be above t²/64: docs/guarantee.md.
_ON_LINES, _BETWEEN = 2 * PLACES * 3 / 22, PLACES * 4 / 22


@dataclass(frozen=True)
class Achieved:
    """Screen error over the surface in a picture, without voids.

    Attributes
    ----------
    max_px, rms_px
        Pixels between the drawn and the true position of a place: the largest, and the root mean square over the area.
        For the latter, each place counts with the part of the cells around it that have data and are drawn, and with
        its weight in these cells (`_ON_LINES`).
    max_posts_px
        The largest error over posts alone.
    posts
        Number of measured posts.
    uncovered
        Number of places in the picture that no triangle covers, hidden land aside: 0 for a mesh without holes.
    share
        Share of the places in the picture that are drawn: 1 unless hidden land is left out.
    """

    max_px: float
    rms_px: float
    max_posts_px: float
    posts: int
    uncovered: int
    share: float = 1.0


class _Part(NamedTuple):
    """A rectangle of places: their screen error, NaN if nothing is drawn there, and whether they are in the picture."""

    region: Region
    px: np.ndarray  # (rows, cols)
    seen: np.ndarray

    def at_posts(self) -> _Part:
        """Only the posts of this part."""
        col, row = (-first % PLACES for first in self.region[:2])
        posts = np.s_[row::PLACES, col::PLACES]
        return self._replace(px=self.px[posts], seen=self.seen[posts])


class Measurement:
    """Draws meshes of a terrain from above; `errors_m` gives metres, `achieved` pixels."""

    def __init__(self, terrain: Terrain) -> None:
        self.terrain = terrain
        self.ctx = terrain.ctx
        self._draws = MeshDraws("ABOVE", geometry="mesh/triangle.geom", fragment="mesh/error.frag")
        cols, rows = (min(PLACES * TILE, n) for n in places_of(terrain.heightmap))
        self._nowhere = self.ctx.framebuffer(self.ctx.renderbuffer((cols, rows), 1))

    def errors_m(self, selection: Selection, region: Region) -> np.ndarray:
        """Drawn minus true height, in metres, at the places of a region (x, y, w, h).

        Returns (h, w) float32; NaN where nothing is drawn.
        """
        return drain(self._errors_steps(selection, region))

    def _errors_steps(self, selection: Selection, region: Region) -> Steps[np.ndarray]:
        """Incremental `errors_m`: a step draws a part of the mesh. A region may need millions of triangles."""
        draw = self._draws.of(selection.surface)
        x, y, width, height = region
        box = 0, 0, width, height
        errors_m = np.full((height, width), np.nan, "f4")
        image = self.ctx.texture((width, height), 1, errors_m, dtype="f4")
        truth = None if isinstance(self.terrain, Terrain) else self._truth_of(region)
        resources: dict[str, Resource] = {"u_error_m": image}
        uniforms: dict[str, Any] = {"tile": (x, y), "tile_size": (width, height)}
        if truth:
            resources["u_truth"] = truth
            uniforms["truth_first"] = x // PLACES, y // PLACES
        try:
            for number, flip in enumerate(_FLIPS):
                for first in range(0, selection.draws, _COMMANDS):
                    part = slice(first, first + _COMMANDS)
                    state = State(self._nowhere, box, box)
                    draw.draw(selection, state, resources, {**uniforms, "flip": flip}, part)
                    self.ctx.memory_barrier(_STORED)
                    self.ctx.finish()  # otherwise the last step would wait for all
                    yield (number + min(1.0, part.stop / selection.draws)) / len(_FLIPS)
                errors_m = np.frombuffer(image.read(), "f4").reshape(height, width)
                # a place on the rim of the map, or of hidden land, is on a triangle's edge, and the rasteriser covers
                # it in only one of the flips
                if not (selection.hidden or self._on_rim(region)) or not np.isnan(errors_m).any():
                    break
        finally:
            image.release()
            if truth:
                truth.release()
        return errors_m

    def _seen_errors_steps(self, region: Region, view: View) -> Steps[np.ndarray | None]:
        """Incremental `errors_m` of a region; None if none of its places are in the picture."""
        heightmap, (selection, camera, size, near_m) = self.terrain.heightmap, view
        for part in _parts_in_picture(heightmap, region, camera, size, near_m):
            if in_picture(camera, size, _from_camera(heightmap, part, camera), near_m).any():
                return (yield from self._errors_steps(selection, region))
        return None

    def achieved(self, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float) -> Achieved:
        """Project the error of every place in the picture to pixels."""
        return drain(self.achieved_steps(selection, camera, size, near_m))

    def achieved_steps(
        self, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float, tile: int = TILE
    ) -> Steps[Achieved]:
        """Incremental `achieved`, in regions of at most `tile` posts a side; yields progress from 0 to 1.

        Each region takes several steps: parts of its mesh, then bands of its places.
        """
        largest = largest_at_posts = total = area = 0.0
        places = posts = uncovered = seen = 0
        hidden = _hidden_boxes(selection)
        regions = list(_regions_in_picture(self.terrain.heightmap, PLACES * min(tile, TILE), camera, size, near_m))
        for done, region in enumerate(regions):
            drawing = self._seen_errors_steps(region, (selection, camera, size, near_m))
            drawn = yield from portion(drawing, done, len(regions))
            for part in self._parts(drawn, region, camera, size, near_m):
                behind = _inside(hidden, part.region)  # with the rims that hidden patches share with drawn ones
                known = ~np.isnan(part.px)
                uncovered += int(np.count_nonzero(part.seen & ~known & ~behind))
                seen += int(np.count_nonzero(part.seen))
                share = known * _drawn_shares(self.terrain.heightmap, hidden, part.region)
                px = np.where(share > 0, part.px, 0.0)  # an error may be infinite
                total += float(np.einsum("ij,ij,ij", share, px, px))  # for `@`, threads of OpenBLAS wait busily
                area += float(share.sum())
                part.px[behind] = np.nan
                at_posts = part.at_posts().px
                places += int(np.count_nonzero(known & ~behind))
                posts += int(np.count_nonzero(~np.isnan(at_posts)))
                largest = max(largest, float(np.fmax.reduce(part.px, None, initial=0.0)))
                largest_at_posts = max(largest_at_posts, float(np.fmax.reduce(at_posts, None, initial=0.0)))
                yield (done + 1) / len(regions)
            if drawn is None:
                yield (done + 1) / len(regions)
        rms_px = float(np.sqrt(total / area)) if area else 0.0
        return Achieved(largest, rms_px, largest_at_posts, posts, uncovered, places / seen if seen else 1.0)

    def largest_steps(
        self, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float, tile: int = TILE
    ) -> Steps[float | None]:
        """Find `Achieved.max_px` by branch and bound; yields progress from 0 to 1.

        First the patches with the largest certified bounds are measured, then all others whose bounds are not below the
        largest error found so far. The rest is skipped, so the result relies on the bounds of these patches.

        Returns
        -------
        px
            None if patches have no bounds for points, if one of these bounds is seen to be wrong, or if more than
            `_MOST` of the land would have to be measured.
        """
        surface = selection.surface
        if not isinstance(surface, PatchSurface) or selection.certified_px is None or selection.farthest_px is not None:
            return None
        patches, drawn = surface.chosen(selection), surface.drawn(selection)
        boxes, bounds_px = _boxes(patches), patches.bound_px
        land = patches.size[:, 0].astype(float) ** 2
        by_bound = drawn[np.argsort(-bounds_px[drawn])]
        first = -(-len(drawn) // _FIRST)
        regions = list(_regions_in_picture(self.terrain.heightmap, PLACES * min(tile, TILE), camera, size, near_m))
        largest = 0.0
        for turn, some in enumerate((by_bound[:first], by_bound[first:])):
            if land[some[bounds_px[some] >= largest]].sum() > _MOST * land[drawn].sum():
                return None
            for number, region in enumerate(regions, turn * len(regions)):
                which = some[_touching(boxes[some], region) & (bounds_px[some] >= largest)]
                if len(which):
                    part = replace(surface.part_of(selection, which), hidden=0)
                    errors_m = yield from portion(self._errors_steps(part, region), number, 2 * len(regions))
                    for box in boxes[which].tolist():
                        for band in self._parts(*_cut(errors_m, region, box), camera, size, near_m):
                            behind = _inside(boxes[selection.patches :], band.region)
                            largest = max(largest, float(np.fmax.reduce(band.px[~behind], None, initial=0.0)))
                        yield (number + 1) / (2 * len(regions))
            yield 0.5 * (turn + 1)
        return largest if largest <= selection.certified_px else None

    def jumps_steps(
        self, before: View, after: View, least_px: float, tile: int = TILE
    ) -> Steps[tuple[np.ndarray, np.ndarray]]:
        """How far posts jump from one picture to the next: the change of the distance from their true places.

        Both pictures must show the post. Yields progress from 0 to 1.

        Returns
        -------
        posts
            (n, 2) columns and rows of the posts that jump by `least_px` or more.
        px
            (n,) pixels.
        """
        found = [(np.zeros((0, 2), int), np.zeros(0))]
        regions = list(_regions_in_picture(self.terrain.heightmap, PLACES * min(tile, TILE), *after[1:]))
        for done, region in enumerate(regions):
            after_px = yield from portion(self._shifts_steps(region, after), 2 * done, 2 * len(regions))
            before_px = yield from portion(self._shifts_steps(region, before), 2 * done + 1, 2 * len(regions))
            jump_px = np.abs(after_px - before_px)
            far = jump_px >= least_px
            first = -(-region[0] // PLACES), -(-region[1] // PLACES)
            found.append((np.argwhere(far)[:, ::-1] + first, jump_px[far]))
            yield (done + 1) / len(regions)
        posts, px = zip(*found, strict=True)
        return np.concatenate(posts), np.concatenate(px)

    def _shifts_steps(self, region: Region, view: View) -> Steps[np.ndarray]:
        """Pixels by which each post of a region is drawn above its true place; below 0 if under it, NaN if not seen."""
        x, y, width, height = region
        px = np.full((height, width), np.nan)
        drawn = yield from self._seen_errors_steps(region, view)
        for part in self._parts(drawn, region, *view[1:], signed=True):
            left, top, w, h = part.region
            px[top - y : top - y + h, left - x : left - x + w] = part.px
        return px[-y % PLACES :: PLACES, -x % PLACES :: PLACES]

    def at(
        self, places: np.ndarray, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float
    ) -> np.ndarray:
        """Screen error at points of the map, (n, 2) columns and rows of posts: (n,) pixels.

        The error is interpolated between the measured places around the point that are in the picture; NaN if there are
        none.
        """
        col, row = PLACES * places.T.astype(np.float64)
        at = np.full(len(places), np.nan)
        for region in _overlapping(*places_of(self.terrain.heightmap), PLACES * TILE):
            x, y, width, height = region
            inside = np.flatnonzero((col >= x) & (row >= y) & (col <= x + width - 1) & (row <= y + height - 1))
            if not len(inside):
                continue
            px = np.full((height, width), np.nan, np.float32)
            drawn = drain(self._seen_errors_steps(region, (selection, camera, size, near_m)))
            for part in self._parts(drawn, region, camera, size, near_m):
                left, top, w, h = part.region
                px[top - y : top - y + h, left - x : left - x + w] = part.px
            at[inside] = _between_known(px, col[inside] - x, row[inside] - y)
        return at

    def _parts(
        self,
        drawn: np.ndarray | None,
        region: Region,
        camera: Camera,
        size: tuple[int, int],
        near_m: float,
        signed: bool = False,
    ) -> Iterator[_Part]:
        """Project the errors of the parts of a region that may be in the picture. They are NaN outside the picture.

        `drawn` are those in metres, None if no part is in the picture.
        `signed`: errors of places that are drawn under their true places are less than 0.
        """
        heightmap = self.terrain.heightmap
        if drawn is None:
            return
        for part in _parts_in_picture(heightmap, region, camera, size, near_m):
            at = _from_camera(heightmap, part, camera)
            seen = in_picture(camera, size, at, near_m)
            if not seen.any():
                continue
            col, row = part[0] - region[0], part[1] - region[1]
            errors = drawn[row : row + part[3], col : col + part[2]].astype(np.float64)
            known = seen & np.isfinite(errors)
            px = np.full(seen.shape, np.nan)
            px[known] = shift_px(camera, size, [axis[known] for axis in at], errors[known])
            if signed:
                px[known] *= np.sign(errors[known])
            yield _Part(part, px, seen)

    def release(self) -> None:
        """Release GPU resources."""
        gl.release_with_pixels(self._nowhere)
        self._draws.release()

    def _truth_of(self, region: Region) -> moderngl.Texture:
        """The true heights of a region, voids filled, because a paged map is not wholly on the GPU."""
        heightmap: Any = self.terrain.heightmap
        x, y = region[0] // PLACES, region[1] // PLACES
        rows = slice(y, min((region[1] + region[3] - 1) // PLACES + 2, heightmap.rows))
        cols = slice(x, min((region[0] + region[2] - 1) // PLACES + 2, heightmap.cols))
        posts = heightmap.lattice_heights(0, rows, cols) - np.float32(self.terrain.base_m)
        return self.ctx.texture(posts.shape[::-1], 1, np.ascontiguousarray(posts), dtype="f4")

    def _on_rim(self, region: Region) -> bool:
        x, y, width, height = region
        cols, rows = places_of(self.terrain.heightmap)
        return x == 0 or y == 0 or x + width == cols or y + height == rows


def _hidden_boxes(selection: Selection) -> np.ndarray:
    """Boxes of the hidden patches of a selection, (n, 4): first column and row, last column and row of places."""
    if not selection.hidden or not isinstance(selection.surface, RingsSelector):
        return np.empty((0, 4), int)
    return _boxes(selection.surface.chosen(selection))[selection.patches :]


def _boxes(patches: Patches) -> np.ndarray:
    """Closed boxes of patches, (n, 4): first column and row, last column and row of places."""
    return PLACES * np.hstack([patches.corner, patches.corner + patches.size])


def _cut(errors_m: np.ndarray, region: Region, box: list[int]) -> tuple[np.ndarray, Region]:
    """The errors of a region in a closed box, and the region that they cover."""
    x, y, width, height = region
    left, top, right, bottom = max(x, box[0]), max(y, box[1]), min(x + width, box[2] + 1), min(y + height, box[3] + 1)
    return errors_m[top - y : bottom - y, left - x : right - x], (left, top, right - left, bottom - top)


def _inside(boxes: np.ndarray, region: Region) -> np.ndarray:
    """Whether each place of a region lies in one of the closed boxes, (h, w) bool."""
    x, y, width, height = region
    inside = np.zeros((height, width), bool)
    for x0, y0, x1, y1 in np.maximum(boxes[_touching(boxes, region)] - [x, y, x, y], 0).tolist():
        inside[y0 : y1 + 1, x0 : x1 + 1] = True
    return inside


def _touching(boxes: np.ndarray, region: Region) -> np.ndarray:
    """Which closed boxes have places in common with a region."""
    x, y, width, height = region
    return (boxes[:, 0] < x + width) & (boxes[:, 1] < y + height) & (boxes[:, 2] >= x) & (boxes[:, 3] >= y)


def _drawn_shares(heightmap: Heightmap, hidden: np.ndarray, region: Region) -> np.ndarray:
    """The weight of each place, (h, w): of the cells around it, those that have data and are not hidden count."""
    x, y, width, height = region
    rows, cols = (np.arange((at - 1) // PLACES, (at + n - 1) // PLACES + 1) for at, n in ((y, height), (x, width)))
    drawn = ~_holes(heightmap, rows, cols)
    boxes = hidden // PLACES - [cols[0], rows[0], cols[0], rows[0]]
    near = (boxes[:, :2] < [len(cols), len(rows)]).all(1) & (boxes[:, 2:] > 0).all(1)
    for x0, y0, x1, y1 in np.maximum(boxes[near], 0).tolist():
        drawn[y0:y1, x0:x1] = False
    weights = []
    share = 0.25 * drawn.astype(np.float32)
    for axis, (at, n, first) in enumerate(((y, height, rows[0]), (x, width, cols[0]))):
        before, after = ((at + np.arange(n) - k) // PLACES - first for k in (1, 0))
        weights.append(np.where(before == after, _BETWEEN, _ON_LINES).astype(np.float32))
        share = np.ones(1, np.float32) if drawn.all() else share.take(before, axis) + share.take(after, axis)
    return weights[0][:, None] * share * weights[1]


def places_of(heightmap: Heightmap) -> tuple[int, int]:
    """Columns and rows of the places that are measured."""
    return PLACES * (heightmap.cols - 1) + 1, PLACES * (heightmap.rows - 1) + 1


def _regions_in_picture(
    heightmap: Heightmap, tile: int, camera: Camera, size: tuple[int, int], near_m: float
) -> Iterator[Region]:
    """Regions that may be in the picture: the map's four rims, one place wide, and tiles of the rest of the map."""
    cols, rows = places_of(heightmap)
    east, north = _steps_m(heightmap)
    low_m, high_m = heightmap.range_m
    low_m -= 0.25 * camera.bend_per_m * PLACES**2 * (east**2 + north**2)  # between posts: `drop_between_m`
    y, height = np.array(list(_spans(rows, tile))).T
    for x, width in _spans(cols, tile):
        low = np.stack(np.broadcast_arrays(x * east, (rows - y - height) * north, low_m), -1)
        high = np.stack(np.broadcast_arrays((x + width - 1) * east, (rows - 1 - y) * north, high_m), -1)
        for i in np.flatnonzero(boxes_in_picture(camera, size, near_m, low, high)):
            yield x, int(y[i]), width, int(height[i])


def _overlapping(cols: int, rows: int, tile: int) -> Iterator[Region]:
    """Tiles that share their rims: every point of the map lies inside one of them."""
    for y in range(0, rows - 1, tile - 1):
        for x in range(0, cols - 1, tile - 1):
            yield x, y, min(tile, cols - x), min(tile, rows - y)


def _between_known(px: np.ndarray, col: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Bilinear interpolation, in which unknown values have no weight."""
    known = np.isfinite(px)
    weight = bilinear(known, col, row)
    at = np.full(len(col), np.nan)
    near = weight > 0
    at[near] = bilinear(np.where(known, px, 0), col[near], row[near]) / weight[near]
    return at


def _parts_in_picture(
    heightmap: Heightmap, region: Region, camera: Camera, size: tuple[int, int], near_m: float
) -> Iterator[Region]:
    """Bands of rows, cut to the columns that may be in the picture.

    A side of the picture is a plane n · (p - eye) = d; the picture is where n · (p - eye) ≥ d. A column is left out if
    no point in it, at any height of the map and in any row of the band, is on the picture's side of the plane.
    """
    x, y, width, height = region
    planes = picture_planes(camera, size, near_m)
    east, north = _steps_m(heightmap)
    last = places_of(heightmap)[1] - 1
    heights_m = _drawn_range_m(heightmap, region, camera)
    for top in range(y, y + height, _BAND):
        rows = np.array([top, min(top + _BAND, y + height) - 1])
        first, end = float(x), float(x + width)
        for n, d in planes:
            most = max(n[1] * (last - rows) * north) + max(n[2] * heights_m) - n @ camera.eye - d
            if n[0] == 0:
                end = end if most >= 0 else first
            elif n[0] > 0:
                first = max(first, np.floor(-most / (n[0] * east)) - 1)
            else:
                end = min(end, np.ceil(-most / (n[0] * east)) + 2)
        if first < end:
            yield int(first), top, int(end - first), int(rows[1] - rows[0]) + 1


def _drawn_range_m(heightmap: Heightmap, region: Region, camera: Camera) -> np.ndarray:
    """Lowest and highest height at which places of a region may be drawn, drops included."""
    x, y, width, height = region
    cols, rows = (np.array([first, first + n - 1]) / PLACES for first, n in ((x, width), (y, height)))
    drop_m = camera.drop_between_m(heightmap, np.floor(cols) + [0, 1], np.floor(rows[:, None]) + [[0], [1]])
    return np.array(heightmap.range_m) - [drop_m.max(), 0.0]


def _spans(n: int, tile: int) -> Iterator[tuple[int, int]]:
    yield 0, 1
    for first in range(1, n - 1, tile):
        yield first, min(tile, n - 1 - first)
    yield n - 1, 1


def truth_m(heightmap: Heightmap, region: Region) -> np.ndarray:
    """True heights at a region's places, (h, w) float64, bilinear between posts; NaN over voids.

    A place on the edge between two posts is NaN, too, if all cells beside it are holes: there is no known surface.
    """
    x, y, width, height = region
    cols = np.s_[x // PLACES : (x + width - 1) // PLACES + 2]
    rows = np.s_[y // PLACES : (y + height - 1) // PLACES + 2]
    fine = _finer(heightmap.heights[rows, cols], y - PLACES * rows.start, height)
    truth = _finer(fine.T, x - PLACES * cols.start, width).T
    return np.where(_between_holes(heightmap, region), np.nan, truth) if heightmap.voids else truth


def _between_holes(heightmap: Heightmap, region: Region) -> np.ndarray:
    """Whether each place is on the common edge of two holes, or of a hole and the map's rim: (h, w) bool."""
    x, y, width, height = region
    (row, part_y), (col, part_x) = (np.divmod(at + np.arange(n), PLACES) for at, n in ((y, height), (x, width)))
    hole = _holes(heightmap, *(np.arange(axis[0] - 1, axis[-1] + 1) for axis in (row, col)))
    row, col = row - row[0], col - col[0]
    along_row = (part_y == 0)[:, None] & (part_x > 0) & hole[np.ix_(row, col + 1)] & hole[np.ix_(row + 1, col + 1)]
    along_col = (part_y > 0)[:, None] & (part_x == 0) & hole[np.ix_(row + 1, col)] & hole[np.ix_(row + 1, col + 1)]
    return along_row | along_col


def _holes(heightmap: Heightmap, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Which cells have a void corner, or lie beyond the map, for consecutive rows and columns of cells."""
    posts = [np.append(axis, axis[-1] + 1) for axis in (rows, cols)]
    inside = [(axis >= 0) & (axis < n) for axis, n in zip(posts, (heightmap.rows, heightmap.cols), strict=True)]
    void = ~inside[0][:, None] | ~inside[1]
    if heightmap.voids:
        at = (np.where(kept, axis, 0) for axis, kept in zip(posts, inside, strict=True))
        void |= np.isnan(heightmap.heights[np.ix_(*at)])
    return void[1:, 1:] | void[1:, :-1] | void[:-1, 1:] | void[:-1, :-1]


def _finer(heights: np.ndarray, first: int, n: int) -> np.ndarray:
    """Heights of places along the first axis, linear between two posts. A post beside a void keeps its height."""
    post, part = np.divmod(first + np.arange(n), PLACES)
    low = heights[post].astype(np.float64)
    high = heights[np.minimum(post + 1, len(heights) - 1)]
    return np.where(part[:, None] == 0, low, low + (high - low) * (part[:, None] / PLACES))


def _steps_m(heightmap: Heightmap) -> tuple[float, float]:
    """Metres between places, east and north."""
    return heightmap.spacing_m[0] / PLACES, heightmap.spacing_m[1] / PLACES


def _from_camera(heightmap: Heightmap, region: Region, camera: Camera) -> list[np.ndarray]:
    """Coordinates of a region's places along the camera's axes: three arrays (h, w), metres from the eye."""
    x, y, width, height = region
    step = _steps_m(heightmap)
    last = places_of(heightmap)[1] - 1
    east = (x + np.arange(width)) * step[0] - camera.eye[0]
    north = ((last - y - np.arange(height)) * step[1] - camera.eye[1])[:, None]
    cols, rows = (x + np.arange(width)) / PLACES, (y + np.arange(height))[:, None] / PLACES
    up = truth_m(heightmap, region) - camera.drop_between_m(heightmap, cols, rows) - camera.eye[2]
    return [axis[0] * east + axis[1] * north + axis[2] * up for axis in camera.axes]
