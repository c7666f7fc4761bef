"""What entries with one mesh for the whole flight have in common."""

import numpy as np


def tolerance_m(heights, spacing_m, cameras, size, tolerance_px):
    """The error in metres that is at most `tolerance_px` pixels at the nearest post of any picture."""
    row, col = np.indices(heights.shape).reshape(2, -1)
    places = np.stack([col * spacing_m[0], (len(heights) - 1 - row) * spacing_m[1], heights.reshape(-1)], -1)
    metres = []
    for camera in cameras:
        tan_y = np.tan(np.radians(camera["fov_deg"]) / 2)
        corner = 1 + tan_y**2 * (1 + (size[0] / size[1]) ** 2)  # errors look larger there by this factor
        away, forward = places - camera["eye"], np.subtract(camera["target"], camera["eye"])
        distance_m = np.linalg.norm(away, axis=1)
        is_near = away @ forward * np.sqrt(corner) >= distance_m * np.linalg.norm(forward)
        metres.append(tolerance_px * distance_m[is_near].min() * 2 * tan_y / size[1] / corner)
    return min(metres)


def placed(posts, heights_m, spacing_m, rows):
    """Vertices at columns and rows (n, 2) of posts."""
    return np.column_stack([posts[:, 0] * spacing_m[0], (rows - 1 - posts[:, 1]) * spacing_m[1], heights_m])
