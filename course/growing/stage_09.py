# Lesson 9: a budget. The best quadtree within the budget, repaired along its edges.

TRIANGLES = 4000


def mesh(heights):
    """Posts and triangles within the budget."""
    return tree_mesh(heights, TRIANGLES)


def tree_mesh(heights, triangles):
    """Posts and triangles of the best tree with at most this number of triangles, after the repair."""
    allowed, squares = tolerance(heights), [np.zeros((128, 128))]
    for j in range(1, 8):
        n = 1 << j
        nearest = allowed[:-1, :-1].reshape(128 >> j, n, 128 >> j, n).min((1, 3))
        squares.append((quad_errors(heights, j) / nearest) ** 2 * 4**j)
    exists, parts = np.ones((1, 1), bool), []
    for j, split in reversed(list(enumerate(budget(squares, triangles)))):
        parts += [grid(x << j, y << j, 1 << j, 1 << j, 1 << j) for y, x in np.argwhere(exists & ~split).tolist()]
        exists = split.repeat(2, 0).repeat(2, 1)
    posts, corners = together(parts)
    return posts, repair(places_of(heights, posts), corners)
