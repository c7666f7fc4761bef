# Lesson 6: right triangles, small where the land is rough.


def tolerance(heights):
    """The height in metres that is ten pixels at each post."""
    row, col = np.indices(heights.shape).reshape(2, -1)
    p, (axes, focal) = in_camera(places_of(heights, np.stack([col, row], 1))), camera()
    p[2] = np.maximum(p[2], 300)
    return tolerance_m(p, axes[:, 2], focal, 10.0).reshape(heights.shape)


def mesh(heights):
    """Posts and triangles: RTIN within 60 metres."""
    corners = rtin_mesh(rtin_errors(heights), 60.0)
    posts, which = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return posts, which.reshape(-1, 3)
