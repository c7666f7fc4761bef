"""Overlays drawn on the land. Lines follow the ground, also between posts; points are drawn as rings."""

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from ..camera import Camera
from ..camera.pieces import Piece
from ..gpu import gl
from ..heightmap import Heightmap
from ..image import linear_from_srgb
from ..readers.raster import INSTALL_GEO, has_rasterio
from ..shade.picture import Picture
from .lines import Color, Lines, leg, posts_on_land
from .overlay import PLAIN, Overlay

Wide = tuple[np.ndarray, Color, float]  # a line, its colour, and its width in usual widths

COLOURS: tuple[Color, ...] = ((255, 70, 50, 255), (60, 200, 255, 255), (255, 220, 60, 255), (200, 130, 255, 255))
WIDTH_PX = 2.0  # width of a line, in a picture of up to 720 rows
MOST_FILL = 2048  # texels along the longer side of the picture of filled polygons
MOST = 512  # most places along a leg
RING_POSTS = 0.004  # radius of a point's ring, as a fraction of the posts along the map's longer side
_TURN = np.linspace(0, 2 * np.pi, 13)


class OverlayLines:
    """Draws overlays over pictures."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._lines: Lines | None = None
        self._of: list[object] = []  # the overlays, the map and its number of edits that `_draped` shows
        self._draped: list[list[Wide]] = []
        self.drawn: list[int] = []  # for each overlay, the number of samples that it has drawn since `begin`

    def begin(self, overlays: tuple[Overlay, ...]) -> None:
        """Begin to count drawn samples from 0."""
        self.drawn = [0] * len(overlays)

    def draw(self, overlays: tuple[Overlay, ...], picture: Picture, eye: Camera, piece: Piece) -> None:
        """Draw over a piece. In pictures of more than 720 rows, lines are wider, so that they look the same."""
        terrain = picture.terrain
        now = [overlays, terrain.heightmap, terrain.edits]
        if not self._of or any(new is not old for new, old in zip(now, self._of, strict=True)):
            self._of = now
            self._draped = [polylines(each, i, terrain.heightmap) for i, each in enumerate(overlays)]
        self._lines = self._lines or Lines(self.ctx, picture.samples)
        width_px = piece.fine * WIDTH_PX * max(1.0, piece.picture[1] / 720)
        for i, lines in enumerate(self._draped):
            for width in sorted({width for *_, width in lines}):
                of_width = [(points, colour) for points, colour, each in lines if each == width]
                with gl.fragments_drawn(self.ctx) as drawn:
                    self._lines.draw(picture, eye, picture.target, piece.drawn_size, of_width, width * width_px)
                self.drawn[i] += drawn.value

    def release(self) -> None:
        if self._lines:
            self._lines.release()


def is_on_map(overlay: Overlay, heightmap: Heightmap) -> bool:
    """Whether any part of an overlay may be on the map."""
    legs = (line[i : i + 2] for line in overlay.lines for i in range(len(line) - 1))
    return any(_is_near(each, heightmap) for each in (*overlay.points[:, None], *legs))


def polylines(overlay: Overlay, number: int, heightmap: Heightmap) -> list[Wide]:
    """An overlay's polylines in world metres, in their own colours, or in the colour of its number."""
    radius = RING_POSTS * max(heightmap.cols, heightmap.rows)
    around = radius * np.stack([np.cos(_TURN), np.sin(_TURN)], -1)
    rings = [point + around if _is_near(point[None], heightmap) else None for point in overlay.points]
    usual = COLOURS[number % len(COLOURS)]
    shapes = (*overlay.lines, *rings)
    styles = overlay.styles or (PLAIN,) * len(shapes)
    return [
        (run, style.stroke or usual, style.width)
        for line, style in zip(shapes, styles, strict=True)
        if line is not None and style.width
        for run in _runs(line, heightmap)
    ]


def fills(overlays: tuple[Overlay, ...], heightmap: Heightmap) -> np.ndarray | None:
    """Filled polygons as a picture of the ground, (rows, cols, 4) linear albedo times opacity, and opacity.

    Holes stay empty. None without such polygons. `TerrainError` if rasterio is missing.
    """
    areas = [area for overlay in overlays for area in overlay.areas]
    if not areas:
        return None
    if not has_rasterio():
        raise TerrainError(f"filled polygons need rasterio: {INSTALL_GEO}")
    from rasterio.features import rasterize

    size = np.array([heightmap.cols, heightmap.rows])
    per_post = MOST_FILL / size.max()
    cols, rows = (int(n) for n in np.maximum(1, np.rint(size * per_post)))
    laid = np.zeros((rows, cols, 4), np.float32)
    for rings, colour in areas:
        texels = [(ring + 0.5) * per_post for ring in rings]
        geometry = {"type": "Polygon", "coordinates": [ring.tolist() for ring in texels]}
        inside = rasterize([(geometry, 1)], (rows, cols), dtype="uint8")[..., None] * np.float32(colour[3] / 255)
        own = np.append(linear_from_srgb(np.array(colour[:3])), 1).astype("f4")
        laid = inside * own + (1 - inside) * laid
    return laid.astype("f2")


def _is_near(posts: np.ndarray, heightmap: Heightmap) -> bool:
    """Whether the box around some posts meets the map."""
    low, high = posts.min(0), posts.max(0)
    return bool((high >= 0).all() and (low <= (heightmap.cols - 1, heightmap.rows - 1)).all())


def _runs(line: np.ndarray, heightmap: Heightmap) -> list[np.ndarray]:
    """The parts (n, 3) of a line that are over land, in world metres."""
    nowhere = np.full((1, 3), np.nan)
    parts = [nowhere]
    for a, b in zip(line, line[1:], strict=False):
        if not _is_near(np.stack([a, b]), heightmap):
            parts.append(nowhere)
            continue
        parts.append(posts_on_land(heightmap, np.concatenate([leg(a, b, (1.0, 1.0), MOST), b[None]])))
    points = np.concatenate(parts)
    runs = np.split(points, np.flatnonzero(~np.isfinite(points[:, 2])))
    return [run[np.isfinite(run[:, 2])] for run in runs if len(run) > 2]
