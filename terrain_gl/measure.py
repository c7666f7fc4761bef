"""The achieved error of a view: its very mesh, drawn from straight above, compared with the truth post by post.

What the GPU drew at each post is subtracted from the post's height there and then (glsl/mesh/error.frag); here every
post in the picture is projected in float64.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np

from . import gl
from .camera import Camera, screen_shift_px
from .heightmap import Heightmap
from .holes import bilinear
from .lod import Selection
from .mesh import MeshDraw, MeshDraws
from .terrain import Terrain

TILE = 2048  # posts a side that are measured at a time
_BAND = 64  # rows that are looked at together
Region = tuple[int, int, int, int]
_FLIPS = ((0, 0), (1, 1), (1, 0), (0, 1))


@dataclass(frozen=True)
class Achieved:
    """Screen error over all posts in a picture, voids aside.

    Attributes
    ----------
    max_px, rms_px
        Pixels between where a post is drawn and where it belongs.
    posts
        Posts measured.
    uncovered
        Posts in the picture that no triangle covers: 0 for a mesh without holes.
    """

    max_px: float
    rms_px: float
    posts: int
    uncovered: int


class Measurement:
    """Draws meshes of a terrain from above; `errors_m` gives metres, `achieved` pixels."""

    def __init__(self, terrain: Terrain) -> None:
        self.terrain, self.ctx = terrain, terrain.ctx
        self._draws = MeshDraws("ABOVE", geometry="mesh/triangle.geom", fragment="mesh/error.frag")
        heightmap = terrain.heightmap
        size = min(TILE, heightmap.cols), min(TILE, heightmap.rows)
        self._errors = self.ctx.texture(size, 1, dtype="f4")
        self._nowhere = self.ctx.framebuffer(self.ctx.renderbuffer(size, 1))
        self._nothing = np.full((size[1], size[0]), np.nan, "f4").tobytes()

    def errors_m(self, selection: Selection, region: Region) -> np.ndarray:
        """Drawn minus true height in metres at the posts of columns x to x + w, rows y to y + h (x, y, w, h).

        Returns (h, w) float32; NaN where nothing is drawn.
        """
        draw = self._draws.of(selection.surface)
        for flip in _FLIPS:
            first = flip == _FLIPS[0]
            errors = self._pass(draw, selection, region, flip, clear=first)
            # a post on the map's rim is inside a triangle by one direction of the rasteriser's edge rule only
            if not self._on_rim(region) or not np.isnan(errors).any():
                break
        return errors

    def achieved(self, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float) -> Achieved:
        """Project every post in the picture and compare."""
        return deque(self.steps(selection, camera, size, near_m), maxlen=1).pop()

    def steps(
        self, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float, tile: int = TILE
    ) -> Iterator[Achieved]:
        """Go over the map in regions of at most `tile` posts a side; after each, what holds of the posts so far."""
        largest = total = 0.0
        posts = uncovered = 0
        heightmap = self.terrain.heightmap
        for region in _regions(heightmap.cols, heightmap.rows, min(tile, TILE)):
            for _, px, seen in self._errors_px(selection, region, camera, size, near_m):
                drawn = px[~np.isnan(px)]
                uncovered += int(np.count_nonzero(seen)) - len(drawn)
                posts += len(drawn)
                largest = max(largest, float(drawn.max(initial=0.0)))
                total += float(np.square(drawn).sum())
            yield Achieved(largest, float(np.sqrt(total / posts)) if posts else 0.0, posts, uncovered)

    def at(
        self, places: np.ndarray, selection: Selection, camera: Camera, size: tuple[int, int], near_m: float
    ) -> np.ndarray:
        """Screen error at places on the map, (n, 2) columns and rows: (n,) pixels.

        That of the posts around that are in the picture, bilinear; NaN where there are none.
        """
        heightmap = self.terrain.heightmap
        px = np.full(heightmap.heights.shape, np.nan, np.float32)
        for region in _regions(heightmap.cols, heightmap.rows, TILE):
            for (x, y, width, height), errors, _ in self._errors_px(selection, region, camera, size, near_m):
                px[y : y + height, x : x + width] = errors.reshape(height, width)
        col, row = places.T.astype(np.float64)
        known = np.isfinite(px)
        weight = bilinear(known, col, row)  # posts that are not known share theirs among the others
        at = np.full(len(places), np.nan)
        near = weight > 0
        at[near] = bilinear(np.where(known, px, 0), col[near], row[near]) / weight[near]
        return at

    def _errors_px(
        self, selection: Selection, region: Region, camera: Camera, size: tuple[int, int], near_m: float
    ) -> Iterator[tuple[Region, np.ndarray, np.ndarray]]:
        """Parts of a region that may be in the picture: what the screen error of their posts is, and which are in it.

        Row after row; errors are NaN where nothing is drawn, and outside the picture.
        """
        heightmap = self.terrain.heightmap
        drawn: np.ndarray | None = None
        for part in _parts_in_picture(heightmap, region, camera, size, near_m):
            points = posts_of(heightmap, part)
            _, seen = screen_shift_px(camera, size, points, np.zeros(len(points)), near_m)
            seen &= np.isfinite(points[:, 2])
            if not seen.any():
                continue
            drawn = self.errors_m(selection, region) if drawn is None else drawn
            col, row = part[0] - region[0], part[1] - region[1]
            errors = drawn[row : row + part[3], col : col + part[2]].ravel().astype(np.float64)
            px = np.full(len(points), np.nan)
            known = seen & np.isfinite(errors)
            px[known] = screen_shift_px(camera, size, points[known], errors[known], near_m)[0]
            yield part, px, seen

    def release(self) -> None:
        """Give the GPU's memory back."""
        gl.use_default_framebuffer(self.ctx)  # the one in use must not be one that is gone
        gl.release_with_pixels(self._nowhere)
        self._draws.release()
        self._errors.release()

    def _pass(
        self, draw: MeshDraw, selection: Selection, region: Region, flip: tuple[int, int], clear: bool
    ) -> np.ndarray:
        x, y, width, height = region
        if clear:
            self._errors.write(self._nothing)
        self._nowhere.use()
        self._nowhere.viewport = (0, 0, width, height)
        self._nowhere.scissor = (0, 0, width, height)
        self._errors.bind_to_image(0, read=False, write=True)
        program = draw.program
        program["u_tile"], program["u_tile_size"], program["u_flip"] = (x, y), (width, height), flip
        self.ctx.disable(moderngl.CULL_FACE | moderngl.DEPTH_TEST | moderngl.BLEND)
        draw.draw(selection)
        self.ctx.memory_barrier(moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT)
        whole = np.frombuffer(self._errors.read(), "f4").reshape(self._errors.height, self._errors.width)
        return whole[:height, :width]

    def _on_rim(self, region: Region) -> bool:
        x, y, width, height = region
        heightmap = self.terrain.heightmap
        return x == 0 or y == 0 or x + width == heightmap.cols or y + height == heightmap.rows


