# Lesson 3: means of boxes. The picture shows land above the mean of its surroundings, 17 × 17 posts.


def paint_03(heights, posts):
    """Colours (n, 3): brown where land is above the mean of its surroundings, green where it is below."""
    table = sat(np.round(heights * 10).astype(np.uint32))
    low = np.clip(posts - 8, 0, np.array(heights.shape)[::-1] - 17)
    mean = box_sums(table, np.concatenate([low, low + 17], 1)) / 17**2 / 10
    t = np.clip((heights[posts[:, 1], posts[:, 0]] - mean) / 400 + 0.5, 0, 1)[:, None]
    return np.array([0.15, 0.40, 0.25]) * (1 - t) + np.array([0.75, 0.55, 0.35]) * t
