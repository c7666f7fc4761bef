# Lesson 1: posts stand in the world, and have normals.


def places_of(heights, posts):
    """World coordinates (n, 3) of posts (n, 2), columns and rows."""
    return world(heights, SPACING)[posts[:, 1], posts[:, 0]]


def at_posts(cells, posts):
    """Values of cells at the posts in their north-west corners."""
    return cells[np.minimum(posts[:, 1], len(cells) - 1), np.minimum(posts[:, 0], cells.shape[1] - 1)]


def light(heights, posts):
    """Light (n,): the sun on the normals, and a little from the sky."""
    return 0.25 + 0.85 * np.maximum(at_posts(normals(heights, SPACING), posts) @ SUN, 0)
