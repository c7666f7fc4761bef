"""The course's entry in its leaderboard: right triangles (lesson 6) by nested bounds in pixels (lessons 2, 5, 14)."""

import numpy as np


def middles(n):
    """Middles of longest sides, from coarse to fine: rows and columns of many middles, and of both ends."""
    side = n - 1
    while side > 1:
        half = side // 2
        y, x = np.mgrid[half:n:side, half:n:side]
        turn = np.where((y // side + x // side) % 2 == 0, half, -half)
        yield (y, x), (y - half, x - turn), (y + half, x + turn)
        y, x = np.mgrid[0:n:side, half:n:side]
        yield (y, x), (y, x - half), (y, x + half)
        y, x = np.mgrid[half:n:side, 0:n:side]
        yield (y, x), (y - half, x), (y + half, x)
        side = half


def nested(values, own, heights):
    """Nested numbers: those of a post, `own` added, are not below those of the posts inside."""
    n = len(heights)
    for middle, one, other in reversed(list(middles(n))):
        values[middle] += own(middle, one, other)
        (y, x), dy, dx = middle, other[0] - middle[0], other[1] - middle[1]
        for row, col in ((y + dx, x - dy), (y - dx, x + dy)):
            there = (row >= 0) & (row < n) & (col >= 0) & (col < n)
            np.maximum.at(values, (row[there], col[there]), values[middle][there])
    return values


def bounds(heights):
    """For each post a bound in metres of all meshes without it, between the posts too."""
    twist = np.abs(heights[:-1, :-1] - heights[:-1, 1:] - heights[1:, :-1] + heights[1:, 1:]) / 4
    padded = np.pad(twist, 1)
    around = np.maximum.reduce([padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]])
    off = nested(np.zeros(heights.shape), lambda m, a, b: np.abs(heights[m] - (heights[a] + heights[b]) / 2), heights)
    return off + nested(around, lambda m, a, b: 0.0, heights)


def mesh(heights, spacing_m, camera, size, tolerance_px):
    """Vertices and triangles within the tolerance."""
    n = len(heights)
    metres, (y, x) = bounds(heights), np.indices(heights.shape)
    radius = nested_spheres(np.full(heights.shape, np.hypot(*spacing_m)), spacing_m)
    east, north, up = camera["eye"]
    level = np.hypot(x * spacing_m[0] - east, (n - 1 - y) * spacing_m[1] - north)
    away = np.hypot(np.maximum(level - radius, 0), max(up - heights.max(), 0))
    tan_y = np.tan(np.radians(camera["fov_deg"]) / 2)
    stretched = 1 + tan_y**2 * (
        1 + (size[0] / size[1]) ** 2
    )  # an angle in the corner of the picture, against its middle
    focal_px = size[1] / 2 / tan_y
    px = np.where(away > metres, focal_px * stretched * metres / np.maximum(away - metres, 1e-9), np.inf)
    return triangles_of(px > tolerance_px, heights, spacing_m)


def nested_spheres(radius, spacing_m):
    """Radii that are large enough to hold the spheres of the posts inside."""
    n, found = len(radius), radius.copy()
    for (y, x), _, (yb, xb) in reversed(list(middles(n))):
        dy, dx = yb - y, xb - x
        for row, col in ((y + dx, x - dy), (y - dx, x + dy)):
            there = (row >= 0) & (row < n) & (col >= 0) & (col < n)
            away = np.hypot((col - x) * spacing_m[0], (row - y) * spacing_m[1])[there]
            np.maximum.at(found, (row[there], col[there]), found[y, x][there] + away)
    return found


def triangles_of(active, heights, spacing_m):
    """Cut triangles while the middle of their longest side is active."""
    last, found = len(heights) - 1, []
    todo = [((0, 0), (last, last), (0, last)), ((last, last), (0, 0), (last, 0))]
    while todo:
        a, b, c = todo.pop()
        m = ((a[0] + b[0]) // 2, (a[1] + b[1]) // 2)
        if (a[0] + b[0]) % 2 == (a[1] + b[1]) % 2 == 0 and active[m]:
            todo += [(c, a, m), (b, c, m)]
        else:
            found.append((a, b, c))
    corners = np.array(found).reshape(-1, 2)
    posts, number = np.unique(corners, axis=0, return_inverse=True)
    y, x = posts.T
    vertices = np.stack([x * spacing_m[0], (last - y) * spacing_m[1], heights[y, x]], -1)
    triangles = number.reshape(-1, 3)
    p = vertices[triangles]
    (ax, ay), (bx, by) = (p[:, 1] - p[:, 0])[:, :2].T, (p[:, 2] - p[:, 0])[:, :2].T
    return vertices, np.where((ax * by < ay * bx)[:, None], triangles[:, ::-1], triangles)
