"""The horizon around the eye. With it, hidden patches are found, and left out of the picture: docs/hidden.md.

    horizon   the horizon of each sector around the eye, shell by shell       glsl/lod/rings/horizon.comp
    hidden    is a box below the horizon in front of it?                      glsl/lod/rings/hidden.glsl

Specification: `reference.hidden`.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..camera import Camera
from ..camera.view import ViewBlock
from ..gpu import gl
from ..gpu.layout import SECTORS
from ..heightmap import Heightmap
from ..terrain import Terrain
from .goal import Goal

SHELLS_PER_DOUBLING = 45.0  # as glsl/lod/rings/hidden.glsl has them
SHELL_SPACINGS = 64.0
ROUGH_PX = 64.0  # a mesh with larger errors may be above an eye that is above the ground
SNAP_PX = 1 / 32  # the rasteriser moves a vertex to a 256th of a pixel
FARTHEST = {"max": 1.0, "rms": 16.0}  # largest screen error of the drawn surface, as a multiple of the tolerance
_NOTHING: dict[str, Any] = {"sectors": (0, 0), "shells": 0, "tan_off": 0.0}


class Hiding(NamedTuple):
    """Uniforms of the shaders that hide land, and the error up to which they are right.

    Attributes
    ----------
    uniforms
        Values for glsl/lod/rings/hidden.glsl.
    farthest_px
        The uniforms are right if no visible point is drawn further than this from its true position. 0 if nothing is
        hidden.
    camera
        The camera at the centre of the horizon.
    """

    uniforms: dict[str, Any]
    farthest_px: float
    camera: Camera | None = None

    @property
    def sectors(self) -> int:
        """Number of sectors that need a horizon."""
        first, end = self.uniforms["sectors"]
        return int(end - first)


NO_HIDING = Hiding(_NOTHING, 0.0)


def horizon_texture(ctx: moderngl.Context, heightmap: Heightmap) -> moderngl.Texture:
    """A texture for the horizon around any eye over the map: a column for each sector, a row for each shell."""
    return gl.texel_texture(ctx, (SECTORS, shells_within(heightmap, math.hypot(*heightmap.extent_m))), "f4")


def slopes_of(horizon: moderngl.Texture) -> np.ndarray:
    """Slopes of the horizon, (sectors, shells) float32."""
    return np.frombuffer(horizon.read(), "f4").reshape(-1, SECTORS).T


def hiding(terrain: Terrain, view: ViewBlock, camera: Camera, size: tuple[int, int], goal: Goal) -> Hiding:
    """The uniforms with which the shaders find hidden land; `NO_HIDING` where the proof does not hold.

    Nothing is hidden if the eye may see the land from below. A budget of least squares hides nothing either: its mesh
    depends on all the land in the picture.
    """
    heightmap = terrain.heightmap
    farthest_px = FARTHEST.get(goal.metric, math.inf) * goal.tolerance_px
    if not goal.hides or not goal.cull or goal.triangles or not 0 < farthest_px <= ROUGH_PX:
        return NO_HIDING
    if goal.has_holes and heightmap.voids:  # a sight line may pass through a hole and then under a ridge
        return NO_HIDING
    if camera.is_orthographic:  # the horizon is that of one eye
        return NO_HIDING
    focal_px = camera.focal_px(size[1]) * min(1.0, camera.aspect(size))
    tan_off = tan_between(farthest_px + SNAP_PX, focal_px)
    if tan_off is None:
        return NO_HIDING
    # at the near plane, the surface may be drawn this much too high, as a fraction of the plane's distance
    # (lod/project.glsl)
    drawn_off = farthest_px / (focal_px * _least_stretch(camera, size))
    if not is_above_ground(terrain, view.eye[0], view.eye[2], view.reach_m * (1.0 + drawn_off)):
        return NO_HIDING
    uniforms = {
        "sectors": sectors_in_picture(camera, size),
        "shells": shells_over(heightmap, camera),
        "tan_off": tan_off,
    }
    return Hiding(uniforms, farthest_px, camera)


def _least_stretch(camera: Camera, size: tuple[int, int]) -> float:
    """A lower bound of the largest `stretch` of a picture's corners (lod/project.glsl), without the aspect."""
    half = camera.half_extent(size)
    if camera.centre == (0.0, 0.0):
        return min(1.0, math.hypot(*half))
    x, y, w = camera.vertical.tolist()
    sides = (abs(v - middle * w) + tan * abs(w) for v, middle, tan in zip((x, y), camera.centre, half, strict=True))
    return math.hypot(*sides)


