# Lesson 14: the eye moves. The picture shows the land between two keys, and how far each post moves from key to key.
# The film shows the flight.

FLIGHT, KEY_EACH, FLIGHT_PX = 33, 8, 6.0


def eyes_of(heights):
    """The eyes (n, 3) of a flight ahead, above all land, in the world."""
    way = (TARGET - EYE)[:2] * np.linspace(0, 0.4, FLIGHT)[:, None] + EYE[:2]
    return np.column_stack([way, np.full(FLIGHT, max(EYE[2], heights.max()) + 600.0)])


def flown(heights):
    """Bounds in pixels and pixels of a metre at each post, for the eyes of the flight, frame by frame."""
    eyes = eyes_of(heights) * np.array([1, -1, 1]) + np.array([0, (len(heights) - 1) * SPACING[1], 0])
    px = pixels(heights, bounds(heights), SPACING[0], eyes, camera()[1])
    y, x = np.indices(heights.shape) * SPACING[0]
    away = [np.hypot(np.hypot(x - east, y - south), up - heights) for east, south, up in eyes]
    return px, camera()[1] / np.array(away)


def mesh(heights):
    """Posts and triangles of the first two keys together."""
    px, _ = flown(heights)
    keys = held(px, FLIGHT_PX, KEY_EACH)
    corners = rtin_mesh((keys[0] | keys[1]).astype(float), 0.5)
    posts, which = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return posts, which.reshape(-1, 3)


def show_14(heights, posts, triangles):
    """Wires; white where a post rests between the keys, to red, where it moves by a quarter of the error or more."""
    px, scale = flown(heights)
    one, other = (surface(heights, key) for key in held(px, FLIGHT_PX, KEY_EACH)[:2])
    moved = (np.abs(other - one) * scale[KEY_EACH])[posts[:, 1], posts[:, 0]]
    red = np.clip(moved / FLIGHT_PX * 4, 0, 1)[:, None]
    colours = np.array([1, 1, 1]) * (1 - red) + np.array([0.8, 0.1, 0.05]) * red
    lit = np.clip(colours * light(heights, posts)[:, None], 0, 1)
    return wired(heights, posts, triangles, draw(heights, posts, triangles, lit))


def report_14(heights):
    """The largest jump of the flight, with a mesh for each frame, and blended from key to key."""
    px, scale = flown(heights)
    anew = np.array([surface(heights, each > FLIGHT_PX) for each in px])
    blended = fly(heights, px, FLIGHT_PX, KEY_EACH)
    one, other = (max(map(jump_px, each[:-1], each[1:], scale[1:])) for each in (anew, blended))
    return f"the largest jump: {one:.1f} px with a mesh for each frame, {other:.1f} px blended"


def film_14(heights, picture):
    """Write the flight: left a mesh for each frame, right blended. Red is a place that has jumped."""
    from PIL import Image

    global EYE
    (px, scale), start, eyes, frames = flown(heights), EYE, eyes_of(heights), []
    anew = np.array([surface(heights, each > FLIGHT_PX) for each in px])
    blended = fly(heights, px, FLIGHT_PX, KEY_EACH)
    posts, triangles = grid(0, 0, heights.shape[1] - 1, heights.shape[0] - 1, 1)
    for k in range(1, FLIGHT):
        EYE, shown = eyes[k], []
        for land in (anew, blended):
            jump = (np.abs(land[k] - land[k - 1]) * scale[k])[posts[:, 1], posts[:, 0]]
            red = np.clip(jump / FLIGHT_PX * 2, 0, 1)[:, None]
            clay = (1 - red) * np.array([1, 1, 1]) + red * np.array([0.8, 0.1, 0.05])
            shown.append(draw(land[k], posts, triangles, light(land[k], posts)[:, None] * clay))
        frames.append(Image.fromarray(np.uint8(255 * np.clip(beside(*shown), 0, 1))))
    EYE, path = start, picture.rpartition(".")[0] + ".webp"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=150, loop=0, quality=50)
    return f"the flight is in {path}"
