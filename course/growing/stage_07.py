# Lesson 7: no cracks. Triangles are cut where a vertex stands on their edge.


def mesh(heights):
    """The same squares, repaired."""
    posts, triangles = clipmap(heights)
    return posts, repair(places_of(heights, posts), triangles)
