"""The method of this project: the error of every patch is certified. Hidden land is drawn, too, as by other entries."""

from entries._ours import drawn


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices, triangles and milliseconds for each camera."""
    return drawn("sat", heights, spacing_m, cameras, size, max_error_px=tolerance_px, occlusion="off")