def tan_between(apart_px: float, focal_px: float) -> float | None:
    """Tangent of the largest angle between the directions to two points of a picture; None if it is 90° or more.

    The points are `apart_px` pixels apart. With half the angle's tangent t, tan φ = 2t / (1 - t²), which is negative
    beyond 90°.
    """
    half = apart_px / (2 * focal_px)
    return 2 * half / (1 - half * half) if half < 1 else None


def is_above_ground(terrain: Terrain, post: tuple[int, int], up_m: float, reach_m: float) -> bool:
    """Whether the eye is over the map, and every point within `reach_m` of it is above the ground.

    False over voids: nothing bounds the surface that is drawn there.

    Parameters
    ----------
    post, up_m
        Column and row of the post nearest to the eye, and the eye's height in metres above the terrain's base.
    reach_m
        Distance of the near plane's corners. The near plane may cut the ground although the eye is above it.
    """
    col, row = post
    heightmap = terrain.heightmap
    is_over_map = 0 < col < heightmap.cols - 1 and 0 < row < heightmap.rows - 1
    if not is_over_map or 2 * reach_m > min(heightmap.spacing_m) or terrain.has_voids_around(col, row):
        return False
    highest_m = terrain.filled[row - 1 : row + 2, col - 1 : col + 2].max() - terrain.base_m
    return bool(up_m - reach_m > highest_m)


def sectors_in_picture(camera: Camera, size: tuple[int, int]) -> tuple[int, int]:
    """The first sector in a picture, and the one after the last; all sectors if it shows straight down or up."""
    right, up, forward = camera.axes
    (tan_x, tan_y), (middle_x, middle_y) = camera.half_extent(size), camera.centre
    aside = abs(right[2] - middle_x * forward[2]), abs(up[2] - middle_y * forward[2])
    if aside[0] <= tan_x * abs(forward[2]) and aside[1] <= tan_y * abs(forward[2]):
        return 0, SECTORS
    corners = itertools.product((middle_x - tan_x, middle_x + tan_x), (middle_y - tan_y, middle_y + tan_y))
    rays = [forward + x * right + y * up for x, y in corners]
    seen = [sector_of(forward[:2], ray[:2]) for ray in rays]
    if max(seen) - min(seen) > SECTORS / 2:  # the picture includes the direction where sectors begin
        return 0, SECTORS
    return max(0, math.floor(min(seen)) - 1), min(SECTORS, math.floor(max(seen)) + 2)


def sector_of(forward: np.ndarray, towards: np.ndarray) -> float:
    """Sector number of a horizontal direction, with a fraction: twin of sector_of() of glsl/lod/rings/hidden.glsl."""
    level = math.hypot(*forward)
    x, y = forward / level if level > 1e-6 else (1.0, 0.0)
    along, left = x * towards[0] + y * towards[1], x * towards[1] - y * towards[0]
    t = left / (abs(along) + abs(left))
    return float((2 + t if along >= 0 else 4 - t if left >= 0 else -t) * SECTORS / 4)


def shells_over(heightmap: Heightmap, camera: Camera) -> int:
    """Number of shells up to the map's farthest corner."""
    east, north = heightmap.extent_m
    x, y, _ = camera.eye
    return shells_within(heightmap, math.hypot(max(x, east - x), max(y, north - y)))


def shells_within(heightmap: Heightmap, far_m: float) -> int:
    """Number of shells up to a distance."""
    unit_m = SHELL_SPACINGS * min(heightmap.spacing_m)
    return math.ceil(SHELLS_PER_DOUBLING * math.log2(1 + far_m / unit_m)) + 1


def ridge_before(slopes: np.ndarray, heightmap: Heightmap, camera: Camera, x: float, y: float) -> tuple[float, float]:
    """World (x, y) of the land that rises highest in front of a place, as seen from the eye; exact to about a shell.

    `slopes` is the result of `slopes_of`.
    """
    away = np.array([x, y]) - camera.eye[:2]
    unit_m = SHELL_SPACINGS * min(heightmap.spacing_m)
    shells = 1 + int(SHELLS_PER_DOUBLING * math.log2(1 + math.hypot(*away) / unit_m))
    in_front = slopes[min(int(sector_of(camera.axes[2][:2], away)), SECTORS - 1), :shells]
    r_m = unit_m * (2 ** (int(np.argmax(in_front)) / SHELLS_PER_DOUBLING) - 1)
    return camera.eye[0] + r_m * away[0] / math.hypot(*away), camera.eye[1] + r_m * away[1] / math.hypot(*away)
