"""Geometry clipmaps (Losasso and Hoppe 2004) with rings of 255 vertices, as in the paper. They aim at no error."""

from entries._ours import drawn


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices, triangles and milliseconds for each camera."""
    return drawn("clipmap", heights, spacing_m, cameras, size)
