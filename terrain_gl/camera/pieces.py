"""Pieces: a picture of any size is drawn part by part. Each part is a rectangle of the same view.

The mesh is chosen once, for the whole picture. For each piece, the projection is cropped, and the shaders get the place
of its pixels in the picture (glsl/blocks/view.glsl). With `fine` > 1, each pixel is drawn as fine × fine pixels.

    whole picture                piece             x' = x · W/w + (W − 2·x₀ − w)/w, and y' in the same way:
    ┌──────────────┐                               the window, x₀ to x₀ + w of W pixels, becomes −1 to 1
    │   ┌────┐     │            ┌────┐
    │   │    │     │     →      │    │
    │   └────┘     │            └────┘
    └──────────────┘
"""

from __future__ import annotations

from dataclasses import dataclass

from ..basics.exceptions import UsageError

LARGEST = 2048  # drawn pixels a side of a piece: with 4 samples a pixel, depth and detail take 192 MiB
_EVEN = 2  # pieces begin at even pixels: shaders take differences within quads of 2 × 2 pixels
Size = tuple[int, int]


@dataclass(frozen=True)
class Piece:
    """A rectangle of a picture.

    Attributes
    ----------
    picture
        Width and height of the whole picture in pixels.
    corner
        Column and row of the piece's lower left pixel, counted from the picture's lower left.
    size
        Width and height of the piece in pixels.
    fine
        Each pixel is drawn as fine × fine pixels.
    """

    picture: Size
    corner: Size
    size: Size
    fine: int = 1

    @classmethod
    def whole(cls, picture: Size) -> Piece:
        """The whole picture as one piece."""
        return cls(picture, (0, 0), picture)

    @property
    def drawn_size(self) -> Size:
        """Width and height in drawn pixels."""
        return self.size[0] * self.fine, self.size[1] * self.fine

    @property
    def rows(self) -> slice:
        """The piece's rows in an array of the whole picture, first row on top."""
        bottom = self.picture[1] - self.corner[1]
        return slice(bottom - self.size[1], bottom)

    @property
    def cols(self) -> slice:
        """The piece's columns in an array of the whole picture."""
        return slice(self.corner[0], self.corner[0] + self.size[0])

    @property
    def window(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Factor and offset from clip coordinates of the whole picture to those of the piece, across and up."""
        w, h = self.picture
        x, y = self.corner
        part_w, part_h = self.size
        return (w / part_w, (w - 2 * x - part_w) / part_w), (h / part_h, (h - 2 * y - part_h) / part_h)


def cut(picture: Size, fine: int = 1, largest: int = LARGEST) -> list[Piece]:
    """Cut a picture into pieces of at most `largest` drawn pixels a side, the top row first.

    Parameters
    ----------
    picture
        Width and height in pixels.
    fine
        Each pixel is drawn as fine × fine pixels.

    Raises
    ------
    UsageError
        A picture without pixels, or `fine` out of range.
    """
    if min(picture) < 1:
        raise UsageError(f"picture size must be at least 1x1, got {picture[0]}x{picture[1]}")
    if not 1 <= fine <= largest // _EVEN:
        raise UsageError(f"pixels drawn for one: expected 1 to {largest // _EVEN} a side, got {fine}")
    columns, rows = _spans(picture[0], largest // fine), _spans(picture[1], largest // fine)
    return [Piece(picture, (x, y), (w, h), fine) for y, h in reversed(rows) for x, w in columns]


def _spans(n: int, most: int) -> list[tuple[int, int]]:
    """First and length of parts of about equal length; each begins at an even number."""
    parts = -(-n // (most // _EVEN * _EVEN))
    length = -(-n // (parts * _EVEN)) * _EVEN
    return [(first, min(length, n - first)) for first in range(0, n, length)]
