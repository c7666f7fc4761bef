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
            px, seen = self._errors_px(selection, region, camera, size, near_m)
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
        px = np.empty(heightmap.heights.shape, np.float32)
        for region in _regions(heightmap.cols, heightmap.rows, TILE):
            x, y, width, height = region
            errors, _ = self._errors_px(selection, region, camera, size, near_m)
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
    ) -> tuple[np.ndarray, np.ndarray]:
        """Screen error of a region's posts, row after row, NaN where nothing is drawn; and which are in the picture."""
        points = posts_of(self.terrain.heightmap, region)
        _, seen = screen_shift_px(camera, size, points, np.zeros(len(points)), near_m)
        seen &= np.isfinite(points[:, 2])
        px = np.full(len(points), np.nan)
        if seen.any():
            errors = self.errors_m(selection, region).ravel()[seen].astype(np.float64)
            drawn = np.isfinite(errors)
            shift, _ = screen_shift_px(camera, size, points[seen][drawn], errors[drawn], near_m)
            px[np.flatnonzero(seen)[drawn]] = shift
        return px, seen

    def release(self) -> None:
        """Give the GPU's memory back."""
        gl.use_default_framebuffer(self.ctx)  # the one in use must not be one that is gone
        for resource in (self._draws, self._errors, self._nowhere):
            resource.release()

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
