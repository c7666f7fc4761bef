# Lesson 14: the eye moves. The picture shows the land between two keys, and how far each post moves from key to key.

FLIGHT, KEY_EACH, FLIGHT_PX = 33, 8, 6.0


def flown(heights):
    """Bounds in pixels and pixels of a metre at each post, for the eyes of a flight ahead, frame by frame."""
    last, above = len(heights) - 1, EYE[2] - heights.max() + 600.0
    way = (TARGET - EYE)[:2] * np.linspace(0, 0.4, FLIGHT)[:, None] + EYE[:2]
    eyes = np.column_stack([way[:, 0], last * SPACING[1] - way[:, 1], np.full(FLIGHT, heights.max() + max(above, 600))])
    px = pixels(heights, bounds(heights), SPACING[0], eyes, camera()[1])
    y, x = np.indices(heights.shape) * SPACING[0]
    away = [np.hypot(np.hypot(x - east, y - south), up - heights.max()) for east, south, up in eyes]
    return px, camera()[1] / np.array(away)


def mesh(heights):
    """Posts and triangles of the first two keys together."""
    px, _ = flown(heights)
    keys = held(px, FLIGHT_PX, KEY_EACH)
    corners = rtin_mesh((keys[0] | keys[1]).astype(float), 0.5)
    posts, which = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return posts, which.reshape(-1, 3)


def paint_14(heights, posts):
    """Colours (n, 3): white where a post rests between the keys, to red, where it moves by the error or more."""
    px, scale = flown(heights)
    one, other = (surface(heights, key) for key in held(px, FLIGHT_PX, KEY_EACH)[:2])
    moved = (np.abs(other - one) * scale[KEY_EACH])[posts[:, 1], posts[:, 0]]
    red = np.clip(moved / FLIGHT_PX * 4, 0, 1)[:, None]
    return np.array([1, 1, 1]) * (1 - red) + np.array([0.8, 0.1, 0.05]) * red


def report_14(heights):
    """The largest jump of the flight, with a mesh for each frame, and blended from key to key."""
    px, scale = flown(heights)
    anew = np.array([surface(heights, each > FLIGHT_PX) for each in px])
    blended = fly(heights, px, FLIGHT_PX, KEY_EACH)
    one, other = (max(map(jump_px, each[:-1], each[1:], scale[1:])) for each in (anew, blended))
    return f"the largest jump: {one:.1f} px with a mesh for each frame, {other:.1f} px blended"
