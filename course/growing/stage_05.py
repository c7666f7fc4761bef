# Lesson 5: errors of nodes. The whole map gets one level: the coarsest level with an error of at most 400 metres.
# The picture shows its wires, and the error of each place on the screen in colour.


def mesh(heights):
    """Posts and triangles of one level."""
    level = max((j for j in range(1, 6) if quad_errors(heights, j).max() <= 400), default=0)
    return grid(0, 0, heights.shape[1] - 1, heights.shape[0] - 1, 1 << level)


def show_05(heights, posts, triangles):
    """Wires, and errors in colour."""
    return show_errors(heights, posts, triangles)


def show_errors(heights, posts, triangles):
    """Wires over colours: white without error, red from 8 pixels on."""
    ground = draw(heights, posts, triangles, np.column_stack([posts, light(heights, posts)]))
    col, row = (np.clip(np.rint(ground[..., i]), 0, heights.shape[1 - i] - 1).astype(int) for i in (0, 1))
    red = np.clip(errors_px(heights, posts, triangles)[row, col] / 8, 0, 1)[..., None]
    colours = (1 - red) * np.array([1, 1, 1]) + red * np.array([0.8, 0.1, 0.05])
    return wired(heights, posts, triangles, colours * (0.35 + 0.65 * ground[..., 2:]))


def wired(heights, posts, triangles, pixels):
    """A picture with the edges of triangles over it, and the sky."""
    corners = places_of(heights, posts)[triangles].reshape(-1, 3)
    which, ends = np.arange(len(corners)).reshape(-1, 3), np.tile(np.eye(3), (len(triangles), 1))
    share = rasterise(SIZE, project(corners), ends, which, (2, 2, 2))  # of each corner of the triangle; 0 on its edges
    near = share.min(-1)
    step = np.max([np.abs(near - np.roll(near, by, axis)) for axis in (0, 1) for by in (-1, 1)], 0)
    found = np.where((near < 0.5 * np.minimum(step, 0.5))[..., None], 0.45 * pixels, pixels)
    return np.where(share[..., :1] > 1.5, SKY, found)
