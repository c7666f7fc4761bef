# Lesson 10: the light of footprints of 3 × 3 cells, not of single cells. The picture shows three ways on white land.


def light(heights, posts):
    """Light (n,)."""
    return footprint_light(heights, posts)


def footprint_light(heights, posts):
    """Light (n,): the mean normal of a footprint, unnormalised, and a little from the sky."""
    low = np.clip(posts - 1, 0, np.array(heights.shape)[::-1] - 4)
    mean = mean_normals(normals(heights, SPACING), np.concatenate([low, low + 3], 1))
    return 0.25 + np.maximum(diffuse(mean, SUN, 0.95), 0)


def show_10(heights, posts, triangles):
    """White land in footprints of 8 x 8 cells: one cell's normal; their mean vector; the mean of all cells' light."""
    posts, triangles = grid(0, 0, heights.shape[1] - 1, heights.shape[0] - 1, 1)
    cells, low = normals(heights, SPACING), np.minimum(posts // 8 * 8, np.array(heights.shape)[::-1] - 9)
    boxes = np.concatenate([low, low + 8], 1)
    lit = np.maximum(cells @ SUN, 0)[..., None] * np.ones(3)
    rivals = at_posts(cells, low) @ SUN, diffuse(mean_normals(cells, boxes), SUN, 1.0), mean_normals(lit, boxes)[:, 0]
    clay = [np.clip(0.1 + 0.9 * each[:, None], 0.1, 1) * np.ones(3) for each in rivals]
    return beside(*(draw(heights, posts, triangles, each) for each in clay))
