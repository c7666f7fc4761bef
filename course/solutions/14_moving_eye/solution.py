"""Lesson 14: a moving eye.

The map has n × n posts, n = 2^k + 1, and is cut into right triangles, as in lesson 6. A mesh is a set of posts,
`active`: those in the middle of a longest side that is cut. The corners of the map are always there.
"""

import numpy as np


def middles(n):
    """Middles of longest sides, from coarse to fine: (rows, columns) of many middles, and of both ends. Done for you.

    Use them as indices: heights[middle], heights[one], heights[other].
    """
    side = n - 1
    while side > 1:
        half = side // 2
        y, x = np.mgrid[half:n:side, half:n:side]
        turn = np.where((y // side + x // side) % 2 == 0, half, -half)  # the square's diagonal falls or rises
        yield (y, x), (y - half, x - turn), (y + half, x + turn)
        y, x = np.mgrid[0:n:side, half:n:side]
        yield (y, x), (y, x - half), (y, x + half)
        y, x = np.mgrid[half:n:side, 0:n:side]
        yield (y, x), (y - half, x), (y + half, x)
        side = half


def bounds(heights):
    """For each post a bound in metres of all meshes without it, at least those of the posts inside. Done for you."""
    found = np.zeros(heights.shape)
    for middle, one, other in reversed(list(middles(len(heights)))):
        found[middle] += np.abs(heights[middle] - (heights[one] + heights[other]) / 2)
        (y, x), dy, dx = middle, other[0] - middle[0], other[1] - middle[1]
        for row, col in ((y + dx, x - dy), (y - dx, x + dy)):  # the right angles of both triangles
            there = (row >= 0) & (row < len(heights)) & (col >= 0) & (col < len(heights))
            np.maximum.at(found, (row[there], col[there]), found[middle][there])
    found[:: len(heights) - 1, :: len(heights) - 1] = 0  # the map's corners
    return found


def pixels(heights, metres, spacing_m, eyes, focal_px):
    """`metres` in pixels, focal length · metres / distance, for each eye (x, y, z): (frames, n, n). Done for you.

    The distance is at most that of any land inside, so a post has no less than the posts inside. It is 0 where the eye
    may be among that land: the pixels are then infinite.
    """
    n = len(heights)
    y, x = np.indices(heights.shape) * spacing_m
    radius = np.zeros(heights.shape)
    for middle, _, other in middles(n):
        # With half a side L: the posts inside are L/√2 away at most, those inside these L/2 more, ...: 2.42 L in all.
        radius[middle] = 2.42 * spacing_m * np.hypot(other[0] - middle[0], other[1] - middle[1])
    found = []
    for east, south, up in eyes:
        level = np.maximum(np.hypot(x - east, y - south) - radius, 0)
        away = np.hypot(level, max(up - heights.max(), heights.min() - up, 0))
        among = np.where(metres > 0, np.inf, 0)
        found.append(np.divide(focal_px * metres, away, out=among, where=away > 0))
    return np.array(found)


def surface(heights, active):
    """14.1 The drawn height at every post: its own where a post is active, else on the line between the two ends.

    returns   (n, n) metres
    """
    # solution
    drawn = heights.astype(float)
    for middle, one, other in middles(len(heights)):
        drawn[middle] = np.where(active[middle], heights[middle], (drawn[one] + drawn[other]) / 2)
    return drawn
    # end


def jump_px(before, after, scale):
    """14.2 The largest jump of the land from one frame to the next.

    before, after  drawn heights (n, n)
    scale          pixels of a metre at each post, (n, n), as the later eye sees it
    returns        pixels
    """
    # solution
    return float((np.abs(after - before) * scale).max())
    # end


def still(active, px, error_px, share):
    """14.3 Hysteresis: the next active posts.

    A post joins if its px is above the error. It stays while its px is above share · error.

    active    bool (n, n), the posts of the frame before
    px        bounds in pixels (n, n) in this frame
    share     0 to 1. A post whose px is exactly error_px does not join; one at exactly share · error_px leaves
    returns   bool (n, n)
    """
    # solution
    return (px > error_px) | (active & (px > share * error_px))
    # end


def held(px, error_px, period):
    """14.4 The active posts of each key: those whose px is above the error in a frame in which the key must hold.

    Key i stands at frame i · period. It is drawn, alone or blended, after frame (i - 1) · period and before frame
    (i + 1) · period. It also holds in frame (i + 1) · period, where the last step away from it is seen. The last key
    stands at the last frame or behind it.

    px        bounds in pixels (frames, n, n)
    returns   bool (keys, n, n)
    """
    # solution
    frames = len(px)
    keys = range(-(-(frames - 1) // period) + 1)
    return np.array([px[max((i - 1) * period + 1, 0) : (i + 1) * period + 1].max(0) > error_px for i in keys])
    # end


def fly(heights, px, error_px, period):
    """14.5 The drawn surface of every frame: from key to key, each post moves evenly. Use `held` and `surface`.

    px, error_px, period   as in `held`
    returns                (frames, n, n) metres
    """
    # solution
    keys = [surface(heights, active) for active in held(px, error_px, period)]
    found = []
    for frame in range(len(px)):
        i, t = frame // period, frame % period / period
        found.append(keys[i] if t == 0 else (1 - t) * keys[i] + t * keys[i + 1])
    return np.array(found)
    # end
