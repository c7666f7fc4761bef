"""Right triangles that are bisected at their longest edge, written from the paper, in numpy.

Lindstrom and others 1996, "Real-time, continuous level of detail rendering of height fields", SIGGRAPH. A vertex halves
the longest edge of two triangles. It is used if its distance to that edge, as seen on the screen, is above the
tolerance, or if a vertex that depends on it is used: then there are no cracks. The error of a triangle at posts inside
it is not asked for. The map has 2^n + 1 posts a side.
"""

import numpy as np


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera."""
    errors_m = distances_to_edges(heights)
    places = all_places(heights, spacing_m)
    for camera in cameras:
        away = places - camera["eye"]
        focal_px = size[1] / 2 / np.tan(np.radians(camera["fov_deg"]) / 2)
        seen_px = focal_px * errors_m * np.linalg.norm(away[..., :2], axis=2) / np.square(away).sum(2)  # equation 3
        yield triangles_of(seen_px > tolerance_px, places)


def all_places(heights, spacing_m):
    """(rows, cols, 3) places of posts."""
    row, col = np.indices(heights.shape)
    return np.stack([col * spacing_m[0], (len(heights) - 1 - row) * spacing_m[1], heights], -1)


def distances_to_edges(heights):
    """How far each vertex is above or below the middle of the edge that it halves."""
    errors_m = np.zeros(heights.shape)
    side = len(heights) - 1
    step = side
    while step > 1:
        half, z = step // 2, heights[::step, ::step]
        turned = np.indices((side // step,) * 2).sum(0) % 2 == 1
        middle = np.where(turned, z[1:, :-1] + z[:-1, 1:], z[:-1, :-1] + z[1:, 1:]) / 2
        for at, of_edge in (
            (np.s_[half::step, half::step], middle),
            (np.s_[::step, half::step], (z[:, :-1] + z[:, 1:]) / 2),
            (np.s_[half::step, ::step], (z[:-1] + z[1:]) / 2),
        ):
            errors_m[at] = np.abs(heights[at] - of_edge)
        step = half
    return errors_m


def to_parents(side, give):
    """Go from the finest vertices to the coarsest: `give(parents, children)` with slices of both, 2-D and equal."""
    step = 2
    while step <= side:
        half = step // 2
        centres = np.s_[half::step, half::step]
        for shift in (0, step):  # the middle of an edge depends on the centres of both squares beside it
            end = side + 1 - step + shift
            give(centres, np.s_[shift:end:step, half::step])
            give(centres, np.s_[half::step, shift:end:step])
        if step < side:  # the centre of a square depends on two of its corners
            for row in (0, 1):
                for col in (0, 1):
                    start = half + row * step, half + col * step
                    squares = np.s_[start[0] :: 2 * step, start[1] :: 2 * step]
                    for i, j in ((0, 1), (1, 0)) if (row + col) % 2 == 0 else ((0, 0), (1, 1)):
                        first = (row + i) * step, (col + j) * step
                        last = tuple(n + side - step for n in first)
                        give(np.s_[first[0] : last[0] : 2 * step, first[1] : last[1] : 2 * step], squares)
        step *= 2


def triangles_of(used, places):
    """Vertices and triangles of the used vertices and of those that they depend on."""
    used = used.copy()

    def also(parents, children):
        used[parents] |= used[children]

    side = len(used) - 1
    to_parents(side, also)
    waiting = np.array([[[0, 0], [side, side], [side, 0]], [[side, side], [0, 0], [0, side]]])  # base, and apex
    done = []
    while len(waiting):
        a, b, apex = np.moveaxis(waiting, 1, 0)
        middle = (a + b) // 2
        halves = ((a + b) % 2 == 0).all(1) & used[middle[:, 0], middle[:, 1]]
        done.append(waiting[~halves])
        a, b, apex, middle = a[halves], b[halves], apex[halves], middle[halves]
        waiting = np.concatenate([np.stack([apex, a, middle], 1), np.stack([b, apex, middle], 1)])
    rows, cols = np.moveaxis(np.concatenate(done).reshape(-1, 2), -1, 0)
    return places[rows, cols], np.arange(len(rows)).reshape(-1, 3)
