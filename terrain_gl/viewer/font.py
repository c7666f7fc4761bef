"""A typeface of pen strokes, drawn for this project: crisp at any size, and small enough to read here.

A glyph is a list of strokes, a stroke a list of points, a point two digits: x from 0 to 6, and y in hexadecimal, 4 on
the baseline, a on top of small letters, d on top of capitals, 0 at the foot of descenders. One unit is one pixel at
scale 1. `~` before a stroke makes its points the control polygon of a quadratic B-spline, `@` of a closed one.
"""

from __future__ import annotations

from functools import cache

import numpy as np

WIDTH, HEIGHT = 8, 17  # units of a cell, one free to the left and above
PEN = 1.3  # units across

GLYPHS = {
    " ": "",
    "!": "3d37 3435",
    '"': "2d2a 4d4a",
    "#": "141d 545d 0767 0a6a",
    "$": "~6b6c0c096864040506 323e",
    "%": "046d @0a2a2d0d @44646747",
    "&": "~640b1d4d4b0705044467",
    "'": "3d3a",
    "(": "~5e2c2552",
    ")": "~1e4c4512",
    "*": "363c 175b 1b57",
    "+": "0868 353b",
    ",": "3513",
    "-": "1858",
    ".": "3435",
    "/": "036e",
    "0": "@04646d0d",
    "1": "1b3d34 1454",
    "2": "~0b0d6d6904 0464",
    "3": "~0b0d6d6929 ~2969640406",
    "4": "545d0767",
    "5": "6d0d09 ~096a640405",
    "6": "@04646a0a ~5d0c07",
    "7": "0d6d24",
    "8": "@19595d1d @04646909",
    "9": "@07676d0d ~6a6514",
    ":": "3435 393a",
    ";": "3513 393a",
    "<": "5c0854",
    "=": "0666 0a6a",
    ">": "1c6814",
    "?": "~0b0d6d693836 3434",
    "@": "@26464a2a ~4a46666d0d0454",
    "A": "043d64 1757",
    "B": "040d ~0d2d5d592909 ~092969642404",
    "C": "~6b6d0d046466",
    "D": "040d ~0d2d6d642404",
    "E": "6d0d0464 0959",
    "F": "6d0d04 0959",
    "G": "~6b6d0d046468 6838",
    "H": "040d 646d 0969",
    "I": "1454 1d5d 343d",
    "J": "5d58 ~58540407",
    "K": "040d 6d08 2a64",
    "L": "0d0464",
    "M": "040d386d64",
    "N": "040d646d",
    "O": "@043464686d3d0d08",
    "P": "040d ~0d2d6d682808",
    "Q": "@043464686d3d0d08 4662",
    "R": "040d ~0d2d6d682808 3864",
    "S": "~6b6d0d0968640406",
    "T": "0d6d 343d",
    "U": "0d07 ~07046467 676d",
    "V": "0d346d",
    "W": "0d143a546d",
    "X": "046d 0d64",
    "Y": "0d386d 3834",
    "Z": "0d6d0464",
    "[": "4e2e2242",
    "\\": "0e63",
    "]": "2e4e4222",
    "^": "1a3d5a",
    "_": "0262",
    "`": "2d4b",
    "a": "@04646a0a 6a64",
    "b": "040d @04646a0a",
    "c": "~696a0a046465",
    "d": "646d @04646a0a",
    "e": "0767 ~676a0a046465",
    "f": "242a ~2a2d5d 0a5a",
    "g": "@04646a0a 6a63 ~63600001",
    "h": "040d ~070a6a67 6764",
    "i": "1a3a34 1454 3d3d",
    "j": "2a4a43 ~434000 4d4d",
    "k": "040d 5a06 2864",
    "l": "1d3d34 1454",
    "m": "040a ~080a3a38 3834 ~383a6a68 6864",
    "n": "040a ~070a6a67 6764",
    "o": "@04646a0a",
    "p": "000a @04646a0a",
    "q": "606a @04646a0a",
    "r": "040a ~070a5a",
    "s": "~696a0a0767640405",
    "t": "2d27 ~272464 0a5a",
    "u": "0a07 ~07046467 6a64",
    "v": "0a346a",
    "w": "0a1438546a",
    "x": "046a 0a64",
    "y": "0a34 6a10",
    "z": "0a6a0464",
    "{": "~4e2e2b28 0828 ~28252242",
    "|": "323e",
    "}": "~2e4e4b48 4868 ~48454222",
    "~": "~071a5669",
    "°": "@0a3a3d0d",
    "·": "3839",
    "×": "1a56 165a",
    "–": "0868",
    "…": "0404 3434 6464",
    "→": "0868 4b6845",
    "■": "0666 0767 0868 0969 0a6a",
    "√": "0819346e",
    "≤": "6c0967 0464",
    "≥": "0c6907 0464",
    "\ufffd": "0464 646d 6d0d 0d04",
}
INDEX = {character: place for place, character in enumerate(GLYPHS)}
_UNKNOWN = INDEX["\ufffd"]


def indices(text: str) -> list[int]:
    """Places of a text's glyphs in the atlas; what the typeface has not is an empty box."""
    return [INDEX.get(character, _UNKNOWN) for character in text]


@cache
def atlas(scale: int) -> np.ndarray:
    """All glyphs side by side, (HEIGHT · scale, len(GLYPHS) · WIDTH · scale) uint8 coverage."""
    return np.hstack([_draw(strokes, scale) for strokes in GLYPHS.values()])


def _draw(strokes: str, scale: int) -> np.ndarray:
    """Coverage by a round pen: by distance from the nearest line, a pixel wide at its edge."""
    x = (np.arange(WIDTH * scale) + 0.5) / scale - 1.5
    y = HEIGHT - 1.5 - (np.arange(HEIGHT * scale) + 0.5) / scale
    points = np.stack(np.meshgrid(x, y), -1)
    distance = np.full(points.shape[:2], np.inf)
    for line in map(_line, strokes.split()):
        for start, end in zip(line[:-1], line[1:], strict=True):
            distance = np.minimum(distance, _distance(points, start, end))
    coverage = np.clip(0.5 + scale * (0.5 * PEN - distance), 0, 1)
    return np.round(255 * coverage).astype(np.uint8)


def _distance(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = np.clip((points - start) @ along / max(along @ along, 1e-9), 0, 1)
    return np.linalg.norm(points - start - t[..., None] * along, axis=-1)


def _line(stroke: str) -> np.ndarray:
    """Points (n, 2) of a stroke as straight pieces."""
    digits = stroke.lstrip("~@")
    points = np.array([(int(x), int(y, 16)) for x, y in zip(digits[::2], digits[1::2], strict=True)], float)
    if stroke[0] == "@":
        return _spline(np.vstack([0.5 * (points[-1] + points[0]), points, 0.5 * (points[-1] + points[0])]))
    return _spline(points) if stroke[0] == "~" else points


def _spline(control: np.ndarray) -> np.ndarray:
    """Quadratic B-spline that begins and ends in its end points, as Bézier arcs between the middles of its legs."""
    joints = np.vstack([control[:1], 0.5 * (control[1:-2] + control[2:-1]), control[-1:]])
    t = np.linspace(0, 1, 9)[:, None]
    arcs = zip(joints[:-1], control[1:-1], joints[1:], strict=True)
    return np.vstack([(1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c for a, b, c in arcs])
