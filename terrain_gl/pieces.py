"""Pieces: a picture of any size drawn part by part, each through its own window of one view.

The mesh is chosen once, for the whole picture. A piece then crops the projection that draws it and tells the shaders
where in the picture its pixels are (glsl/blocks/view.glsl); with `fine` > 1 each pixel is drawn as fine × fine.

    whole picture                piece             x' = x · W/w + (W − 2·x₀ − w)/w, and y' alike: a wider picture of
    ┌──────────────┐                               which the window, x₀ to x₀ + w of W pixels, reaches from −1 to 1
    │   ┌────┐     │            ┌────┐
    │   │    │     │     →      │    │
    │   └────┘     │            └────┘
    └──────────────┘
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .exceptions import UsageError

LARGEST = 2048  # drawn pixels a side: 200 MiB of samples
_EVEN = 2  # pieces begin at even pixels, where shaders take differences between neighbours
Size = tuple[int, int]


@dataclass(frozen=True)
class Piece:
    """A rectangle of a picture.

    Attributes
    ----------
    picture
        Width and height of the whole in pixels.
    corner
        Column and row of its lower left pixel, counted from the picture's lower left.
    size
        Its width and height in pixels.
    fine
        Pixels drawn for each, along a side.
    """

    picture: Size
    corner: Size
    size: Size
    fine: int = 1

    @classmethod
    def whole(cls, picture: Size) -> Piece:
        """The picture in one."""
        return cls(picture, (0, 0), picture)

    @property
    def drawn_size(self) -> Size:
        """Width and height in drawn pixels."""
        return self.size[0] * self.fine, self.size[1] * self.fine

    @property
    def rows(self) -> slice:
        """Its rows in an array of the whole picture, first row on top."""
        bottom = self.picture[1] - self.corner[1]
        return slice(bottom - self.size[1], bottom)

    @property
    def cols(self) -> slice:
        """Its columns in an array of the whole picture."""
        return slice(self.corner[0], self.corner[0] + self.size[0])

    @property
    def clip_from_picture(self) -> np.ndarray:
        """(4, 4) float64: clip coordinates of the piece, from those of the whole picture."""
        matrix = np.eye(4)
        for axis in (0, 1):
            whole, first, part = self.picture[axis], self.corner[axis], self.size[axis]
            matrix[axis, axis] = whole / part
            matrix[axis, 3] = (whole - 2 * first - part) / part
        return matrix


def cut(picture: Size, fine: int = 1, largest: int = LARGEST) -> list[Piece]:
    """Pieces of at most `largest` drawn pixels a side that make up a picture, the top row first.

    Parameters
    ----------
    picture
        Width and height in pixels.
    fine
        Pixels to draw for each, along a side.

    Raises
    ------
    UsageError
        No pixels, or a pixel that would not fit into a piece.
    """
    if min(picture) < 1:
        raise UsageError(f"picture size must be at least 1x1, got {picture[0]}x{picture[1]}")
    if not 1 <= fine <= largest // _EVEN:
        raise UsageError(f"pixels drawn for one: expected 1 to {largest // _EVEN} a side, got {fine}")
    columns, rows = _spans(picture[0], largest // fine), _spans(picture[1], largest // fine)
    return [Piece(picture, (x, y), (w, h), fine) for y, h in reversed(rows) for x, w in columns]


def _spans(n: int, most: int) -> list[tuple[int, int]]:
    """First and length of parts of about one length, each beginning at an even place."""
    parts = -(-n // (most // _EVEN * _EVEN))
    length = -(-n // (parts * _EVEN)) * _EVEN
    return [(first, min(length, n - first)) for first in range(0, n, length)]
