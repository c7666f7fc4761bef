# Lesson 10: the light of footprints of 3 × 3 cells, not of single cells.


def light(heights, posts):
    """Light (n,)."""
    return footprint_light(heights, posts)


def footprint_light(heights, posts):
    """Light (n,): the mean normal of a footprint, unnormalised, and a little from the sky."""
    low = np.clip(posts - 1, 0, np.array(heights.shape)[::-1] - 4)
    mean = mean_normals(normals(heights, SPACING), np.concatenate([low, low + 3], 1))
    return 0.25 + np.maximum(diffuse(mean, SUN, 0.95), 0)
