# Lesson 7: no cracks. Triangles are cut where a vertex stands on their edge. The picture shows them before and after.


def mesh(heights):
    """The same squares, repaired."""
    posts, triangles = clipmap(heights)
    return posts, repair(places_of(heights, posts), triangles)


def show_07(heights, posts, triangles):
    """Left the squares as they are, right repaired."""
    return beside(show_cracks(heights, *clipmap(heights)), show_cracks(heights, posts, triangles))


def show_cracks(heights, posts, triangles):
    """Wires, and a red dot at each visible vertex that stands on an open edge."""
    vertices, clay = places_of(heights, posts), light(heights, posts)[:, None] * np.ones(3)
    pixels = wired(heights, posts, triangles, draw(heights, posts, triangles, clay))
    loose = [k for a, b in open_edges(triangles) for k in on_edge(vertices, a, b)]
    x, y, z = in_camera(vertices[np.array(loose, int)])
    depth = rasterise(SIZE, project(vertices), in_camera(vertices)[2][:, None] * np.ones(3), triangles, (0, 0, 0))
    focal = camera()[1]
    with np.errstate(divide="ignore"):
        col, row = SIZE[0] / 2 + focal * x / z, SIZE[1] / 2 - focal * y / z
    for i in np.flatnonzero((z > 200) & (col > 2) & (col < SIZE[0] - 2) & (row > 2) & (row < SIZE[1] - 2)):
        at = slice(int(row[i]) - 1, int(row[i]) + 2), slice(int(col[i]) - 1, int(col[i]) + 2)
        if z[i] < depth[at].max() * 1.01:
            pixels[at] = 0.9, 0.1, 0.05
    return pixels
