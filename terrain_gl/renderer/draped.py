"""Overlays drawn on the land. Lines follow the ground, also between posts; points are drawn as rings."""

import moderngl
import numpy as np

from ..camera import Camera
from ..camera.pieces import Piece
from ..gpu import gl
from ..heightmap import Heightmap
from ..shade.picture import Picture
from .lines import Color, Line, Lines, leg, posts_on_land
from .overlay import Overlay

COLOURS: tuple[Color, ...] = ((255, 70, 50, 255), (60, 200, 255, 255), (255, 220, 60, 255), (200, 130, 255, 255))
WIDTH_PX = 2.0  # width of a line, in a picture of up to 720 rows
MOST = 512  # most places along a leg
RING_POSTS = 0.004  # radius of a point's ring, as a fraction of the posts along the map's longer side
_TURN = np.linspace(0, 2 * np.pi, 13)


class OverlayLines:
    """Draws overlays over pictures."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._lines: Lines | None = None
        self._of: tuple[tuple[Overlay, ...], int] = (), 0  # the overlays and number of edits that `_draped` shows
        self._draped: list[list[Line]] = []
        self.drawn: list[int] = []  # for each overlay, the number of samples that it has drawn since `begin`

    def begin(self, overlays: tuple[Overlay, ...]) -> None:
        """Begin to count drawn samples from 0."""
        self.drawn = [0] * len(overlays)

    def draw(self, overlays: tuple[Overlay, ...], picture: Picture, eye: Camera, piece: Piece) -> None:
        """Draw over a piece. In pictures of more than 720 rows, lines are wider, so that they look the same."""
        terrain = picture.terrain
        if self._of[0] is not overlays or self._of[1] != terrain.edits:
            self._of = (overlays, terrain.edits)
            self._draped = [_lines_of(each, i, terrain.heightmap) for i, each in enumerate(overlays)]
        self._lines = self._lines or Lines(self.ctx, picture.samples)
        width_px = piece.fine * WIDTH_PX * max(1.0, piece.picture[1] / 720)
        for i, lines in enumerate(self._draped):
            with gl.fragments_drawn(self.ctx) as drawn:
                self._lines.draw(picture, eye, picture.target, piece.drawn_size, lines, width_px)
            self.drawn[i] += drawn.value

    def release(self) -> None:
        if self._lines:
            self._lines.release()


def draped(overlays: tuple[Overlay, ...], heightmap: Heightmap) -> list[Line]:
    """The overlays as polylines in world metres, each overlay in a colour of its own."""
    return [line for i, overlay in enumerate(overlays) for line in _lines_of(overlay, i, heightmap)]


def is_on_map(overlay: Overlay, heightmap: Heightmap) -> bool:
    """Whether any part of an overlay may be on the map."""
    legs = (line[i : i + 2] for line in overlay.lines for i in range(len(line) - 1))
    return any(_is_near(each, heightmap) for each in (*overlay.points[:, None], *legs))


def _lines_of(overlay: Overlay, number: int, heightmap: Heightmap) -> list[Line]:
    """An overlay's polylines in the colour of its number."""
    radius = RING_POSTS * max(heightmap.cols, heightmap.rows)
    around = radius * np.stack([np.cos(_TURN), np.sin(_TURN)], -1)
    rings = [point + around for point in overlay.points if _is_near(point[None], heightmap)]
    colour = COLOURS[number % len(COLOURS)]
    return [(run, colour) for line in (*overlay.lines, *rings) for run in _runs(line, heightmap)]


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