def _regions(cols: int, rows: int, tile: int) -> Iterator[Region]:
    """The map's four rims, one post thick, and what lies between them in tiles."""
    for x, width in _spans(cols, tile):
        for y, height in _spans(rows, tile):
            yield x, y, width, height


def _parts_in_picture(
    heightmap: Heightmap, region: Region, camera: Camera, size: tuple[int, int], near_m: float
) -> Iterator[Region]:
    """Bands of rows, as wide as the picture may reach: outside them no post of the region is in it.

    A side of the picture is a plane n · (p - eye) = d; whatever the heights and the band's rows, it passes no column
    beyond the one where the most favourable of them lies on it.
    """
    x, y, width, height = region
    right, up, forward = camera.axes
    tan_x, tan_y = camera.half_extent(size)
    planes = [(tan_x * forward + right, 0.0), (tan_x * forward - right, 0.0)]
    planes += [(tan_y * forward + up, 0.0), (tan_y * forward - up, 0.0), (forward, near_m)]
    (east, north), last = heightmap.spacing_m, heightmap.rows - 1
    for top in range(y, y + height, _BAND):
        rows = np.array([top, min(top + _BAND, y + height) - 1])
        first, end = float(x), float(x + width)
        for n, d in planes:
            most = max(n[1] * (last - rows) * north) + max(n[2] * np.array(heightmap.range_m)) - n @ camera.eye - d
            if n[0] == 0:
                end = end if most >= 0 else first
            elif n[0] > 0:
                first = max(first, np.floor(-most / (n[0] * east)) - 1)
            else:
                end = min(end, np.ceil(-most / (n[0] * east)) + 2)
        if first < end:
            yield int(first), top, int(end - first), int(rows[1] - rows[0]) + 1


def _spans(n: int, tile: int) -> Iterator[tuple[int, int]]:
    yield 0, 1
    for first in range(1, n - 1, tile):
        yield first, min(tile, n - 1 - first)
    yield n - 1, 1


def posts_of(heightmap: Heightmap, region: Region) -> np.ndarray:
    """World positions (w·h, 3) of a region's posts, row after row."""
    x, y, width, height = region
    east = (x + np.arange(width)) * heightmap.spacing_m[0]
    north = (heightmap.rows - 1 - y - np.arange(height)) * heightmap.spacing_m[1]
    z = heightmap.heights[y : y + height, x : x + width]
    grid = np.broadcast_arrays(east[None, :], north[:, None], z.astype(np.float64))
    return np.stack([axis.ravel() for axis in grid], -1)
