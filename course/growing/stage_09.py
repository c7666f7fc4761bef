# Lesson 9: a budget. The best quadtree within the budget, repaired along its edges. The picture shows the tower.

TRIANGLES = 4000
TOWER = 85, 65  # row and column of a post of the plain


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
    return leaves(heights, budget(squares, triangles))


def leaves(heights, splits):
    """Posts and triangles of a tree's leaves, after the repair."""
    exists, parts = np.ones((1, 1), bool), []
    for j, split in reversed(list(enumerate(splits))):
        parts += [grid(x << j, y << j, 1 << j, 1 << j, 1 << j) for y, x in np.argwhere(exists & ~split).tolist()]
        exists = split.repeat(2, 0).repeat(2, 1)
    posts, corners = together(parts)
    return posts, repair(places_of(heights, posts), corners)


def show_09(heights, posts, triangles):
    """The land with a tower on one post, in 1000 triangles: left greedy, right the best tree; errors in colour."""
    heights, squares = heights.copy(), []
    heights[TOWER] += 1500
    for j in range(8):
        px = errors_px(heights, *grid(0, 0, 128, 128, 1 << j))[:-1, :-1]
        squares.append((px**2).reshape(128 >> j, 1 << j, 128 >> j, 1 << j).sum((1, 3)))
    return beside(*(show_errors(heights, *leaves(heights, way(squares, 1000))) for way in (greedy, budget)))
