# Lesson 2: metres become pixels. The picture shows how far each post is off if only each eighth one is drawn.


def paint_02(heights, posts):
    """Colours (n, 3): from white, at most half a pixel, to red, eight pixels."""
    x, y = posts.T
    x0, y0 = np.minimum(x // 8 * 8, heights.shape[1] - 9), np.minimum(y // 8 * 8, len(heights) - 9)
    f, g = (x - x0) / 8, (y - y0) / 8
    drawn = (1 - g) * ((1 - f) * heights[y0, x0] + f * heights[y0, x0 + 8])
    drawn += g * ((1 - f) * heights[y0 + 8, x0] + f * heights[y0 + 8, x0 + 8])
    axes, focal = camera()
    p = in_camera(places_of(heights, posts))
    px = shift_px(np.maximum(p, [[-np.inf], [-np.inf], [100.0]]), axes[:, 2], focal, drawn - heights[y, x])
    red = np.clip(np.log2(np.maximum(px, 1e-9) / 0.5) / 4, 0, 1)[:, None]
    return np.array([1, 1, 1]) * (1 - red) + np.array([0.8, 0.1, 0.05]) * red
