"""What the colours of a style mean: a ramp and the words at its ends, the same as in glsl/shade/drawn.glsl."""

from __future__ import annotations

from typing import NamedTuple

from ..drawing import Drawing

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

COLOURS = {  # what the land's colours can tell, by style
    "shaded": "light",
    "lod": "rings: how far apart vertices are",
    "segments": "segments of each patch",
    "promise": "error promised of each patch",
    "error": "error of each pixel",
}


class Legend(NamedTuple):
    """A ramp of colours, and what its ends mean."""

    ramp: tuple[Colour, ...]
    least: str
    most: str
    beside: str  # what else there is


def legend(drawing: Drawing) -> Legend | None:
    """Of a style; None where colours are what they are."""
    whole = f"{drawing.tolerance_px or 1.0:.3g} px"
    return {
        "lod": Legend(VIRIDIS, "every post", "1/16 of the map", "Fans are paler; borders of patches are dark."),
        "segments": Legend(VIRIDIS, "one quad", "32 × 32", "Fans are paler; borders of patches are dark."),
        "promise": Legend(INFERNO, "0", whole, "Grey: nothing promised. Cyan: beyond the tolerance."),
        "error": Legend(INFERNO, "0", whole, "Cyan: beyond the tolerance."),
    }.get(drawing.style)
