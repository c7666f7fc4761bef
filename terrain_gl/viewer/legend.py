"""The legend of a style: a ramp of colours, and the text at its ends. Twin: glsl/shade/drawn.glsl."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..basics.words import metres
from ..heightmap import Heightmap
from ..renderer.options import FrameOptions

Colour = tuple[float, float, float]

VIRIDIS = (
    (0.267, 0.005, 0.329),
    (0.230, 0.322, 0.546),
    (0.128, 0.567, 0.551),
    (0.369, 0.789, 0.383),
    (0.993, 0.906, 0.144),
)
INFERNO = (
    (0.001, 0.000, 0.014),
    (0.342, 0.062, 0.429),
    (0.736, 0.216, 0.330),
    (0.978, 0.558, 0.035),
    (0.988, 0.998, 0.645),
)

PALE = tuple((0.5 + 0.5 * r, 0.5 + 0.5 * g, 0.5 + 0.5 * b) for r, g, b in VIRIDIS)  # of glsl/shade/cracks.frag
VISIBLE = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.93, 0.93, 1.0), (0.93, 0.93, 0.0))

COLOURS = {  # meaning of the colours of the land, by style
    "shaded": "shaded: light",
    "lod": "lod: spacing of vertices",
    "segments": "segments: of each patch",
    "cracks": "cracks: no agreement on edges",
    "promise": "promise: bound of each patch",
    "error": "error: of each pixel",
}


class Legend(NamedTuple):
    """A ramp of colours, the meaning of its ends and of its middle, and a note on other colours."""

    ramp: tuple[Colour, ...]
    least: str
    most: str
    note: str
    middle: str = ""


def legend(options: FrameOptions, steps_log2: Sequence[int] = (), heightmap: Heightmap | None = None) -> Legend | None:
    """The legend of a style; None if its colours need none.

    With the levels in use, `DrawnFrame.steps_log2`, the legend of vertices shows only these, and metres.
    """
    if options.style == "lod" and steps_log2 and heightmap:
        return _of_levels(steps_log2, heightmap)
    end_px = options.error_scale_px or options.tolerance_px or 1.0
    most = f"{end_px:.3g} px"
    over = f"Cyan: over {most}." if options.error_scale_px else "Cyan: over the tolerance."
    between = f"{end_px / 4:.3g} px" if options.error_scale_px else ""
    borders = "Borders of patches are dark."
    return {
        "lod": Legend(VIRIDIS, "every post, or closer", "1/16 of the map", borders),
        "segments": Legend(VIRIDIS, "one quad", "32 × 32", borders),
        "cracks": Legend(PALE, "one quad", "32 × 32", "Red: a crack, through which one looks under the land."),
        "promise": Legend(INFERNO, "0", most, f"Grey: no bound. {over}", between),
        "visibility": Legend(VISIBLE, "neither", "sun alone", "Blue: the sky's share. Yellow: the sun's. White: both."),
        "error": Legend(INFERNO, "0", most, f"{over} Grey: not known.", between),
    }.get(options.style)


def _of_levels(steps_log2: Sequence[int], heightmap: Heightmap) -> Legend:
    """The colours of levels, as glsl/shade/lod.frag gives them; closer than every post is one colour."""
    used = [step for step in steps_log2 if step > 0]
    levels = [0, *used] if steps_log2[0] <= 0 else used
    most = max(math.ceil(math.log2(max(heightmap.cols, heightmap.rows) - 1)) - 4, 1)
    shares = np.clip(np.array(levels) / most, 0, 1) * (len(VIRIDIS) - 1)
    red, green, blue = (
        np.interp(shares, range(len(VIRIDIS)), channel).tolist() for channel in zip(*VIRIDIS, strict=True)
    )
    ramp = list(zip(red, green, blue, strict=True))
    apart = [metres(2.0**level * min(heightmap.spacing_m)) for level in levels]
    least = apart[0] if levels[0] else f"every post, {apart[0]}"
    note = f"Distance of the vertices: {', '.join(apart)}. Borders of patches are dark."
    return Legend(tuple(ramp * (3 - len(ramp[:2]))), least, apart[-1], note)
