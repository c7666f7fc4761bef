"""Lines over the land: a frustum, the outline of a patch, the ring of a brush. Behind land they are faint."""

import math
from collections.abc import Sequence

import moderngl
import numpy as np

from ..camera import Camera
from ..gpu.passes import Box, DrawPass, Feed, State
from ..heightmap import Heightmap, ground_m
from ..shade.picture import Picture

PIECE = np.dtype([("a_m", "3f4"), ("b_m", "3f4"), ("color", "4u1")])  # glsl/view/lines.vert
Color = tuple[int, int, int, int]
Line = tuple[np.ndarray, Color]  # points (n, 3) of a polyline in world metres, or ends (n, 2, 3) of separate pieces


class Lines:
    """Draws polylines over a picture."""

    def __init__(self, ctx: moderngl.Context, samples: int) -> None:
        self.ctx = ctx
        files = {"vertex": "view/lines.vert", "fragment": "view/lines.frag"}
        self._pass = DrawPass(ctx, files, {"SAMPLES": samples})
        self._pieces = ctx.buffer(reserve=PIECE.itemsize, dynamic=True)
        content = [(self._pieces, "3f4 3f4 4f1 /i", "in_a_m", "in_b_m", "in_color")]
        self._feed = Feed(content, mode=moderngl.TRIANGLE_STRIP)

    def draw(
        self,
        picture: Picture,
        camera: Camera,
        target: moderngl.Framebuffer,
        size: tuple[int, int],
        lines: Sequence[Line],
        width_px: float = 2.0,
        left_px: int = 0,
        scissor: Box | None = None,
    ) -> None:
        """Draw lines into a target of `size`, as `camera` sees them.

        `left_px`: by how many columns the picture is moved to the right; `scissor`: the part of the target.
        """
        parts = [_pieces(points, color, camera) for points, color in lines]
        pieces = np.concatenate(parts or [np.zeros(0, PIECE)])
        if not len(pieces):
            return
        self._pieces.orphan(pieces.nbytes)
        self._pieces.write(pieces.tobytes())
        state = State(target, (left_px, 0, *size), scissor, blends=True, stays_opaque=True)
        read = {"Terrain": picture.terrain.resources["Terrain"], **picture.view.resources, "u_depth": picture.depth}
        uniforms = {"window_px": size, "width_px": width_px, "left_px": left_px}
        self._pass.draw(state, read, uniforms, self._feed, vertices=4, instances=len(pieces))

    def release(self) -> None:
        self._pass.release()
        self._pieces.release()


def _pieces(points: np.ndarray, color: Color, camera: Camera) -> np.ndarray:
    from_eye = (camera.lowered(points.reshape(-1, 3)) - np.asarray(camera.eye)).astype("f4")
    if points.ndim == 3:
        ends = from_eye.reshape(-1, 2, 3)
        ends = ends[np.isfinite(ends).all((1, 2))]
    else:
        from_eye = from_eye[np.isfinite(from_eye).all(1)]
        ends = np.stack([from_eye[:-1], from_eye[1:]], 1)
    pieces = np.zeros(len(ends), PIECE)
    pieces["a_m"], pieces["b_m"] = ends[:, 0], ends[:, 1]
    pieces["color"] = color
    return pieces


def frustum(camera: Camera, size: tuple[int, int], far_m: float) -> list[np.ndarray]:
    """The frustum of a camera as polylines, up to a distance of `far_m`."""
    signs = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    corners = far_m * (signs * [*camera.half_extent(size), 1]) @ camera.axes
    eye = np.asarray(camera.eye)
    near, far = eye + 0.1 * corners, eye + corners
    return [np.stack([eye, corner]) for corner in far] + [np.vstack([rim, rim[:1]]) for rim in (near, far)]


def ring(heightmap: Heightmap, x_m: float, y_m: float, radius_m: float, points: int = 96) -> np.ndarray:
    """A circle on the land, as a polyline."""
    turn = np.linspace(0, 2 * np.pi, points)
    return on_land(heightmap, np.stack([x_m + radius_m * np.cos(turn), y_m + radius_m * np.sin(turn)], -1))


def outline(heightmap: Heightmap, corner: tuple[int, int], size: tuple[int, int], most: int = 64) -> np.ndarray:
    """The outline of a rectangle of posts on the land: `corner` is a column and a row, `size` columns and rows."""
    steps = np.linspace(0, 1, max(2, min(most, max(size) + 1)))
    zero, one = np.zeros_like(steps), np.ones_like(steps)
    sides = (steps, zero), (one, steps), (1 - steps, one), (zero, 1 - steps)
    around = np.concatenate([np.stack(side, -1) for side in sides])
    posts = np.minimum(np.array(corner) + around * size, [heightmap.cols - 1, heightmap.rows - 1])
    return posts_on_land(heightmap, posts)


def posts_on_land(heightmap: Heightmap, posts: np.ndarray) -> np.ndarray:
    """World places (n, 3) of columns and rows (n, 2); the height is NaN where there is no land."""
    east, north = heightmap.spacing_m
    return on_land(heightmap, np.stack([posts[:, 0] * east, (heightmap.rows - 1 - posts[:, 1]) * north], -1))


def on_land(heightmap: Heightmap, places: np.ndarray) -> np.ndarray:
    """World places (n, 2) with the land's height; NaN where there is none."""
    return np.column_stack([places, ground_m(heightmap, places)])


def leg(start: np.ndarray, end: np.ndarray, spacing_m: tuple[float, float], most: int) -> np.ndarray:
    """Places along a straight leg, (n, 2): its start and its crossings with rows and columns of posts, not its end.

    If these are more than `most` places, the result is `most` places at equal distances instead.
    """
    cells = np.stack([start, end]) / spacing_m
    shares = [np.zeros(1)]
    for a, b in cells.T:
        lines = np.arange(math.floor(min(a, b)) + 1, math.ceil(max(a, b)))
        shares.append((lines - a) / (b - a) if a != b else np.zeros(0))
    share = np.unique(np.concatenate(shares))
    share = np.linspace(0, 1, most, endpoint=False) if len(share) > most else share
    return start + share[:, None] * (end - start)
